#!/usr/bin/env python3
"""What a step costs from Python besides the engine's work, and what a law in Python costs.

Steps: the same by the program and by the module. Overhead: Model I on 20 000 vertices, processor seconds of the steps after the first
equilibrium on one thread, in turn, and the ratios of each round. Laws: Model I on 20 000 triangles as a plugin, as text and in NumPy; the
time that `costs.json` has for the law, and that of whole steps.

usage: benches/python.py steps|overhead|laws [PROGRAM]    (with the module installed; the program without output but the ledger)
"""

import json
import re
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy

import rumple

PROGRAM = sys.argv[2] if len(sys.argv) > 2 else "target/release/rumple"
MODELS = Path(__file__).parents[1] / "models/model-i"
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


def steps():
    """Prints what a step costs."""
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


OVERHEAD = {"sheet.vertices": 20_000, "time.until": 0.03, "output.report": False, "output.every": 0.03}
ROUNDS = 5


def overhead():
    """Prints the processor seconds of the steps from Python over those of the program."""
    scene, plugins = MODELS / "small.toml", [Path(PROGRAM).parent]
    sets = [word for key, value in OVERHEAD.items() for word in ("--set", f"{key}={toml(value)}")]

    def program():
        with tempfile.TemporaryDirectory() as folder:
            command = [PROGRAM, "run", scene, "--out", Path(folder) / "out", "--quiet", "--threads", "1", *sets]
            subprocess.run(command, check=True, capture_output=True)
            status = json.loads((Path(folder) / "out/status.json").read_text())
            return status["cpu_seconds"] - status["start"]["cpu_seconds"]

    def module(observe):
        sim = rumple.Simulation(rumple.load(scene, OVERHEAD), plugins=plugins)
        sim.prepare()
        start = time.process_time()
        if observe:
            sim.run(observe=lambda sim, step: sim.species["c"].max() < 0 or sim.positions.size == 0)
        else:
            for _ in sim:
                pass
        return time.process_time() - start

    found = [(program(), module(False), module(True)) for _ in range(ROUNDS)]
    for name, column in [("for step in sim", 1), ("run(observe=…) that copies state", 2)]:
        ratios = [row[column] / row[0] for row in found]
        print(f"{name}: {statistics.median(ratios):.3f} of the program, rounds {[f'{r:.3f}' for r in ratios]}")
    print(f"program: {statistics.median(row[0] for row in found):.2f} s, {[f'{row[0]:.2f}' for row in found]}")


def toml(value):
    """A value after --set."""
    return str(value).lower()


def length_factor(at):
    mean = at.lambda_min + (at.lambda_max - at.lambda_min) / (1 + numpy.exp(at.b * (at.c - at.c_star)))
    return at.lambda_max / mean


MODEL_I = {"w": 15.0, "beta": 1.0, "H_s": 0.05, "b": 100.0, "c_star": 0.1, "lambda_max": 1.0, "lambda_min": 0.65}


@rumple.law(
    {"c": {"typical": 0.1, "lower": 0.0}},
    signals=["mean_curvature"],
    parameters=MODEL_I,
    length_factor=length_factor,
    location="face",
)
def model_i(at):
    up = numpy.maximum(at.mean_curvature, 0.0)
    return {"c": at.w * up * at.H_s / (up + at.H_s) - at.beta * at.c}


COMMON = {"sheet.vertices": 10_180, "output.report": False, "output.every": 1.0}
INTEGRATORS = {
    "Heun, 5 steps": {"time.until": 0.05},
    "Rosenbrock to t = 0.05": {"time.until": 0.05, "time.integrator": "staggered"},
}


def laws():
    """Prints what Model I costs as a plugin, as text and in Python, from one state."""
    with tempfile.TemporaryDirectory() as folder:
        start = {**COMMON, "time.max_steps": 1}
        start = rumple.run(rumple.load(MODELS / "formula.toml", start), Path(folder) / "start")
        state = start.frames[0].path
        for name, integrator in INTEGRATORS.items():
            settings = {**COMMON, **integrator}
            text = rumple.load(MODELS / "formula.toml", settings)
            toml = text.resolved()
            without = rumple.parse(toml[: toml.index("[kinetics")] + toml[toml.index("[time") :])
            plugin = rumple.load(MODELS / "small.toml", settings)
            ways = {"plugin": (plugin, None), "text": (text, None), "Python": (without, model_i)}
            found = {way: [] for way in ways}
            for _ in range(3):
                for way, (scene, law) in ways.items():
                    found[way].append(law_cost(scene, law, state))
            for way, all_of in found.items():
                law, whole = numpy.median([costs[:2] for costs in all_of], axis=0)
                print(f"{name}, {way}: law {law:.3f} s, all {whole:.2f} s, {all_of[0][2]}", flush=True)


def law_cost(scene, law, state):
    """Seconds of the law, seconds of all steps, and calls of the law, of a run."""
    with tempfile.TemporaryDirectory() as folder:
        folders = [Path(PROGRAM).parent]
        results = rumple.run(scene, Path(folder) / "out", state=state, law=law, plugins=folders)
        costs = json.loads((results.directory / "costs.json").read_text())
        assert 19_500 < len(results.frames[0].triangles) < 20_500
    parts = [part for part in costs["parts"] if part["group"] == "law"]
    counts = [" ".join(f"{count} {name}" for name, count in part["counts"]) for part in parts]
    return sum(part["seconds"] for part in parts), costs["seconds"], counts


if __name__ == "__main__":
    {"steps": steps, "overhead": overhead, "laws": laws}[sys.argv[1]]()
