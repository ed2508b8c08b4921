"""Whether two builds of the program write the same bits, over the shipped scenes.

    python3 benches/same_bits.py OLD NEW [scene.toml ...] [--seconds 20]

Every scene runs for a share of its time with both; frames and ledgers (but for the wall time) must have the same bytes. A
run that takes longer than the limit is interrupted, and the frames and rows that both have are compared. Exit code 1 if
anything differs.
"""

import argparse
import csv
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SHARE = 0.05


def until(scene: Path) -> float | None:
    """The end of the scene, if its `until` is written as a number."""
    value = tomllib.loads(scene.read_text()).get("time", {}).get("until")
    return value if isinstance(value, (int, float)) else None


def run(program: Path, scene: Path, out: Path, seconds: float) -> int | None:
    """Runs a part of `scene`; returns the exit code, or none where it was interrupted."""
    command = [program, "run", scene, "--out", out, "--quiet", "--threads", "1"]
    command += ["--plugin-path", program.parent]
    if (end := until(scene)) is not None:
        command += ["--set", f"time.until={SHARE * end}", "--set", f"output.every={SHARE * end / 4}"]
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        return None if child.wait(timeout=seconds) == 3 else child.returncode
    except subprocess.TimeoutExpired:
        child.terminate()
        child.wait()
        return None


def rows(directory: Path) -> list[str]:
    """The rows of the ledger without the wall time."""
    path = directory / "ledger.csv"
    table = list(csv.reader(path.open())) if path.exists() else []
    kept = [k for k, name in enumerate(table[0]) if not name.startswith("wall time")] if table else []
    return [",".join(row[k] for k in kept if k < len(row)) for row in table]


def difference(old: Path, new: Path, complete: bool) -> str | None:
    """The first difference of two results."""
    ledgers = rows(old), rows(new)
    if complete and len(ledgers[0]) != len(ledgers[1]):
        return f"{len(ledgers[0])} and {len(ledgers[1])} rows"
    for number, pair in enumerate(zip(*ledgers)):
        if pair[0] != pair[1]:
            return f"row {number} of the ledger"
    frames = [sorted(p.name for p in (d / "frames").glob("*")) for d in (old, new)]
    if complete and frames[0] != frames[1]:
        return f"{len(frames[0])} and {len(frames[1])} frames"
    # An interrupted run writes a last frame where it is.
    frames = frames if complete else [names[:-1] for names in frames]
    for name in sorted(set(frames[0]) & set(frames[1])):
        if (old / "frames" / name).read_bytes() != (new / "frames" / name).read_bytes():
            return name
    return None


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("scenes", type=Path, nargs="*")
    parser.add_argument("--seconds", type=float, default=20.0)
    arguments = parser.parse_args()
    programs = [path.resolve() for path in (arguments.old, arguments.new)]
    scenes = arguments.scenes or sorted((ROOT / "models").rglob("*.toml"))
    different = 0
    for scene in scenes:
        with tempfile.TemporaryDirectory() as folder:
            outs = [Path(folder) / name for name in ("old", "new")]
            codes = [run(p, scene, o, arguments.seconds) for p, o in zip(programs, outs)]
            complete = codes[0] is not None and codes[0] == codes[1]
            found = difference(*outs, complete)
            if None not in codes and codes[0] != codes[1]:
                found = f"exit codes {codes[0]} and {codes[1]}"
            count = len(rows(outs[0])) - 1
        different += found is not None
        state = f"DIFFERENT: {found}" if found else "the same"
        print(f"{scene.relative_to(ROOT) if scene.is_relative_to(ROOT) else scene}: {state}, "
              f"{max(count, 0)} rows, exit code {codes[0]}", flush=True)
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
