#!/usr/bin/env python3
"""Scatter of fitted rates over noise, against the standard errors that every fit states.

usage: fit_scatter.py PROGRAM [SEEDS]
"""

import json
import math
import random
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

SCENE = """
sheet = { shape = "disc", radius = 3.0, vertices = 80 }
time = { until = 4.0, integrator = { kind = "staggered", rtol = 1e-5, atol = 1e-5 } }
effect = [{ kind = "diffusion", species = "u", coefficient = 0.2 }]
[kinetics]
rates.u = "s - k*u"
parameters = { k = 0.5, s = 0.3 }
initial.u = 2.0
"""
K, S, SIGMA = 0.8, 0.4, 0.02


def fitted(program: Path, folder: Path, seed: int) -> list[float]:
    """(found - true)/(standard error) of k and s; half of the seeds state the errors of the data."""
    noise = random.Random(seed)
    given = seed % 2 == 0
    rows = ["t,mean(u)" + (",sigma mean(u)" if given else "")]
    for step in range(1, 41):
        t = 0.1 * step
        value = S / K + (2 - S / K) * math.exp(-K * t) + noise.gauss(0, SIGMA)
        rows.append(f"{t},{value}" + (f",{SIGMA}" if given else ""))
    (folder / "scene.toml").write_text(SCENE)
    (folder / "data.csv").write_text("\n".join(rows) + "\n")
    words = "fit scene.toml data.csv --with kinetics.parameters.k=0.01:5 --with kinetics.parameters.s=0: --json --quiet --force"
    done = subprocess.run([program, *words.split()], cwd=folder, capture_output=True, text=True, check=True)
    fit = json.loads(done.stdout)
    standard = fit["uncertainty"]["standard"]
    return [(found - true) / error for found, true, error in zip(fit["values"], (K, S), standard)]


def main() -> None:
    program = Path(sys.argv[1]).resolve()
    seeds = int(sys.argv[2]) if len(sys.argv) > 2 else 40
    with tempfile.TemporaryDirectory() as folder:
        all_seeds = [fitted(program, Path(folder), seed) for seed in range(seeds)]
    for name, errors in zip("ks", zip(*all_seeds)):
        print(f"{name}: mean {statistics.mean(errors):.2f}, standard deviation {statistics.stdev(errors):.2f}")


if __name__ == "__main__":
    main()
