"""States that are set between steps."""

import numpy
import pytest

import rumple
from conftest import DOME


def test_species_are_set_and_the_shape_follows(sim):
    sim.run(until=0.2)
    before, energy = sim.positions, sim.energies()["stretching"]
    sim.species["c"] = numpy.full(len(before), 0.5)
    assert (sim.species["c"] == 0.5).all()
    assert (sim.positions == before).all()
    assert sim.relax() > 0
    assert sim.positions[:, 2].max() > before[:, 2].max()
    assert sim.energies()["stretching"] != energy
    assert sim.run(until=0.3).time == 0.3


def test_positions_are_set_and_equilibrium_is_found_again(sim):
    sim.run(until=0.2)
    rest = sim.positions
    moved = rest.copy()
    inner = numpy.linalg.norm(rest[:, :2], axis=1) < 5
    moved[inner, 2] += 0.2
    sim.positions = moved
    assert (sim.positions == moved).all()
    sim.relax()
    assert numpy.abs(sim.positions - rest).max() < 1e-3
    sim.positions = moved
    step = sim.step(until=0.21)
    other = rumple.Simulation(rumple.load(DOME))
    other.run(until=0.2)
    other.run(until=step.time)
    assert numpy.abs(sim.positions - other.positions).max() < 1e-3


def test_a_start_is_set_before_the_first_step(sim):
    sim.species["c"] = [0.25] * len(sim.positions)
    sim.run()
    assert sim.species["c"].min() > 0.25 / 3
    sim = rumple.Simulation(rumple.load(DOME))
    sim.run()
    assert sim.species["c"].min() < 0.25 / 3


def test_what_does_not_fit_is_refused(sim):
    with pytest.raises(ValueError, match="c: 3 items, expected a number, or an array of"):
        sim.species["c"] = [1, 2, 3]
    with pytest.raises(TypeError, match="c: str, expected a number"):
        sim.species["c"] = "high"
    count = len(sim.positions)
    for wrong in [sim.positions[:-1], sim.positions[:, :2]]:
        with pytest.raises(ValueError, match=rf"positions: .* expected an array of shape \({count}, 3\)"):
            sim.positions = wrong
    with pytest.raises(ValueError, match="c: an array of complex128 with the shape"):
        sim.species["c"] = numpy.full(count, 1j)
    with pytest.raises(ValueError, match="c: an array of complex128"):
        sim.species["c"] = numpy.complex128(1j)
    with pytest.raises(ValueError, match="c: an array of <U1 with the shape"):
        sim.species["c"] = numpy.full(count, "1")
    with pytest.raises(ValueError, match="items, expected a number"):
        sim.species["c"] = ["1"] * count
    with pytest.raises(ValueError, match="c: an array of object"):
        sim.species["c"] = numpy.full(count, None)
    with pytest.raises(ValueError, match="c: masked values.*filled"):
        sim.species["c"] = numpy.ma.masked_array(numpy.ones(count), [True] * count)
    with pytest.raises(ValueError, match="positions: an array of complex128"):
        sim.positions = sim.positions * 1j
    sim.species["c"] = sim.species["c"] + 0.5
    (value,) = sim.species.values()
    for copy in [sim.positions, sim.rest_positions, sim.triangles, sim.field("c"), sim.species["c"], value]:
        with pytest.raises(ValueError, match="read-only"):
            copy[:] = 0
    sim.species["c"] = 0.25
    assert (sim.species["c"] == 0.25).all()
    wrong = sim.positions.copy()
    wrong[3, 0] = numpy.nan
    with pytest.raises(rumple.Error, match="vertex 3"):
        sim.positions = wrong
    with pytest.raises((TypeError, ValueError)):
        sim.positions = "here"
    sim.positions = sim.positions + 0.0
    sim.run(until=0.2)
    for past in [-1, 0.1]:
        with pytest.raises(ValueError, match="before the time 0.2 of the state"):
            sim.run(until=past)
        with pytest.raises(ValueError, match="before the time 0.2 of the state"):
            sim.step(until=past)
    assert sim.run(until=0.2) is None or sim.time == 0.2
    assert numpy.isfinite(sim.positions).all()
