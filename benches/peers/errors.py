"""errors.py STUDY: errors of the runs in STUDY/peers against the reference of the study `rumple accuracy`, and their times.

Root mean squares over points, which count alike: of the worst species relative to its values, of the shape relative to
its displacement since the start, after the best rigid motion; the largest over output times.
"""
import json
import re
import struct
import sys
from pathlib import Path

import numpy as np


def states(path):
    """Times with positions and species of every state in a file."""
    data, at, found = path.read_bytes(), 16, {}
    while at + 32 <= len(data):
        time, _, vertices, species = struct.unpack_from("<d3Q", data, at)
        counts = struct.unpack_from(f"<{species}Q", data, at + 32)
        at += 32 + 8 * species
        numbers = np.frombuffer(data, "<f8", 3 * vertices + sum(counts), at)
        at += 8 * len(numbers)
        parts = np.split(numbers, np.cumsum([3 * vertices, *counts])[:-1])
        found[round(time, 9)] = parts[0].reshape(-1, 3), parts[1:]
    return found


def aligned(a, b):
    """Positions a after the rigid motion that brings them closest to b."""
    u, _, vt = np.linalg.svd((a - a.mean(0)).T @ (b - b.mean(0)))
    turn = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return (a - a.mean(0)) @ turn + b.mean(0)


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


study = Path(sys.argv[1])
name = re.search(r"^\* Reference: (.*), [^,]*\.$", (study / "accuracy.md").read_text(), re.M).group(1)
plan = json.loads((study / "sweep.json").read_text())
number = plan["axes"][0]["values"].index(f"reference: {name}")
folder = next(m["folder"] for m in plan["members"] if m["at"][0] == number)
truth = states(study / "members" / folder / "states.bin")
rest = truth[min(truth)][0]
print(f"against {name}\n\n| program | tolerance | species | shape | s | evaluations | factorisations |")
print("| --- | --- | --- | --- | --- | --- | --- |")
records = [(json.loads(path.read_text()), path.parent) for path in sorted(study.glob("peers/*/peer.json"))]
for said, folder in sorted(records, key=lambda one: (one[0]["integrator"], -one[0]["tolerance"])):
    if said["failed"]:
        print(f"| {said['integrator']} | {said['tolerance']:g} | failed: {said['failed']} |  |  |  |  |")
        continue
    species, shape = [0.0], [0.0]
    for time, (x, values) in states(folder / "states.bin").items():
        if time > 0 and time in truth:
            right, known = truth[time]
            species += [rms(a - b) / rms(b) for a, b in zip(values, known)]
            if len(x) > 2:
                shape.append(rms(aligned(x, right) - right) / rms(right - rest))
    seconds = np.median(said["seconds"])
    print(f"| {said['integrator']} | {said['tolerance']:g} | {max(species):.2g} | {max(shape):.2g} | {seconds:.3g} "
          f"| {said['evaluations']} | {said['factorisations']} |")
