"""The same quasi-static scenes by other solvers, in other digits and at a finer tolerance.

Prints the total energy of the default at the end, its CPU seconds, and the relative differences of the others. With another
program, of another version, prints CPU seconds and energies of both in place of that.

    python3 benches/limit.py [--rumple target/release/rumple] [--against PROGRAM] [--only NAME] [--limit SECONDS]
"""

import argparse
import csv
import resource
import subprocess
import tempfile
from pathlib import Path

MODELS = Path(__file__).resolve().parent.parent / "models"
QUASI_STATIC = 'time.policy="quasi-static"'
# name: file and overrides
SCENES = {
    "model-i/small": ["time.until=0.75"],
    "model-i/formula": ["time.until=0.2"],
    "model-ii/wrinkles": ["sheet.vertices=3000", "time.until=0.3"],
    "model-ii/planar": ["time.until=10"],
    "model-ii/formula": ["time.until=0.5"],
    "policies/dome": [QUASI_STATIC, "time.until=0.5"],
    "policies/bump": [QUASI_STATIC, "sheet.vertices=2000"],
    "plates/column": [],
    "plates/pressed": [],
    "plates/ruffle": ["sheet.vertices=1000", "time.until=1"],
    "plates/snap": [],
    "hard/spot": [],
    "hard/dome": [QUASI_STATIC],
    "hard/scales": [QUASI_STATIC],
    "hard/motors": ["time.until=5"],
    "accuracy/before": ["sheet.vertices=1000", "time.until=0.5"],
    "accuracy/ring": [QUASI_STATIC, "sheet.vertices=800", "time.until=0.5"],
    "shells/emptied": ["sheet.vertices=1000"],
}
MATERIAL = "poisson = 0.3333333333333333"
SHELL = 'effect = [{ kind = "stretching" }, { kind = "bending" }'
END = 'kind = "pin", where = { half-space = { point = [%s9.99, 0, 0], normal = [%s1, 0, 0] } }, axes = "xyz"'
SIDE = 'kind = "pin", where = { half-space = { point = [0, %s4.99, 0], normal = [0, %s1, 0] } }, axes = "xyz"'
RAMP = 'ramp = { formula = "t" }'
STEPS = "time = { until = 1.0, integrator = { kind = \"staggered\", longest_step = 0.05 } }"
# Scenes that are not shipped: name, text.
OWN = {
    "strip whose ends approach": f"""
sheet = {{ shape = "rectangle", width = 20.0, height = 4.0, vertices = 400, imperfection = {{ amplitude = 1e-2, seed = 3 }} }}
material = {{ young = 1e5, {MATERIAL}, thickness = 0.2, drag = 0.01 }}
{SHELL}, {{ {END % ("-", "-")} }}, {{ {END % ("", "")}, displacement = [-6.0, 0, 0], ramp = {{ formula = "t" }} }}]
time = {{ until = 1.0, integrator = {{ kind = "staggered", longest_step = 0.05 }} }}
""",
    "shell that loses volume": f"""
sheet = {{ shape = "sphere", radius = 5.0, irregular = true, vertices = 500 }}
material = {{ young = 1e4, {MATERIAL}, thickness = 0.1, drag = 0.001 }}
{SHELL}, {{ kind = "volume", stiffness = 1e4, ramp = {{ formula = "1 - 0.6*t" }} }}]
time = {{ until = 0.05, integrator = {{ kind = "staggered", longest_step = 0.001 }} }}
""",
    "disc that grows at its edge": f"""
sheet = {{ shape = "disc", radius = 10.0, vertices = 500, imperfection = {{ amplitude = 1e-2, seed = 5 }} }}
material = {{ young = 1e5, {MATERIAL}, thickness = 0.3, drag = 0.001 }}
{SHELL}, {{ kind = "diffusion", species = "a", coefficient = 0.05 }}]
time = {{ until = 3.0 }}
[kinetics]
species.a = {{ typical = 1.0, lower = 0.0 }}
rates.a = "k*where_edge*(1 - a)"
length_factor = "1 + g*a"
parameters = {{ k = 1.0, g = 0.25, where_edge = {{ formula = "logistic(4*(sqrt(x^2+y^2) - 8))" }} }}
""",
    "sheet stretched between clamps": f"""
sheet = {{ shape = "rectangle", width = 20.0, height = 10.0, vertices = 900, imperfection = {{ amplitude = 1e-2, seed = 3 }} }}
material = {{ young = 1e5, {MATERIAL}, thickness = 0.05, drag = 0.01 }}
{SHELL}, {{ {END % ("-", "-")} }}, {{ {END % ("", "")}, displacement = [3.0, 0, 0], {RAMP} }}]
{STEPS}
""",
    "sheared strip": f"""
sheet = {{ shape = "rectangle", width = 30.0, height = 10.0, vertices = 900, imperfection = {{ amplitude = 1e-2, seed = 3 }} }}
material = {{ young = 1e5, {MATERIAL}, thickness = 0.2, drag = 0.01 }}
{SHELL}, {{ {SIDE % ("-", "-")} }}, {{ {SIDE % ("", "")}, displacement = [0.5, 0, 0], {RAMP} }}]
{STEPS}
""",
    "strip lifted at an end": f"""
sheet = {{ shape = "rectangle", width = 20.0, height = 3.0, vertices = 400, imperfection = {{ amplitude = 1e-2, seed = 3 }} }}
material = {{ young = 1e5, {MATERIAL}, thickness = 0.2, drag = 0.01 }}
{SHELL}, {{ {END % ("-", "-")} }}, {{ {END % ("", "")}, displacement = [-6.0, 2.0, 7.0], {RAMP} }}]
{STEPS}
""",
    "free disc, boundary grows by factor": f"""
sheet = {{ shape = "disc", radius = 10.0, vertices = 600, imperfection = {{ amplitude = 1e-2, seed = 3 }} }}
material = {{ young = 1e5, {MATERIAL}, thickness = 0.2, drag = 0.01 }}
{SHELL}, {{ kind = "growth", factor = "1 + 0.2*t*(x^2 + y^2)/100" }}]
{STEPS}
""",
    "free annulus, inner boundary grows": f"""
sheet = {{ shape = "annulus", inner = 3.0, outer = 10.0, vertices = 600, imperfection = {{ amplitude = 1e-2, seed = 3 }} }}
material = {{ young = 1e5, {MATERIAL}, thickness = 0.2, drag = 0.01 }}
{SHELL}, {{ kind = "growth", factor = "1 + 0.3*t*exp(-(sqrt(x^2 + y^2) - 3)/1.5)" }}]
{STEPS}
""",
    "shell of exact volume": f"""
sheet = {{ shape = "sphere", radius = 5.0, irregular = true, vertices = 600 }}
material = {{ young = 1e4, {MATERIAL}, thickness = 0.2, drag = 0.01 }}
{SHELL}, {{ kind = "volume", exact = true, ramp = {{ formula = "1 - 0.4*t" }} }}]
{STEPS}
""",
    "balloon below its limit load": f"""
sheet = {{ shape = "sphere", radius = 5.0, irregular = true, vertices = 600 }}
material = {{ young = 1e4, {MATERIAL}, thickness = 0.1, drag = 0.01 }}
{SHELL}, {{ kind = "pressure", value = 100.0, {RAMP} }}]
{STEPS}
""",
    "grown stripe, fixed boundary": f"""
sheet = {{ shape = "rectangle", width = 20.0, height = 20.0, vertices = 900, imperfection = {{ amplitude = 1e-2, seed = 3 }} }}
material = {{ young = 1e5, {MATERIAL}, thickness = 0.3, drag = 0.01 }}
{SHELL}, {{ kind = "pin", where = "rim", axes = "xyz" }}, {{ kind = "growth", factor = "1 + 0.1*t*exp(-x^2/10)" }}]
{STEPS}
""",
    "sphere, grown cap": f"""
sheet = {{ shape = "sphere", radius = 5.0, irregular = true, vertices = 800 }}
material = {{ young = 1e5, {MATERIAL}, thickness = 0.2, drag = 0.01 }}
{SHELL}, {{ kind = "growth", factor = "1 + 0.3*t/(1 + exp(3*(3 - z)))" }}]
{STEPS}
""",
}
VARIANTS = {
    "2 threads": [],
    "multigrid": ['equilibrium.preconditioner="multigrid"'],
    "newton": ['equilibrium.method="newton"'],
    "E (1 + 1e-7)": None,
    "rtol / 4": None,
}


def value(rumple, scene, keys, path):
    """The value that the resolved scene has for a dotted key, or None."""
    done = subprocess.run(
        [rumple, "check", "--resolved", scene, *sets(keys)], capture_output=True, text=True, check=False
    )
    table = ""
    for line in done.stdout.splitlines():
        if line.startswith("["):
            table = line.strip("[]")
        elif "=" in line and f"{table}.{line.split('=')[0].strip()}" == path:
            return float(line.split("=", 1)[1])
    return None


def sets(keys):
    """Overrides as options."""
    return [part for key in keys for part in ("--set", key)]


def run(rumple, scene, keys, limit, out, threads="1"):
    """Total energy at the end and CPU seconds of the run, or a word on what happened."""
    out = Path(out) / "run"
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    command = [rumple, "run", scene, "--out", out, "--force", "--quiet", "--threads", threads, *sets(keys)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        return None, f"> {limit} s"
    if done.returncode:
        words = [line for line in done.stderr.splitlines() if line.startswith("error")]
        return None, (words or ["failed"])[0][:60]
    with open(out / "ledger.csv", encoding="utf-8") as file:
        last = list(csv.DictReader(file))[-1]
    total = last.get("total energy [energy]") or next(v for k, v in last.items() if k.startswith("energy of"))
    return float(total), resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def costs(options, scene, keys, out):
    """CPU seconds and energies of two programs, and the ratio of their seconds."""
    cells, seconds = [], []
    for program in (options.against, options.rumple):
        energy, spent = run(program, scene, keys, options.limit, out)
        cells.append(spent if energy is None else f"{spent:.2f}, {energy:.7g}")
        seconds.append(spent if energy is not None else None)
    ratio = seconds[1] / seconds[0] if None not in seconds else None
    return [*cells, "" if ratio is None else f"{ratio:.2f}"], seconds


def differences(options, scene, keys, out):
    """Energy and CPU seconds of the default, and the relative differences of the variants."""
    energy, seconds = run(options.rumple, scene, keys, options.limit, out)
    if energy is None:
        return [seconds]
    row = [f"{energy:.7g}", f"{seconds:.1f}"]
    for variant, more in VARIANTS.items():
        if more is None:
            young = value(options.rumple, scene, keys, "material.young")
            rtol = value(options.rumple, scene, keys, "time.integrator.rtol")
            if variant.startswith("E"):
                more = young and [f"material.young={young * (1 + 1e-7)!r}"]
            else:
                more = rtol and [f"time.integrator.{k}={rtol / 4!r}" for k in ("rtol", "atol")]
        if more is None:
            row.append("")
            continue
        threads = "2" if variant == "2 threads" else "1"
        other, word = run(options.rumple, scene, keys + more, options.limit, out, threads)
        row.append(word if other is None else f"{other / energy - 1:.1e}")
    return row


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rumple", default="target/release/rumple")
    parser.add_argument("--against", default="")
    parser.add_argument("--only", default="")
    parser.add_argument("--limit", type=float, default=60.0)
    options = parser.parse_args()
    head = ["before: s, energy", "after", "ratio"] if options.against else ["energy", "s", *VARIANTS]
    print("| scene |", " | ".join(head), "|")
    print("| --- |", " | ".join("---" for _ in head), "|")
    total = [0.0, 0.0]
    with tempfile.TemporaryDirectory() as out:
        for name in [*SCENES, *OWN]:
            if options.only not in name:
                continue
            keys = SCENES.get(name, [])
            scene = MODELS / f"{name}.toml"
            if name in OWN:
                scene = Path(out) / "own.toml"
                scene.write_text(OWN[name], encoding="utf-8")
            if options.against:
                row, seconds = costs(options, scene, keys, out)
                if None not in seconds:
                    total = [a + b for a, b in zip(total, seconds)]
            else:
                row = differences(options, scene, keys, out)
            print("|", " | ".join([f"{name}, {', '.join(keys)}" if keys else name, *row]), "|", flush=True)
    if options.against:
        print(f"| sum of those that both ran | {total[0]:.1f} | {total[1]:.1f} | {total[1] / total[0]:.2f} |")


if __name__ == "__main__":
    main()
