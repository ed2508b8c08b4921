#!/usr/bin/env python3
"""What a step costs from Python besides the engine's work: the same steps by the program and by the module.

usage: benches/python.py [PROGRAM]    (with the module installed; the program without output but the ledger)
"""

import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import rumple

PROGRAM = sys.argv[1] if len(sys.argv) > 1 else "target/release/rumple"
STEPS = 20_000
SCENE = f"""
sheet = {{ shape = "sphere", radius = 2.0, vertices = VERTICES }}
effect = [{{ kind = "diffusion", species = "c", coefficient = 0.5 }}]
time = {{ until = 1.0, integrator = {{ kind = "staggered", method = "euler", step = {1 / STEPS} }} }}
output = {{ report = false }}
kinetics = {{ rates = {{ c = "1 - c" }} }}
"""


def by_program(scene, folder):
    """Seconds of the program without start and output."""
    command = [PROGRAM, "run", scene, "--out", folder, "--force"]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    numbers = re.search(r"([\d.]+) s, of these ([\d.]+) s for .* and ([\d.]+) s for output", text)
    whole, start, output = map(float, numbers.groups())
    return whole - start - output


def by_module(scene, observe=None):
    """Seconds of stepping by the module."""
    sim = rumple.Simulation(rumple.load(scene))
    sim.prepare()
    start = time.perf_counter()
    if observe is None:
        for _ in sim:
            pass
    else:
        sim.run(observe=observe)
    assert sim.time == 1.0
    return time.perf_counter() - start


def main():
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.toml"
        for vertices in [100, 1000]:
            scene.write_text(SCENE.replace("VERTICES", str(vertices)))
            ways = {
                "program": lambda: by_program(scene, Path(folder) / "out"),
                "for step in sim": lambda: by_module(scene),
                "run(observe=…) of all species": lambda: by_module(
                    scene, lambda sim, step: sim.species["c"].size == 0
                ),
            }
            seconds = {name: [] for name in ways}
            for _ in range(3):
                for name, way in ways.items():
                    seconds[name].append(way())
            sim = rumple.Simulation(rumple.load(scene))
            start = time.perf_counter()
            for _ in range(STEPS):
                sim.ending
            print(f"{vertices} vertices, a call without work: {(time.perf_counter() - start) / STEPS * 1e6:.1f} µs")
            for name, all_of in seconds.items():
                steps = f"{statistics.median(all_of) / STEPS * 1e6:.1f} µs a step"
                print(f"{vertices} vertices, {name}: {steps}")


if __name__ == "__main__":
    main()
