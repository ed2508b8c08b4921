"""The classes of trials.py with sheets, prescriptions, results on the disk, and Python."""

from __future__ import annotations

import base64
import math
import re
import shutil
import struct
from pathlib import Path

MATERIAL = "material = { young = 1e3, poisson = 0.3, thickness = 0.2 }"
QUIET = ("--set", 'output.compression="none"', "--set", "output.report=false")


def positions(frame: Path) -> list[tuple[float, ...]]:
    """The points of a frame without compression."""
    points = re.search(r"<Points>\s*<DataArray[^>]*>([^<]*)<", frame.read_text())
    raw = base64.b64decode(points[1]) if points else b""
    values = struct.unpack(f"<{(len(raw) - 8) // 8}d", raw[8:])
    return [values[k : k + 3] for k in range(0, len(values), 3)]


def sheet(shape: str, effects: list[str], until: float = 1.0, more: str = "", policy: str = "quasi-static") -> str:
    """A scene of a sheet with effects, each a line of keys."""
    lines = [f"sheet = {{ {shape} }}", MATERIAL, *(f"[[effect]]\n{keys}" for keys in effects), more]
    return "\n".join([*lines, "[time]", f'policy = "{policy}"', f"until = {until!r}", ""])


# ------------------------------------------------------------------------------------------------ 4: contradictions
def contradictions(trials) -> None:
    """Two prescriptions that cannot both be: refused in either order, with the place and both effects."""
    pin = lambda where, axes="xyz", more="": f"kind = 'pin'\naxes = '{axes}'\nwhere = {where}\n{more}"
    ball = "{ ball = { centre = [0, 0, 0], radius = 1.0 } }"
    box = "{ box = { min = [-9, -9, -1], max = [-1.5, 9, 1] } }"
    by = lambda vector, ramp="": f"displacement = {vector}" + (f"\nramp = {{ {ramp} }}" if ramp else "")
    hold = lambda value, where, species="c": f"kind = 'hold'\nspecies = '{species}'\nvalue = {value}\nwhere = {where}"
    flux = lambda value, where, more="": f"kind = 'flux'\nspecies = 'c'\nvalue = {value}\nwhere = {where}\n{more}"
    tilted = "{ half-space = { point = [0, 1.2, 0], normal = [0, 1, 0] } }"
    members = [
        ("one vertex in two balls", pin(ball, "z"), pin("{ vertices = [0] }", "z", by("[0, 0, 0.1]")).replace("[0]", "NEAR")),
        ("pulse of 1e-3 of the span", pin("'rim'", "xy", by("[0.1, 0, 0]")), pin(box, "x", by("[0.1, 0, 0]", "formula = '1 + exp(-((t-0.5)/0.001)^2)'"))),
        ("the same, against a pin at rest", pin("'rim'"), pin(box, "y", by("[0, 0.1, 0]", "formula = 'exp(-((t-0.4441)/1e-3)^2)'"))),
        ("ramps equal at both ends", pin("'rim'", "z", by("[0, 0, 1]", "formula = 't'")), pin(box, "z", by("[0, 0, 1]", "formula = 't^2'"))),
        ("points against a formula", pin("'rim'", "z", by("[0, 0, 1]", "points = [[0, 0], [1, 1]]")), pin(tilted, "z", by("[0, 0, 1]", "formula = 'min(t, 0.9)'"))),
        ("a corner of two edges", pin(box, "xz", by("[-0.1, 0, 0]")), pin(tilted, "x", by("[0.1, 0, 0]"))),
        ("two values of a species", hold("0.5", "'rim'"), hold("{ default = 0.5, regions = [{ where = { vertices = [BOX] }, value = 0.6 }] }", "'all'")),
        ("a formula against a number", hold("'1 + 1e-9*x'", box), hold("1", "'rim'")),
        ("flux through one held edge", hold("1", box), flux("0.1", "'rim'")),
        ("flux out, exchange", hold("0", "'all'"), flux("-2", "'rim'")),
        ("exchange by a field", hold("'x'", tilted), "kind = 'exchange'\nspecies = 'c'\nwhere = 'rim'\nrate = 'pos(y)'\nreference = 1"),
        ("two exact volumes", "kind = 'volume'\nexact = true", "kind = 'volume'\nexact = true\ntarget = { share = 1.1 }"),
        ("exact volume of a sheet that is pinned", "kind = 'volume'\nexact = true\nramp = { formula = '1 + t' }", pin("'all'")),
        ("an obstacle moved into pinned vertices", pin("'rim'"), "kind = 'obstacle'\nshape = { plane = { point = [0, 0, -1], normal = [0, 0, 1] } }\ndisplacement = [0, 0, 2]\nramp = { formula = 't' }"),
        ("two obstacles that close", "kind = 'obstacle'\nshape = { plane = { point = [0, 0, -1], normal = [0, 0, 1] } }\ndisplacement = [0, 0, 2]\nramp = { formula = 't' }",
         "kind = 'obstacle'\nshape = { plane = { point = [0, 0, 1], normal = [0, 0, -1] } }"),
    ]
    also = ["constraints volume, volume 2", "pins, or another obstacle, hold it there",
            "pins fix every vertex: no force meets the constraint volume"]
    for member, one, other in members:
        closed = "volume" in one + other
        shape = "shape = 'sphere', radius = 2.0, vertices = 162" if closed else "shape = 'disc', radius = 2.0, vertices = 150"
        found = []
        for first, second in ((one, other), (other, one)):
            effects = [e.replace("NEAR", near_origin(trials)).replace("BOX", "0") for e in (first, second)]
            species = "[kinetics]\nrates.c = '0'" if "species" in one + other else ""
            elastic = ["kind = 'stretching'", "kind = 'bending'"]
            run = trials.run(sheet(shape, [*elastic, *effects], 1.0, species), *QUIET)
            named = all(f"effect[{k}]" in run.said or f"effect.{k}" in run.said for k in (2, 3))
            named |= any(words in run.said for words in also)
            found.append(f"code {run.code}{', both named' if named else ', ' + run.said[-150:]}")
        # A barrier does not prescribe positions: the manual has pins hold the sheet within an obstacle, with a warning.
        wanted = "code 0, both named" if "obstacle" in one + other else "code 2, both named"
        trials.row(4, member, f"{wanted}, in either order", "; ".join(dict.fromkeys(found)), set(found) == {wanted})


def near_origin(trials) -> str:
    """The vertex next to the origin of the disc of [`contradictions`]."""
    if not hasattr(trials, "nearest"):
        run = trials.run(sheet("shape = 'disc', radius = 2.0, vertices = 150", ["kind = 'stretching'"], 1e-3), *QUIET)
        points = positions(next((run.out / "frames").glob("*.vtu")))
        trials.nearest = min(range(len(points)), key=lambda k: math.hypot(*points[k]))
    return f"[{trials.nearest}]"


# ------------------------------------------------------------------------------------------------ 7: resolution
def resolution(trials) -> None:
    """Patterns and wrinkles of known width: a note where they are narrower than 6 edges, and nowhere else."""
    still = lambda shape, formula, location="vertex": f"sheet = {{ {shape} }}\n[kinetics]\nlocation = '{location}'\nrates.c = '0*c'\ninitial.c = {{ formula = '{formula}' }}\n[time]\nuntil = 1e-3\n"
    square = lambda n: f"shape = 'lattice', width = 10.0, height = 10.0, vertices = {n}"
    edge = lambda area, n: math.sqrt(2 * area / math.sqrt(3) / n)
    plane, members = lambda width: f"1 + cos(pi*x/{width})", []
    for n, edges in ((1500, 3.0), (1500, 5.4), (4000, 6.8), (4000, 12.0)):
        members.append((f"plane wave, {n} vertices", edges, still(square(n), plane(edges * edge(100, n)))))
    members.append(("plane wave on triangles", 9.0, still(square(4000), plane(9 * edge(100, 4000)), "face")))
    k = lambda edges, n: math.pi / math.sqrt(2) / (edges * edge(100, n))
    for n, edges in ((2000, 4.5), (4000, 7.5)):
        members.append((f"squares, {n} vertices", edges, still(square(n), f"cos({k(edges, n)}*x)*cos({k(edges, n)}*y)")))
    for n, order in ((362, 3), (2562, 3)):
        harmonic = {3: "z*(5*z^2 - 3)"}[order]
        width = math.pi / math.sqrt(order * (order + 1)) / edge(4 * math.pi, n)
        members.append((f"spherical harmonic of order {order}, {n} vertices", width, still(f"shape = 'sphere', radius = 1.0, vertices = {n}", harmonic)))
    for n, wavelength in ((1500, 2.5), (4000, 5.0)):
        strip = f"shape = 'wavy-strip', width = 10.0, height = 10.0, amplitude = 0.15, wavelength = {wavelength}, vertices = {n}"
        effects = ["kind = 'stretching'\nmodel = 'stvk'", "kind = 'bending'\nrest = 'mesh'"]
        members.append((f"wrinkles {wavelength} long at rest, {n} vertices", wavelength / 2 / edge(100, n), sheet(strip, effects, 1e-3)))
    members.append(("a flat sheet, uniform", math.inf, still(square(800), "1")))
    for member, width, scene in members:
        run = trials.run(scene, *QUIET)
        said = re.search(r"(?:is|are) ([0-9.]+) edges wide", run.said)
        expected = f"{width:.1f} edges: note" if width < 6 else f"{width:.1f} edges: no note"
        right = run.code == 0 and (said is not None) == (width < 6) and (said is None or abs(float(said[1]) / width - 1) < 0.15)
        trials.row(7, member, expected, f"{said[1]} edges: note" if said else "no note" if run.code == 0 else run.said[:150], right)


# ------------------------------------------------------------------------------------------------ 10: clamps
def clamps(trials) -> None:
    """Directions that pins fix are those of the smooth start in every frame, bit for bit, imperfections or not."""
    rough = "imperfection = { amplitude = 0.02, direction = 'DIR' }"
    load = "kind = 'load'\nwhere = 'all'\nforce = { per-area = [0.1, 0.05, 0.2] }"
    disc, strip, ball = "shape = 'disc', radius = 3.0, vertices = 300", "shape = 'rectangle', width = 6.0, height = 3.0, vertices = 250", "shape = 'sphere', radius = 2.0, vertices = 162"
    members = [  # shape, region, its test at rest, axes, direction of the imperfection, policy
        ("one row", disc, "'rim'", lambda x: math.hypot(*x) > 2.999, "xyz", "z", "quasi-static"),
        ("two rows", disc, "{ ring = { inner = 2.6, outer = 4 } }", lambda x: math.hypot(x[0], x[1]) >= 2.6, "xyz", "z", "quasi-static"),
        ("two rows at one end", strip, "{ half-space = { point = [2.5, 0, 0], normal = [1, 0, 0] } }", lambda x: x[0] >= 2.5, "xyz", "normal", "quasi-static"),
        ("a patch inside", disc, "{ ball = { centre = [0, 0, 0], radius = 1.0 } }", lambda x: math.hypot(*x) <= 1.0, "xyz", "z", "quasi-static"),
        ("a line inside, along z", strip, "{ box = { min = [-0.4, -9, -1], max = [0.4, 9, 1] } }", lambda x: abs(x[0]) <= 0.4, "z", "z", "quasi-static"),
        ("half of the boundary, x and z", disc, "{ all-of = ['rim', { half-space = { normal = [1, 0, 0] } }] }", lambda x: x[0] >= 0 and math.hypot(*x) > 2.999, "xz", "normal", "quasi-static"),
        ("a cap of a sphere, x and y", ball, "{ half-space = { point = [0, 0, 1], normal = [0, 0, 1] } }", lambda x: x[2] >= 1, "xy", "normal", "quasi-static"),
        ("a belt of a sphere, y", ball, "{ box = { min = [-9, -9, -0.5], max = [9, 9, 0.5] } }", lambda x: abs(x[2]) <= 0.5, "xyz", "normal", "quasi-static"),
        ("under drag", disc, "{ ring = { inner = 2.6, outer = 4 } }", lambda x: math.hypot(x[0], x[1]) >= 2.6, "yz", "z", "simultaneous"),
        ("under drag, a patch inside", strip, "{ ball = { centre = [0, 0, 0], radius = 1.2 } }", lambda x: math.hypot(*x) <= 1.2, "xyz", "normal", "simultaneous"),
        ("monolithic, two rows", disc, "{ ring = { inner = 2.6, outer = 4 } }", lambda x: math.hypot(x[0], x[1]) >= 2.6, "xyz", "z", "monolithic"),
    ]
    for member, shape, where, inside, axes, direction, policy in members:
        effects = ["kind = 'stretching'\nmodel = 'stvk'", "kind = 'bending'\nrest = 'mesh'", f"kind = 'pin'\nwhere = {where}\naxes = '{axes}'", load,
                   "kind = 'foundation'\nwhere = 'all'\nstiffness = 1.0"]
        flat = trials.run(sheet(shape, effects, 1e-6), *QUIET, "--set", 'time.start="given"')
        more = 'integrator = "monolithic"\n' if policy == "monolithic" else ""
        scene = sheet(f"{shape}, {rough.replace('DIR', direction)}", effects, 1.0, "", "simultaneous" if more else policy)
        run = trials.run(scene + more + "[output]\nevery = 0.25\n", *QUIET)
        frames = sorted((run.out / "frames").glob("*.vtu")) if run.code == 0 else []
        rest = positions(sorted((flat.out / "frames").glob("*.vtu"))[0])
        chosen = [k for k, x in enumerate(rest) if inside(x)]
        moved = max((abs(x[k]["xyz".index(a)] - rest[k]["xyz".index(a)]) for x in map(positions, frames) for k in chosen for a in axes), default=math.nan)
        others = [math.dist(x, r) for x, r in zip(positions(frames[-1]), rest)] if frames else [0.0]
        right = run.code == 0 and moved == 0.0 and bool(chosen) and max(others) > 1e-4
        found = f"{moved:g} for {len(chosen)} vertices in {len(frames)} frames; others move by {max(others):.2g}" if frames else run.said[-150:]
        trials.row(10, f"{member}, imperfection along {direction}", f"{axes} unchanged in every frame", found, right)


# ------------------------------------------------------------------------------------------------ 9: results
def results(trials) -> None:
    """Directories that are damaged or of something else: every command says so and names the file, with a code other than 0."""
    scene = sheet("shape = 'disc', radius = 2.0, vertices = 60", ["kind = 'stretching'", "kind = 'pin'\nwhere = 'rim'\naxes = 'xyz'"],
                  1.0, "[kinetics]\nrates.c = '1'\n[checkpoint]\nevery = 0.25\n[output]\nevery = 0.25\nreport = false")
    whole = trials.run(scene)
    other = trials.run(scene, "--set", "sheet.vertices=90")
    swept = Path(trials.folder) / "swept"
    trials.command("sweep", str(whole.scene), "--over", "sheet.seed=1,2", "--out", str(swept))
    half = lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    frame, last = "frames/frame_000002.vtu", "frames/frame_000004.vtu"
    names = {"view": ["view", "{}"], "resume": ["resume", "{}", "--until", "2"], "collect": ["sweep", "collect", "{}"],
             "inspect": ["inspect", str(whole.scene), "--state", "{}"], "paraview": ["paraview", "{}"], "explain": ["explain", "{}"]}
    members = [  # what was done to a copy, the file to be named, the commands that it concerns
        ("an empty folder", lambda d: (shutil.rmtree(d), d.mkdir()), "", ["view", "resume", "collect", "paraview", "explain", "inspect"]),
        ("a file in place of the folder", lambda d: (shutil.rmtree(d), d.write_text("x")), "", ["view", "resume", "collect", "paraview", "explain", "inspect"]),
        ("results of another program", lambda d: (shutil.rmtree(d), (d / "0").mkdir(parents=True), (d / "case.foam").touch()), "", ["view", "resume", "collect", "paraview", "explain"]),
        ("frames as VTKHDF", lambda d: (shutil.rmtree(d / "frames"), (d / "sheet.vtkhdf").write_bytes(b"\x89HDF\r\n\x1a\n" * 9), (d / "sheet.pvd").unlink()), "", ["view", "resume"]),
        ("a frame cut in the middle", lambda d: half(d / frame), frame, ["view", "resume"]),
        ("the last frame, empty", lambda d: (d / last).write_text(""), last, ["view", "resume"]),
        ("a frame that is missing", lambda d: (d / frame).unlink(), frame, ["view", "resume"]),
        ("a frame of another sheet", lambda d: shutil.copy(other.out / frame, d / frame), frame, ["view", "resume"]),
        ("a ledger cut within a line", lambda d: half(d / "ledger.csv"), "ledger.csv", ["view", "resume"]),
        ("a ledger of zeros", lambda d: (d / "ledger.csv").write_bytes(bytes(400)), "ledger.csv", ["view", "resume"]),
        ("a ledger that is missing", lambda d: (d / "ledger.csv").unlink(), "ledger.csv", ["view", "resume"]),
        ("a resolved scene cut short", lambda d: half(d / "resolved.toml"), "resolved.toml", ["view", "resume"]),
        ("no resolved scene", lambda d: (d / "resolved.toml").unlink(), "resolved.toml", ["view", "resume"]),
        ("a status that is not JSON", lambda d: (d / "status.json").write_text("{"), "status.json", ["view"]),
        ("an index that is a web page", lambda d: (d / "sheet.pvd").write_text("<html></html>"), "sheet.pvd", ["view", "paraview"]),
        ("checkpoints that are empty", lambda d: [c.write_text("") for c in (d / "checkpoints").iterdir()], "checkpoint", ["resume"]),
    ]
    for member, damage, named, commands in members:
        for name in commands:
            copy = Path(trials.folder) / "copy"
            if copy.is_file():
                copy.unlink()
            shutil.rmtree(copy, ignore_errors=True)
            shutil.copytree(whole.out, copy)
            damage(copy)
            code, said = trials.command(*(a.format(copy) for a in names[name]))
            # A checkpoint before the damage serves, with a warning.
            said_so = any(words in said for words in (named or "copy", "frame 2 of its 5 is gone", "checkpoint_000003.bin"))
            right = (code in (1, 2) or name == "resume" or "warning: " in said) and said_so and "panicked" not in said
            # A page of what is left has its own first line.
            said = said.partition("warning: ")[2] or said
            trials.row(9, f"{member}: `{name}`", f"names {named or 'the folder'}", f"code {code}: {said[:160]}", right)
    image = Path(trials.folder) / "sheet.png"
    image.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(64))
    for member, path in [("a picture", image), ("a ledger", whole.out / "ledger.csv"), ("a checkpoint", next((whole.out / "checkpoints").iterdir())), ("a folder", whole.out)]:
        code, said = trials.command("inspect", str(whole.scene), "--state", str(path))
        trials.row(9, f"{member}: `inspect --state`", "code 2, names the file", f"code {code}: {said[:160]}", code == 2 and path.name in said)
    for member, damage, expected in [
        ("a member that is empty", lambda m: (shutil.rmtree(m), m.mkdir()), "not begun"), ("a member with a cut table", lambda m: half(m / "measures.csv"), "damaged"),
        ("a member without status", lambda m: (m / "status.json").unlink(), "not begun"), ("a plan cut short", lambda m: half(swept / "sweep.json"), "sweep.json"),
    ]:
        saved = Path(trials.folder) / "saved"
        shutil.copytree(swept, saved)
        damage(sorted((swept / "members").iterdir())[0])
        code, said = trials.command("sweep", "collect", str(swept))
        row = next((line for line in ("damaged", "not begun", "sweep.json", "complete") if line in said), "nothing")
        trials.row(9, f"{member}: `sweep collect`", expected, f"code {code}: {row}", row == expected)
        shutil.rmtree(swept)
        saved.rename(swept)


# ------------------------------------------------------------------------------------------------ 11: output.every
def every(trials) -> None:
    """The same scene with output times three times as near: results differ within the tolerance, and the summary counts."""
    models = Path(__file__).resolve().parent.parent / "models"
    flow = "[kinetics]\nrates.c = '-c'\ninitial.c = { formula = '1 + x/5' }\n"
    disc = "sheet = { shape = 'disc', radius = 3.0, vertices = 200 }\neffect = [{ kind = 'diffusion', species = 'c', coefficient = 1.0 }]\n"
    law = lambda more: f"{disc}{flow}[time]\npolicy = 'simultaneous'\nuntil = 3.0\n{more}"
    kinds = "effect = [{ kind = 'stretching' }, { kind = 'pin', where = 'rim', axes = 'z' }]"
    members = [  # scene, every, overrides, column, tolerance: that of the integrator, or the error of Euler's step
        ("decay and diffusion, default", law(""), 0.3, [], "total c", 0.01),
        ("the same, steps of 0.3", law(""), 0.03, [], "total c", 0.01),
        ("monolithic bdf", law("integrator = 'monolithic'\n"), 0.3, [], "total c", 1e-4),
        ("staggered bdf, rtol 1e-3", law("integrator = { kind = 'staggered', chemistry = 'bdf', rtol = 1e-3 }\n"), 0.3, [], "total c", 1e-3),
        ("Euler, steps of 0.2", law("integrator = { kind = 'explicit', method = 'euler', step = 0.002 }\n"), 0.003, [], "total c", 0.002),
        ("FitzHugh-Nagumo, stiff", (models / "kinetics/stiff-sheet.toml").read_text(), 2.0, ["sheet.vertices=200"], "total u", 0.01),
        ("Model I, buckled", (models / "hard/spot.toml").read_text(), 0.3, ["time.until=1.2"], "total c", 0.01),
        ("Model I, energy", (models / "hard/spot.toml").read_text(), 0.3, ["time.until=1.2"], "total energy", 0.01),
        ("the same at rtol 1e-3", (models / "hard/spot.toml").read_text(), 0.3, ["time.until=0.6", 'time.integrator={kind="staggered",rtol=1e-3,atol=1e-3}'], "total energy", 1e-3),
        ("Model II", (models / "hard/motors.toml").read_text(), 0.3, ["time.until=1.2"], "total m", 0.01),
        ("a dome that snaps", (models / "hard/dome.toml").read_text(), 0.3, ["time.until=1.2"], "total energy", 0.01),
        ("growth under drag", f"sheet = {{ shape = 'disc', radius = 3.0, vertices = 200, bump = {{ amplitude = 0.2, width = 1.5 }} }}\n{MATERIAL}\n{kinds}\n[kinetics]\nrates.c = '1 - c'\nlength_factor = '1 + 0.1*c'\n[time]\npolicy = 'simultaneous'\nuntil = 1.0\n", 0.2, [], "total energy", 0.01),
    ]
    for member, scene, interval, overrides, column, tolerance in members:
        runs = []
        for k in (1, 3):
            sets = [f"output.every={interval / k!r}", "output.report=false", *overrides]
            runs.append(trials.run(scene, *(part for s in sets for part in ("--set", s))))
        if any(run.code for run in runs):
            trials.row(11, member, "complete", "; ".join(run.said[-100:] for run in runs), False)
            continue
        ends = [run.columns[column][-1] for run in runs]
        count = [re.search(r"(\d+) of (\d+) steps end at output times", run.said) for run in runs]
        steps = [len(run.columns["time"]) - 1 for run in runs]
        wanted = [sum(is_multiple(t, interval / k, run.columns["time"][-1]) for t in run.columns["time"][1:]) for k, run in zip((1, 3), runs)]
        told = all((c is not None) == (0 < 2 * w >= s) for c, w, s in zip(count, wanted, steps))
        counts = ", ".join(f"{w} of {s}" + ("" if c is None else " (said)") for w, s, c in zip(wanted, steps, count))
        change = abs(ends[1] / ends[0] - 1)
        trials.row(11, f"{member}: {column}", f"tolerance {tolerance:g}", f"{change:.1e} = {change / tolerance:.2g} tolerances; steps that end at output times: {counts}", told and change < 10 * tolerance)


def is_multiple(time: float, every: float, until: float) -> bool:
    """Whether a step has ended at an output time before the end."""
    return time < until * (1 - 1e-9) and abs(time / every - round(time / every)) < 1e-9 * max(1.0, time / every)


# ------------------------------------------------------------------------------------------------ 8: Python
PRELUDE = """
import numpy, rumple, warnings
warnings.simplefilter("ignore")
scene = rumple.scene(sheet={"shape": "disc", "radius": 2.0, "vertices": 60}, kinetics={"rates": {"c": "-c"}, "initial": {"c": 1.0}},
                     time={"until": 1.0})
sim = rumple.Simulation(scene)
sim.run(until=0.1)
n = len(sim.positions)
try:
    @
except Exception as error:
    print(type(error).__name__ + ":", error)
else:
    print("accepted")
"""


def python(trials) -> None:
    """Arguments that cannot be meant: an exception of the right kind, whose message has what to do."""
    members = [
        ("items of positions", "sim.positions[:, 2] += 1", "read-only"),
        ("`out=` of a species", "numpy.add(sim.species['c'], 1, out=sim.species['c'])", "read-only"),
        ("items of rest positions", "sim.rest_positions[0] = 0", "read-only"),
        ("items of triangles", "sim.triangles[0] = 0", "read-only"),
        ("items of a field", "sim.field('c')[0] = 5", "read-only"),
        ("complex species", "sim.species['c'] = numpy.full(n, 1 + 0j)", "an array of complex128"),
        ("complex positions", "sim.positions = sim.positions * (1 + 0j)", "an array of complex128"),
        ("a list with text", "sim.species['c'] = ['1'] * n", "number"),
        ("objects", "sim.species['c'] = numpy.array([None] * n)", "number"),
        ("a mask", "sim.species['c'] = numpy.ma.masked_array(numpy.ones(n), [True] * n)", "mask"),
        ("too few values", "sim.species['c'] = numpy.ones(3)", "60"),
        ("numbers that are not finite", "sim.species['c'] = numpy.full(n, numpy.nan)", "finite"),
        ("a species that there is not", "sim.species['d'] = 1.0", "c"),
        ("positions in the plane", "sim.positions = sim.positions[:, :2]", "3"),
        ("until = NaN", "sim.run(until=float('nan'))", "until"),
        ("until = infinity", "sim.run(until=float('inf'))", "until"),
        ("until as text", "sim.run(until='2')", "real number"),
        ("until complex", "sim.step(until=1j)", "real number"),
        ("until before the state", "sim.step(until=0.05)", "until"),
        ("until beyond the scene", "sim.run(until=2.0)", "until"),
        ("the time", "sim.time = 0.0", "time"),
        ("an override without a value", "rumple.Simulation(scene.varied({'time.until': None}))", "time.until"),
        ("an override of a complex number", "scene.varied({'time.until': 1j})", "time.until"),
        ("results of no run", "rumple.read('/')", "ledger.csv"),
        ("results that are a file", "rumple.read(__file__)", "directory"),
    ]
    if trials.python is None:
        print("| 8 | left out: no --python | | | |")
        return
    for member, code, words in members:
        script = Path(trials.folder) / "trial.py"
        script.write_text(PRELUDE.replace("@", code))
        _, said = trials.command(str(script), executable=trials.python)
        kinds = ("Error:", "KeyError:", "TypeError:", "ValueError:", "AttributeError:")
        right = any(kind in said for kind in kinds) and words in said.split("Error:")[-1] and "Traceback" not in said
        trials.row(8, f"{member}: `{code}`", f"an exception with “{words}”", said[:250], right)
