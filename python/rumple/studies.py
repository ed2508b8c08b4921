"""Studies: sweeps over keys, accuracy against references, comparisons of policies.

Members run in processes of their own, which the interpreter starts. Tables are
DataFrames of pandas, which has to be installed.
"""

from __future__ import annotations

import os
import pickle
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from . import _rumple
from ._progress import counted
from ._rumple import Error, Law, Scene, load
from .runs import checked

__all__ = ["accuracy", "compare", "sweep"]

MEMBER = [sys.executable, "-m", "rumple._member"]


def _pickled(law: Any) -> bytes:
    """A law for other processes, with the path of modules; functions of a notebook or a script by cloudpickle."""
    what = f"the law {law.name!r} cannot be given to the processes of a study"
    helps = "pip install cloudpickle, or define its functions in a module"
    try:
        import cloudpickle
    except ImportError:
        cloudpickle = pickle
        (rates, *_), settings = law.__getnewargs_ex__()
        # Pickle keeps names, and in another process this module is another one.
        if any(getattr(one, "__module__", "") == "__main__" for one in (rates, *filter(callable, settings.values()))):
            raise Error(f"{what}: {helps}") from None
    try:
        return pickle.dumps((sys.path, bytes(cloudpickle.dumps(law))))
    except Exception as error:
        more = f"; {helps}" if cloudpickle is pickle else ""
        raise Error(f"{what}: {type(error).__name__}: {error}{more}") from error


def _saved(scene: Scene, root: Path, force: bool) -> Scene:
    """The scene from a file: one of text is written beside the directory of its study."""
    text, overrides = scene._parsed()
    if text is None:
        return scene
    if scene._files():
        raise Error(
            f"the scene {scene.name!r} is no file and names files ({', '.join(scene._files())}), which a study looks up from "
            "its scene: save it and use rumple.load"
        )
    path = root.with_name(root.name + ".toml")
    if not force and path.is_file() and path.read_text(encoding="utf-8") != text:
        raise Error(f"{path} is another scene than {scene.name!r}: choose another out, or give force=True")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return load(path, overrides, law=scene.law)


def _pandas() -> Any:
    try:
        import pandas
    except ImportError as error:
        raise Error("tables of studies need pandas: pip install pandas") from error
    return pandas


def _table(
    name: str,
    scene: Scene | str | os.PathLike[str],
    out: Any,
    settings: dict[str, Any],
    progress: bool | Callable[[float, str], Any],
    study: Callable[[Scene, Any], Any],
) -> tuple[Any, Any]:
    """The table `name` of a study in the directory `out`, or in one that is removed again; what `study` returns."""
    pandas = _pandas()
    with tempfile.TemporaryDirectory(prefix="rumple-") as folder:
        root = Path(folder, "study") if out is None else Path(out)
        given, law = checked(scene), settings.pop("law")
        given = given if law is None else given.with_law(law)
        kept = Path(folder, "law.pickle") if given.law is not None else None
        if kept is not None:
            kept.write_bytes(_pickled(given.law))
        member = [*MEMBER, "" if kept is None else str(kept)]
        usual = {"jobs": 1, "threads": 1, "retry_failed": False, "member": member}
        given = _saved(given, root, settings["force"])
        happens, close = counted(progress)
        try:
            said = study(given, SimpleNamespace(out=root, progress=happens, **{**usual, **settings}))
        finally:
            close()
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
    progress: bool | Callable[[float, str], Any] = False,
    law: Law | None = None,
    plugins: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = (),
) -> Any:
    """Runs a scene over all combinations of values of its keys, as `rumple sweep` does; a row a member.

    `over` has for every key path a sequence of values, or a text as after `--over`, such as `"0.5..1.5:5"`. `seeds=n`
    repeats every member with n seeds of everything random. `jobs` members run at once, with `threads` each. `progress` shows
    how many have ended, by tqdm if that is installed, or calls `progress(share of members, text)` for everything that happens.

    The DataFrame has the keys, `status`, measures of the last state, time and work. Members that fail have the status
    `failed` and a `reason`. The results of all members stay in the directory `out`, where the same call continues; without
    it they are removed; a scene that does not come from a file is written beside it, as `out` with the ending .toml. `law` is a
    law in Python, by default that of the scene; `over` has its parameters where the scene names it as a plugin.
    """
    settings = {
        "force": force,
        "jobs": jobs,
        "retry_failed": retry_failed,
        "threads": threads,
        "law": law,
        "plugins": plugins,
    }
    over = None if over is None else dict(over)
    study = lambda scene, how: _rumple.sweep(scene, over, seeds, level, how)
    return _table("sweep.csv", scene, out, settings, progress, study)[0]


def accuracy(
    scene: Scene | str | os.PathLike[str],
    *,
    integrators: Sequence[str] = (),
    tolerances: Sequence[float] | None = None,
    want: float = 0.01,
    of: str | None = None,
    references: Sequence[str] = (),
    seeds: int = 2,
    limit: int = 300,
    level: float | None = None,
    out: str | os.PathLike[str] | None = None,
    jobs: int = 1,
    force: bool = False,
    retry_failed: bool = False,
    threads: int = 1,
    progress: bool | Callable[[float, str], Any] = False,
    law: Law | None = None,
    plugins: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = (),
) -> Any:
    """Runs a scene by several integrators at several tolerances against references, as `rumple accuracy` does.

    The DataFrame has a row for every run that is compared: integrator, tolerance, errors as shares, times and work. Its
    `attrs["advice"]` says what reaches the error `want` of the quantity `of` at the least cost. `limit` is the wall time
    of a run in seconds. Report and plots stay in the directory `out`; without it they are removed. `progress` is that of `sweep`.
    """
    asked = SimpleNamespace(
        integrators=list(integrators),
        tolerances=None if tolerances is None else [float(value) for value in tolerances],
        references=list(references),
        seeds=seeds,
        limit=limit,
        want=want,
        of=of,
    )
    settings = {
        "force": force,
        "jobs": jobs,
        "retry_failed": retry_failed,
        "threads": threads,
        "law": law,
        "plugins": plugins,
    }
    study = lambda scene, how: _rumple.accuracy(scene, level, asked, how)
    table, advice = _table("accuracy.csv", scene, out, settings, progress, study)
    table.attrs["advice"] = advice
    return table


def compare(
    scene: Scene | str | os.PathLike[str],
    *,
    policies: Sequence[str] = (),
    integrators: Sequence[str] = (),
    out: str | os.PathLike[str] | None = None,
    jobs: int = 1,
    force: bool = False,
    retry_failed: bool = False,
    threads: int = 1,
    progress: bool | Callable[[float, str], Any] = False,
    law: Law | None = None,
    plugins: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = (),
) -> Any:
    """Runs a scene under several policies and integrators from the same start, as `rumple compare` does.

    The DataFrame has a row for every output time of every member: distances from the first member, measures, and in the
    last row of a member its work. `attrs["report"]` has the lines that the program prints: pairings that are left out, time
    scales and a table. The same call continues in the directory `out`. `progress` is that of `sweep`.
    """
    settings = {
        "force": force,
        "jobs": jobs,
        "retry_failed": retry_failed,
        "threads": threads,
        "law": law,
        "plugins": plugins,
    }
    study = lambda scene, how: _rumple.compare(scene, list(policies), list(integrators), how)
    table, report = _table("compare.csv", scene, out, settings, progress, study)
    table.attrs["report"] = "\n".join(report)
    return table
