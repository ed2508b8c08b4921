"""A spherical shell pressed between two rigid plates, by shell theory: force against approach.

    benches/pressed_sphere.py [--ratio 50] [--poisson 0.3] [--depths 0.25 0.5 1 1.5 2 2.2 2.4]

Reissner's equations of finite rotations for a shell of revolution, strains small, without transverse shear (Proc. Symp. Appl.
Math. 3 (1950) 27). Of a meridian, s its arc at rest from the pole, r₀ = sin s, angle φ against the plate, R = E = 1:

    r' = (1+ε) cos φ,  z' = -(1+ε) sin φ,  φ' = 1 + κ
    (r₀H)' = N_θ,  r₀V = F/2π,  (r₀M)' = M_θ cos φ + r₀ (1+ε) (H sin φ + V cos φ),  N = H cos φ - V sin φ
    N = C (ε + ν ε_θ),  M = D (κ + ν κ_θ),  ε_θ = r/r₀ - 1,  κ_θ = (sin φ - sin s)/r₀, and N_θ, M_θ alike

Where the shell lies on the plate, s < a, φ = 0: it is pushed at the edge of the contact, over which M is continuous. φ = π/2 and
H = 0 at the equator. a and F are unknown, the approach of a plate to the equator is given. Solved by scipy (solve_bvp).
Prints F/(k δ), k = 4 E h²/(R √(3(1-ν²))): the constants of `examples/known_answers/squeezed.rs`; and whether the disc on the plate, which
is compressed, stays flat: whether g, g'' + g'/r - g/r² = (N/D) g with g(0) = 0, has no zero up to its edge.
"""

import argparse

import numpy as np
from scipy.integrate import solve_bvp, solve_ivp

EQUATOR = np.pi / 2
TOLERANCE = 1e-7


class Shell:
    """A shell of thickness h and Poisson's ratio, R = E = 1."""

    def __init__(self, thickness: float, poisson: float) -> None:
        self.h, self.nu = thickness, poisson
        self.stretching = thickness / (1 - poisson**2)
        self.bending = self.stretching * thickness**2 / 12
        self.length = np.sqrt(thickness / np.sqrt(12 * (1 - poisson**2)))

    def slopes(self, t: np.ndarray, y: np.ndarray, unknown: np.ndarray) -> np.ndarray:
        """Of r and H on the plate, s = a t, and of r, z, φ, M and H beyond it, s = a + (π/2 - a) t."""
        flat_r, flat_h, r, z, phi, moment, h = y
        load, a = unknown
        nu, pole = self.nu, t == 0
        r0 = np.where(pole, 1.0, np.sin(a * t))
        # At the pole both strains are the same, and H and r grow with it.
        hoop = np.where(pole, flat_h / self.stretching / (1 + nu), flat_r / r0 - 1)
        along = flat_h / self.stretching - nu * hoop
        force = self.stretching * (hoop + nu * along)
        flat = [1 + along, np.where(pole, 0.0, (force - np.cos(a * t) * flat_h) / r0)]
        span = EQUATOR - a
        s = a + span * t
        r0, v = np.sin(s), load / np.sin(s)
        hoop = r / r0 - 1
        along = (h * np.cos(phi) - v * np.sin(phi)) / self.stretching - nu * hoop
        force = self.stretching * (hoop + nu * along)
        bend_hoop = np.sin(phi) / r0 - 1
        bend = moment / self.bending - nu * bend_hoop
        other = self.bending * (bend_hoop + nu * bend)
        turned = other * np.cos(phi) + r0 * (1 + along) * (h * np.sin(phi) + v * np.cos(phi))
        free = [
            (1 + along) * np.cos(phi),
            -(1 + along) * np.sin(phi),
            1 + bend,
            (turned - np.cos(s) * moment) / r0,
            (force - np.cos(s) * h) / r0,
        ]
        return np.array([a * f for f in flat] + [span * f for f in free])

    def misses(self, approach: float, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """What is not met at the pole and the edge of the contact (`start` and `end` of it), and at the equator."""
        flat_moment = -self.bending * (1 + self.nu)
        joined = [end[0] - start[2], (end[1] - start[6]) / self.h]
        edge = [start[3] - (1 - approach), start[4], (start[5] - flat_moment) / self.bending]
        return np.array([start[0], *joined, *edge, end[3], end[4] - EQUATOR, end[6] / self.h])

    def stays_flat(self, a: float, solution) -> bool:
        """Whether the disc on the plate is stable against turning inwards."""

        def slopes(r: float, g: np.ndarray) -> list[float]:
            force = np.interp(r / a, solution.x, solution.y[1])
            return [g[1], force / self.bending * g[0] - g[1] / r + g[0] / r**2]

        return bool(solve_ivp(slopes, [1e-3 * a, a], [1e-3 * a, 1.0], rtol=1e-8).y[0][-1] > 0)

    def pressed(self, depths: list[float]) -> list[tuple[float, float, bool]]:
        """a/ℓ, F/(k δ) and whether the disc stays flat at these approaches, in units of the thickness, ascending."""
        a = 0.3 * self.length
        t = np.linspace(0, 1, 400) ** 1.5
        s = a + (EQUATOR - a) * t
        near = np.exp(-(s - a) / self.length)
        moment = -self.bending * (1 + self.nu) * near
        y = np.array([a * t, 0 * t, np.sin(s), np.cos(s), s - a * near, moment, 0 * t])
        unknown, found = [0.1 * self.h**3, a], []
        stiffness = 4 * self.h**2 / np.sqrt(3 * (1 - self.nu**2))
        for depth in depths:
            approach = depth * self.h
            solution = solve_bvp(
                self.slopes, lambda p, q, _, d=approach: self.misses(d, p, q), t, y, p=unknown, tol=TOLERANCE, max_nodes=50_000
            )
            if solution.status:
                raise SystemExit(f"no solution at {depth} h: {solution.message}")
            t, y, unknown = solution.x, solution.y, solution.p
            force = 2 * np.pi * unknown[0]
            ratio = force / (stiffness * approach)
            found.append((unknown[1] / self.length, ratio, self.stays_flat(unknown[1], solution)))
        return found


def main() -> None:
    """Reads the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ratio", type=float, default=50.0, help="R/h")
    parser.add_argument("--poisson", type=float, default=0.3)
    parser.add_argument("--depths", type=float, nargs="+", default=[0.25, 0.5, 1.0, 1.5, 2.0, 2.2, 2.4])
    given = parser.parse_args()
    print("| approach / h | a / ℓ | F / (k δ) | flat |\n| --- | --- | --- | --- |")
    shell = Shell(1 / given.ratio, given.poisson)
    for depth, (edge, ratio, flat) in zip(given.depths, shell.pressed(given.depths), strict=True):
        print(f"| {depth} | {edge:.3f} | {ratio:.4f} | {'yes' if flat else 'no'} |")


if __name__ == "__main__":
    main()
