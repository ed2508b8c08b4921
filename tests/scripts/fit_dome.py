#!/usr/bin/env python3
"""Parameters of models/policies/dome.toml from noisy frames of its own run on another mesh; wants the Python module.

usage: fit_dome.py PROGRAM
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy
import rumple

SCENE = Path(__file__).resolve().parents[2] / "models/policies/dome.toml"


def tolerance(value: str) -> str:
    return f'time.integrator={{kind="staggered",rtol={value},atol={value}}}'


def main() -> None:
    program = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        truth = folder / "truth"
        words = ["run", SCENE, "--quiet", "--out", truth, "--set", "sheet.vertices=900", "--set", "sheet.seed=5"]
        subprocess.run([program, *words, "--set", tolerance("1e-5")], check=True)
        search = program.parent
        rest = rumple.Simulation(rumple.load(truth / "resolved.toml"), plugins=search).rest_positions
        for noise in (0.01, 0.05):
            random = numpy.random.default_rng(3)
            rows = ["t,x,y,c"]
            for frame in list(rumple.Results(truth).frames)[1:]:
                c = frame.field("c")
                for i in random.choice(len(c), 150, replace=False):
                    value = c[i] * (1 + noise * random.normal())
                    rows.append(f"{frame.time},{rest[i, 0]},{rest[i, 1]},{value}")
            data = folder / f"{noise}.csv"
            data.write_text("\n".join(rows) + "\n")
            print(f"noise of {noise}")
            words = ["fit", SCENE, data, "--quiet", "--out", folder / f"fit-{noise}", "--set", tolerance("1e-4")]
            starts = {"kinetics.parameters.w": (1.2, 0.2, 10), "kinetics.parameters.c_star": (0.6, 0.05, 1)}
            starts["effect.diffusion.coefficient"] = (0.5, 0.05, 10)
            for key, (start, low, high) in starts.items():
                words += ["--set", f"{key}={start}", "--with", f"{key}={low}:{high}"]
            subprocess.run([program, *words], check=True)


if __name__ == "__main__":
    main()
