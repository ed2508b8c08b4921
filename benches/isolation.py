#!/usr/bin/env python3
"""What --isolate costs: scenes run with and without it in turn; a table of ratios for docs/notebook/isolation.md.

    benches/isolation.py [TIMES]      pairs of runs of each scene (5)

Processor time is that of the run and of the processes of its plugins; wall time is what one waits. Ratios are medians over
the pairs, with the least and the largest. Needs `cargo build --release`; RUMPLE is another program.
"""

import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = os.environ.get("RUMPLE", str(ROOT / "target/release/rumple"))
SCENES = [
    ("model-i/small.toml", ["time.until=1"], "2000 vertices"),
    ("model-i/spots.toml", ["time.until=0.05"], "20 000 vertices"),
    ("policies/bump.toml", ["time.until=0.02"], ""),
    ("kinetics/schnakenberg-sphere.toml", ["time.until=1"], "20 000 vertices, no mechanics"),
    ("kinetics/hires.toml", [], "a single point"),
]


def run(scene, keys, folder, isolated):
    """Processor and wall time of a run, s."""
    command = [PROGRAM, "run", str(ROOT / "models" / scene), "--out", str(folder / "out"), "--force", "--quiet"]
    command += [part for key in keys for part in ("--set", key)]
    command += ["--isolate"] if isolated else []
    began = time.monotonic()
    process = os.posix_spawn(PROGRAM, command, os.environ, file_actions=[
        (os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0)])
    _, status, used = os.wait4(process, 0)
    if status != 0:
        raise SystemExit(f"{' '.join(command)}: status {status}")
    return used.ru_utime + used.ru_stime, time.monotonic() - began


def percent(ratios):
    """Median, least and largest of ratios as more or less."""
    shown = [f"{100 * (value - 1):+.1f} %" for value in (statistics.median(ratios), min(ratios), max(ratios))]
    return f"{shown[0]} ({shown[1]} to {shown[2]})"


def main():
    times = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    print("| run | processor time | wall time |\n| --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for scene, keys, what in SCENES:
            ratios = ([], [])
            for pair in range(times):
                # The first of a pair finds the machine in the state left by the previous pair.
                order = (False, True) if pair % 2 == 0 else (True, False)
                seen = {isolated: run(scene, keys, Path(folder), isolated) for isolated in order}
                for kind in range(2):
                    ratios[kind].append(seen[True][kind] / seen[False][kind])
            options = "".join(f" --set {key}" for key in keys)
            note = f" ({what})" if what else ""
            print(f"| `{scene}{options}`{note} | {percent(ratios[0])} | {percent(ratios[1])} |", flush=True)


if __name__ == "__main__":
    main()
