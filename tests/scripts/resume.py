#!/usr/bin/env python3
"""Runs that are continued against runs that were left alone, byte by byte.

    resume.py every [NAME]         continues from every checkpoint of every case (or of those with NAME in it)
    resume.py kill KILLS [SEED]    kills runs of all cases in turn at random instants: so many that meet a run at work,
                                   with signal 9, and half as many with a signal that asks
    resume.py writing KILLS        kills runs of three cases while they write a checkpoint
    resume.py threads [NAME]       every case on a finer mesh, of Model I and of Model II, on 1, 2 and 4 threads, and continued
                                   from its middle with another number of them
    resume.py price                what new starts of diffsol's methods cost, and what a checkpoint costs

Compared are all frames, their index, events, modes, and the ledger without its wall time. `rumple` is
target/release/rumple, or what RUMPLE says.
"""

import csv
import json
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = pathlib.Path(os.environ.get("RUMPLE", HERE / "target/release/rumple"))
WORK = pathlib.Path(tempfile.mkdtemp(prefix="rumple-resume-"))

BASE = """
[sheet]
shape = "disc"
radius = 14.0
vertices = {vertices}
imperfection = {{ amplitude = 1e-3, seed = 7 }}
bump = {{ amplitude = 0.3, width = 4.0 }}
[material]
young = {young}
poisson = 0.3333333333333333
thickness = {thickness}
drag = {drag}
[[effect]]
kind = "stretching"
[[effect]]
kind = "bending"
[[effect]]
kind = "pin"
where = "rim"
axes = "z"
{effects}
[kinetics]
location = "vertex"
species.c = {{ typical = 0.1, lower = 0.0 }}
let.up = "pos(mean_curvature)"
rates.c = "15*up*0.05/(up + 0.05) - c"
length_factor = "1 + 0.25*logistic(20*(c - 0.1))"
initial.c = {{ gaussian = {{ width = 4.0, amplitude = 0.08 }} }}
[equilibrium]
{equilibrium}
[time]
policy = "{policy}"
integrator = {integrator}
until = {until}
[output]
every = {output}
fields = ["c", "mean_curvature"]
{more}
"""

DIFFUSION = '[[effect]]\nkind = "diffusion"\nspecies = "c"\ncoefficient = 0.3'


def case(**keys):
    usual = dict(vertices=400, young=1e4, thickness=0.8, drag=10.0, effects="", equilibrium="",
                 policy="quasi-static", integrator='"staggered"', until=0.3, output=0.1, more="")
    return BASE.format(**(usual | keys))


def staggered(**keys):
    inside = ", ".join(f"{key} = {value}" for key, value in keys.items())
    return '{ kind = "staggered", rtol = 0.02, atol = 0.02, step = 0.01, ' + inside + " }"


SMOOTH = dict(young=1e3, thickness=2.0)
WATCH = "[stability]\nperturb = 0.05\n"


def cases():
    quasi = dict(policy="quasi-static")
    drag = dict(policy="simultaneous", effects=DIFFUSION)
    fast = dict(policy="chemistry-fast", effects=DIFFUSION, integrator=staggered(), **SMOOTH)
    yield "quasi-static, heun, chebyshev", case(**quasi, integrator=staggered(), effects=DIFFUSION)
    yield "quasi-static, euler", case(
        **quasi, integrator='{ kind = "staggered", method = "euler", step = 0.01 }')
    for method in ["bdf", "tr-bdf2", "esdirk34", "tsit45"]:
        yield f"quasi-static, {method}", case(
            **quasi, integrator=staggered(chemistry=f'"{method}"'), effects=DIFFUSION)
    for preconditioner in ["multigrid", "blocks"]:
        yield f"quasi-static, {preconditioner}", case(
            **quasi, integrator=staggered(), until=0.1, output=0.05, vertices=300,
            equilibrium=f'preconditioner = "{preconditioner}"\ntolerance = 1e-4')
    for method in ["newton", "descent"]:
        bound = "\nsteps = 20" if method == "descent" else "\ntolerance = 1e-4"
        yield f"quasi-static, {method}", case(
            **quasi, integrator=staggered(), until=0.1, output=0.05, vertices=200,
            equilibrium=f'method = "{method}"' + bound)
    yield "quasi-static, single precision", case(
        **quasi, integrator=staggered(), equilibrium='precision = "single"')
    yield "quasi-static, watch", case(**quasi, integrator=staggered(), more=WATCH)
    for shape in ["euler", "sdirk2"]:
        yield f"simultaneous, {shape}", case(**drag, integrator=staggered(shape=f'"{shape}"'))
    yield "simultaneous, multigrid", case(
        **drag, integrator=staggered(), equilibrium='preconditioner = "multigrid"')
    yield "simultaneous, drag by direction", case(
        policy="simultaneous", integrator=staggered(), effects=DIFFUSION).replace(
            "drag = 10.0", "drag = { per-vertex = { tangential = 10.0, normal = 30.0 } }")
    yield "chemistry-fast", case(**fast)
    for method in ["bdf", "tr-bdf2", "esdirk34"]:
        integrator = f'{{ kind = "monolithic", method = "{method}", rtol = 1e-3 }}'
        for policy in ["simultaneous", "quasi-static", "chemistry-fast"]:
            shorter = dict(vertices=100, until=0.1, output=0.05) if policy == "quasi-static" else dict(vertices=200)
            yield f"monolithic {method}, {policy}", case(
                policy=policy, integrator=integrator, effects=DIFFUSION, **SMOOTH, **shorter)
    yield "explicit euler", case(
        policy="simultaneous", integrator='{ kind = "explicit", step = 1e-4 }', vertices=200,
        until=0.02, output=0.01, **SMOOTH)
    yield "explicit tsit45", case(
        policy="simultaneous", integrator='{ kind = "explicit", method = "tsit45" }', vertices=200,
        until=0.02, output=0.01, **SMOOTH)


def rumple(*args, threads=1, **keys):
    command = [str(PROGRAM), *map(str, args), "--threads", str(threads), "--quiet"]
    return subprocess.run(command, capture_output=True, text=True, **keys)


def ledger(directory):
    rows = list(csv.reader(open(directory / "ledger.csv")))
    wall = rows[0].index("wall time [s]")
    return [row[:wall] + row[wall + 1:] for row in rows]


def compare(whole, other, what):
    """The files in which two runs differ."""
    wrong = []
    names = lambda d: sorted(p.relative_to(d) for p in d.rglob("*")
                             if p.suffix in (".vtu", ".pvd") or p.name == "events.csv")
    if names(whole) != names(other):
        wrong.append(f"files {set(names(whole)) ^ set(names(other))}")
    for name in names(whole):
        if (other / name).is_file() and (whole / name).read_bytes() != (other / name).read_bytes():
            wrong.append(str(name))
    a, b = ledger(whole), ledger(other)
    if a != b:
        at = next((k for k, (x, y) in enumerate(zip(a, b)) if x != y), min(len(a), len(b)))
        columns = [a[0][k] for k, (x, y) in enumerate(zip(a[at], b[at])) if x != y] \
            if at < min(len(a), len(b)) else []
        wrong.append(f"ledger of {len(a)} and {len(b)} rows from row {at}: {columns[:4]}")
    if wrong:
        print(f"DIFFERENT {what}: {wrong[:3]}", flush=True)
    return not wrong


def restart_interval(title):
    """Where a new start is a part of what is computed: the time between two, with some steps."""
    return "0.02" if title.startswith("monolithic") else "0.003" if "explicit tsit45" in title else None


def every(name):
    good = bad = 0
    for title, text in cases():
        if name not in title:
            continue
        scene = WORK / "scene.toml"
        often = restart_interval(title) or "1e-9"
        scene.write_text(text + f"\n[checkpoint]\nevery = {often}\nkeep = 100000\n")
        whole = WORK / "whole"
        shutil.rmtree(whole, ignore_errors=True)
        out = rumple("run", scene, "--out", whole)
        if out.returncode:
            print(f"FAILED {title}: {out.stderr.strip()[:400]}", flush=True)
            bad += 1
            continue
        checkpoints = sorted((whole / "checkpoints").iterdir())
        chosen = checkpoints[:-1]
        chosen = chosen[::max(1, len(chosen) // 8)]
        wrong = 0
        for checkpoint in chosen:
            other = WORK / "other"
            shutil.rmtree(other, ignore_errors=True)
            shutil.copytree(whole, other)
            for later in (other / "checkpoints").iterdir():
                if later.name > checkpoint.name:
                    later.unlink()
            status = other / "status.json"
            status.write_text(status.read_text().replace('"complete"', '"running"'))
            out = rumple("resume", other)
            if out.returncode:
                print(f"REFUSED {title}: {out.stderr.strip()[:400]}", flush=True)
                wrong += 1
            else:
                wrong += not compare(whole, other, f"{title}, {checkpoint.name}")
        size = checkpoints[-1].stat().st_size if checkpoints else 0
        print(f"{title}: {len(chosen) - wrong} of {len(chosen)} continued runs are equal; "
              f"{len(ledger(whole)) - 2} steps, {len(checkpoints)} checkpoints of {size} bytes", flush=True)
        good, bad = good + (not wrong and bool(chosen)), bad + bool(wrong or not chosen)
    print(f"{good} cases equal, {bad} not")
    return bad


# Parallel loops hand out blocks of 512 entries: so many vertices are five of them.
FINER = 2300
MOTORS = '''location = "vertex"
species.c = { lower = 0.0, upper = 1.0 }
parameters = { a = 0.1 }
rates.c = "0.2*(1 - c) - 10*exp(-a*pos(tension))*c"
length_factor = "1 - 0.05*c"
initial.c = { gaussian = { width = 4.0, amplitude = 0.3 } }
'''


def finer(text):
    size = re.search(r"vertices = (\d+)", text)
    edge = 14.0 / int(size[1]) ** 0.5
    text = text.replace(size[0], f"vertices = {FINER}").replace("radius = 14.0", f"radius = {edge * FINER ** 0.5}")
    # Enough steps to tell, on a mesh that has six times as many vertices.
    shorter = lambda key, text: re.sub(rf"\b{key} = ([0-9.e-]+)", lambda m: f"{key} = {float(m[1]) / 5}", text)
    return shorter("until", shorter("every", text))


def models(text):
    yield "model I", text
    start, end = text.index('location = "vertex"'), text.index("[equilibrium]")
    yield "model II", text[:start] + MOTORS + text[end:]


def threads(name):
    bad = runs = 0
    for title, text in cases():
        if name not in title:
            continue
        for model, scene_text in models(finer(text)):
            what = f"{title}, {model}"
            often = restart_interval(title) or "1e-9"
            scene = WORK / "scene.toml"
            scene.write_text(scene_text + f"\n[checkpoint]\nevery = {float(often) / 5}\nkeep = 100000\n"
                             + "[invariants]\nenergy = true\nforce = true\ncrossings = true\n")
            made = {}
            for count in (1, 2, 4):
                made[count] = WORK / f"threads{count}"
                shutil.rmtree(made[count], ignore_errors=True)
                out = rumple("run", scene, "--out", made[count], threads=count)
                if out.returncode:
                    print(f"FAILED {what}: {out.stderr.strip()[:400]}", flush=True)
                    break
            else:
                same = [compare(made[1], made[count], f"{what}, {count} threads") for count in (2, 4)]
                other = WORK / "other"
                shutil.rmtree(other, ignore_errors=True)
                shutil.copytree(made[1], other)
                checkpoints = sorted((other / "checkpoints").iterdir())
                for later in checkpoints[len(checkpoints) // 2 + 1:]:
                    later.unlink()
                status = other / "status.json"
                status.write_text(status.read_text().replace('"complete"', '"running"'))
                out = rumple("resume", other, threads=4)
                same.append(not out.returncode and compare(made[1], other, f"{what}, continued with 4 threads"))
                print(f"{what}: {sum(same)} of 3 runs equal that on one thread; {len(ledger(made[1])) - 2} steps",
                      flush=True)
                runs, bad = runs + 1, bad + (not all(same))
                continue
            bad += 1
    print(f"{runs} cases on 1, 2 and 4 threads and continued; {bad} are not equal or failed")
    return bad


class Whole:
    """Runs that were left alone, made when they are needed."""

    def __init__(self):
        self.runs = {}

    def of(self, title, scene):
        if title not in self.runs:
            directory = WORK / f"whole{len(self.runs)}"
            began = time.monotonic()
            rumple("run", scene, "--out", directory, check=True)
            self.runs[title] = (directory, time.monotonic() - began)
        return self.runs[title]


def begin(command):
    return subprocess.Popen([str(PROGRAM), *map(str, command), "--threads", "1", "--quiet"],
                            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def half_written(directory):
    """Files that a run that was killed has left in pieces; those under construction are called .part."""
    wrong = []
    for path in (p for p in directory.rglob("*") if p.is_file() and p.suffix != ".part"):
        content = path.read_bytes()
        try:
            if path.suffix in (".vtu", ".pvd"):
                # Frames may hold raw numbers, which no parser of XML accepts.
                whole = content.rstrip().endswith(b"</VTKFile>")
                listed = re.findall(rb'file="([^"]*)"', content) if path.suffix == ".pvd" else []
                whole = whole and all((path.parent / name.decode()).is_file() for name in listed)
            elif path.suffix == ".json":
                json.loads(content)
                whole = True
            else:
                # Rows of ledger and events are appended: the system itself may cut the last one, where it crosses a
                # page, and `resume` drops it.
                whole = path.suffix != ".toml" or content.endswith(b"\n")
        except ValueError:
            whole = False
        if not whole:
            wrong.append(str(path.relative_to(directory)))
    if wrong:
        print(f"HALF WRITTEN {wrong}", flush=True)
    return len(wrong)


def onwards(scene, other):
    """How a run that was killed is resumed."""
    begun = any((other / "checkpoints").glob("checkpoint_*.bin"))
    return ["resume", other] if begun else ["run", scene, "--out", other, "--force"]


def ends_the_same(scene, other, whole, title):
    """Continues to the end; whether all is as in the run that was left alone."""
    out = rumple(*onwards(scene, other))
    if out.returncode and "the run is complete" not in out.stderr:
        print(f"REFUSED {title}: {out.stderr.strip()[:400]}", flush=True)
        return False
    return compare(whole, other, title)


def kill(kills, seed):
    dice = random.Random(seed)
    whole, cases_met = Whole(), set()
    killed = asked = missed = bad = runs = halves = 0
    while killed < kills:
        for title, text in cases():
            if killed >= kills:
                break
            scene = WORK / "scene.toml"
            # The clock asks for checkpoints now and then; that must not change a bit.
            every = f"every = {restart_interval(title)}" if restart_interval(title) else ""
            scene.write_text(text + f"\n[checkpoint]\nwall = 0.02\n{every}\n")
            directory, seconds = whole.of(title, scene)
            other = WORK / "other"
            shutil.rmtree(other, ignore_errors=True)
            command = ["run", scene, "--out", other]
            for _ in range(3):
                process = begin(command)
                try:
                    process.wait(dice.uniform(0.0, seconds))
                    missed += 1
                except subprocess.TimeoutExpired:
                    cases_met.add(title)
                    if dice.random() < 2 / 3:
                        process.kill()
                        killed += 1
                    else:
                        process.terminate()
                        asked += 1
                process.wait()
                halves += half_written(other)
                command = onwards(scene, other)
            bad += not ends_the_same(scene, other, directory, title)
            runs += 1
    print(f"{killed} kills with signal 9 and {asked} with SIGTERM met a run at work ({missed} came too late), in "
          f"{runs} runs of {len(cases_met)} cases; {bad} runs differ, {halves} files were half written")
    return bad + halves


def writing(kills):
    """Kills as soon as a file under construction is seen; counted if it was still there after the kill."""
    chosen = [(title, text.replace("vertices = 400", "vertices = 4000").replace("radius = 14.0", "radius = 44.0"))
              for title, text in cases() if title in ("quasi-static, euler", "simultaneous, sdirk2", "chemistry-fast")]
    whole, met, tries, bad, runs = Whole(), 0, 0, 0, 0
    while met < kills:
        for title, text in chosen:
            if met >= kills:
                break
            scene = WORK / "scene.toml"
            text = text.replace("until = 0.3", "until = 0.03").replace("every = 0.1", "every = 0.01")
            scene.write_text(text + "\n[checkpoint]\nwall = 1e-6\n")
            directory, _ = whole.of(title, scene)
            other = WORK / "other"
            shutil.rmtree(other, ignore_errors=True)
            command = ["run", scene, "--out", other]
            for _ in range(4):
                process = begin(command)
                checkpoints, wait = other / "checkpoints", random.Random(tries).uniform(0.0, 0.3)
                began = time.monotonic()
                while process.poll() is None:
                    late = time.monotonic() - began > wait
                    if late and checkpoints.is_dir() and any(n.endswith(".part") for n in os.listdir(checkpoints)):
                        process.kill()
                process.wait()
                tries += 1
                bad += half_written(other)
                met += checkpoints.is_dir() and any(n.endswith(".part") for n in os.listdir(checkpoints))
                command = onwards(scene, other)
            bad += not ends_the_same(scene, other, directory, title)
            left = [path for path in other.rglob("*.part")]
            if left:
                print(f"LEFT {title}: {left}", flush=True)
                bad += 1
            runs += 1
    print(f"{met} kills met a checkpoint half written ({tries} tries, {runs} runs); {bad} runs differ")
    return bad


def price():
    dome = HERE / "models/policies/dome.toml"

    def work(method, more):
        keys = ["time.policy=simultaneous", "output.every=1.0", f"time.integrator={method}", *more]
        directory = WORK / "price"
        shutil.rmtree(directory, ignore_errors=True)
        rumple("run", dome, "--out", directory, *(word for key in keys for word in ("--set", key)), check=True)
        status = json.loads((directory / "status.json").read_text())
        return status["work"] | {"cpu_seconds": status["cpu_seconds"] - status["start"]["cpu_seconds"]}

    starts, between = 9, 3000
    small = ["sheet.vertices=100"]
    for name, more in [("bdf", []), ("tr-bdf2", []), ("esdirk34", []), ("tsit45", small)]:
        kind = "explicit" if name == "tsit45" else "monolithic"
        method = f'{{ kind = "{kind}", method = "{name}", rtol = 1e-6, atol = 1e-8 }}'
        plain, often = work(method, more), work(method, [*more, "checkpoint.every=0.1"])
        words = []
        for key in ["steps", "right_hand_sides", "newton_iterations", "factorisations", "cpu_seconds"]:
            each = (often[key] - plain[key]) / starts
            share = 100 * each / (plain[key] / plain["steps"] * between) if plain[key] else 0.0
            words.append(f"{key} {plain[key]:.4g}, {each:+.3g} a new start ({share:.2f} % of {between} steps)")
        print(f"{name}: " + "; ".join(words), flush=True)
    scene = (HERE / "models/model-i/formula.toml").read_text()
    for vertices, radius in [(2000, 32.0), (20000, 100.0)]:
        text = scene.replace("radius = 32.0", f"radius = {radius}").replace("= 2000", f"= {vertices}")
        text = text.replace('policy = "quasi-static"', 'policy = "simultaneous"\nmax_steps = 5')
        text = text.replace("thickness = 0.5", "thickness = 0.5\ndrag = 100.0")
        (WORK / "scene.toml").write_text(text + "\n[checkpoint]\nevery = 1e-9\n")
        rumple("run", WORK / "scene.toml", "--out", WORK / "large", "--force", check=True)
        costs = json.loads((WORK / "large/costs.json").read_text())
        part = next(part for part in costs["parts"] if part["name"] == "checkpoints")
        calls = dict(part["counts"])["made or written"] / 2
        size = max(path.stat().st_size for path in (WORK / "large/checkpoints").iterdir())
        each = part["seconds"] / calls
        print(f"{vertices} vertices: {size / 1e6:.1f} MB and {each:.3f} s a checkpoint, "
              f"{100 * each / 600:.4f} % of ten minutes; a step {costs['seconds'] / 5:.2f} s", flush=True)


if __name__ == "__main__":
    wrong = 0
    try:
        if sys.argv[1] == "price":
            price()
        elif sys.argv[1] == "every":
            wrong = every(sys.argv[2] if len(sys.argv) > 2 else "")
        elif sys.argv[1] == "threads":
            wrong = threads(sys.argv[2] if len(sys.argv) > 2 else "")
        elif sys.argv[1] == "writing":
            wrong = writing(int(sys.argv[2]))
        else:
            wrong = kill(int(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 1)
    finally:
        shutil.rmtree(WORK, ignore_errors=True)
    sys.exit(1 if wrong else 0)
