"""Gradients of equilibria, and design by them."""

import numpy
import pytest

import rumple

PLATE = """
sheet = { shape = "rectangle", width = 8.0, height = 4.0, vertices = 120 }
material = { young = 1e4, poisson = 0.3, thickness = 0.3 }
time = { until = 1.0 }
[[effect]]
kind = "stretching"
[[effect]]
kind = "bending"
[[effect]]
kind = "pin"
where = { half-space = { point = [-3.3, 0, 0], normal = [-1, 0, 0] } }
axes = "xyz"
[[effect]]
kind = "load"
where = "all"
force = { per-area = [0.0, 0.0, 0.4] }
"""


def plate(**over):
    return rumple.parse(PLATE, over)


def test_a_gradient_is_that_of_differences():
    objective = rumple.Objective(plate(), ["mean(uz)", "0.5*mean(ux)"], ["material.young"], ["material.thickness"])
    assert objective.names == ["material.young", "material.thickness"]
    x = objective.start
    assert x[0] == 1e4 and (x[1:] == 0.3).all()
    value, gradient = objective(x)
    assert value == objective.value(x) and (gradient == objective.gradient(x)).all()
    random = numpy.random.default_rng(1).normal(size=x.size) * x
    ends = [objective.value(x + side * 1e-4 * random) for side in (1, -1)]
    expected, found = (ends[0] - ends[1]) / 2e-4, gradient @ random
    assert abs(found - expected) < 1e-6 * numpy.abs(gradient * random).sum()


def test_the_load_that_makes_a_shape_is_found_again(tmp_path):
    target = rumple.Objective(plate(), "mean(uz)", ["material.young"])
    points = target.positions(target.start)
    scene = rumple.Simulation(plate())
    lines = ["v %.17g %.17g %.17g" % tuple(p) for p in points]
    lines += ["f %d %d %d" % tuple(t + 1) for t in scene.triangles]
    (tmp_path / "target.obj").write_text("\n".join(lines) + "\n")
    key = "effect.load.force.per-area[2]"
    objective = rumple.Objective(plate(**{}), f"shape({tmp_path / 'target.obj'})", [key])
    low, high = 0.1, 0.7
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if objective.gradient([middle])[0] > 0 else (middle, high)
    assert low == pytest.approx(0.4, abs=1e-8)
    assert objective.value([low]) < 1e-14
    assert objective.split([low]) == {key: low}


def test_a_rate_is_found_from_values_in_time():
    decay = """
    sheet = { shape = "disc", radius = 3.0, vertices = 60 }
    time = { until = 2.0, integrator = { kind = "staggered", rtol = 1e-5, atol = 1e-5 } }
    [kinetics]
    rates.u = "-k*u"
    parameters.k = 0.5
    initial.u = 2.0
    """
    key = "kinetics.parameters.k"
    objective = rumple.Objective(rumple.parse(decay), "mean(u)", [key], times=[1, 2])
    value, gradient = objective([0.7])
    times = numpy.array([1, 2])
    assert value == pytest.approx((2 * numpy.exp(-0.7 * times)).sum(), rel=1e-4)
    assert gradient[0] == pytest.approx((-2 * times * numpy.exp(-0.7 * times)).sum(), rel=1e-4)
    at_end = rumple.Objective(rumple.parse(decay), "mean(u)", [key], in_time=True)
    assert at_end.value([0.7]) == pytest.approx(2 * numpy.exp(-1.4), rel=1e-4)
    with pytest.raises(ValueError):
        rumple.Objective(rumple.parse(decay), "mean(u)", [key], in_time=True, at_start=True)


def test_what_is_wrong_is_said():
    with pytest.raises(rumple.SceneError) as wrong:
        rumple.Objective(plate(), "mean(uz)", ["material.thicknes"])
    assert "did you mean thickness?" in str(wrong.value)
    with pytest.raises(rumple.Error) as wrong:
        rumple.Objective(plate(), "median(uz)", ["material.thickness"])
    assert "expected energy, volume" in str(wrong.value)
    objective = rumple.Objective(plate(), "mean(uz)", ["material.thickness"])
    with pytest.raises(rumple.Error) as wrong:
        objective.value([1.0, 2.0])
    assert "2 numbers are given, and the parameters are 1" in str(wrong.value)
    with pytest.raises(rumple.SceneError):
        objective.value([-1.0])
    assert objective.value([0.3]) > 0


def decaying():
    scene = rumple.parse("""
    sheet = { shape = "disc", radius = 3.0, vertices = 60 }
    time = { until = 2.0 }
    [kinetics]
    rates.u = "s - k*u"
    parameters = { k = 0.5, s = 0.1 }
    initial.u = 2.0
    """)
    keys = ["kinetics.parameters.k", "kinetics.parameters.s"]
    return rumple.Objective(scene, "mean(u)", keys, in_time=True)


def test_jax_differentiates_through_a_run():
    jax = pytest.importorskip("jax")
    objective = decaying()
    loss = rumple.autodiff.to_jax(objective)
    x = jax.numpy.array([0.6, 0.2])
    through = lambda x: loss(x * x) ** 2
    value, gradient = jax.value_and_grad(jax.jit(through))(x)
    j, slope = objective(numpy.array([0.36, 0.04]))
    assert float(value) == pytest.approx(j**2, rel=1e-5)
    assert numpy.asarray(gradient) == pytest.approx(2 * j * slope * 2 * numpy.array([0.6, 0.2]), rel=1e-5)
    assert float(through(x)) == pytest.approx(j**2, rel=1e-5)


def test_torch_differentiates_through_a_run():
    torch = pytest.importorskip("torch")
    objective = decaying()
    loss = rumple.autodiff.to_torch(objective)
    x = torch.tensor([0.6, 0.2], dtype=torch.float64, requires_grad=True)
    value = loss(x * x) ** 2
    value.backward()
    j, slope = objective(numpy.array([0.36, 0.04]))
    assert value.item() == pytest.approx(j**2, rel=1e-9)
    assert x.grad.numpy() == pytest.approx(2 * j * slope * 2 * numpy.array([0.6, 0.2]), rel=1e-9)
    with torch.no_grad():
        assert loss(x * x).item() == j


@pytest.mark.parametrize("name, package", [("to_jax", "jax"), ("to_torch", "torch")])
def test_what_is_not_installed_is_named(monkeypatch, name, package):
    monkeypatch.setitem(__import__("sys").modules, package, None)
    with pytest.raises(rumple.Error, match=f"pip install {package}"):
        getattr(rumple.autodiff, name)(decaying())
