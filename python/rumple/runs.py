"""Runs that write result directories, as those of `rumple run` and `rumple resume`."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from . import _rumple
from ._rumple import Law, Scene, State, load
from .results import Results, read

__all__ = ["resume", "run"]


def checked(scene: Any) -> Scene:
    """The scene itself, or the scene of a file."""
    return scene if isinstance(scene, Scene) else load(scene)


def run(
    scene: Scene | str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    state: str | os.PathLike[str] | None = None,
    force: bool = False,
    observe: Callable[[State], Any] | None = None,
    law: Law | None = None,
    plugins: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = (),
) -> Results:
    """Runs a scene and writes its results into the directory `out`, as `rumple run` does.

    Without `out` the directory is named after the scene and the time. One that is not empty is refused, unless `force`
    replaces the results of an earlier run in it. `observe(state)` is called with a `State` after every accepted step;
    a true result ends the run there. `state` is a file, such as a frame, whose positions and species the run starts from, as by
    `--from`. `law` is one in Python, by default that of the scene.

    Ctrl-C, and an exception in `observe`, end the run after writing what `resume` needs. Raises `Error`.
    """
    return read(_rumple.run(checked(scene), out, state, force, observe, law, plugins))


def resume(
    directory: str | os.PathLike[str],
    until: float | None = None,
    overrides: Mapping[str, Any] | None = None,
    *,
    observe: Callable[[State], Any] | None = None,
    law: Law | None = None,
    plugins: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = (),
) -> Results:
    """Continues the run in `directory` from its last checkpoint, as `rumple resume` does.

    With `until` it continues to that time instead of the one in the scene. `overrides` may change when the run ends, as
    `{"time.max_steps": 100}`, and its checkpoints; other keys are refused. The results are those of a run that was not
    interrupted. `observe(state)` is called as by `run`. A run with a law in Python needs that law again: one with another
    code or other parameters is refused.
    """
    end = {} if until is None else {"time.until": float(until)}
    return read(_rumple.resume(directory, {**(overrides or {}), **end}, observe, law, plugins))
