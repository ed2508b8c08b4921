"""Scenes of keyword arguments."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ._rumple import Error, Law, Scene, parse, tables_as_toml

__all__ = ["scene"]


def scene(*, name: str = "scene", **tables: Any) -> Scene:
    """Checks a scene whose tables are the keyword arguments, with the keys and values of a scene file.

        rumple.scene(
            sheet={"shape": "disc", "radius": 10.0, "vertices": 300},
            effect=[{"kind": "diffusion", "species": "c", "coefficient": 0.5}],
            kinetics={"plugin": rates, "initial": {"c": 1.0}},
            time={"until": 1.0},
        )

    A `Law` stands where the name of a plugin would. `name` stands for the file in messages. Raises `Error`.
    """
    laws: list[Law] = []
    if "kinetics" in tables:
        tables["kinetics"] = _named(tables["kinetics"], laws)
    if len(laws) > 1:
        names = ", ".join(repr(law.name) for law in laws)
        raise Error(f"a scene has one law in Python, and these are {len(laws)}: {names}; make one law of them")
    return parse(tables_as_toml(tables), name=name, law=laws[0] if laws else None)


def _named(kinetics: Any, laws: list[Law]) -> Any:
    """The table or tables of laws, with names in place of laws in Python, which are appended to `laws`."""
    if callable(kinetics) or isinstance(kinetics, Mapping) and callable(kinetics.get("plugin")):
        raise TypeError("a function alone is no law: make one of it by @rumple.law(species, …) or rumple.Law")
    if isinstance(kinetics, Law):
        kinetics = {"plugin": kinetics}
    if isinstance(kinetics, (list, tuple)):
        return [_named(table, laws) for table in kinetics]
    if isinstance(kinetics, Mapping) and isinstance(kinetics.get("plugin"), Law):
        laws.append(kinetics["plugin"])
        return {**kinetics, "plugin": laws[-1].name}
    return kinetics
