"""Runs that write result directories, as those of `rumple run` and `rumple resume`."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from . import _rumple
from ._progress import watched
from ._rumple import Error, Law, Scene, State, load
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
    start_time: float | None = None,
    force: bool = False,
    observe: Callable[[State], Any] | None = None,
    progress: bool | Callable[[float, State], Any] = False,
    threads: int = 0,
    law: Law | None = None,
    plugins: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = (),
) -> Results:
    """Runs a scene and writes its results into the directory `out`, as `rumple run` does.

    Without `out` the directory is named after the scene and the time. One that is not empty is refused, unless `force`
    replaces the results of an earlier run in it. `observe(state)` is called with a `State` after every accepted step;
    a true result ends the run there. `progress` shows how far the run is, by tqdm if that is installed, or calls
    `progress(share of time, state)`. `threads` is how many compute, 0 for all cores; results do not depend on it. `state` is a file, such as a
    frame, whose positions and species the run starts from, as by `--from`; `start_time` is the time at which it begins, by default 0. `law` is one in Python, by default that of the scene.

    Ctrl-C, and an exception in `observe`, end the run after writing what `resume` needs. Raises `Error`.
    """
    if start_time is not None and state is None:
        raise Error("start_time is the time at which a state continues: give its file as state")
    scene = checked(scene)
    observe, close = watched(observe, progress, scene.until)
    try:
        return read(_rumple.run(scene, out, state, start_time, force, observe, law, plugins, threads))
    finally:
        close()


def resume(
    directory: str | os.PathLike[str],
    until: float | None = None,
    overrides: Mapping[str, Any] | None = None,
    *,
    observe: Callable[[State], Any] | None = None,
    progress: bool | Callable[[float, State], Any] = False,
    threads: int = 0,
    law: Law | None = None,
    plugins: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = (),
) -> Results:
    """Continues the run in `directory` from its last checkpoint, as `rumple resume` does.

    With `until` it continues to that time instead of the one in the scene. `overrides` may change when the run ends, as
    `{"time.max_steps": 100}`, and its checkpoints; other keys are refused. The results are those of a run that was not
    interrupted. `observe`, `progress` and `threads` are those of `run`. A run with a law in Python needs that law again: one with another
    code or other parameters is refused.
    """
    end = {} if until is None else {"time.until": float(until)}
    changes = {**(overrides or {}), **end}
    resolved = Path(directory) / "resolved.toml"
    last = changes.get("time.until") or (load(resolved).until if progress and resolved.is_file() else 0.0)
    observe, close = watched(observe, progress, float(last))
    try:
        return read(_rumple.resume(directory, changes, observe, law, plugins, threads))
    finally:
        close()
