"""What closeness to the quasi-static limit costs: measures, CPU seconds and iterations over tolerance and stabilisation.

Every scene runs with rtol = atol = τ and S = τ, then with one τ and several S; a reference with τ = S = 1e-3, and on single meshes
another with S ten times less, which says how well the limit itself is known. With `--seeds` each is the mean over as many meshes.

    python3 benches/error_cost.py [--rumple PROGRAM] [--only NAME] [--seeds 8] [--picture FILE] [--out DIR]
"""

import argparse
import csv
import subprocess
from pathlib import Path

MODELS = Path(__file__).resolve().parent.parent / "models"
# name: file, overrides, whether its mesh has a seed
SCENES = {
    "spots, R = 50": ("model-i/spots", ["sheet.radius=50", "sheet.vertices=5000", "time.until=1"], True),
    "small": ("model-i/small", [], False),
    "formula": ("model-i/formula", ["time.until=0.2"], False),
    "hard/spot": ("hard/spot", [], False),
}
TOLERANCES = [0.1, 0.05, 0.02, 0.01, 0.005]
SHARES = [1e-3, 1e-4, 1e-5]
AT = 0.01
REFERENCES = [(1e-3, 1e-3), (1e-3, 1e-4)]
MEASURES = {"energy": "energy [energy]", "regions": "spots", "total c": "total c"}


def members(options, name, tolerance, share):
    """The rows of the sweep over seeds for one choice; made unless it is there."""
    file, keys, seeded = SCENES[name]
    out = Path(options.out) / f"{file.replace('/', '-')}-{tolerance:g}-{share:g}"
    keys = [*keys, f"time.integrator.rtol={tolerance}", f"time.integrator.atol={tolerance}"]
    command = [options.rumple, "sweep", MODELS / f"{file}.toml", "--out", out, "--quiet", "--jobs", options.jobs]
    command += ["--over", f"time.stabilisation={share}"]
    command += ["--seeds", str(options.seeds)] if seeded and options.seeds > 1 else []
    command += [part for key in keys for part in ("--set", key)]
    if not (out / "sweep.csv").exists():
        subprocess.run(command, check=False)
    with open(out / "sweep.csv", encoding="utf-8") as file:
        return [row for row in csv.DictReader(file) if row["status"] == "complete"]


def mean(rows, column):
    """Mean and standard error over the members, or None."""
    values = [float(row[column]) for row in rows if row.get(column)]
    if not values:
        return None, None
    middle = sum(values) / len(values)
    spread = sum((value - middle) ** 2 for value in values) / max(len(values) - 1, 1)
    return middle, (spread / len(values)) ** 0.5


def line(options, name, choice, reference):
    """A row of the table: the choice, its measures relative to the reference, and what it costs."""
    rows = members(options, name, *choice)
    cells = [f"{choice[0]:g}", f"{choice[1]:g}", str(len(rows))]
    errors = {}
    for measure, column in MEASURES.items():
        value, error = mean(rows, column)
        if value is None or not reference:
            cells.append("" if value is None else f"{value:.5g} ± {error:.1g}" if len(rows) > 1 else f"{value:.5g}")
            continue
        errors[measure] = value / reference[measure] - 1
        text = f"{100 * errors[measure]:+.2g} %"
        cells.append(f"{text} ± {100 * error / reference[measure]:.1g}" if len(rows) > 1 else text)
    cost, iterations = mean(rows, "CPU [s]")[0], mean(rows, "iterations")[0]
    cells += ["" if cost is None else f"{cost:.1f}", "" if iterations is None else f"{iterations:.0f}"]
    print("|", " | ".join(cells), "|", flush=True)
    return errors, cost


def draw(points, path):
    """Error of the energy against CPU seconds, by scene."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.4, 4.2), constrained_layout=True)
    for number, (name, choices) in enumerate(points.items()):
        for follows, style in ((True, "o-"), (False, "s:")):
            some = [(c, 100 * abs(e["energy"]), t) for (t, s), e, c in choices if (t == s) == follows and e and c]
            if not some:
                continue
            seconds, errors, labels = zip(*some)
            label = f"{name}, S = rtol" if follows else f"{name}, rtol = {AT:g}, S smaller"
            axes.plot(seconds, errors, style, color=f"C{number}", label=label, markersize=5)
            for x, y, text in zip(seconds, errors, labels) if follows else ():
                axes.annotate(f"{text:g}", (x, y), textcoords="offset points", xytext=(4, 4), fontsize=7)
    axes.set(xscale="log", yscale="log", xlabel="CPU time [s]", ylabel="difference of the energy from the reference [%]")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7)
    figure.savefig(path, dpi=150)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rumple", default="target/release/rumple")
    parser.add_argument("--only", default="")
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--jobs", default="2")
    parser.add_argument("--picture", default="")
    parser.add_argument("--out", default="results/error-cost")
    options = parser.parse_args()
    points = {}
    for name in SCENES:
        if options.only not in name:
            continue
        print(f"\n{name}\n\n| rtol = atol | S | runs |", " | ".join(MEASURES), "| CPU s | iterations |")
        print("| --- | --- | --- |", " | ".join("---" for _ in MEASURES), "| --- | --- |")
        line(options, name, REFERENCES[0], None)
        rows = members(options, name, *REFERENCES[0])
        reference = {measure: mean(rows, column)[0] for measure, column in MEASURES.items()}
        choices = [*((t, t) for t in TOLERANCES), *((AT, s) for s in SHARES)]
        points[name] = [(choice, *line(options, name, choice, reference)) for choice in choices]
        if not (SCENES[name][2] and options.seeds > 1):
            line(options, name, REFERENCES[1], reference)
    if options.picture:
        draw(points, options.picture)


if __name__ == "__main__":
    main()
