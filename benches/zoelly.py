"""Buckling pressure of spherical shells over that of Zoelly, by model of stretching, mesh and thickness.

A shell loses volume exactly as much as is prescribed, in small steps; the largest pressure on the way is that at which it
buckles. Zoelly (1915): p = 2E h²/(R² √(3 (1 - ν²))).

    python3 benches/zoelly.py [--rumple target/release/rumple] [--ratio 20 50] [--vertices 2562 10242] [--keep FOLDER]
"""

import argparse
import csv
import math
import subprocess
import tempfile
import time
from pathlib import Path

RADIUS = 10.0
YOUNG = 1e3
NU = 1 / 3
# The uniform contraction at Zoelly's pressure, in thicknesses: the volume falls by three times this over R/h.
CONTRACTION = (1 - NU) / math.sqrt(3 * (1 - NU * NU))


def scene(model, mesh, vertices, thickness, steps):
    """Text of the scene, to 1.15 times the contraction at Zoelly's pressure in so many steps."""
    loss = 1.15 * 3 * CONTRACTION * thickness / RADIUS
    return f"""
sheet = {{ shape = "sphere", radius = {RADIUS}, vertices = {vertices}{mesh} }}
material = {{ young = {YOUNG}, poisson = {NU!r}, thickness = {thickness} }}
time = {{ until = 1.0, integrator = {{ kind = "staggered", method = "euler", step = {1 / steps!r} }} }}
equilibrium = {{ tolerance = 1e-8 }}
effect = [{{ kind = "stretching", model = "{model}" }}, {{ kind = "bending" }},
    {{ kind = "volume", exact = true, ramp = {{ formula = "1 - {loss!r}*t" }} }}]
output = {{ every = 0.05 }}
"""


def column(row, start):
    """The value of the first column whose name starts so."""
    return float(next(value for name, value in row.items() if name.startswith(start)))


def buckling(rumple, text, thickness, folder):
    """Largest pressure over Zoelly's and the last one."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "scene.toml").write_text(text, encoding="utf-8")
    out = folder / "run"
    command = [rumple, "run", folder / "scene.toml", "--out", out, "--force", "--quiet", "--threads", "1"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        return None, done.stderr.strip().splitlines()[-1][:80]
    critical = 2 * YOUNG * (thickness / RADIUS) ** 2 / math.sqrt(3 * (1 - NU * NU))
    with open(out / "ledger.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    # The multiplier is that of the logarithm of the volume.
    full = 4 / 3 * math.pi * RADIUS**3
    loss = 1.15 * 3 * CONTRACTION * thickness / RADIUS
    pressures = []
    for row in rows:
        volume = full * (1 - loss * column(row, "time"))
        pressures.append(-column(row, "multiplier of volume") / volume / critical)
    return max(pressures), pressures[-1]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rumple", default="target/release/rumple")
    parser.add_argument("--ratio", type=float, nargs="*", default=[20.0, 50.0])
    parser.add_argument("--vertices", type=int, nargs="*", default=[2562])
    parser.add_argument("--steps", type=int, default=60)
    parser.add_argument("--keep", type=Path)
    options = parser.parse_args()
    print("| R/h | mesh | vertices | model | buckles at | after | s |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for ratio in options.ratio:
            for vertices in options.vertices:
                for name, mesh in (("icosphere", ""), ("irregular", ", irregular = true")):
                    for model in ("bond", "stvk"):
                        text = scene(model, mesh, vertices, RADIUS / ratio, options.steps)
                        where = (options.keep or Path(folder)) / f"{ratio:g}-{name}-{vertices}-{model}"
                        begun = time.monotonic()
                        most, last = buckling(options.rumple, text, RADIUS / ratio, where)
                        seconds = time.monotonic() - begun
                        found = f"{most:.3f} | {last:.3f}" if most is not None else f"| {last}"
                        print(f"| {ratio:g} | {name} | {vertices} | {model} | {found} | {seconds:.0f} |", flush=True)


if __name__ == "__main__":
    main()
