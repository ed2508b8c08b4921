"""sheet_peer.py RELAXATION SHARE FORCE H UNTIL EVERY MESH START LIBRARY STATES: Model I without diffusion on a sheet in
equilibrium at every time, by explicit Euler and another program's relaxations, after every step.

RELAXATION  blmvm (PETSc TAO, warm-started) or descent (of the paper, with analytic forces)
SHARE       the step as a share of UNTIL
FORCE       largest force on a vertex that counts as equilibrium, of Y x mean edge
H           thickness
MESH        .obj of the sheet at rest
START       states of a run of the same scene (`study::states`): it begins at the first
LIBRARY     folder with sheet.py and, beside it, seed/libsheet.so: the energy as printed, in C, with its gradient

Prints a line: seconds steps evaluations factorisations. Writes the states as `cvode.c` does.
"""
import os

os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"
import collections
import struct
import sys
import tempfile
import time

import numpy as np

(relaxation, share, force, thickness, until, every, mesh, start, library, states) = sys.argv[1:]
share, force, thickness, until, every = map(float, (share, force, thickness, until, every))
sys.path.insert(0, library)
from sheet import Sheet  # noqa: E402

# Longest processor time, s.
PATIENCE = 900.0
# The most that a descent's step may raise the energy by, and what its step size is at most, of 2/largest stiffness.
RISE, LARGEST = 0.02, 0.75



def text(path):
    """What the library reads: "vertices triangles", then "x y boundary", then triangles."""
    lines = [line.split() for line in open(path)]
    points = [line[1:3] for line in lines if line[:1] == ["v"]]
    faces = [[int(corner.split("/")[0]) - 1 for corner in line[1:4]] for line in lines if line[:1] == ["f"]]
    sides = collections.Counter(frozenset((f[k], f[k - 1])) for f in faces for k in range(3))
    rim = {vertex for side, count in sides.items() if count == 1 for vertex in side}
    file = tempfile.NamedTemporaryFile("w", suffix=".txt")
    print(len(points), len(faces), file=file)
    for number, (a, b) in enumerate(points):
        print(a, b, int(number in rim), file=file)
    for face in faces:
        print(*face, file=file)
    file.flush()
    return file


with text(mesh) as file:
    sheet = Sheet(file.name, h=thickness)
triangles, edges = sheet.tri.reshape(-1, 3), sheet.edge.reshape(-1, 2)
with open(start, "rb") as file:
    assert file.read(16) == b"rumple states 1\n"
    _, _, vertices, species, faces = struct.unpack("<d4Q", file.read(40))
    if (vertices, species, faces) != (sheet.N, 1, sheet.T):
        sys.exit(f"{start}: {vertices} vertices, {species} species, {faces} faces; the mesh has {sheet.N}, {sheet.T}")
    x = np.frombuffer(file.read(24 * vertices)).copy()
    c = np.frombuffer(file.read(8 * faces)).copy()
largest = force * sheet.Y * sheet.l0.mean()
evaluations, left = 0, np.inf


def gradient(x):
    """Energy, gradient; the largest force is kept."""
    global evaluations, left
    evaluations += 1
    energy, found = sheet.fg(x)
    left = np.sqrt((found.reshape(-1, 3) ** 2).sum(axis=1).max())
    return energy, found


def grow():
    """Species from faces to vertices, by the inverse distance in the present shape; from these to optimal lengths."""
    p = x.reshape(-1, 3)
    weight = 1 / np.linalg.norm(p[triangles].mean(axis=1)[:, None, :] - p[triangles], axis=2)
    corners = triangles.ravel()
    total = np.bincount(corners, weight.ravel(), minlength=sheet.N)
    at = np.bincount(corners, (weight * c[:, None]).ravel(), minlength=sheet.N) / total
    steep = np.exp(100 * (np.minimum(at[edges].mean(axis=1), 2) - 0.1))
    sheet.lb[:] = sheet.l0 * (1 + steep) / (1 + 0.65 * steep)


def blmvm():
    """A relaxation by TAO from x; its memory is cleared."""
    global x
    tao.setSolution(vector)
    tao.solve()
    x = vector.array.copy()
    if tao.getConvergedReason() < 0:
        raise RuntimeError(f"TAO stopped with reason {tao.getConvergedReason()}")


def descent():
    """The paper's: x -= a g, where a is halved if the energy rises by more than RISE, and grows slowly."""
    global x, length, since
    energy = sheet.f(x)
    while True:
        _, down = gradient(x)
        if left < largest:
            return
        while True:
            tried = x - length * down
            after = sheet.f(tried)
            if after <= energy * (1 + RISE) or length < 1e-14:
                break
            length, since = 0.5 * length, 0
        x, energy, since = tried, after, since + 1
        if since >= 20:
            length, since = min(1.05 * length, bound), 0
        if time.process_time() - begin > PATIENCE:
            raise RuntimeError(f"not done after {PATIENCE:g} s")


def stiffness():
    """Largest eigenvalue of the Hessian, by power iteration on differences of gradients."""
    direction, base, value = np.random.default_rng(1).uniform(-1, 1, x.size), sheet.fg(x)[1], 1.0
    for _ in range(40):
        direction /= np.linalg.norm(direction)
        direction = (sheet.fg(x + 1e-5 * direction)[1] - base) / 1e-5
        value = np.linalg.norm(direction)
    return value


grow()
if relaxation == "blmvm":
    import petsc4py

    petsc4py.init(["x"])
    from petsc4py import PETSc

    vector = PETSc.Vec().createWithArray(x.copy())

    def objective(_, at, out):
        energy, found = gradient(at.getArray(readonly=1))
        out.setArray(found)
        return energy

    def monitor(tao):
        if left < largest:
            tao.setConvergedReason(PETSc.TAO.Reason.CONVERGED_USER)

    tao = PETSc.TAO().create()
    tao.setType("blmvm")
    tao.setObjectiveGradient(objective, vector.duplicate())
    tao.setTolerances(gatol=0, grtol=0, gttol=0)
    tao.setMaximumIterations(100_000)
    tao.setMaximumFunctionEvaluations(10**8)
    tao.setMonitor(monitor)
    relax = blmvm
elif relaxation == "descent":
    bound = 2 * LARGEST / stiffness()
    length, since, relax = 0.5 * bound, 0, descent
else:
    sys.exit(f"no relaxation `{relaxation}`: blmvm, descent")

outputs = np.unique(np.append(np.arange(0.0, until, every), until))
begin = time.process_time()
relax()
evaluations, begin, taken, steps = 0, time.process_time(), 0.0, 0
with open(states, "wb") as file:
    file.write(b"rumple states 1\n")
    for before, when in zip(np.append(0.0, outputs), outputs):
        count = int(np.ceil((when - before) / (share * until) - 1e-9))
        for _ in range(count):
            curvature = sheet.H(x)[triangles].mean(axis=1)
            upward = np.maximum(curvature, 0)
            c += (when - before) / count * (15 * upward / (1 + upward / 0.05) - c)
            grow()
            relax()
            steps += 1
            if time.process_time() - begin > PATIENCE:
                sys.exit(f"not done after {PATIENCE:g} s")
        taken = time.process_time() - begin
        file.write(struct.pack("<d4Q", when, steps, sheet.N, 1, sheet.T) + x.tobytes() + c.tobytes())
print(taken, steps, evaluations, 0)
