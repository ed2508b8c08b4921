"""How much results depend on what should not matter: round-off and units.

    python benches/sensitivity.py [--program target/release/rumple] [--scenes small-vertex,dome]
                                  [--out results/sensitivity] [--cases E,length]
                                  [--equilibrium 'method = "newton"'] [--along] [--more]

The scenes `spots` and `drag` take minutes and are run where they are asked for. Every scene is run as it
is, with Young's modulus changed in its seventh digit, and with the units of length, time and stress changed
by 1e6 and 1e-6 (every dimensional number of the scene is scaled; the solution is the same but for the
units); with --more also with Poisson's ratio and the height of the start changed by 1e-7. Prints a Markdown table: the
largest distance between vertices, after the best rigid motion and in mean edge lengths, and the largest
difference of the species relative to their largest value, in the first and in the last frame, and the
steps and iterations of both runs. With --along a second table has the root mean squares of
`tests/scripts/difference.py` at every time that is written, and the regions where c exceeds its threshold in
the last frame. Needs numpy and vtk.
"""

import argparse
import copy
import csv
import glob
import json
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "tests/scripts"))
from measure import measure  # noqa: E402

# Exponents of length, time and stress of every dimensional number; a number that a scene leaves to
# the default of a plugin is written out first. Energies as printed lack an area, and drag goes with them.
COMMON = {
    "sheet.radius": (1, 0, 0),
    "sheet.width": (1, 0, 0),
    "sheet.height": (1, 0, 0),
    "sheet.imperfection.amplitude": (1, 0, 0),
    "sheet.bump.amplitude": (1, 0, 0),
    "sheet.bump.width": (1, 0, 0),
    "material.young": (0, 0, 1),
    "material.thickness": (1, 0, 0),
    "material.drag": (1, 1, 1),
    "material.drag.per-vertex": (-1, 1, 1),
    "kinetics.parameters.w": (1, -1, 0),
    "kinetics.parameters.beta": (0, -1, 0),
    "kinetics.parameters.H_s": (-1, 0, 0),
    "kinetics.parameters.k_on": (0, -1, 0),
    "kinetics.parameters.k_off": (0, -1, 0),
    "kinetics.parameters.a": (-1, 0, -1),
    "kinetics.initial.c.gaussian.width": (1, 0, 0),
    "kinetics.initial.m.gaussian.width": (1, 0, 0),
    "time.integrator.step": (0, 1, 0),
    "time.until": (0, 1, 0),
    "output.every": (0, 1, 0),
    "stability.perturb": (1, 0, 0),
}
EFFECTS = {"value": (0, 0, 1), "coefficient": (2, -1, 0)}
MODEL_I = {"w": 15.0, "beta": 1.0, "H_s": 0.05}
SMALL_DRAG = {"sheet.radius": 40.0, "sheet.vertices": 3200, "time.until": 3.0, "output.every": 0.25}

SCENES = {
    "small-vertex": ("model-i/small.toml", {"kinetics.location": "vertex", "time.until": 0.5}, MODEL_I),
    "small-face": ("model-i/small.toml", {"time.until": 0.5}, MODEL_I),
    "spots": ("model-i/spots.toml", {"time.until": 1.0}, MODEL_I),
    "wrinkles": ("model-ii/formula.toml", {}, {}),
    "dome": ("policies/dome.toml", {}, {"beta": 1.0}),
    "bump": ("policies/bump.toml", {}, MODEL_I),
    "small-drag": ("paper/model-i.toml", SMALL_DRAG, MODEL_I),
    "drag": ("paper/model-i.toml", {"time.until": 3.0, "output.every": 0.25}, MODEL_I),
    "column": ("plates/column.toml", {}, {}),
    "pressed": ("plates/pressed.toml", {}, {}),
}
SLOW = ("spots", "drag", "small-drag")
# The key that is changed by a factor, or the unit.
CASES = {
    "E (1 + 1e-7)": ("material.young", 1 + 1e-7),
    "E (1 - 1e-7)": ("material.young", 1 - 1e-7),
    "E (1 + 3e-7)": ("material.young", 1 + 3e-7),
    "length 1e6": ((1, 0, 0), 1e6),
    "length 1e-6": ((1, 0, 0), 1e-6),
    "time 1e6": ((0, 1, 0), 1e6),
    "time 1e-6": ((0, 1, 0), 1e-6),
    "stress 1e6": ((0, 0, 1), 1e6),
    "stress 1e-6": ((0, 0, 1), 1e-6),
}


MORE = {
    "nu (1 + 1e-7)": ("material.poisson", 1 + 1e-7),
    "start (1 + 1e-7)": ("sheet.bump.amplitude", 1 + 1e-7),
}


def parent(scene, key):
    *path, last = key.split(".")
    for part in path:
        if not isinstance(scene.get(part), dict):
            return None, last
        scene = scene[part]
    return scene, last


def rescaled(scene, unit, factor):
    """The same scene in units in which numbers of dimension `unit` are `factor` times as large."""
    scene = copy.deepcopy(scene)

    def scale(holder, key, exponents):
        power = sum(a * b for a, b in zip(exponents, unit))
        value = holder[key]
        times = factor**power
        holder[key] = [times * v for v in value] if isinstance(value, list) else times * value

    for key, exponents in COMMON.items():
        holder, last = parent(scene, key)
        if holder is not None and last in holder and not isinstance(holder[last], dict):
            scale(holder, last, exponents)
    for effect in scene.get("effect", []):
        for key, exponents in EFFECTS.items():
            if key in effect:
                scale(effect, key, exponents)
        if "force" in effect:
            scale(effect["force"], "total", (2, 0, 1))
        if isinstance(effect.get("where"), dict):
            for corner in ("min", "max"):
                scale(effect["where"]["box"], corner, (1, 0, 0))
    return scene


def toml(value):
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{k} = {toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(value) if isinstance(value, (str, bool)) else repr(value)


def run(program, scene, folder):
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "scene.toml"
    path.write_text("".join(f"{k} = {toml(v)}\n" for k, v in scene.items()))
    out = folder / "out"
    done = subprocess.run(
        [program, "run", path, "--out", out, "--force", "--threads", "1"],
        capture_output=True, text=True, cwd=ROOT,
    )
    if done.returncode:
        return None, done.stderr.strip().splitlines()
    rows = list(csv.DictReader(open(out / "ledger.csv")))
    frames = sorted(glob.glob(str(out / "frames" / "*.vtu")))
    work = (len(rows) - 1, sum(int(row[k]) for row in rows for k in ("iterations", "newton iterations")))
    return frames, work


def read(path):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    triangles = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 3)
    fields = {}
    for data in (grid.GetPointData(), grid.GetCellData()):
        for k in range(data.GetNumberOfArrays()):
            fields[data.GetArrayName(k).split(" [")[0]] = vtk_to_numpy(data.GetArray(k))
    return vtk_to_numpy(grid.GetPoints().GetData()).astype(float), triangles, fields


def distances(a, b, length):
    """Shape after the best rigid motion, in mean edges of `a`; species relative to the largest."""
    (x, triangles, fields), (y, _, others) = a, b
    x, y = x - x.mean(0), y / length - (y / length).mean(0)
    u, _, vt = np.linalg.svd(y.T @ x)
    flip = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    edge = np.linalg.norm(x[triangles[:, 1]] - x[triangles[:, 0]], axis=1).mean()
    shape = np.linalg.norm(y @ (u @ flip @ vt) - x, axis=1).max() / edge
    species = [s for s in ("c", "m") if s in fields]
    chemical = max((abs(others[s] - fields[s]).max() / abs(fields[s]).max() for s in species), default=0.0)
    return shape, chemical


def root_mean_squares(a, b, length):
    """Shape by the heights of `a`, species c by its own size: the norms of difference.py."""
    (x, _, fields), (y, _, others) = a, b
    shape = np.sqrt(np.sum((y / length - x) ** 2) / np.sum(x[:, 2] ** 2))
    return shape, np.linalg.norm(others["c"] - fields["c"]) / np.linalg.norm(fields["c"])


def regions(frame):
    """Where c exceeds 0.1."""
    return measure(frame, "c", 0.1, False, None)["regions"]


def print_along(frames, times, results):
    """Differences of `results`, by case with the unit of length, from `frames` at all times."""
    print("\n| t | " + " | ".join(results) + " |\n| --- |" + " --- |" * len(results))
    for k, (frame, time) in enumerate(zip(frames, times)):
        base = read(frame)
        pairs = [root_mean_squares(base, read(others[k]), unit) for others, unit in results.values()]
        print(f"| {time:g} | " + " | ".join(f"{shape:.0e}, {c:.0e}" for shape, c in pairs) + " |")
    print(f"| regions: {regions(frames[-1])} | " + " | ".join(f"{regions(o[-1])}" for o, _ in results.values()) + " |")


STUDY = {
    "single, every 15": {"precision": "single", "refresh": 15},
    "double, every 15": {"precision": "double", "refresh": 15},
    "double, every 5": {"precision": "double", "refresh": 5},
    "double, every 15, largest_move = 0.2": {"precision": "double", "refresh": 15, "largest_move": 0.2},
    "as by default": {},
}


def study(program, out):
    """How many of 18 pairs of runs of the small Model I part when E changes by 1e-7, by factor."""
    print("| factor, renewed | parted | median difference of c | iterations |\n| --- | --- | --- | --- |")
    for label, keys in STUDY.items():
        apart, iterations = [], 0
        for name in ("small-vertex", "small-face"):
            for thickness in (0.5, 0.7, 1.0):
                for seed in (7, 8, 9):
                    file, overrides, defaults = SCENES[name]
                    scene = tomllib.loads((ROOT / "models" / file).read_text())
                    for key, value in overrides.items():
                        holder, last = parent(scene, key)
                        holder[last] = value
                    scene["material"]["thickness"] = thickness
                    scene["sheet"]["imperfection"]["seed"] = seed
                    scene["equilibrium"] = {"method": "lbfgs", **keys}
                    frames, work = run(program, scene, Path(out) / "study" / "base")
                    scene["material"]["young"] *= 1 + 1e-7
                    other, _ = run(program, scene, Path(out) / "study" / "other")
                    if frames is None or other is None:
                        apart.append(float("inf"))
                        continue
                    apart.append(distances(read(frames[-1]), read(other[-1]), 1.0)[1])
                    iterations += work[1]
        parted = sum(c > 1e-2 for c in apart)
        print(f"| {label} | {parted} of {len(apart)} | {np.median(apart):.0e} | {iterations} |", flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--program", default=str(ROOT / "target/release/rumple"))
    parser.add_argument("--scenes", default=",".join(s for s in SCENES if s not in SLOW))
    parser.add_argument("--cases", default="")
    parser.add_argument("--equilibrium", default="", help="keys of that table, instead of the scene's")
    parser.add_argument("--out", default=str(ROOT / "results/sensitivity"))
    parser.add_argument("--along", action="store_true", help="differences at every time that is written")
    parser.add_argument("--more", action="store_true", help="Poisson's ratio and the start, too")
    parser.add_argument("--study", action="store_true", help="how often 18 pairs of runs part, by factor")
    options = parser.parse_args()
    if options.study:
        study(options.program, options.out)
        return
    print("| scene | changed | first frame: shape, species | last frame: shape, species | steps | iterations |")
    print("| --- | --- | --- | --- | --- | --- |", flush=True)
    for name in options.scenes.split(","):
        file, overrides, defaults = SCENES[name]
        scene = tomllib.loads((ROOT / "models" / file).read_text())
        for key, value in overrides.items():
            holder, last = parent(scene, key)
            holder[last] = value
        for key, value in defaults.items():
            scene["kinetics"].setdefault("parameters", {}).setdefault(key, value)
        if options.equilibrium:
            scene["equilibrium"] = tomllib.loads(options.equilibrium)
        folder = Path(options.out) / name
        frames, work = run(options.program, scene, folder / "base")
        if frames is None:
            print(f"| {name} | nothing | failed: {work[-1] if work else ''} | | | |", flush=True)
            continue
        results = {}
        for case, (unit, factor) in (CASES | MORE if options.more else CASES).items():
            if options.cases and not any(c in case for c in options.cases.split(",")):
                continue
            if isinstance(unit, str):
                changed, length = copy.deepcopy(scene), 1.0
                holder, last = parent(changed, unit)
                if holder is None or last not in holder:
                    continue
                holder[last] *= factor
            else:
                changed, length = rescaled(scene, unit, factor), factor ** unit[0]
            other, other_work = run(options.program, changed, folder / case.replace(" ", "-"))
            if other is None:
                print(f"| {name} | {case} | failed: {other_work[-1] if other_work else ''} | | | |", flush=True)
                continue
            results[case] = (other, length)
            ends = ((frames[k], other[k]) for k in (0, -1))
            first, last = (distances(read(a), read(b), length) for a, b in ends)
            print(
                f"| {name} | {case} | {first[0]:.0e}, {first[1]:.0e} | {last[0]:.0e}, {last[1]:.0e} "
                f"| {work[0]}, {other_work[0]} | {work[1]}, {other_work[1]} |",
                flush=True,
            )
        if options.along and results:
            span, last = scene["time"]["until"], len(frames) - 1
            print_along(frames, [span * k / last for k in range(last + 1)], results)


if __name__ == "__main__":
    main()
