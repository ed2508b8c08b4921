#!/usr/bin/env python3
"""The JSON Schema of scenes against what the program accepts: schema.py PROGRAM

Valid are all scenes of models/, all templates of `rumple new` and their resolved scenes. Refused are, for every key of
every scene, the same scene with that key misspelt, or with a value of another type. With taplo beside Python (PyPI's
taplo), it reads a template by its `#:schema` line, and a mistake in it is refused. With target/npm (npm's @taplo/lsp)
its language server is asked what editors ask: errors while a scene is typed, and the keys that can stand somewhere.
"""

import copy
import json
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import jsonschema

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = str(Path(sys.argv[1]).resolve())
# Tables whose keys are names of the user's.
OPEN = {"parameters", "initial", "rates", "let", "species", "observables", "units", "rename", "totals"}
# Lists of scenes for scripts, not scenes.
OTHERS = {"cases.toml"}


def rumple(*args):
    return subprocess.run([PROGRAM, *map(str, args)], capture_output=True, text=True, check=True).stdout


def mistakes(node, path=()):
    """Each key below node with a wrong type in place of its value, and whether it can be misspelt."""
    items = node.items() if isinstance(node, dict) else enumerate(node)
    for key, value in items:
        yield path + (key,), isinstance(node, dict) and not (path and path[-1] in OPEN)
        if isinstance(value, (dict, list)):
            yield from mistakes(value, path + (key,))


def changed(scene, path, misspelt):
    scene = copy.deepcopy(scene)
    node = scene
    for key in path[:-1]:
        node = node[key]
    if misspelt:
        node[path[-1] + "x"] = node.pop(path[-1])
    else:
        # Nothing in a scene is a list of booleans.
        node[path[-1]] = [True]
    return scene


def editor():
    """What taplo, and so the editors that use it, say of a template with its schema."""
    taplo = Path(sys.executable).with_name("taplo")
    if not taplo.exists():
        return ["left out: no taplo"]
    said = []
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.toml"
        rumple("new", scene, "--from", "turing", "--schema")
        good = scene.read_text()
        for right, wrong in [
            ("", ""),
            ("thickness =", "thicknes ="),
            ("vertices = 1500", 'vertices = "many"'),
            ('kind = "bending"', 'kind = "bendin"'),
        ]:
            assert right in good
            scene.write_text(good.replace(right, wrong))
            lint = subprocess.run([taplo, "lint", scene], capture_output=True, text=True, cwd=folder)
            if (lint.returncode == 0) != (right == wrong):
                sys.exit(f"taplo: {right!r} as {wrong!r}: exit code {lint.returncode}\n{lint.stderr}")
            said.append(wrong or "good")
    return said


def language_server():
    """Whether taplo's language server shows errors and keys of a template while it is typed."""
    modules = ROOT / "target/npm"
    # Node of PyPI stands beside Python.
    path = os.pathsep.join([os.environ["PATH"], str(Path(sys.executable).parent)])
    node = shutil.which("node", path=path)
    if node is None or not (modules / "node_modules/@taplo/lsp").is_dir():
        return "left out: no node or no @taplo/lsp"
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.toml"
        rumple("new", scene, "--from", "turing", "--schema")
        good = scene.read_text()
        # A text, what an error about it has to say, and keys that have to be offered at its end or after `at`.
        cases = [
            ({"text": good}, None, []),
            ({"text": good.replace("thickness =", "thicknes =")}, "thicknes", []),
            ({"text": good.replace("vertices = 1500", 'vertices = "many"')}, "many", []),
            ({"text": good.replace('kind = "bending"', 'kind = "bendin"')}, "bendin", []),
            ({"text": good.replace("[time]\n", "[time]\nu"), "at": "[time]\nu"}, "u", ["until", "policy", "stop_when_steady"]),
            ({"text": f"{good}\n[output]\nev", "at": "\n[output]\nev"}, "EOF", ["compression", "every", "fields", "report"]),
            ({"text": good}, None, []),
        ]
        done = subprocess.run(
            [node, ROOT / "tests/scripts/editor.mjs", modules, scene],
            input=json.dumps([text for text, _, _ in cases]),
            capture_output=True,
            text=True,
        )
    if done.returncode != 0:
        sys.exit(f"editor.mjs: exit code {done.returncode}\n{done.stderr}")
    for answer, (case, wrong, keys) in zip(json.loads(done.stdout), cases, strict=True):
        errors = "\n".join(answer["errors"])
        if bool(errors) != (wrong is not None) or (wrong or "") not in errors or set(keys) - set(answer["keys"]):
            sys.exit(f"language server: {answer} where {wrong!r} and {keys} are expected of {case.get('at')!r}")
    return f"{len(cases)} texts, errors and completions as expected"


def main():
    schema = json.loads(rumple("schema"))
    jsonschema.Draft7Validator.check_schema(schema)
    validator = jsonschema.Draft7Validator(schema)
    with tempfile.TemporaryDirectory() as folder:
        scenes = [path for path in sorted(ROOT.glob("models/**/*.toml")) if path.name not in OTHERS]
        for template in ("model-i", "turing", "plate", "shell", "own-law"):
            rumple("new", Path(folder) / template, "--from", template)
            scenes.append(Path(folder) / f"{template}.toml")
        failures, valid, refused = [], 0, 0
        for path in scenes:
            scene = tomllib.loads(path.read_text())
            resolved = tomllib.loads(rumple("check", path, "--resolved")) if path.parent == Path(folder) else scene
            for one in (scene, resolved):
                for error in validator.iter_errors(one):
                    failures.append(f"{path.name}: refused at {list(error.absolute_path)}: {error.message[:200]}")
                valid += 1
            for where, named in mistakes(scene):
                for misspelt in [False, True] if named else [False]:
                    if validator.is_valid(changed(scene, where, misspelt)):
                        what = "misspelt" if misspelt else "of a wrong type"
                        failures.append(f"{path.name}: accepted with {where} {what}")
                    refused += 1
    print(f"{valid} scenes valid, {refused} with a mistake refused, {len(failures)} failures")
    if failures:
        sys.exit("\n".join(failures[:40]))
    print(f"taplo: {', '.join(editor())}")
    print(f"language server: {language_server()}")


main()
