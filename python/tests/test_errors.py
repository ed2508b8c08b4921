"""Errors are exceptions with their place."""

import pytest

import rumple
from conftest import COMMON, DOME
from rumple import _rumple


def test_a_mistake_in_a_scene_has_its_place():
    with pytest.raises(rumple.Error) as caught:
        rumple.load(DOME, {"sheet.vertexes": 5})
    assert "vertexes" in str(caught.value) and "vertices" in str(caught.value)
    text = DOME.read_text().replace("poisson = 0.3333333333333333", "poisson = 2.0")
    with pytest.raises(rumple.Error) as caught:
        rumple.parse(text, name="wrong.toml")
    message = str(caught.value)
    assert "wrong.toml:7" in message and "poisson" in message and "\x1b" not in message
    assert isinstance(caught.value, rumple.SceneError)
    assert (caught.value.path, caught.value.line) == ("wrong.toml", 7) and caught.value.column > 0


def test_a_scene_that_is_not_there():
    with pytest.raises(rumple.Error, match="nowhere.toml"):
        rumple.load("nowhere.toml")


def test_errors_of_later_checks_have_their_place_too():
    with pytest.raises(rumple.Error, match="effect") as caught:
        rumple.Simulation(rumple.load(DOME, {"effect[4].species": "d"}))
    assert "species" in str(caught.value)


def test_overrides_of_other_types_are_refused():
    with pytest.raises(TypeError, match="NoneType"):
        rumple.load(DOME, {"sheet.vertices": None})
    with pytest.raises(TypeError, match="overrides"):
        rumple.load(DOME, 3)


def test_a_panic_is_an_exception(capfd):
    with pytest.raises(rumple.Error, match="internal error: on purpose"):
        _rumple._panic()
    assert "on purpose" in capfd.readouterr().err


def test_a_step_that_blows_up_is_an_error(tmp_path):
    text = """
    sheet = { shape = "sphere", radius = 5.0, vertices = 100 }
    material = { young = 1e4, poisson = 0.3333333333333333, thickness = 0.1, drag = 0.1 }
    effect = [
        { kind = "stretching" },
        { kind = "bending" },
        { kind = "pressure", value = 500.0, ramp = { formula = "t" } },
    ]
    time = { until = 1.0, policy = "simultaneous" }
    """
    sim = rumple.Simulation(rumple.parse(text))
    with pytest.raises(rumple.SolverError, match="blow") as caught:
        sim.run()
    assert caught.value.folder is None and caught.value.line is None
    assert 0.3 < sim.time < 1.0
    with pytest.raises(rumple.SolverError, match="blow") as caught:
        rumple.run(rumple.parse(text), tmp_path / "out")
    assert 0.3 < caught.value.time < 1.0 and (caught.value.folder / "report.md").is_file()


def test_errors_of_files_and_laws_have_classes_of_their_own(tmp_path):
    with pytest.raises(rumple.FileError, match="none.vtu"):
        rumple.run(DOME, tmp_path / "out", state=tmp_path / "none.vtu")

    @rumple.law("c")
    def wrong(at):
        raise ValueError("on purpose")

    scene = rumple.scene(**COMMON, kinetics={"plugin": wrong}, time={"until": 1.0})
    with pytest.raises(rumple.LawError, match="on purpose"):
        rumple.Simulation(scene).run()
    with pytest.raises(rumple.SceneError, match="no_such_law") as caught:
        rumple.Simulation(rumple.load(DOME, {"kinetics": {"plugin": "no_such_law"}}))
    assert caught.value.path is None


def test_errors_name_the_key_and_the_vertex(tmp_path):
    text = DOME.read_text().replace("poisson = 0.3333333333333333", "poisson = 2.0")
    with pytest.raises(rumple.SceneError) as caught:
        rumple.parse(text)
    assert caught.value.key == "material.poisson"
    with pytest.raises(rumple.SceneError) as caught:
        rumple.Simulation(rumple.load(DOME, {"effect[4].species": "d"}))
    assert caught.value.key == "effect[4].species"

    @rumple.law("c")
    def wrong(at):
        rates = 0.0 * at.c
        rates[7] = float("nan")
        return {"c": rates}

    scene = rumple.scene(**COMMON, kinetics={"plugin": wrong}, time={"until": 1.0})
    for run in (lambda: rumple.Simulation(scene).run(), lambda: rumple.run(scene, tmp_path / "out")):
        with pytest.raises(rumple.LawError, match="vertex 7") as caught:
            run()
        assert caught.value.vertex == 7
