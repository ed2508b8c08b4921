"""One sheet over ranks: runs of 1, 2, 3 and 4 processes by mpirun, compared with one process.

    ranks.py RUMPLE OUT [TEST…]

RUMPLE is the program with the feature `mpi`; OUT takes the runs. Wants vtk and numpy.
"""

import csv
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

import numpy
import vtk
from vtk.util.numpy_support import vtk_to_numpy

PATIENCE = 300
# What the environment has takes precedence.
ENVIRONMENT = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "OMPI_MCA_btl_vader_single_copy_mechanism": "none",
    "RAYON_NUM_THREADS": "1",
} | os.environ

DOME = """
sheet = {{ shape = "disc", radius = 10.0, vertices = {vertices}, bump = {{ amplitude = 0.5, width = 4.0 }} }}
material = {{ young = 1e3, poisson = 0.3333333333333333, thickness = 0.3, drag = 1.0 }}
time = {{ until = {until}, policy = "{policy}" }}
output = {{ every = {every}, fields = ["c", "mean_curvature"], boundary = "zero" }}
checkpoint = {{ every = {every} }}
equilibrium = {{ method = "lbfgs", preconditioner = "{preconditioner}", tolerance = 1e-9 }}

[kinetics]
rates = {{ c = "k*(0.5 + 0.5*tanh(x/3) - c)" }}
parameters = {{ k = 1.0 }}
initial = {{ c = 0.0 }}
length_factor = "1 + 0.05*c"

[[effect]]
kind = "stretching"

[[effect]]
kind = "bending"

[[effect]]
kind = "pin"
where = "rim"
axes = "xyz"

[[effect]]
kind = "diffusion"
species = "c"
coefficient = 0.5

# So that round-off does not decide which way it buckles.
[[effect]]
kind = "pressure"
value = 0.05
{more}
"""

SPHERE = """
sheet = {{ shape = "sphere", radius = 10.0, vertices = 400 }}
material = {{ young = 1e3, poisson = 0.3, thickness = 0.5 }}
time = {{ until = 0.5 }}
output = {{ every = 0.25, fields = ["c", "mean_curvature"], boundary = "zero" }}
equilibrium = {{ method = "lbfgs", tolerance = 1e-9, preconditioner = "{preconditioner}" }}

[kinetics]
rates = {{ c = "0.5 + 0.5*tanh(z/3) - c" }}
initial = {{ c = 0.0 }}
length_factor = "1 + 0.1*c"

[[effect]]
kind = "stretching"

[[effect]]
kind = "bending"

[[effect]]
kind = "volume"
stiffness = 10.0

[[effect]]
kind = "diffusion"
species = "c"
coefficient = 1.0
"""

PLUGIN = """plugin = "curvature-feedback"
initial = {{ c = 0.05 }}

"""

USUAL = dict(vertices=600, until=0.5, every=0.25, policy="quasi-static", preconditioner="gamg", more="")


def command(ranks, *arguments):
    if ranks == 0:
        return [RUMPLE, *arguments]
    return ["mpirun", "--oversubscribe", "-n", str(ranks), RUMPLE, *arguments]


def run(ranks, *arguments, code=0):
    done = subprocess.run(
        command(ranks, *map(str, arguments)),
        env=ENVIRONMENT, capture_output=True, text=True, timeout=PATIENCE, check=False,
    )
    said = done.stdout + done.stderr
    assert done.returncode == code, f"{ranks} ranks, {arguments}: exit code {done.returncode}\n{said}"
    return said


def scene(name, of=DOME, **changes):
    path = OUT / f"{name}.toml"
    path.write_text(of.format(**(USUAL | changes)))
    return path


def frame(directory, number):
    """Points with their values, in the order of the coordinates of the rest positions: the same for any number of pieces."""
    pieces = directory / "frames" / f"frame_{number:06}.pvtu"
    whole = pieces.with_suffix(".vtu")
    reader = vtk.vtkXMLPUnstructuredGridReader() if pieces.exists() else vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(pieces if pieces.exists() else whole))
    reader.Update()
    grid = reader.GetOutput()
    assert grid.GetNumberOfCells() > 0
    points = vtk_to_numpy(grid.GetPoints().GetData())
    data = grid.GetPointData()
    moved = vtk_to_numpy(data.GetArray("displacement [length]"))
    values = {data.GetArrayName(k): vtk_to_numpy(data.GetArray(k)) for k in range(data.GetNumberOfArrays())}
    rest = numpy.round(points - moved, 9)
    _, first = numpy.unique(rest, axis=0, return_index=True)
    return rest[first], points[first], {name: value[first] for name, value in values.items()}, grid.GetNumberOfCells()


def ledger(directory):
    with open(directory / "ledger.csv", newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def compare(one, other, number, tolerance, what):
    a, b = frame(one, number), frame(other, number)
    assert a[3] == b[3], f"{what}: {a[3]} and {b[3]} triangles"
    assert numpy.array_equal(a[0], b[0]), f"{what}: other vertices"
    moved = numpy.abs(a[1] - b[1]).max()
    species = numpy.abs(a[2]["c"] - b[2]["c"]).max()
    curvature = numpy.abs(a[2]["mean_curvature [1/length]"] - b[2]["mean_curvature [1/length]"]).max()
    print(f"{what}: positions differ by {moved:.1e}, species by {species:.1e}, curvatures by {curvature:.1e}", flush=True)
    assert max(moved, species) < tolerance and curvature < 30 * tolerance, what


def same_as_one_process():
    for policy, tolerance, counts in [("quasi-static", 2e-6, [1, 2, 3]), ("simultaneous", 5e-3, [2, 4])]:
        one = OUT / f"{policy}-one"
        path = scene(policy, policy=policy)
        run(0, "run", path, "--set", "equilibrium.preconditioner=\"factor\"", "--out", one)
        for ranks in counts:
            out = OUT / f"{policy}-{ranks}"
            run(ranks, "run", path, "--out", out)
            compare(one, out, 2, tolerance, f"{policy}, {ranks} ranks")
            a, b = ledger(one)[-1], ledger(out)[-1]
            for column in ["total c", "least c", "largest c", "energy of stretching [energy]"]:
                x, y = float(a[column]), float(b[column])
                assert abs(x - y) < 100 * tolerance * max(abs(x), 1e-3), f"{policy}, {ranks}: {column} {x} {y}"


def other_linear_solvers():
    for preconditioner in ["mumps", "factor", "blocks"]:
        path = scene(preconditioner, preconditioner=preconditioner)
        out = OUT / preconditioner
        run(2, "run", path, "--out", out)
        compare(OUT / "quasi-static-one", out, 2, 2e-6, f"{preconditioner}, 2 ranks")


def effects():
    """Each effect once more than the dome has, and other models of those that it has."""
    more = {
        "load": 'kind = "load"\nwhere = { ball = { centre = [0, 0, 0], radius = 3 } }\nforce = { total = [0, 0, 2] }',
        "foundation": 'kind = "foundation"\nwhere = "all"\nto = "rest"\nstiffness = 0.05',
        "growth": 'kind = "growth"\nfactor = "1 + 0.02*t*(1 + x/10)"',
        "flux": 'kind = "flux"\nspecies = "c"\nwhere = "rim"\nvalue = 0.1',
        "hold": 'kind = "hold"\nspecies = "c"\nwhere = "rim"\nvalue = 0.2',
        "active-tension": 'kind = "active-tension"\nvalue = 5.0',
        "along-normal": 'kind = "load"\nwhere = { half-space = { point = [3, 0, 0], normal = [1, 0, 0] } }\nforce = { along-normal = 0.02 }',
        "exchange": 'kind = "exchange"\nspecies = "c"\nwhere = "rim"\nrate = 1.0\nreference = 0.5',
        "advection": 'kind = "advection"\nspecies = "c"\nvelocity = ["-y", "x", "0"]',
        "directed-growth": 'kind = "directed-growth"\nfibre = ["1", "0", "0"]',
        "vertices": 'kind = "load"\nwhere = { vertices = [0, 7, 150] }\nforce = { total = [0, 0, 1] }',
    }
    variants = {
        "stvk": ['effect[0].model="stvk"'],
        "hinge": ['effect[1].model="hinge"'],
        "faces": ['kinetics.location="face"'],
        "amounts": ['kinetics.measure="amount"'],
        "thickness": ['material.thickness="0.3 + 0.01*x"'],
        "euler": ['time.integrator={ kind = "staggered", method = "euler", step = 0.125 }'],
    }
    for name in [*more, *variants]:
        text = "\n[[effect]]\n" + more[name] if name in more else ""
        sets = [word for change in variants.get(name, []) for word in ("--set", change)]
        path = scene(name, more=text, vertices=300)
        run(0, "run", path, *sets, "--set", "equilibrium.preconditioner=\"factor\"", "--out", OUT / f"{name}-one")
        run(3, "run", path, *sets, "--out", OUT / name)
        compare(OUT / f"{name}-one", OUT / name, 2, 5e-6, f"{name}, 3 ranks")


def closed():
    """A sphere, which nothing holds, with a volume: exact solvers, as rigid motions are free."""
    run(0, "run", scene("sphere-one", SPHERE, preconditioner="factor"), "--out", OUT / "sphere-one")
    run(3, "run", scene("sphere", SPHERE, preconditioner="mumps"), "--out", OUT / "sphere")
    compare(OUT / "sphere-one", OUT / "sphere", 2, 1e-6, "sphere with a volume, 3 ranks")


def lattice():
    """A sheet of which each rank makes its part: start, noise and steps as those of one process; resumed on other ranks."""
    text = DOME.replace('shape = "disc", radius = 10.0', 'shape = "lattice", width = 20.0, height = 14.0')
    text = text.replace("bump =", "imperfection = {{ amplitude = 0.02 }}, bump =")
    text = text.replace("initial = {{ c = 0.0 }}", "initial = {{ c = {{ random = {{ mean = 0.2, amplitude = 0.1 }} }} }}")
    run(0, "run", scene("lattice-one", text, preconditioner="factor"), "--out", OUT / "lattice-one")
    for ranks in [2, 3, 4]:
        run(ranks, "run", scene("lattice", text), "--out", OUT / f"lattice-{ranks}")
        start = [frame(OUT / name, 0)[2]["c"] for name in ["lattice-one", f"lattice-{ranks}"]]
        assert numpy.array_equal(*start), "other noise"
        for number in [0, 2]:
            compare(OUT / "lattice-one", OUT / f"lattice-{ranks}", number, 5e-6, f"lattice, {ranks} ranks")
    run(4, "resume", OUT / "lattice-2", "--until", 0.6)
    run(0, "resume", OUT / "lattice-one", "--until", 0.6)
    compare(OUT / "lattice-one", OUT / "lattice-2", 3, 2e-3, "lattice, resumed on 4 ranks")


def plugin():
    """The law of Model I as a plugin, on the dome, until it buckles at t = 0.12: where depends on the linear solver."""
    law = DOME.replace(DOME[DOME.index("rates ="):DOME.index("[[effect]]")], PLUGIN)
    run(0, "run", scene("plugin-one", law, until=0.1, every=0.05, preconditioner="factor"), "--out", OUT / "plugin-one")
    run(2, "run", scene("plugin", law, until=0.1, every=0.05), "--out", OUT / "plugin")
    compare(OUT / "plugin-one", OUT / "plugin", 2, 5e-6, "Model I by its plugin, 2 ranks")


def from_a_frame():
    """A frame in pieces is a mesh, and the start of another run."""
    path = scene("from", vertices=300)
    run(2, "run", path, "--out", OUT / "from")
    piece = OUT / "from" / "frames" / "frame_000002.pvtu"
    for ranks in [0, 3]:
        out = OUT / f"from-{ranks}"
        run(ranks, "run", path, "--from", piece, "--set", "time.until=0.1", "--set", "output.every=0.1", "--out", out)
    compare(OUT / "from-0", OUT / "from-3", 1, 5e-6, "from a frame in pieces")
    said = run(0, "mesh", "check", piece)
    assert "usable" in said, said
    assert (OUT / "from" / "report.html").is_file()


def resumed():
    path = scene("long", until=1.0, every=0.25)
    run(2, "run", path, "--out", OUT / "whole")
    run(2, "run", path, "--set", "time.until=0.5", "--out", OUT / "half")
    shutil.copytree(OUT / "half", OUT / "half-3")
    shutil.copytree(OUT / "half", OUT / "half-1")
    run(2, "resume", OUT / "half", "--until", 1.0)
    a, b = frame(OUT / "whole", 4), frame(OUT / "half", 4)
    assert numpy.array_equal(a[1], b[1]), "resumed on as many ranks: other bits"
    run(3, "resume", OUT / "half-3", "--until", 1.0)
    compare(OUT / "whole", OUT / "half-3", 4, 2e-3, "2 ranks, resumed on 3")
    run(0, "resume", OUT / "half-1", "--until", 1.0)
    compare(OUT / "whole", OUT / "half-1", 4, 2e-3, "2 ranks, resumed by one process")


def refused():
    said = run(2, "run", scene("fast", policy="chemistry-fast"), "--out", OUT / "no", code=2)
    assert said.count("on more than one rank") == 1, said
    said = run(2, "run", scene("wrong", more="\n[[effect]]\nkind = \"pressur\"\nvalue = 1"), "--out", OUT / "no", code=2)
    assert said.count("did you mean pressure") == 1, said
    said = run(2, "check", scene("check"))
    assert said.count("ready to run") == 1, said
    said = run(2, "check", scene("check-fast", policy="chemistry-fast"), code=2)
    assert said.count("on more than one rank") == 1 and "ready to run" not in said, said
    full = OUT / "full"
    full.mkdir()
    (full / "notes.txt").write_text("not of a run")
    said = run(2, "run", scene("quasi-static"), "--out", full, code=2)
    assert said.count("is not empty") == 1, said
    assert not (OUT / "no").exists()


def killed():
    path = scene("killed", until=200.0, every=0.25, vertices=2000)
    out = OUT / "killed"
    program = subprocess.Popen(
        command(2, "run", str(path), "--out", str(out)),
        env=ENVIRONMENT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )
    deadline = time.time() + PATIENCE
    while len(list(out.glob("checkpoints/*.bin"))) < 2 and time.time() < deadline:
        time.sleep(0.2)
        assert program.poll() is None, program.communicate()[0]
    ranks = subprocess.run(["pgrep", "-P", str(program.pid)], capture_output=True, text=True, check=False).stdout.split()
    assert len(ranks) == 2, ranks
    os.kill(int(ranks[1]), signal.SIGKILL)
    began = time.time()
    said, _ = program.communicate(timeout=60)
    assert program.returncode != 0 and time.time() - began < 30, said
    assert "killed" in said.lower() or "signal 9" in said.lower(), said
    step = int(ledger(out)[-1]["step"])
    run(2, "resume", out, "--until", 3.0)
    assert int(ledger(out)[-1]["step"]) > step or float(ledger(out)[-1]["time"]) == 3.0


TESTS = [
    same_as_one_process, other_linear_solvers, effects, closed, lattice, plugin, from_a_frame, resumed, refused, killed
]
LAUNCHER = "mpirun --oversubscribe"

if __name__ == "__main__":
    RUMPLE, OUT, names = sys.argv[1], pathlib.Path(sys.argv[2]).resolve(), sys.argv[3:]
    shutil.rmtree(OUT, ignore_errors=True)
    OUT.mkdir(parents=True)
    for test in [globals()[name] for name in names] or TESTS:
        print(f"--- {test.__name__.replace('_', ' ')}", flush=True)
        test()
    print("all passed")
