"""Thin elastic sheets whose shape and chemistry drive one another.

    import rumple

    scene = rumple.load("dome.toml", {"sheet.vertices": 5000})
    sim = rumple.Simulation(scene)
    for step in sim:
        print(step.time, step.iterations, sim.energies())

`Simulation` steps a scene and is asked for positions, species, energies and fields; `Law` is a law written in
Python; `read` opens the results of `rumple run`. Everything that can go wrong is an `Error`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ._rumple import Batch, Error, Law, Scene, Simulation, Species, Step, __version__, load, parse
from .results import Frame, Frames, Results, read

__all__ = [
    "Batch",
    "Error",
    "Frame",
    "Frames",
    "Law",
    "Results",
    "Scene",
    "Simulation",
    "Species",
    "Step",
    "__version__",
    "law",
    "load",
    "parse",
    "read",
]


def law(species: Any, **settings: Any) -> Callable[[Callable[[Batch], Any]], Law]:
    """Makes a `Law` of the function below it, which gives the rates: `@rumple.law("c", signals=["mean_curvature"])`."""
    return lambda rates: Law(rates, species, **settings)
