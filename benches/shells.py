"""Two shells with known answers that are hard: the slit annular plate, and half a mylar balloon.

    target/venv/bin/python benches/shells.py annulus [--cells 9 14 18] [--method lbfgs newton] [--tolerance 1e-9] [--bending meyer]
    target/venv/bin/python benches/shells.py balloon [--vertices 400 1600] [--seed 1 2] [--method lbfgs newton] [--strain 1e-3 1e-2]

Prints rows of `docs/notebook/shells.md`. References: Sze, Liu & Lo, Finite Elem. Anal. Des. 40 (2004) 1551; Paulsen,
Am. Math. Mon. 101 (1994) 953.
"""

import argparse
import csv
import itertools
import math
import subprocess
import tempfile
import time
from pathlib import Path

import vtk

# Deflections at the inner and the outer radius under the smallest load.
LOAD, INSIDE, OUTSIDE = 0.025, 1.305, 1.789
# Volume of half a balloon over the cube of the radius of the flat disc.
BALLOON = 0.60922


def annulus(cells: int, path: Path) -> tuple[int, int]:
    """Writes the slit annulus as right triangles, without ears at the corners; returns rows and vertices a row."""
    width = 4 / cells
    sectors = max(8, round(2 * math.pi * 8 / width * 0.87))
    angle = 2 * math.pi / (sectors - 0.5)
    with path.open("w") as out:
        for k, i in itertools.product(range(sectors + 1), range(cells + 1)):
            a, r = (k - 0.5) * angle, 6 + width * i
            out.write(f"v {r * math.cos(a):.15g} {r * math.sin(a):.15g} 0\n")
        for j, i in itertools.product(range(sectors), range(cells)):
            a = j * (cells + 1) + i + 1
            b, c, d = a + 1, a + cells + 1, a + cells + 2
            corner = j == sectors - 1 and i in (0, cells - 1)
            forward = i == cells - 1 if corner else (i + j) % 2 == 0
            for t in ((a, b, d), (a, d, c)) if forward else ((a, b, c), (b, d, c)):
                out.write("f {} {} {}\n".format(*t))
    return sectors + 1, cells + 1


def run(rumple: Path, folder: Path, scene: str) -> tuple[list, list, dict, float]:
    """Vertices and triangles at the end, the last row of the ledger, and the seconds that it took."""
    (folder / "scene.toml").write_text(scene)
    start = time.monotonic()
    command = [rumple, "run", folder / "scene.toml", "--out", folder / "out", "--force", "--quiet", "--threads", "1"]
    subprocess.run(command, check=True)
    seconds = time.monotonic() - start
    frame = sorted((folder / "out" / "frames").glob("*.vtu"))[-1]
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(frame))
    reader.Update()
    grid = reader.GetOutput()
    x = [grid.GetPoint(i) for i in range(grid.GetNumberOfPoints())]
    triangles = [[grid.GetCell(t).GetPointId(k) for k in range(3)] for t in range(grid.GetNumberOfCells())]
    with (folder / "out" / "ledger.csv").open() as ledger:
        last = list(csv.DictReader(ledger))[-1]
    return x, triangles, last, seconds


def plate(rumple: Path, folder: Path, cells: int, method: str, tolerance: float, bending: str) -> str:
    rows, row = annulus(cells, folder / "mesh.obj")
    held, loaded = list(range(2 * row)), list(range((rows - 1) * row, rows * row))
    x, _, _, seconds = run(rumple, folder, f"""
sheet = {{ file = "mesh.obj" }}
material = {{ young = 21e6, poisson = 0.0, thickness = 0.03 }}
effect = [{{ kind = "stretching", model = "stvk", modulus = "plate" }}, {{ kind = "bending", model = "{bending}" }},
  {{ kind = "pin", where = {{ vertices = {held} }}, axes = "xyz" }},
  {{ kind = "load", where = {{ vertices = {loaded} }}, force = {{ per-length = [0, 0, {0.8 * LOAD}] }}, ramp = {{ formula = "t" }} }}]
equilibrium = {{ method = "{method}", tolerance = {tolerance} }}
time = {{ until = 1.0, integrator = {{ kind = "staggered", method = "euler", step = 0.25 }} }}
output.every = 1.0
""")
    inside, outside = x[(rows - 1) * row][2], x[-1][2]
    errors = [f"{z:.4f} ({100 * (z / known - 1):+.1f} %)" for z, known in ((inside, INSIDE), (outside, OUTSIDE))]
    return f"| {cells} | {method} | {errors[0]} | {errors[1]} | {cells * (inside / INSIDE - 1):.2f} | {seconds:.1f} |"


def balloon(rumple: Path, folder: Path, vertices: int, seed: int, method: str, strain: float) -> str:
    x, triangles, last, seconds = run(rumple, folder, f"""
sheet = {{ shape = "disc", radius = 10.0, vertices = {vertices}, seed = {seed}, imperfection = {{ amplitude = 1e-2, seed = {seed} }}, bump = {{ amplitude = 0.5, width = 4.0 }} }}
material = {{ young = 1e6, poisson = 0.3333333333333333, thickness = 0.01 }}
effect = [{{ kind = "stretching", model = "stvk" }}, {{ kind = "bending" }}, {{ kind = "pin", where = "rim", axes = "z" }},
  {{ kind = "pressure", value = {1e3 * strain}, ramp = {{ formula = "t" }} }}]
equilibrium.method = "{method}"
time = {{ until = 1.0, integrator = {{ kind = "staggered", method = "euler", step = 0.125 }} }}
output.every = 1.0
""")
    volume = sum(
        a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
        for a, b, c in ((x[i], x[j], x[k]) for i, j, k in triangles)
    )
    deficit = 100 * (abs(volume) / 6 / (BALLOON * 1e3) - 1)
    stretching = next(float(v) for k, v in last.items() if k.startswith("energy of stretching"))
    return f"| {vertices} | {seed} | {method} | {strain:g} | {deficit:+.1f} % | {stretching:.0f} | {seconds:.1f} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case", choices=["annulus", "balloon"])
    parser.add_argument("--rumple", type=Path, default=Path("target/release/rumple"))
    parser.add_argument("--method", nargs="+", default=["lbfgs"])
    parser.add_argument("--cells", nargs="+", type=int, default=[9, 14, 18])
    parser.add_argument("--tolerance", type=float, default=1e-9)
    parser.add_argument("--bending", default="meyer")
    parser.add_argument("--vertices", nargs="+", type=int, default=[400])
    parser.add_argument("--seed", nargs="+", type=int, default=[1])
    parser.add_argument("--strain", nargs="+", type=float, default=[1e-2])
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if args.case == "annulus":
            for cells, method in itertools.product(args.cells, args.method):
                print(plate(args.rumple, folder, cells, method, args.tolerance, args.bending), flush=True)
        else:
            for vertices, seed, method, strain in itertools.product(args.vertices, args.seed, args.method, args.strain):
                print(balloon(args.rumple, folder, vertices, seed, method, strain), flush=True)


if __name__ == "__main__":
    main()
