"""Thin elastic sheets whose shape and chemistry drive one another.

    import rumple

    scene = rumple.load("dome.toml", {"sheet.vertices": 5000})
    sim = rumple.Simulation(scene)
    for step in sim:
        print(step.time, step.iterations, sim.energies())

`Simulation` steps a scene and is asked for positions, species, energies and fields; `Law` is a law written in
Python; `scene` makes a scene of keyword arguments. `run` writes a result directory, `resume` continues it, `read` opens it. `sweep`, `accuracy` and `compare` make
many runs of a scene and return tables. Everything that can go wrong is an `Error`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ._rumple import (
    Batch,
    Error,
    Law,
    Scene,
    Simulation,
    Species,
    State,
    Step,
    __version__,
    load,
    parse,
)
from .results import Frame, Frames, Results, read
from .runs import resume, run
from .scenes import scene
from .studies import accuracy, compare, sweep

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
    "State",
    "Step",
    "__version__",
    "accuracy",
    "compare",
    "law",
    "load",
    "parse",
    "read",
    "resume",
    "run",
    "scene",
    "sweep",
]


def law(species: Any, **settings: Any) -> Callable[[Callable[[Batch], Any]], Law]:
    """Makes a `Law` of the function below it, which gives the rates: `@rumple.law("c", signals=["mean_curvature"])`."""
    return lambda rates: Law(rates, species, **settings)
