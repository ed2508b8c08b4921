#!/usr/bin/env python3
"""Licences and sources of every crate in the locked graphs, against deny.toml: licences.py

The same lists as `cargo deny check licenses sources` takes, which is run too where it is installed.
"""

import json
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
REGISTRY = "registry+https://github.com/rust-lang/crates.io-index"


def packages(manifest):
    """All crates of the workspace and of what it depends on, with every feature."""
    command = ["cargo", "metadata", "--format-version", "1", "--all-features", "--locked", "--manifest-path", manifest]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{manifest}: {done.stderr}")
    return json.loads(done.stdout)["packages"]


def permitted(expression, allowed):
    """Whether an SPDX expression holds with the licences of `allowed`; a slash is the OR of old manifests."""
    terms = re.findall(r"[()]|[\w.+-]+(?: WITH [\w.+-]+)?", expression.replace("/", " OR "))
    words = {"OR": "or", "AND": "and", "(": "(", ")": ")"}
    # Names, "or", "and" and parentheses alone are left, and the names become True or False.
    return eval(" ".join(words.get(term, str(term in allowed)) for term in terms))


def main():
    settings = tomllib.loads((ROOT / "deny.toml").read_text())["licenses"]
    exceptions = {one["crate"]: set(one["allow"]) for one in settings["exceptions"]}
    failures, seen = [], {}
    for package in packages(ROOT / "Cargo.toml"):
        name, source, licence = package["name"], package["source"], package["license"]
        seen[name, package["version"]] = licence
        if source not in (None, REGISTRY):
            failures.append(f"{name} comes from {source}")
        if source is None and package["publish"] == []:
            continue
        if not licence or not permitted(licence, set(settings["allow"]) | exceptions.get(name, set())):
            failures.append(f"{name} {package['version']} has the licence {licence}, which deny.toml does not allow")
    for name in exceptions.keys() - {name for name, _ in seen}:
        failures.append(f"deny.toml has an exception for {name}, which nothing depends on")
    print(f"{len(seen)} crates, {len(set(seen.values()))} licences, {len(failures)} failures")
    if failures:
        sys.exit("\n".join(failures))
    if shutil.which("cargo-deny"):
        subprocess.run(["cargo", "deny", "check", "licenses", "bans", "sources"], cwd=ROOT, check=True)


main()
