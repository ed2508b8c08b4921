"""What the shipped scenes cost: processor seconds, steps and iterations of one thread each, as a Markdown table.

    python3 benches/shipped.py [--rumple target/release/rumple] [--only NAME] [--out DIR]
"""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

MODELS = Path(__file__).resolve().parent.parent / "models"
# Cases that are to fail, or that need files which a script makes.
LEFT_OUT = {"hard", "accuracy"}


def row(options, scene, out):
    """The row of `scene`, which runs unless `out` has its result."""
    if not (out / "status.json").exists():
        command = [options.rumple, "run", scene, "--threads", "1", "--out", out, "--quiet", "--force"]
        subprocess.run(command, check=False)
    status = json.loads((out / "status.json").read_text(encoding="utf-8"))
    work = status["work"]
    name = scene.relative_to(MODELS)
    start = status["start"]["cpu_seconds"] if status.get("start") else 0.0
    cells = [f"[`{name}`](../../models/{name})", f"{status['time']:g}", f"{status['cpu_seconds']:.1f}", f"{start:.1f}"]
    return [*cells, f"{work['steps']}", f"{work['iterations']}", status["status"]]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rumple", default="target/release/rumple")
    parser.add_argument("--only", default="")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    root = options.out or Path(tempfile.mkdtemp())
    print("| scene | to t | CPU s | of these the start | steps | iterations | |\n| --- | --- | --- | --- | --- | --- | --- |")
    for scene in sorted(MODELS.glob("*/*.toml")):
        name = scene.relative_to(MODELS)
        if name.parts[0] not in LEFT_OUT and options.only in str(name):
            print("|", " | ".join(row(options, scene, root / name.with_suffix(""))), "|", flush=True)


if __name__ == "__main__":
    main()
