#!/usr/bin/env python3
"""Fuzzes readers with coverage, a target of `cargo fuzz` for each, and prints what came of it.

    tests/scripts/fuzz.py                  # every reader for 60 s
    tests/scripts/fuzz.py 600 vtu scene    # these for ten minutes
    tests/scripts/fuzz.py --sanitizer address 60 vtu

Wants nightly Rust and `cargo install cargo-fuzz`. Begins with the valid inputs of `tests/fuzz/readers`, the corpus in
`tests/fuzz/corpus` and what earlier calls have found, which is in `results/fuzz/found`. A panic, more than 10 s, more
memory than the bound of the reader or than 2 GiB are faults: the input is kept in `results/fuzz`, and the exit code is 1.
"""

import argparse
import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FUZZ = ROOT / "tests/fuzz"
RESULTS = ROOT / "results/fuzz"
TARGETS = ROOT / "target/fuzzing"
# Words of the formats, where there are many.
DICTIONARIES = {"scene": "scene", "override": "scene", "axis": "scene", "law": "scene", "formula": "scene",
                "vtu": "vtk", "vtp": "vtk", "vtk": "vtk", "state": "vtk", "shown": "vtk"}


def build(names, sanitizer):
    """Builds the targets; the folder that they are in."""
    command = ["cargo", "+nightly", "fuzz", "build", "--fuzz-dir", FUZZ, "--target-dir", TARGETS, "-s", sanitizer]
    # One of them, or all.
    subprocess.run(command + (names if len(names) == 1 else []), check=True, cwd=ROOT)
    host = re.search(r"host: (\S+)", subprocess.check_output(["rustc", "-vV"], text=True))[1]
    return TARGETS / host / "release"


def fuzz(target, seconds):
    """Runs one target; what it says of itself."""
    name = target.name
    found, seeds = (RESULTS / kind / name for kind in ("found", "seeds"))
    for folder in (found, seeds):
        folder.mkdir(parents=True, exist_ok=True)
    corpus = [folder for folder in (found, seeds, FUZZ / "corpus" / name) if folder.is_dir()]
    options = [f"-max_total_time={seconds}", "-rss_limit_mb=2048", "-timeout=10", "-print_final_stats=1",
               f"-artifact_prefix={RESULTS}/{name}-"]
    if name in DICTIONARIES:
        options.append(f"-dict={FUZZ}/dictionaries/{DICTIONARIES[name]}.dict")
    environment = {**os.environ, "RUMPLE_FUZZ_SEEDS": str(seeds), "RAYON_NUM_THREADS": "1"}
    done = subprocess.run([target, *corpus, *options], cwd=ROOT, env=environment, capture_output=True, text=True,
                          errors="replace")
    (RESULTS / f"{name}.log").write_text(done.stderr)
    return done


def row(name, done):
    """A row of the table, and whether there was a fault."""
    last = lambda pattern: (re.findall(pattern, done.stderr) or ["0"])[-1]
    executions, added = last(r"number_of_executed_units: (\d+)"), last(r"new_units_added: +(\d+)")
    speed = last(r"average_exec_per_sec: +(\d+)")
    panic = re.search(r"panicked at (.*)", done.stderr) or re.search(r"ERROR: libFuzzer: (.*)", done.stderr)
    fault = "" if done.returncode == 0 else (panic[1] if panic else f"exit code {done.returncode}")
    print(f"| {name} | {executions} | {speed} | {last('cov: ([0-9]+)')} | {added} | {fault} |", flush=True)
    return fault != ""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seconds", nargs="?", type=int, default=60)
    parser.add_argument("readers", nargs="*")
    parser.add_argument("--sanitizer", default="none", help="of rustc; none (safe code), address, …")
    options = parser.parse_args()
    known = re.findall(r'^name = "([a-z-]+)"\npath = "target.rs"', (FUZZ / "Cargo.toml").read_text(), re.M)
    for name in set(options.readers) - set(known):
        parser.error(f"no reader {name}; there are {', '.join(known)}")
    folder = build(options.readers, options.sanitizer)
    print("| reader | executions | a second | places reached | inputs found | fault |\n| --- | --: | --: | --: | --: | --- |")
    # All of them, also after a fault.
    return max([row(name, fuzz(folder / name, options.seconds)) for name in options.readers or known])


if __name__ == "__main__":
    sys.exit(main())
