#!/usr/bin/env python3
"""How long the compiler takes: after a change of one line of an effect, and from nothing.

    python3 benches/build.py [--rounds 3] [--file src/core/effects/load.rs] [--flag='--config=…']...
    python3 benches/build.py --clean [--least 3]

The first form builds the program, then adds a line to the file, builds again and prints processor and
wall seconds of every round and their medians; the file is put back, also after Ctrl-C or SIGTERM. The second builds
into a folder of its own, from nothing (some minutes), and adds a table: every direct dependency with
the processor seconds of all crates that nothing else needs, if they are at least `--least`. Processor
seconds are those of all processes together. They are nearly independent of the number of cores, but grow by up to
half where other programs fill the caches.

As users build: without incremental compilation, whatever a local configuration says.
"""

import argparse
import json
import os
import resource
import shutil
import signal
import statistics
import subprocess
import sys
import time
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LOG = "RUMPLE_BUILD_LOG"
BUILD = ["cargo", "--config", "profile.release.package.rumple.codegen-units=16", "build", "--release"]


def measured(command, environment):
    """Wall and processor seconds of a command and everything that it starts."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run(command, cwd=ROOT, env=environment, check=True)
    wall, after = time.monotonic() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def after_a_line(file, rounds, flags, environment):
    """Builds after a line was added to `file`, `rounds` times another one."""
    text = file.read_text()
    command = [*BUILD, "--quiet", *flags]
    print(f"first, what is missing: {measured(command, environment)[0]:.0f} s wall", flush=True)
    results = []
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    try:
        for number in range(rounds):
            file.write_text(f"{text}\nconst _: u8 = {number % 256}; // a round of build.py\n")
            results.append(measured(command, environment))
            wall, processor = results[-1]
            print(f"{file.relative_to(ROOT)}: {processor:.1f} s processor, {wall:.1f} s wall", flush=True)
    finally:
        file.write_text(text)
    wall, processor = (statistics.median(column) for column in zip(*results))
    print(f"median: {processor:.1f} s processor, {wall:.1f} s wall")


def as_wrapper(command):
    """In place of the compiler: runs it and notes the crate and its processor seconds."""
    # Descriptors stay open: through two of them cargo shares out the processors.
    code = subprocess.run(command, close_fds=False).returncode
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    if "--crate-name" in command:
        package = os.environ.get("CARGO_PKG_NAME", "?"), os.environ.get("CARGO_PKG_VERSION", "?")
        with open(os.environ[LOG], "a") as log:
            log.write(f"{' '.join(package)} {used.ru_utime + used.ru_stime}\n")
    return code


def graph(environment):
    """Every package, as `name version`, with what it needs to be built; and those of the workspace."""
    command = ["cargo", "metadata", "--format-version", "1", "--filter-platform", host()]
    metadata = json.loads(subprocess.check_output(command, cwd=ROOT, env=environment))
    label = {p["id"]: f"{p['name']} {p['version']}" for p in metadata["packages"]}
    needs = {
        label[node["id"]]: {
            label[other["pkg"]] for other in node["deps"] if any(k["kind"] != "dev" for k in other["dep_kinds"])
        }
        for node in metadata["resolve"]["nodes"]
    }
    return needs, {label[member] for member in metadata["workspace_members"]}


def host():
    about = subprocess.check_output(["rustc", "-vV"], text=True)
    return next(line.split()[1] for line in about.splitlines() if line.startswith("host:"))


def reached(needs, roots, without=None):
    """What the roots need, but for one crate and what only that one needs."""
    found, left = set(), [root for root in roots if root != without]
    while left:
        crate = left.pop()
        if crate not in found:
            found.add(crate)
            left.extend(needs[crate] - {without})
    return found


def from_nothing(least, flags, environment):
    """A clean build in a folder of its own, and which dependencies cost most."""
    target = ROOT / "target" / "build-times"
    shutil.rmtree(target, ignore_errors=True)
    target.mkdir(parents=True)
    log = target / "seconds.txt"
    environment |= {"CARGO_TARGET_DIR": str(target), "RUSTC_WRAPPER": __file__, LOG: str(log)}
    wall, processor = measured([*BUILD, "--quiet", *flags], environment)
    seconds = defaultdict(float)
    for line in log.read_text().splitlines():
        name, version, used = line.split()
        seconds[f"{name} {version}"] += float(used)
    needs, own = graph(environment)
    built = own & set(seconds)
    print(f"clean build: {processor:.0f} s processor, {wall:.0f} s wall, {len(seconds)} crates")
    print("\n| own crate | processor, s |\n| --- | --- |")
    for crate in sorted(built, key=lambda c: -seconds[c]):
        if seconds[crate] >= least:
            print(f"| {crate.split()[0]} | {seconds[crate]:.1f} |")
    everything = reached(needs, built)
    direct = set().union(*(needs[crate] for crate in built)) - own
    rows = []
    for crate in direct:
        alone = everything - reached(needs, built, crate)
        rows.append((sum(seconds[c] for c in alone), crate, sum(seconds[c] > 0.0 for c in alone)))
    print("\n| dependency | with what it alone needs, s | crates |\n| --- | --- | --- |")
    for used, crate, count in sorted(rows, reverse=True):
        if used >= least:
            print(f"| {crate.split()[0]} | {used:.1f} | {count} |")
    shutil.rmtree(target)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--file", type=Path, default=ROOT / "src/core/effects/load.rs")
    parser.add_argument("--clean", action="store_true")
    parser.add_argument("--least", type=float, default=3.0)
    parser.add_argument("--flag", action="append", default=[], help="handed on to cargo build")
    arguments = parser.parse_args()
    environment = os.environ | {"CARGO_INCREMENTAL": "0"}
    if arguments.clean:
        from_nothing(arguments.least, arguments.flag, environment)
    else:
        after_a_line(arguments.file.resolve(), max(arguments.rounds, 1), arguments.flag, environment)


if __name__ == "__main__":
    sys.exit(as_wrapper(sys.argv[1:]) if LOG in os.environ else main())
