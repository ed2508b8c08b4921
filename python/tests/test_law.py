"""Laws in Python."""

import signal
import threading
import time
import os

import numpy
import pytest

import laws
import rumple
from conftest import COMMON, DOME


def without_kinetics():
    text = DOME.read_text()
    start, end = text.index("[kinetics]"), text.index("[time]")
    return rumple.parse(text[:start] + text[end:])


def growing(at):
    return {"c": at.k * at["area_strain"] - at.c}


LAW = rumple.Law(
    growing,
    "c",
    signals=["area_strain"],
    parameters={"k": 1.0},
    length_factor=lambda at: 1 + 0.1 * at.c,
)


def test_a_law_gives_what_the_formula_gives(sim):
    own = rumple.Simulation(without_kinetics(), law=LAW)
    own.run()
    sim.run()
    assert own.species["c"].max() > 0.01
    assert numpy.abs(own.species["c"] - sim.species["c"]).max() < 1e-6
    assert numpy.abs(own.positions - sim.positions).max() < 1e-3


def test_derivatives_are_taken_by_differences(sim):
    method = {"time.integrator": {"kind": "monolithic", "rtol": 1e-6}}
    text = without_kinetics().resolved()
    scene = rumple.parse(text, {**method, "time.policy": "simultaneous"})
    own = rumple.Simulation(scene, law=LAW)
    own.run(until=0.3)
    formula = rumple.load(DOME, {**method, "time.policy": "simultaneous"})
    sim = rumple.Simulation(formula)
    sim.run(until=0.3)
    assert numpy.abs(own.species["c"] - sim.species["c"]).max() < 1e-5


def stiff(at):
    return {"c": at.k * at["area_strain"] - at.c**3, "d": at.c - 2.0 * at.d}


def exact(at):
    return {("c", "area_strain"): at.k, ("c", "c"): -3 * at.c**2, ("d", "c"): 1.0, ("d", "d"): numpy.full_like(at.c, -2.0)}


def implicit(**settings):
    scene = rumple.parse(
        without_kinetics().resolved(),
        {"time.integrator": {"kind": "monolithic", "rtol": 1e-8, "atol": 1e-8}, "time.policy": "simultaneous"},
    )
    law = rumple.Law(
        settings.pop("rates", stiff), ["c", "d"], signals=["area_strain"], parameters={"k": 2.0},
        length_factor=lambda at: 1 + 0.1 * at.c, **settings,
    )
    sim = rumple.Simulation(scene, law=law)
    sim.run(until=0.3)
    return sim.species


def test_a_law_may_give_its_derivatives():
    given, found = implicit(rate_partials=exact), implicit()
    assert given["d"].max() > 1e-3
    for name in ("c", "d"):
        assert numpy.abs(given[name] - found[name]).max() < 1e-6 * numpy.abs(found[name]).max()


def test_a_law_of_jax_has_exact_derivatives():
    jax = pytest.importorskip("jax")

    def rates(at):
        return {"c": at.k * at["area_strain"] - jax.numpy.power(at.c, 3), "d": at.c - 2.0 * at.d}

    by_jax, given = implicit(rates=rates, rate_partials="jax"), implicit(rate_partials=exact)
    for name in ("c", "d"):
        # In single precision they would differ by 1e-7 of the largest.
        assert numpy.abs(by_jax[name] - given[name]).max() < 1e-10 * numpy.abs(given[name]).max()


def test_wrong_derivatives_are_named():
    with pytest.raises(rumple.Error, match='"e" by "c"'):
        implicit(rate_partials=lambda at: {("e", "c"): 1.0})
    with pytest.raises(rumple.Error, match="not a pair of a species and an input"):
        implicit(rate_partials=lambda at: {"c": 1.0})
    with pytest.raises(ValueError, match='expected a function or "jax"'):
        implicit(rate_partials="autograd")


def test_a_law_bends_the_sheet():
    scene = rumple.load(DOME, {"kinetics.initial.c": 0.5})
    flat = rumple.Simulation(scene)
    law = rumple.Law(lambda at: {"e": 0.0 * at.e}, "e", curvature=lambda at: 0.2 + at.e)
    bent = rumple.Simulation(scene, law=law)
    for sim in (flat, bent):
        sim.run(until=0.25)
    assert numpy.abs(bent.positions - flat.positions).max() > 1e-3


def test_two_species_and_a_law_of_the_scene(sim):
    @rumple.law({"d": {"typical": 2.0, "lower": 0.0}}, signals="time")
    def rates(at):
        assert (at.time >= 0).all() and list(at.keys()) == ["d", "time"]
        return {"d": 1.0}

    assert rates.species == ["d"]
    sim = rumple.Simulation(rumple.load(DOME), law=rates)
    assert set(sim.species) == {"c", "d"}
    sim.run(until=0.5)
    assert numpy.allclose(sim.species["d"], 0.5)


def failing(rates, **settings):
    law = rumple.Law(rates, "c", **settings)
    sim = rumple.Simulation(without_kinetics(), law=law)
    with pytest.raises(rumple.Error) as caught:
        sim.run()
    return caught.value


def test_exceptions_of_a_law_are_the_cause():
    error = failing(lambda at: {"c": at.nothing})
    assert isinstance(error.__cause__, AttributeError) and "'c'" in str(error.__cause__)
    error = failing(lambda at: 1 / 0)
    assert isinstance(error.__cause__, ZeroDivisionError)


def test_results_of_a_law_are_checked():
    assert "the rate of c: 2 items, expected a number, or an array of" in str(failing(lambda at: {"c": [1.0, 2.0]}))
    assert "the rate of c: an array of float64 with the shape" in str(failing(lambda at: {"c": at.c[:, None]}))
    assert "read-only" in str(failing(lambda at: {"c": numpy.add(at.c, 1.0, out=at.c)}))
    assert "no rate is returned" in str(failing(lambda at: {}))
    assert "not a species" in str(failing(lambda at: {"c": 0.0, "e": 0.0}))
    assert "dict" in str(failing(lambda at: at.c))
    assert "NaN" in str(failing(lambda at: {"c": numpy.nan * at.c}))
    with pytest.raises(ValueError, match="no signal"):
        rumple.Law(growing, "c", signals=["curvature"])
    with pytest.raises(ValueError, match="positive"):
        rumple.Law(growing, {"c": 0.0})
    with pytest.raises(ValueError, match="location"):
        rumple.Law(growing, "c", location="edge")
    with pytest.raises(ValueError, match="lower = 2.* is not below upper = 1"):
        rumple.Law(growing, {"c": {"lower": 2.0, "upper": 1.0}})
    with pytest.raises(TypeError, match="@rumple.law"):
        rumple.law(growing)


def test_laws_are_tried_out_at_the_first_equilibrium():
    random = numpy.random.default_rng(1)
    sim = rumple.Simulation(without_kinetics(), law=rumple.Law(lambda at: {"c": random.random(len(at.c))}, "c", name="random"))
    with pytest.raises(rumple.Error, match="must not keep internal state"):
        sim.prepare()
    law = rumple.Law(lambda at: {"c": -at.c}, "c", rate_partials=lambda at: {("c", "c"): 50.0}, name="wrong")
    with pytest.warns(UserWarning, match="gives 50 in rate_partials .* where differences give"):
        sim = rumple.Simulation(without_kinetics(), law=law)
        sim.step()
    assert any("rate_partials" in note for note in sim.notes)


def test_a_run_warns_of_wrong_derivatives(tmp_path):
    law = rumple.Law(lambda at: {"c": -at.c}, "c", rate_partials=lambda at: {("c", "c"): 50.0}, name="wrong")
    with pytest.warns(UserWarning, match="gives 50 in rate_partials"):
        rumple.run(without_kinetics(), tmp_path / "out", law=law)


def test_a_slow_law_is_interrupted():
    def slow(at):
        time.sleep(0.01)
        return {"c": -at.c}

    sim = rumple.Simulation(without_kinetics(), law=rumple.Law(slow, "c"))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            while True:
                sim = rumple.Simulation(without_kinetics(), law=rumple.Law(slow, "c"))
                sim.run()
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, before)


def test_a_table_gives_a_law_parameters_and_a_start():
    kinetics = {"plugin": laws.GROWING, "parameters": {"k": 0.0}, "initial": {"c": 1.0}}
    scene = rumple.scene(**COMMON, kinetics=kinetics, time={"until": 0.5})
    assert scene.law is laws.GROWING and 'plugin = "growing"' in scene.resolved()
    sim = rumple.Simulation(scene)
    assert (sim.species["c"] == 1.0).all()
    sim.run()
    # Nothing but decay.
    assert numpy.allclose(sim.species["c"], numpy.exp(-0.5), rtol=2e-3)
    scene = scene.varied({"kinetics.parameters.k": 5.0})
    assert rumple.Simulation(scene).run(until=0.1) and scene.law is laws.GROWING
    with pytest.raises(rumple.Error, match=r"kinetics.parameters.q.*no parameter"):
        rumple.Simulation(scene.varied({"kinetics.parameters.q": 5.0}))
    with pytest.raises(rumple.Error, match="growing"):
        rumple.Simulation(scene.with_law(None))
    with pytest.raises(rumple.Error, match="one law in Python"):
        rumple.scene(**COMMON, kinetics=[laws.GROWING, laws.SHRINKING])


def test_the_code_of_a_law_is_told_apart():
    from rumple._law import code

    def made(factor, constant=1):
        return lambda at: {"c": factor * at.c + constant * laws.factor(at)}

    assert code([made(1)]) == code([made(1)])
    others = [made(2), made(1, 2), lambda at: {"c": at.c}, made(numpy.arange(3.0)), made(laws.growing)]
    assert len({code([law]) for law in [made(1), *others]}) == 6
    assert code([made(numpy.arange(3.0))]) != code([made(numpy.arange(3))])
    import pickle

    again = pickle.loads(pickle.dumps(laws.GROWING))
    assert repr(again) == repr(laws.GROWING) and again.species == ["c"]
