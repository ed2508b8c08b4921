"""Numbers of a state: rows of the ledger, measures, evaluations, area and volume."""

import subprocess

import numpy
import pytest

import rumple
from conftest import DOME


def test_rows_are_those_of_the_ledger(program, tmp_path):
    subprocess.run([program, "run", DOME, "--out", tmp_path / "out", "--quiet"], check=True)
    ledger = rumple.read(tmp_path / "out").ledger
    sim = rumple.Simulation(rumple.load(DOME))
    rows = [sim.ledger_row() for _ in sim]
    assert set(ledger) - set(rows[0]) == {"wall time [s]"}
    for title in rows[0]:
        assert [row[title] for row in rows] == list(ledger[title])[1:], title


def test_evaluations_have_forces_and_signals(sim):
    sim.run(until=0.5)
    all_of = sim.inspect()
    assert all_of["energy"]["stretching"] == sim.energies()["stretching"]
    assert all_of["force"]["total"].shape == (len(sim.positions), 3)
    assert (all_of["species"]["c"] == sim.species["c"]).all()
    assert all_of["vertex_area"].sum() == pytest.approx(sim.area)
    assert (all_of["reaction"]["c"] == all_of["signals"]["area_strain"] - sim.species["c"]).all()


def test_measures_are_those_of_a_sweep(sim):
    sim.run()
    measures = sim.measures()
    height = numpy.linalg.norm(sim.positions - sim.rest_positions, axis=1).max()
    assert measures["amplitude"] == pytest.approx(height)
    assert measures["spots"] >= 1 and 0 < measures["share"] < 1
    assert sim.measures(level=1e9)["spots"] == 0 and sim.measures(level=1e9)["separation"] is None


def test_area_and_volume_are_those_of_a_sphere(sim):
    text = """
    sheet = { shape = "sphere", radius = 2.0, vertices = 4000 }
    effect = [{ kind = "diffusion", species = "c", coefficient = 1.0 }]
    time = { until = 1.0 }
    kinetics = { rates = { c = "1" } }
    """
    sphere = rumple.Simulation(rumple.parse(text))
    assert sphere.area == pytest.approx(16 * numpy.pi, rel=2e-3)
    assert sphere.volume == pytest.approx(32 / 3 * numpy.pi, rel=4e-3)
    assert sim.volume is None
    assert sim.area == pytest.approx(100 * numpy.pi, rel=1e-2)
