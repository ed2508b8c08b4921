"""Steps, states and fields."""

import os
import signal
import subprocess
import threading
import time

import numpy
import pytest

import rumple
from conftest import COMMON, DOME, HERE


def test_a_scene_takes_overrides():
    scene = rumple.load(DOME, {"sheet.vertices": numpy.int64(200), "output.fields": ("c",)})
    assert "vertices = 200" in scene.resolved()
    assert scene.until == 1.0
    assert scene.name.endswith("dome.toml")
    assert rumple.load(DOME, ["time.until=2"]).until == 2.0


def test_a_simulation_takes_the_path_of_a_scene(tmp_path):
    assert rumple.Simulation(DOME).run(until=0.25).time == 0.25
    with pytest.raises(rumple.Error, match="nothing.toml"):
        rumple.Simulation(str(tmp_path / "nothing.toml"))
    with pytest.raises(TypeError, match="scene"):
        rumple.Simulation(3)


def test_steps_lead_to_the_end(sim):
    steps = list(sim)
    assert sim.time == steps[-1].time == 1.0
    assert sim.steps == len(steps) == steps[-1].number
    assert all(step.iterations > 0 and 0 <= step.error <= 1 for step in steps)
    assert sum(step.length for step in steps) == pytest.approx(1.0)
    assert {0.25, 0.5, 0.75, 1.0} <= {step.time for step in steps}
    assert sim.ending == "the end time is reached"
    assert sim.step() is None


def test_arrays_of_a_periodic_sheet_are_those_of_one_period(tmp_path):
    for periodic in ["x", "xy"]:
        scene = rumple.scene(
            sheet={"shape": "rectangle", "width": 12.0, "height": 7.0, "vertices": 300, "periodic": periodic},
            kinetics={"rates": {"c": "-c"}, "initial": {"c": {"formula": "1 + cos(2*pi*x/12)"}}},
            effect=[{"kind": "diffusion", "species": "c", "coefficient": 0.5}],
            time={"until": 0.1},
            output={"every": 0.1, "fields": ["c", "vertex_area"]},
        )
        sim = rumple.Simulation(scene)
        n, c, area = len(sim.positions), sim.species["c"], sim.field("vertex_area")
        assert f"{n} vertices" in repr(sim) and sim.triangles.max() == n - 1
        assert len(sim.rest_positions) == len(c) == len(area) == n
        assert len(sim.periods) == len(periodic) and sim.volume is None
        assert area.sum() == pytest.approx(84.0) and sim.area == pytest.approx(84.0)
        assert (area * c).sum() / area.sum() == pytest.approx(1.0, abs=1e-2)
        assert len(sim.inspect()["mean_curvature"]) == n
        # What is set for a vertex holds at its images: the total of the ledger is that of the values.
        sim.species["c"] = 2.0 * c
        sim.positions = sim.positions + [0.0, 0.0, 0.5]
        assert sim.ledger_row()["total c"] == pytest.approx(2.0 * (area * c).sum(), rel=1e-2)
        assert sim.area == pytest.approx(84.0)
        with pytest.raises(ValueError, match=f"{n} numbers"):
            sim.species["c"] = numpy.ones(n + 1)
        results = rumple.run(scene, tmp_path / periodic)
        assert results.vertices == n < len(results.frames[0].points)
        assert results.frames[0].field("c")[:n] == pytest.approx(c)


def test_triangles_across_a_period_are_closed_by_images():
    from rumple._pyvista import _unfolded

    for periodic in ["x", "xy"]:
        sheet = {"shape": "rectangle", "width": 12.0, "height": 7.0, "vertices": 300, "periodic": periodic}
        sim = rumple.Simulation(rumple.scene(sheet=sheet, effect=[{"kind": "stretching"}], time={"until": 1.0},
                                             material={"young": 1.0, "poisson": 0.3, "thickness": 0.1}))
        triangles, vertices, moved = _unfolded(sim)
        a, b, c = (sim.positions[vertices] + moved)[triangles].transpose(1, 0, 2)
        areas = 0.5 * numpy.cross(b - a, c - a)[:, 2]
        assert (areas > 0).all() and areas.sum() == pytest.approx(84.0)
        assert (vertices[triangles] == sim.triangles).all()


def test_a_run_ends_where_asked(sim):
    assert sim.run(until=0.4).time == sim.time == 0.4
    assert sim.run(until=0.4) is None
    assert sim.ending is None
    with pytest.raises(rumple.Error, match="the scene ends at time 1"):
        sim.run(until=2)


def test_observers_see_every_step_and_may_end_the_run(sim):
    seen = []

    def observe(of, step):
        assert of.time == step.time
        seen.append(of.positions[:, 2].max())
        return len(seen) == 3

    assert sim.run(observe=observe).number == 3 == len(seen)

    def fails(of, step):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        sim.run(observe=fails)
    assert sim.steps == 4


def test_arrays_have_their_shapes(sim):
    sim.run(until=0.1)
    count = len(sim.positions)
    assert sim.positions.shape == sim.rest_positions.shape == (count, 3)
    assert sim.triangles.shape[1] == 3 and sim.triangles.max() == count - 1
    assert list(sim.species) == ["c"] and len(sim.species) == 1 and "c" in sim.species
    assert sim.species["c"].shape == (count,)
    assert dict(sim.species.items())["c"].max() > 0
    with pytest.raises(KeyError, match="expected one of: c"):
        sim.species["d"]


def test_fields_have_the_names_of_frames(sim):
    sim.run(until=0.1)
    assert set(sim.fields()) == {"c", "displacement [length]", "mean_curvature [1/length]"}
    assert (sim.field("c") == sim.species["c"]).all()
    moved = sim.positions - sim.rest_positions
    assert (sim.field("displacement") == moved).all()
    with pytest.raises(KeyError, match="output.fields"):
        sim.field("force")


def test_energies_are_by_effect(sim):
    sim.prepare()
    energies = sim.energies()
    assert set(energies) == {"stretching", "bending", "pressure"}
    assert energies["pressure"] < 0 < energies["stretching"]


def same_as_the_program(program, folder, path, overrides, plugins=()):
    texts = [word for text in overrides for word in ("--set", text)]
    folders = [word for plugin in plugins for word in ("--plugin-path", plugin)]
    subprocess.run(
        [program, "run", path, "--out", folder, "--quiet", *folders, *texts], check=True
    )
    results = rumple.read(folder)
    sim = rumple.Simulation(rumple.load(path, overrides), plugins=list(plugins))
    rows = []
    sim.prepare()
    rows.append([0.0, *sim.energies().values()])
    for step in sim:
        rows.append([step.time, *sim.energies().values()])
    ledger = {title: numpy.array(results.ledger[title]) for title in results.ledger}
    titles = ["time", *(f"energy of {name} [energy]" for name in sim.energies())]
    expected = numpy.array([ledger[title] for title in titles]).T
    assert (numpy.array(rows) == expected).all()
    last = results.frames[-1]
    assert (last.points == sim.positions).all()
    assert (last.triangles == sim.triangles).all()
    for cells, fields in [(False, last.fields), (True, last.cell_fields)]:
        own = sim.fields(cells=cells)
        assert set(own) == set(fields)
        assert all((own[name] == fields[name]).all() for name in own)
    assert last.time == sim.time


def test_results_are_those_of_the_program(program, tmp_path):
    same_as_the_program(program, tmp_path / "out", DOME, [])


def test_plugins_and_restarted_integrators_as_well(program, tmp_path):
    scene = HERE.parents[1] / "models/model-i/small.toml"
    overrides = ["sheet.vertices=300", "time.until=0.3", "output.every=0.1"]
    same_as_the_program(program, tmp_path / "i", scene, overrides, [program.parent])
    overrides = ["time.integrator={kind='monolithic', rtol=1e-7}", "time.policy=simultaneous"]
    overrides += ["sheet.vertices=100", "material.drag=1.0"]
    same_as_the_program(program, tmp_path / "m", DOME, overrides)


LONG = {"sheet.vertices": 20000}


def test_an_interruption_stops_within_a_second():
    sim = rumple.Simulation(rumple.load(DOME, LONG))
    sent = []

    def send():
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.5, send)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            sim.run()
        assert time.monotonic() - sent[0] < 1.0
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, before)
    assert sim.time < 1.0 and numpy.isfinite(sim.positions).all()


def test_handlers_of_signals_stay():
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    rumple.Simulation(rumple.load(DOME)).run()
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before
    lines = open("/proc/self/status").read() if os.path.exists("/proc/self/status") else ""
    caught = [int(line.split()[1], 16) for line in lines.splitlines() if line.startswith("SigCgt")]
    for mask in caught:
        assert not mask & 1 << signal.SIGTERM - 1


def test_other_threads_go_on_meanwhile():
    sim = rumple.Simulation(rumple.load(DOME, {"sheet.vertices": 3000}))
    counted = []
    work = threading.Thread(target=sim.prepare)
    work.start()
    while work.is_alive():
        counted.append(time.monotonic())
        time.sleep(0.001)
    assert len(counted) > 20


def test_a_checkpoint_and_a_copy_make_the_same_steps(tmp_path):
    sim = rumple.Simulation(DOME)
    sim.run(0.5)
    sim.checkpoint(tmp_path / "half")
    other = sim.copy()
    assert (other.time, other.steps) == (sim.time, sim.steps)
    sim.run()
    other.run()
    assert (other.positions == sim.positions).all() and other.steps == sim.steps
    assert (other.species["c"] == sim.species["c"]).all()
    # Wherever it has been, with another end.
    longer = rumple.Simulation(rumple.load(DOME, {"time.until": 1.5}))
    longer.run(0.25)
    longer.restore(tmp_path / "half")
    assert longer.time == 0.5
    longer.run(1.0)
    assert (longer.positions == sim.positions).all()
    with pytest.raises(rumple.Error, match="material.young was"):
        rumple.Simulation(rumple.load(DOME, {"material.young": 7.0})).restore(tmp_path / "half")
    with pytest.raises(rumple.Error, match="dome.toml: .*does not begin as a checkpoint"):
        sim.restore(DOME)


def test_a_copy_has_the_law_in_python():
    @rumple.law("c", parameters={"k": 1.0})
    def rates(at):
        return {"c": -at.k * at.c}

    scene = rumple.scene(**COMMON, kinetics={"plugin": rates, "initial": {"c": 1.0}}, time={"until": 1.0})
    sim = rumple.Simulation(scene)
    other = sim.copy()
    other.run()
    assert sim.time == 0.0 and abs(other.species["c"][0] - numpy.exp(-1.0)) < 1e-3
