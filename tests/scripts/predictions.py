#!/usr/bin/env python3
"""How far off predictions of the time of a run are: every shipped scene, run to its end.

    tests/scripts/predictions.py [--program target/release/rumple] [--only TEXT] [--predict S]

Scenes that would take longer than about a minute on one core are cut short in time, by the times in CUT. For
each: what `rumple explain` says in its three seconds, what the run said first and after which part of its time,
both relative to what was true. Times are processor times, which are nearly independent of other programs. The
plugins are looked for beside the program. Prints a table in Markdown, and the median and the worst ratio.
"""

import argparse
import json
import math
import statistics
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# time.until of scenes that take long: so far they come in about a minute.
CUT = {
    "model-i/spots": 1.0,
    "model-ii/wrinkles": 1.0,
    "paper/loose": 5.0,
    "paper/model-i": 2.0,
    "paper/model-ii": 6.0,
    "paper/sphere": 4.0,
}


def measured(scene, options):
    """What a run says of itself: its steps, its prediction, what it took."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "result")
        command = [options.program, "run", scene, "--threads", "1", "--quiet", "--out", out, *options.set]
        subprocess.run(command, check=True)
        return json.loads((out / "status.json").read_text())


def explained(scene, options):
    """What `explain` says: the words, and the processor time if there is a forecast."""
    command = [options.program, "explain", scene, "--threads", "1", "--json"]
    command += ["--predict", str(options.predict), *options.set]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    said = json.loads(text)
    (section,) = (section for section in said["sections"] if section["title"] == "run time")
    return section["lines"][0]["what"], said.get("predicted")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--program", default=ROOT / "target/release/rumple", type=Path)
    parser.add_argument("--only", default="", help="scenes whose path contains this")
    parser.add_argument("--predict", default=3.0, type=float, help="seconds that explain may spend")
    options = parser.parse_args()
    options.program = options.program.resolve()
    print("| scene | steps | CPU s | explain | a run, after | steps | CPU time |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    said_by = {"explain": [], "runs": []}
    for scene in sorted(ROOT.glob("models/*/*.toml")):
        name = str(scene.relative_to(ROOT / "models").with_suffix(""))
        if options.only not in name:
            continue
        options.set = ["--plugin-path", options.program.parent]
        if name in CUT:
            options.set += ["--set", f"time.until={CUT[name]}"]
            name += f", to time {CUT[name]:g}"
        status = measured(scene, options)
        words, before = explained(scene, options)
        steps, row = status["work"]["steps"], status["predicted"]
        cpu = row["took"]["cpu_seconds"] if row else status["cpu_seconds"]
        if before:
            said_by["explain"].append(before["cpu_seconds"] / cpu)
        said = words if before is None else f"{before['cpu_seconds'] / cpu:.2f}"
        cells = ["-", "-", "over before"]
        if row:
            took = row["took"]
            ratio = row["cpu_seconds"] / cpu
            said_by["runs"].append(ratio)
            cells = [
                f"step {row['after_steps']}, {100 * row['after_seconds'] / took['seconds']:.0f} %",
                f"{row['steps'] / steps:.2f}",
                f"{ratio:.2f}",
            ]
        print("| " + " | ".join([name, str(steps), f"{cpu:.1f}", said, *cells]) + " |", flush=True)
    for who, ratios in said_by.items():
        if ratios:
            off = [math.exp(abs(math.log(ratio))) for ratio in ratios]
            middle, worst = statistics.median(off), max(off)
            print(f"\n{who}: {len(off)} predictions, off by a factor of {middle:.2f} (median), {worst:.2f} (worst)")


if __name__ == "__main__":
    main()
