"""Thin elastic sheets whose shape and chemistry drive one another.

    import rumple

    scene = rumple.load("dome.toml", {"sheet.vertices": 5000})
    sim = rumple.Simulation(scene)
    for step in sim:
        print(step.time, step.iterations, sim.energies())

`Simulation` steps a scene and is asked for positions, species, energies and fields; `Law` is a law written in
Python; `scene` makes a scene of keyword arguments. `run` writes a result directory, `resume` continues it, `read` opens it. `sweep`, `accuracy` and `compare` make
many runs of a scene and return tables. Everything that can go wrong is an `Error`: a `SceneError`, `LawError`, `SolverError` or `FileError`. What the program
prints while it works goes to the logger `rumple`, as information.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from typing import Any

from . import autodiff
from ._rumple import (
    Batch,
    Error,
    FileError,
    Law,
    LawError,
    Objective,
    Scene,
    SceneError,
    Simulation,
    SolverError,
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
    "FileError",
    "Frame",
    "Frames",
    "Law",
    "LawError",
    "Objective",
    "Results",
    "Scene",
    "SceneError",
    "Simulation",
    "SolverError",
    "Species",
    "State",
    "Step",
    "__version__",
    "accuracy",
    "autodiff",
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

logging.getLogger("rumple").addHandler(logging.NullHandler())


def law(
    species: str | Iterable[str] | dict[str, Any],
    *,
    signals: str | Iterable[str] | dict[str, Any] | None = None,
    parameters: dict[str, float] | None = None,
    rate_partials: Callable[[Batch], dict[tuple[str, str], Any]] | str | None = None,
    length_factor: Callable[[Batch], Any] | None = None,
    length_factor_across: Callable[[Batch], Any] | None = None,
    curvature: Callable[[Batch], Any] | None = None,
    location: str = "vertex",
    name: str | None = None,
) -> Callable[[Callable[[Batch], Any]], Law]:
    """Makes a `Law` of the function below it, which gives the rates.

        @rumple.law("c", signals=["mean_curvature"], parameters={"k": 1.0})
        def rates(at):
            return {"c": at.k * at.mean_curvature - at.c}

    `species` and `signals` are names, or a dict of names and typical magnitudes; what a species has besides is given by a dict with
    `typical`, `lower`, `upper` and `unit`. The function is called with a `Batch`: NumPy columns of species and signals, one value a
    point, and numbers for `parameters`. It returns a dict with a column or a number for every species, and must be pure.
    `rate_partials` gives the derivatives of the rates, `{("c", "mean_curvature"): column}`, or is "jax" for rates written with
    jax.numpy; by default they are taken by differences. `length_factor`, `length_factor_across` (a fibre) and `curvature`
    (spontaneous, of bending) are functions of the species. `location` is "vertex" or "face"; `name` is by default that of the function.
    """
    if callable(species):
        raise TypeError('a law needs its species: write @rumple.law("c") above the function')
    settings = {
        "signals": signals,
        "parameters": parameters,
        "rate_partials": rate_partials,
        "length_factor": length_factor,
        "length_factor_across": length_factor_across,
        "curvature": curvature,
        "location": location,
        "name": name,
    }
    return lambda rates: Law(rates, species, **settings)
