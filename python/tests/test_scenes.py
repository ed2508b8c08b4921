"""Scenes of other kinds: stop rules, no space, species on faces."""

import numpy
import pytest

import rumple
from conftest import COMMON, DOME
from test_law import without_kinetics


def test_stop_rules_of_the_scene_hold():
    sim = rumple.Simulation(rumple.load(DOME, {"time.max_steps": 3}))
    assert len(list(sim)) == 3 and sim.ending == "the number of steps is reached"
    sim = rumple.Simulation(rumple.load(DOME, {"time.stop_when_steady": 0.5}))
    assert list(sim)[-1].time < 1.0 and sim.ending.startswith("steady")


def test_a_point_has_only_species():
    text = 'sheet = { shape = "point" }\ntime = { until = 1.0 }\nkinetics = { rates = { c = "1 - c" } }'
    sim = rumple.Simulation(rumple.parse(text))
    sim.run()
    assert sim.species["c"] == pytest.approx([1 - numpy.exp(-1)], rel=1e-4)
    assert sim.positions.shape == (1, 3) and sim.triangles.shape == (0, 3)
    assert sim.energies() == {}


def test_species_on_faces():
    @rumple.law("c", signals=["position", "area_strain"], location="face")
    def rates(at):
        return {"c": 1 + 0 * at.position_x - at.c}

    sim = rumple.Simulation(without_kinetics(), law=rates)
    sim.run(until=0.1)
    count = len(sim.triangles)
    assert sim.species["c"].shape == sim.field("c", cells=True).shape == (count,)
    assert sim.field("c").shape == (len(sim.positions),)
    sim.species["c"] = numpy.zeros(count)
    assert sim.species["c"].max() == 0
    with pytest.raises(ValueError, match=rf"shape \(3,\), expected a number, or an array of {count}"):
        sim.species["c"] = numpy.zeros(3)


def test_names_that_clash_are_refused():
    with pytest.raises(rumple.Error, match="belongs to an earlier law"):
        rumple.Simulation(rumple.load(DOME), law=rumple.Law(lambda at: {"c": 0}, "c"))


def test_keyword_arguments_are_the_tables_of_a_scene():
    kinetics = {"rates": {"c": "area_strain - c"}, "length_factor": "1 + 0.1*c"}
    sheet = {**COMMON["sheet"], "vertices": numpy.int64(300)}
    scene = rumple.scene(**{**COMMON, "sheet": sheet}, kinetics=kinetics, time={"until": 1.0})
    assert scene.resolved() == rumple.load(DOME).resolved()
    assert scene.path is None and rumple.load(DOME).path == DOME
    assert scene.varied({"time.until": 2.0}).varied({"sheet.radius": 5.0}).until == 2.0
    with pytest.raises(rumple.Error, match=r"(?s)dome:\d+.*vertices.*\"many\""):
        rumple.scene(name="dome", **{**COMMON, "sheet": {**sheet, "vertices": "many"}})
    with pytest.raises(rumple.Error, match="(?s)sheat.*did you mean sheet"):
        rumple.scene(sheat=sheet)
    for kinetics in [lambda at: {}, {"plugin": lambda at: {}}]:
        with pytest.raises(TypeError, match="make one of it by @rumple.law"):
            rumple.scene(**COMMON, kinetics=kinetics)
    with pytest.raises(TypeError, match="no values of type function"):
        rumple.scene(sheet={"shape": lambda: "disc"})


def test_the_shipped_plugins_come_with_the_package(monkeypatch, tmp_path):
    monkeypatch.delenv("RUMPLE_PLUGIN_PATH", raising=False)

    def scene(plugin):
        sheet = {"shape": "disc", "radius": 10.0, "vertices": 100}
        return rumple.scene(sheet=sheet, kinetics={"plugin": plugin}, time={"until": 0.1})

    assert set(rumple.Simulation(scene("gray-scott")).species) == {"u", "v"}
    with pytest.raises(rumple.Error, match=r"no plugin `nowhere`(.|\n)*plugins=\[DIR\]"):
        rumple.Simulation(scene("nowhere"), plugins=tmp_path)
