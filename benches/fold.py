"""A strip folded until its flanks touch: Rumple beside Newton's method with the contact of ipctk (Li et al. 2020).

    benches/fold.py PROGRAM [--cells 40] [--steps 20] [--closed 5.3]

Both fold the same mesh by bonds and hinges, quasi-statically: its clamped ends come together until the fold closes at the neck. The
driver takes distances, barrier, derivatives and free steps from ipctk (area-weighted, improved maximum) and solves
with scipy; its Hessian is the positive part. Prints energies of elasticity at the end, the smallest gap, iterations and CPU seconds,
for `docs/notebook/contact.md`. Needs ipctk, numpy and scipy. One thread.
"""

import argparse
import csv
import json
import os
import resource
import subprocess
import tempfile
import time
from pathlib import Path

import ipctk
import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

LENGTH, WIDTH, HALF = 12.0, 1.5, 5.5
YOUNG, POISSON, THICKNESS = 1e3, 1 / 3, 0.2
STRETCHING = YOUNG * THICKNESS / (1 - POISSON**2)
BENDING = YOUNG * THICKNESS**3 / (12 * (1 - POISSON**2))


def lattice(cells: int) -> tuple[np.ndarray, np.ndarray]:
    """A rectangle of nearly equilateral triangles, rows shifted in turn."""
    edge = LENGTH / cells
    rows = 2 * max(1, round(WIDTH / (np.sqrt(3) * edge)))
    x, triangles, first = [], [], []
    for row in range(rows + 1):
        first.append(len(x))
        inner = np.arange(cells + 1) if row % 2 == 0 else np.r_[0, np.arange(cells) + 0.5, cells]
        x += [(edge * s - LENGTH / 2, WIDTH * (row / rows - 0.5), 0.0) for s in inner]
    for row in range(rows):
        a, b = first[row], first[row + 1]
        even, odd = (a, b) if row % 2 == 0 else (b, a)
        for k in range(cells):
            triangles.append([even + k, even + k + 1, odd + k + 1])
        for k in range(cells + 1):
            triangles.append([odd + k, even + k, odd + k + 1])
        if row % 2 == 1:
            triangles[-2 * cells - 1 :] = [t[::-1] for t in triangles[-2 * cells - 1 :]]
    x, triangles = np.array(x), np.array(triangles)
    normal = np.cross(x[triangles[:, 1]] - x[triangles[:, 0]], x[triangles[:, 2]] - x[triangles[:, 0]])
    triangles[normal[:, 2] < 0] = triangles[normal[:, 2] < 0][:, ::-1]
    return x, triangles


class Elastic:
    """Bonds and hinges of the theory page, with the positive part of second derivatives."""

    def __init__(self, rest: np.ndarray, triangles: np.ndarray):
        sides = {}
        for t, corners in enumerate(triangles):
            for k in range(3):
                a, b, c = (int(corners[(k + j) % 3]) for j in range(3))
                sides.setdefault((min(a, b), max(a, b)), []).append((t, c, a < b))
        area = np.linalg.norm(np.cross(rest[triangles[:, 1]] - rest[triangles[:, 0]], rest[triangles[:, 2]] - rest[triangles[:, 0]]), axis=1) / 2
        self.edges = np.array(list(sides))
        self.length = np.linalg.norm(rest[self.edges[:, 1]] - rest[self.edges[:, 0]], axis=1)
        around = np.array([sum(area[t] for t, _, _ in near) for near in sides.values()])
        self.bond = STRETCHING * around / self.length**2
        inner = [k for k, near in enumerate(sides.values()) if len(near) == 2]
        hinges = []
        for (a, b), near in sides.items():
            if len(near) == 2:
                left, right = sorted(near, key=lambda of: not of[2])
                hinges.append([a, b, left[1], right[1]])
        self.hinges = np.array(hinges)
        self.hinge = BENDING * self.length[inner] ** 2 / around[inner]

    def bonds_at(self, x):
        along = x[self.edges[:, 1]] - x[self.edges[:, 0]]
        length = np.linalg.norm(along, axis=1)
        return along / length[:, None], length

    def energy(self, x: np.ndarray) -> float:
        _, length = self.bonds_at(x)
        psi, _ = self.angles(x)
        return 0.5 * np.sum(self.bond * (length - self.length) ** 2) + 0.5 * np.sum(self.hinge * psi**2)

    def angles(self, x):
        """ψ = 2 tan(θ/2) with the derivatives of θ by the four vertices."""
        x0, x1, x2, x3 = (x[self.hinges[:, k]] for k in range(4))
        e = x1 - x0
        length = np.linalg.norm(e, axis=1)
        dot = lambda a, b: np.sum(a * b, axis=1)
        first, second = np.cross(e, x2 - x0), np.cross(-e, x3 - x1)
        sizes = np.linalg.norm(first, axis=1), np.linalg.norm(second, axis=1)
        tangent = -length * dot(first, x3 - x0) / (sizes[0] * sizes[1] + dot(first, second))
        by = np.zeros((len(e), 4, 3))
        for (p, q, r, start, end, top, sign), normal, size in zip(
            [(0, 1, 2, x0, x1, x2, 1), (1, 0, 3, x1, x0, x3, 1)], (first, second), sizes
        ):
            m = normal / size[:, None] ** 2
            along = (end - start) / length[:, None]
            a, b = dot(top - start, along), dot(end - top, along)
            by[:, p] += b[:, None] * m
            by[:, q] += a[:, None] * m
            by[:, r] -= length[:, None] * m
        return 2 * tangent, by

    def derivatives(self, x: np.ndarray) -> tuple[np.ndarray, sp.csc_matrix]:
        """Gradient, and the positive part of the Hessian."""
        n, length = self.bonds_at(x)
        tension = self.bond * (length - self.length)
        gradient = np.zeros_like(x)
        np.add.at(gradient, self.edges[:, 1], tension[:, None] * n)
        np.add.at(gradient, self.edges[:, 0], -tension[:, None] * n)
        across = np.eye(3) - n[:, :, None] * n[:, None, :]
        stretch = np.maximum(tension / length, 0)[:, None, None] * across + self.bond[:, None, None] * n[:, :, None] * n[:, None, :]
        psi, by = self.angles(x)
        c = 1 + psi**2 / 4
        force = self.hinge * psi * c
        np.add.at(gradient, self.hinges, force[:, None, None] * by)
        stiffness = self.hinge * (c * c + psi * psi * c / 2)
        flat = by.reshape(len(by), 12)
        bend = stiffness[:, None, None] * flat[:, :, None] * flat[:, None, :]
        sign = np.array([[1, -1], [-1, 1]])
        bonds = np.einsum("pq,eab->epaqb", sign, stretch).reshape(-1, 6, 6)
        matrix = assembled(self.edges, bonds, x.size) + assembled(self.hinges, bend, x.size)
        return gradient, matrix


def assembled(vertices: np.ndarray, blocks: np.ndarray, size: int) -> sp.csc_matrix:
    places = (3 * vertices[:, :, None] + np.arange(3)).reshape(len(vertices), -1)
    rows = np.repeat(places, places.shape[1], axis=1)
    columns = np.tile(places, (1, places.shape[1]))
    return sp.csc_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))


class Peer:
    """Newton's method with the barrier of ipctk."""

    def __init__(self, rest, triangles, stiffness, reach):
        self.reach = reach
        self.elastic = Elastic(rest, triangles)
        self.mesh = ipctk.CollisionMesh(rest, ipctk.edges(triangles), triangles)
        self.potential = ipctk.BarrierPotential(reach, stiffness * YOUNG, True)
        self.iterations = 0

    def near(self, x):
        found = ipctk.NormalCollisions()
        found.use_area_weighting = True
        found.collision_set_type = ipctk.NormalCollisions.CollisionSetType.IMPROVED_MAX_APPROX
        found.build(self.mesh, x, self.reach)
        return found

    def energy(self, x):
        return self.elastic.energy(x) + self.potential(self.near(x), self.mesh, x)

    def relax(self, x, free, tolerance):
        """Until no component of the force on a free vertex is above `tolerance`."""
        free = np.repeat(free, 3)
        for _ in range(500):
            near = self.near(x)
            gradient, matrix = self.elastic.derivatives(x)
            gradient = gradient.ravel() + self.potential.gradient(near, self.mesh, x)
            if np.abs(gradient[free]).max() < tolerance:
                return x
            self.iterations += 1
            matrix = matrix + self.potential.hessian(near, self.mesh, x, ipctk.PSDProjectionMethod.CLAMP)
            matrix = matrix[free][:, free] + 1e-9 * STRETCHING * sp.identity(free.sum())
            step = np.zeros(x.size)
            step[free] = spsolve(matrix.tocsc(), -gradient[free])
            x = self.searched(x, step.reshape(x.shape), gradient @ step)
        raise RuntimeError("500 iterations of Newton's method were not enough")

    def searched(self, x, step, slope):
        share = min(1.0, 0.9 * ipctk.compute_collision_free_stepsize(self.mesh, x, x + step))
        before = self.energy(x)
        round_off = 1e-12 * abs(before)
        while share > 1e-10:
            if self.energy(x + share * step) <= before + 1e-4 * share * slope + round_off:
                break
            share /= 2
        return x + share * step

    def folded(self, rest, given, tolerance):
        steps = given.steps
        ends = np.sign(rest[:, 0]) * (np.abs(rest[:, 0]) >= HALF)
        x = rest.copy()
        x[:, 2] += 1e-2 * np.cos(np.pi * rest[:, 0] / LENGTH) * (ends == 0)
        for step in range(steps + 1):
            t = step / steps
            # No end moves through anything: the strip follows by its own affine motion.
            goal = rest[:, 0] - ends * given.closed * t
            before = rest[:, 0] - ends * given.closed * (max(step - 1, 0) / steps)
            squeeze = np.interp(rest[:, 0], [-HALF, HALF], [1, -1]) * given.closed / steps * (step > 0)
            moved = x.copy()
            moved[:, 0] += np.where(ends != 0, goal - before, squeeze)
            if ipctk.compute_collision_free_stepsize(self.mesh, x, moved) < 1.0:
                moved = x.copy()
                moved[:, 0] += np.where(ends != 0, goal - before, 0.0)
            x = self.relax(moved, ends == 0, tolerance)
        near = self.near(x)
        gap = np.sqrt(near.compute_minimum_distance(self.mesh, x)) if len(near) else np.inf
        return x, gap, len(near)


SCENE = """
[sheet]
file = "strip.obj"
imperfection = {{ amplitude = 1e-2, seed = 1 }}

[material]
young = {young}
poisson = {poisson}
thickness = {thickness}

[time]
until = 1.0
integrator = {{ kind = "staggered", method = "euler", step = {step} }}

[[effect]]
kind = "stretching"

[[effect]]
kind = "bending"
model = "hinge"

[[effect]]
kind = "contact"
distance = {reach}
stiffness = {stiffness}
"""
PIN = """
[[effect]]
kind = "pin"
axes = "xyz"
where = {{ half-space = {{ point = [{at}, 0, 0], normal = [{side}, 0, 0] }} }}
displacement = [{by}, 0, 0]
ramp = {{ points = [[0, 0], [1, 1]] }}
"""


def rumple(program: str, folder: Path, rest, triangles, given) -> dict:
    """The same by Rumple."""
    lines = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in rest]
    lines += ["f " + " ".join(str(v + 1) for v in t) for t in triangles]
    (folder / "strip.obj").write_text("\n".join(lines) + "\n")
    text = SCENE.format(
        young=YOUNG, poisson=POISSON, thickness=THICKNESS, reach=given.reach, step=1 / given.steps, stiffness=given.barrier * YOUNG
    )
    # Vertices at the limit itself are held.
    for side in (1, -1):
        text += PIN.format(at=side * (HALF - 1e-9), side=float(side), by=-side * given.closed)
    (folder / "strip.toml").write_text(text)
    out = folder / "out"
    used = lambda: resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    start = used()
    subprocess.run(
        [program, "run", str(folder / "strip.toml"), "--out", str(out), "--force", "--quiet"],
        check=True,
        env=os.environ | {"RAYON_NUM_THREADS": "1"},
    )
    with (out / "ledger.csv").open() as rows:
        row = list(csv.DictReader(rows))[-1]
    return json.loads((out / "costs.json").read_text()) | {"row": row, "seconds": used() - start}


def main() -> None:
    """Reads the command line, prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--cells", type=int, default=40)
    parser.add_argument("--steps", type=int, default=20)
    parser.add_argument("--closed", type=float, default=5.3, help="how far each end moves: 4 leaves the fold open")
    parser.add_argument("--barrier", type=float, default=0.1, help="stiffness of barriers in units of Young's modulus")
    parser.add_argument("--reach", type=float, default=0.05, help="of barriers, at most the thickness")
    parser.add_argument("--tolerance", type=float, default=1e-6, help="of forces, in units of the force at unit strain")
    given = parser.parse_args()
    ipctk.set_num_threads(1)
    rest, triangles = lattice(given.cells)
    print(f"{len(rest)} vertices, {given.steps} steps\n| | elastic energy | gap | pairs | iterations | CPU s |\n| --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        costs = rumple(given.program, Path(folder), rest, triangles, given)
    row = costs["row"]
    elastic = sum(float(row[f"energy of {name} [energy]"]) for name in ("stretching", "bending"))
    print(
        f"| Rumple | {elastic:.8f} | {float(row['gap of contact [length]'] or 'inf'):.5f} | {row['pairs of contact']} "
        f"| {costs['work']['iterations']} | {costs['seconds']:.1f} |",
        flush=True,
    )
    start = time.process_time()
    peer = Peer(rest, triangles, given.barrier, given.reach)
    x, gap, pairs = peer.folded(rest, given, given.tolerance * STRETCHING * LENGTH / given.cells)
    seconds = time.process_time() - start
    print(f"| ipctk | {peer.elastic.energy(x):.8f} | {gap:.5f} | {pairs} | {peer.iterations} | {seconds:.1f} |")


if __name__ == "__main__":
    main()
