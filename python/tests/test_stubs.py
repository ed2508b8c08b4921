"""Type stubs and docstrings have every name."""

import ast
from pathlib import Path

import rumple
from rumple import _rumple

STUB = ast.parse(Path(_rumple.__file__).with_name("_rumple.pyi").read_text(encoding="utf-8"))
DEFINED = {node.name: node for node in STUB.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}


def public(names):
    return {name for name in names if not name.startswith("_")}


def test_every_name_of_the_engine_has_a_stub_with_a_docstring():
    assert public(dir(_rumple)) == set(DEFINED)
    for name, node in DEFINED.items():
        assert ast.get_docstring(node), name
        if name == "Error" or not isinstance(node, ast.ClassDef):
            continue
        methods = {item.name: item for item in node.body if isinstance(item, ast.FunctionDef)}
        # A mapping inherits items, values and the like from its base.
        missing = public(vars(getattr(_rumple, name))) - set(methods)
        assert not missing or node.bases and missing <= set(dir(dict)), (name, missing)
        assert public(methods) <= set(vars(getattr(_rumple, name))), name
        for title in public(methods):
            documented = [item for item in node.body if getattr(item, "name", "") == title]
            assert any(ast.get_docstring(item) for item in documented), (name, title)


def test_every_public_name_has_a_docstring():
    names = [name for name in rumple.__all__ if name != "__version__"]
    assert [name for name in names if not getattr(rumple, name).__doc__] == []
    assert {"run", "resume", "read", "sweep", "accuracy", "compare"} <= set(names)
