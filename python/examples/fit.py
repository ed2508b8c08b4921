"""Recovers a diffusion coefficient from noisy observations of a species.

    dc/dt = D Δc - k c        on a disc, with a known k and no flux through the boundary

Synthetic data are the values of c at 150 vertices at four times, with D = 0.35 and Gaussian noise of 0.5 % of the
largest start. `scipy.optimize.least_squares` varies log D from D = 1; every evaluation is a simulation. The standard error
that this noise leaves, from the Jacobian at the minimum, is 0.8 % of D; the result has to lie within 3 %.

usage: python fit.py
"""

import numpy
from scipy.optimize import least_squares

import rumple

SCENE = """
sheet = { shape = "disc", radius = 5.0, vertices = 300 }
effect = [{ kind = "diffusion", species = "c", coefficient = 1.0 }]
kinetics = { rates = { c = "-k*c" }, parameters = { k = 0.2 } }
time = { until = 2.0, integrator = { kind = "monolithic", rtol = 1e-7, atol = 1e-9 } }
"""
TIMES = [0.5, 1.0, 1.5, 2.0]
TRUE = 0.35
NOISE = 0.005
TOLERANCE = 0.03


def observed(coefficient, watched):
    """Values of c at the vertices `watched` at all times, for a diffusion coefficient."""
    scene = rumple.parse(SCENE, {"effect[0].coefficient": coefficient})
    sim = rumple.Simulation(scene)
    x, y, _ = sim.rest_positions.T
    sim.species["c"] = numpy.exp(-((x - 1) ** 2) - y**2)
    values = []
    for time in TIMES:
        sim.run(until=time)
        values.append(sim.species["c"][watched])
    return numpy.concatenate(values)


def fit(seed=1):
    """The coefficient that fits synthetic data with noise, its standard error, and the number of simulations."""
    random = numpy.random.default_rng(seed)
    watched = random.choice(300, size=150, replace=False)
    data = observed(TRUE, watched)
    data = data + random.normal(0, NOISE, data.shape)

    def residuals(logarithm):
        return (observed(float(numpy.exp(logarithm[0])), watched) - data) / NOISE

    found = least_squares(residuals, x0=[0.0], diff_step=1e-3)
    coefficient = float(numpy.exp(found.x[0]))
    error = coefficient / float(numpy.sqrt((found.jac.T @ found.jac)[0, 0]))
    return coefficient, error, found.nfev


if __name__ == "__main__":
    coefficient, error, count = fit()
    print(f"D = {coefficient:.4f} ± {error:.4f}, true {TRUE}, after {count} iterations")
    assert abs(coefficient / TRUE - 1) < TOLERANCE, "the coefficient is not recovered"
