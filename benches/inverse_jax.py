#!/usr/bin/env python3
"""The race of docs/notebook/gradients.md: the growth that makes a flat disc a cap, by Rumple and by a shell written in JAX.

Both have Saint Venant-Kirchhoff triangles and hinges, one mesh, one target, one optimiser (L-BFGS-B of SciPy), and find equilibria to
the same force. The shell in JAX: element Hessians by automatic differentiation, Newton's method with SuperLU, one adjoint solution.

usage: inverse_jax.py [VERTICES [ITERATIONS [REPEATS]]]; wants rumple, jax, scipy
"""

import statistics
import sys
import tempfile
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import rumple
import scipy

jax.config.update("jax_enable_x64", True)
YOUNG, POISSON, THICKNESS, CURVATURE, TOLERANCE = 1e3, 1 / 3, 0.5, 0.02, 1e-8
Y = YOUNG * THICKNESS / (1 - POISSON**2)
B = Y * THICKNESS**2 / 12


def scene(vertices: int) -> rumple.Scene:
    return rumple.scene(
        sheet={"shape": "disc", "radius": 10.0, "vertices": vertices},
        material={"young": YOUNG, "poisson": POISSON, "thickness": THICKNESS},
        effect=[
            {"kind": "stretching", "model": "stvk"},
            {"kind": "bending", "model": "hinge", "curvature": CURVATURE},
            {"kind": "growth", "factor": 1.0},
        ],
        equilibrium={"tolerance": TOLERANCE},
        time={"until": 1.0},
    )


def cap(points: np.ndarray) -> np.ndarray:
    radius, r = 15.0, np.hypot(points[:, 0], points[:, 1])
    tilt = 2 * np.arctan(r / (2 * radius))
    across = radius * np.sinc(tilt / np.pi) * tilt / np.maximum(r, 1e-300)
    return np.column_stack([points[:, 0] * across, points[:, 1] * across, radius * np.cos(tilt)])


def metric(squares):
    """The first fundamental form of a triangle from the squared lengths of its edges 01, 12, 20."""
    a, b, c = squares
    return jnp.array([[a, 0.5 * (a + c - b)], [0.5 * (a + c - b), c]])


def grown(growth, rest):
    """The metric of a triangle whose edges grow by the means of their ends, and its area."""
    ends = [(0, 1), (1, 2), (2, 0)]
    best = metric([jnp.sum((rest[i] - rest[j]) ** 2) * (0.5 * (growth[i] + growth[j])) ** 2 for i, j in ends])
    return best, 0.5 * jnp.sqrt(best[0, 0] * best[1, 1] - best[0, 1] ** 2)


def triangle(x, growth, rest):
    now = metric([jnp.sum((x[i] - x[j]) ** 2) for i, j in [(0, 1), (1, 2), (2, 0)]])
    best, area = grown(growth, rest)
    strain = 0.5 * (jnp.linalg.inv(best) @ now - jnp.eye(2))
    return 0.5 * area * Y / (1 - POISSON**2) * ((1 - POISSON) * jnp.trace(strain @ strain) + POISSON * jnp.trace(strain) ** 2)


def hinge(x, growth, rest):
    """Vertices 0 and 1 of the edge, 2 on its left, 3 on its right."""
    left, right, edge = jnp.cross(x[1] - x[0], x[2] - x[0]), jnp.cross(x[3] - x[0], x[1] - x[0]), x[1] - x[0]
    angle = jnp.arctan2(jnp.dot(jnp.cross(left, right), edge) / jnp.linalg.norm(edge), jnp.dot(left, right))
    area = sum(grown(growth[part], rest[part])[1] for part in (jnp.array([0, 1, 2]), jnp.array([0, 1, 3])))
    square = jnp.sum((rest[1] - rest[0]) ** 2) * (0.5 * (growth[0] + growth[1])) ** 2
    return 0.5 * B * square / area * (2 * jnp.tan(0.5 * angle) - CURVATURE * area / jnp.sqrt(square)) ** 2


class Shell:
    def __init__(self, rest, triangles):
        self.rest, self.triangles, self.size = rest, triangles, rest.size
        sides = {(t[i], t[i - 2]): t[i - 1] for t in triangles.tolist() for i in range(3)}
        self.hinges = np.array([[i, j, k, sides[j, i]] for (i, j), k in sides.items() if i < j and (j, i) in sides])
        edge = np.linalg.norm(rest[triangles] - rest[np.roll(triangles, 1, axis=1)], axis=2).mean()
        self.limit, self.x = TOLERANCE * Y * edge, rest.copy()
        t, h = self.triangles, self.hinges
        energy = lambda x, g: jax.vmap(triangle)(x[t], g[t], rest[t]).sum() + jax.vmap(hinge)(x[h], g[h], rest[h]).sum()
        self.energy = jax.jit(jax.value_and_grad(energy))
        self.blocks = jax.jit(lambda x, g: (jax.vmap(jax.hessian(triangle))(x[t], g[t], rest[t]), jax.vmap(jax.hessian(hinge))(x[h], g[h], rest[h])))
        self.mixed = jax.jit(lambda x, g, v: jax.grad(lambda g: jnp.vdot(jax.grad(energy)(x, g), v))(g))
        dofs = [(3 * part[:, :, None] + np.arange(3)).reshape(len(part), -1) for part in (t, h)]
        self.rows = np.concatenate([np.repeat(d, d.shape[1], axis=1).ravel() for d in dofs])
        self.columns = np.concatenate([np.tile(d, (1, d.shape[1])).ravel() for d in dofs])

    def factor(self, x, g, shift):
        values = np.concatenate([np.asarray(part).ravel() for part in self.blocks(x, g)])
        matrix = scipy.sparse.csc_matrix((values, (self.rows, self.columns)), shape=(self.size,) * 2)
        return scipy.sparse.linalg.splu(matrix + shift * scipy.sparse.identity(self.size, format="csc"), "MMD_AT_PLUS_A", options={"SymmetricMode": True})

    def equilibrium(self, g):
        """Newton's method, shifted where its step does not go downhill."""
        x, shift = self.x, 1e-9 * Y
        value, slope = self.energy(x, g)
        for _ in range(300):
            if np.abs(slope).max() < self.limit:
                break
            step = -self.factor(x, g, shift).solve(np.asarray(slope).ravel()).reshape(-1, 3)
            length = min(1.0, 0.5 / np.abs(step).max())
            new_value, new_slope = self.energy(x + length * step, g)
            if np.vdot(step, slope) < 0 and new_value < value + 1e-12 * abs(value):
                x, value, slope, shift = x + length * step, new_value, new_slope, max(shift / 10, 1e-9 * Y)
            else:
                shift = max(10 * shift, 1e-4 * Y)
        else:
            raise RuntimeError("no equilibrium")
        self.x = x
        return x

    def objective(self, g, target, area):
        x = self.equilibrium(g)
        a, b = x - x.mean(0), target - target.mean(0)
        u, _, v = np.linalg.svd(b.T @ a)
        turn = u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v
        apart = a - b @ turn
        adjoint = self.factor(x, g, 1e-9 * Y).solve((area / len(x) * apart).ravel()).reshape(-1, 3)
        return area / (2 * len(x)) * (apart**2).sum(), -np.asarray(self.mixed(x, g, adjoint))


def compare(shell, vertices, file, sheet):
    """What the shell in JAX says of an equilibrium of Rumple."""
    points, target, area = sheet
    objective = rumple.Objective(scene(vertices), f"shape({file})", fields=["effect.growth.factor"], at_start=True)
    growth = 1 + 0.01 * np.sin(points[:, 0])
    value, gradient = objective(growth)
    spent = []
    for scale in np.linspace(1, 0.9, 8):
        began, at = time.process_time(), 1 + scale * (growth - 1)
        objective.value(at)
        between = time.process_time()
        objective.gradient(at)
        spent.append((between - began, time.process_time() - between))
    print("Rumple: %.3f s a value, %.3f s a gradient" % tuple(np.median(spent, axis=0)), flush=True)
    shell.x = np.asarray(objective.positions(growth))
    force = np.abs(shell.energy(shell.x, growth)[1]).max()
    other, other_gradient = shell.objective(growth, target, area)
    apart = np.abs(gradient - other_gradient).max() / np.abs(gradient).max()
    print(f"largest force in an equilibrium of Rumple {force:.1e} (limit {shell.limit:.1e}), J apart by {abs(other / value - 1):.1e}, gradients by {apart:.1e}", flush=True)


def main(vertices=2000, iterations=40, repeats=3):
    sim = rumple.Simulation(scene(vertices))
    points, target, area = sim.rest_positions, cap(sim.rest_positions), sim.area
    file = Path(tempfile.mkdtemp()) / "cap.obj"
    lines = ["v %.17g %.17g %.17g" % tuple(p) for p in target] + ["f %d %d %d" % tuple(t + 1) for t in sim.triangles]
    file.write_text("\n".join(lines) + "\n")
    shell = Shell(points, sim.triangles)
    shell.objective(np.ones(len(points)), target, area)  # compiles
    compare(shell, vertices, file, (points, target, area))

    for name in ["rumple", "jax"]:
        spent, ends = [], []
        for _ in range(repeats):
            began, shell.x = time.process_time(), points.copy()
            objective = lambda g: shell.objective(g, target, area)
            if name == "rumple":
                objective = rumple.Objective(scene(vertices), f"shape({file})", fields=["effect.growth.factor"], at_start=True)
            scaled = lambda u: (lambda value, slope: (value, 0.01 * slope))(*objective(1 + 0.01 * u))
            found = scipy.optimize.minimize(scaled, np.zeros(len(points)), jac=True, method="L-BFGS-B", options={"maxiter": iterations, "ftol": 0, "gtol": 1e-12})
            spent.append(time.process_time() - began)
            ends.append(np.sqrt(2 * found.fun / area) / np.ptp(target[:, 2]))
        print(f"{name}: {statistics.median(spent):.1f} s of processor time, {found.nfev} evaluations, distance {statistics.median(ends):.2e} of the height", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
