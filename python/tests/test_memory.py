"""Simulations that are dropped leave nothing behind."""

import rumple
from conftest import DOME


def resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096


def test_a_thousand_simulations_leave_nothing_behind():
    scene = rumple.load(DOME, {"sheet.vertices": 60})
    law = rumple.Law(lambda at: {"d": -at.d}, "d")

    def make(count):
        for _ in range(count):
            sim = rumple.Simulation(scene, law=law)
            sim.step()
            sim.species["c"] = 0 * sim.species["c"]

    make(200)
    before = resident()
    make(800)
    assert resident() - before < 8e6
