"""Studies: sweeps over keys, accuracy against references, comparisons of policies.

Members of sweeps and accuracy studies run in processes of their own, which the interpreter starts. Tables are
DataFrames of pandas, which has to be installed.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from . import _rumple
from ._rumple import Error, Scene
from .runs import checked

__all__ = ["accuracy", "compare", "sweep"]

MEMBER = [sys.executable, "-m", "rumple._member"]


def _pandas() -> Any:
    try:
        import pandas
    except ImportError as error:
        raise Error("tables of studies need pandas: pip install pandas") from error
    return pandas


def _table(
    name: str, out: Any, settings: dict[str, Any], study: Callable[[Any], Any]
) -> tuple[Any, Any]:
    """The table `name` of a study in the directory `out`, or in one that is removed again; what `study` returns."""
    pandas = _pandas()
    with tempfile.TemporaryDirectory(prefix="rumple-") as folder:
        root = Path(folder, "study") if out is None else Path(out)
        usual = {"jobs": 1, "threads": 1, "retry_failed": False, "member": MEMBER}
        settings["plugins"] = list(settings["plugins"])
        said = study(SimpleNamespace(out=root, **{**usual, **settings}))
        table = pandas.read_csv(root / name)
    table.attrs["directory"] = None if out is None else str(root.absolute())
    return table, said


def sweep(
    scene: Scene | str | os.PathLike[str],
    over: Mapping[str, Any] | None = None,
    *,
    out: str | os.PathLike[str] | None = None,
    jobs: int = 1,
    seeds: int | None = None,
    level: float | None = None,
    force: bool = False,
    retry_failed: bool = False,
    threads: int = 1,
    plugins: Sequence[str | os.PathLike[str]] = (),
) -> Any:
    """Runs a scene over all combinations of values of its keys, as `rumple sweep` does; a row a member.

    `over` has for every key path a sequence of values, or a text as after `--over`, such as `"0.5..1.5:5"`. `seeds=n`
    repeats every member with n seeds of everything random. `jobs` members run at once, with `threads` each.

    The DataFrame has the keys, `status`, measures of the last state, time and work. Members that fail have the status
    `failed` and a `reason`. The results of all members stay in the directory `out`, where the same call continues; without
    it they are removed. The scene has to come from a file, and cannot have a law in Python.
    """
    scene = checked(scene)
    settings = {
        "force": force,
        "jobs": jobs,
        "retry_failed": retry_failed,
        "threads": threads,
        "plugins": plugins,
    }
    over = None if over is None else dict(over)
    return _table(
        "sweep.csv", out, settings, lambda how: _rumple.sweep(scene, over, seeds, level, how)
    )[0]


def accuracy(
    scene: Scene | str | os.PathLike[str],
    *,
    integrators: Sequence[str] = (),
    tolerances: Sequence[float] | None = None,
    force_tolerances: Sequence[float] = (),
    over: Mapping[str, Any] | None = None,
    want: float = 0.01,
    of: str | None = None,
    references: Sequence[str] = (),
    seeds: int = 2,
    limit: int = 300,
    repeats: int = 3,
    level: float | None = None,
    out: str | os.PathLike[str] | None = None,
    jobs: int = 1,
    force: bool = False,
    retry_failed: bool = False,
    plugins: Sequence[str | os.PathLike[str]] = (),
) -> Any:
    """Runs a scene by several integrators at several tolerances against references, as `rumple accuracy` does.

    The DataFrame has a row for every run that is compared: integrator, tolerance, errors as shares, times and work. Its
    `attrs["advice"]` says what reaches the error `want` of the quantity `of` at the least cost. `limit` is the wall time
    of a run in seconds. Report and plots stay in the directory `out`; without it they are removed.
    """
    scene = checked(scene)
    asked = SimpleNamespace(
        integrators=list(integrators),
        tolerances=None if tolerances is None else [float(value) for value in tolerances],
        force_tolerances=[float(value) for value in force_tolerances],
        references=list(references),
        seeds=seeds,
        limit=limit,
        repeats=repeats,
        want=want,
        of=of,
    )
    settings = {"force": force, "jobs": jobs, "retry_failed": retry_failed, "plugins": plugins}
    over = None if over is None else dict(over)
    table, advice = _table(
        "accuracy.csv", out, settings, lambda how: _rumple.accuracy(scene, over, level, asked, how)
    )
    table.attrs["advice"] = advice
    return table


def compare(
    scene: Scene | str | os.PathLike[str],
    *,
    policies: Sequence[str] = (),
    integrators: Sequence[str] = (),
    out: str | os.PathLike[str] | None = None,
    force: bool = False,
    plugins: Sequence[str | os.PathLike[str]] = (),
) -> Any:
    """Runs a scene under several policies and integrators from the same start, as `rumple compare` does.

    The DataFrame has a row for every output time of every member: distances from the first member, measures, and in the
    last row of a member its work. `attrs["report"]` has the lines that the program prints: time scales and a table.
    """
    scene = checked(scene)
    settings = {"force": force, "plugins": plugins}
    table, report = _table(
        "compare.csv",
        out,
        settings,
        lambda how: _rumple.compare(scene, list(policies), list(integrators), how),
    )
    table.attrs["report"] = "\n".join(report)
    return table
