"""Uniform and affine growth of every shape, prescribed and by a species, at default settings.

A free sheet that grows uniformly is similar to itself as long as bending does not see its size: flat sheets and the
closed sphere. Of an open cylinder the energy is compared with that of a motion under a drag of 1e-4. Prints one line a scene:
the energies, and the steps, iterations and snaps. A star marks flat sheets with an imperfection.

    python3 benches/growth.py [--rumple target/release/rumple] [--only NAME]
"""

import argparse
import csv
import math
import subprocess
import tempfile
from pathlib import Path

FACTORS = {"1.01": "1+0.01*t", "2": "1+t", "10": "1+9*t"}
FLAT = {
    "disc": 'shape = "disc", radius = 10.0',
    "rectangle": 'shape = "rectangle", width = 20.0, height = 8.0',
    "annulus": 'shape = "annulus", inner = 4.0, outer = 10.0',
}
CURVED = {"sphere": 'shape = "sphere", radius = 10.0', "cylinder": 'shape = "cylinder", radius = 5.0, height = 12.0'}


def scene(sheet, factor, how, policy, directory):
    """A scene whose lengths grow by `factor`, prescribed or by a species."""
    growth, chemistry = "", ""
    if how == "prescribed":
        growth = f', {{ kind = "growth", factor = "{factor}" }}'
    else:
        chemistry = (
            '[kinetics]\nspecies.g = { doc = "growth", typical = 1.0 }\nrates.g = "1"\ninitial.g = 0.0\n'
            f'length_factor = "{factor.replace("t", "g")}"\n'
        )
    drag = "" if policy == "quasi-static" else ", drag = 1e-4"
    text = (
        f'effect = [{{ kind = "stretching" }}, {{ kind = "bending" }}{growth}]\n'
        f"sheet = {{ {sheet} }}\n"
        f"material = {{ young = 1e5, poisson = 0.3333333333333333, thickness = 0.1{drag} }}\n"
        f'time = {{ policy = "{policy}", until = 1.0 }}\n'
        'output = { every = 1.0 }\n'
        f"{chemistry}"
    )
    path = directory / "scene.toml"
    path.write_text(text)
    return path


def run(rumple, path, directory):
    """Runs a scene; the last row of its ledger, with the sums of its counts, or what it failed with."""
    out = directory / "out"
    done = subprocess.run(
        [rumple, "run", path, "--out", out, "--force", "--quiet", "--threads", "1"], capture_output=True, text=True
    )
    if done.returncode:
        return done.stderr.strip().splitlines()[-1], None
    with open(out / "ledger.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return None, {
        "energy": float(rows[-1]["total energy [energy]"]),
        "first": float(rows[0]["total energy [energy]"]),
        "steps": len(rows) - 1,
        "iterations": sum(int(row["iterations"]) for row in rows),
        "snaps": sum(int(row.get("snaps", 0)) for row in rows),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rumple", default="target/release/rumple")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        print("shape       growth      by           energy at the start and end      under drag  steps  iterations  snaps")
        for name, sheet in {**FLAT, **CURVED}.items():
            for bumpy in ("", ", imperfection = { amplitude = 1e-3, seed = 1 }"):
                if bumpy and name not in FLAT or options.only not in name:
                    continue
                for factor, formula in FACTORS.items():
                    for how in ("prescribed", "a species"):
                        mesh = f"{sheet}, vertices = 642{bumpy}"
                        error, here = run(options.rumple, scene(mesh, formula, how, "quasi-static", folder), folder)
                        label = f"{name + ('*' if bumpy else ''):11} {factor:11} {how:12}"
                        if error:
                            print(f"{label} {error}", flush=True)
                            continue
                        _, drag = run(options.rumple, scene(mesh, formula, how, "simultaneous", folder), folder)
                        under = math.nan if drag is None else drag["energy"]
                        print(
                            f"{label} {here['first']:.6e} {here['energy']:.6e} {under:15.6e} {here['steps']:6} "
                            f"{here['iterations']:11} {here['snaps']:6}",
                            flush=True,
                        )


if __name__ == "__main__":
    main()
