"""What contact costs: in scenes where sheets touch, and where nothing is near.

    benches/contact.py PROGRAM touching                   the shipped scenes of models/contact, and Model I until folds touch
    benches/contact.py PROGRAM dense [--vertices 400 2000]   a crumpled sheet with and without contact
    benches/contact.py PROGRAM apart [--vertices 5000 20000] [--thickness 0.25 2]

`touching` prints steps, iterations, seconds, the share of contact, and what touches at the end. `dense` runs the closing
box of models/contact/crumpled.toml, without contact through itself. `apart` runs a dome under
pressure with and without contact and prints the cost of one evaluation, of one step limit and of all contact in
units of one evaluation of all other energies. Prints rows of `docs/notebook/contact.md`. One thread; needs the plugins beside PROGRAM.
"""

import argparse
import csv
import json
import os
import subprocess
import tempfile
from pathlib import Path

MODELS = Path(__file__).resolve().parent.parent / "models"
CONTACT = '\n[[effect]]\nkind = "contact"\n'


def run(program: str, scene: Path, *overrides: str) -> tuple[dict, dict]:
    """The costs of a run, and the last row of its ledger."""
    out = scene.with_suffix("")
    command = [program, "run", str(scene), "--out", str(out), "--force", "--quiet"]
    command += ["--plugin-path", str(Path(program).resolve().parent)]
    for override in overrides:
        command += ["--set", override]
    subprocess.run(command, check=True, env=os.environ | {"RAYON_NUM_THREADS": "1"})
    with (out / "ledger.csv").open() as rows:
        row = list(csv.DictReader(rows))[-1]
    return json.loads((out / "costs.json").read_text()), row


def parts(costs: dict) -> dict:
    """Seconds and counts of effects, by name."""
    return {part["name"]: part for part in costs["parts"] if part["group"] == "effect"}


def touching(program: str, folder: Path) -> None:
    """The scenes in which sheets touch."""
    scenes = {name: (MODELS / "contact" / f"{name}.toml").read_text() for name in ("crushed", "crumpled")}
    small = (MODELS / "model-i" / "small.toml").read_text()
    small = small.replace('policy = "quasi-static"', 'policy = "simultaneous"').replace("until = 1.0", "until = 6.0")
    small = small.replace("thickness = 0.5", "thickness = 0.5\ndrag = 1.0")
    scenes |= {"small": small, "small-contact": small.replace("\n[kinetics]", CONTACT + "\n[kinetics]")}
    print("| scene | steps | iterations | s | of contact | pairs | gap |\n| --- | --- | --- | --- | --- | --- | --- |")
    for name, text in scenes.items():
        scene = folder / f"{name}.toml"
        scene.write_text(text)
        costs, row = run(program, scene)
        work, contact = costs["work"], parts(costs).get("contact", {"share": 0.0})
        gap = row.get("gap of contact [length]", "")
        print(
            f"| {name} | {work['steps']} | {work['iterations']} | {costs['seconds']:.0f} | {contact['share']:.0%} "
            f"| {row.get('pairs of contact', '')} | {gap[:6]} |",
            flush=True,
        )


def dense(program: str, folder: Path, vertices: int) -> None:
    """A sheet in a closing box."""
    text = (MODELS / "contact" / "crumpled.toml").read_text()
    each = {}
    for name, scene_text in (("without", text.replace(CONTACT, "")), ("with", text)):
        assert (CONTACT in scene_text) == (name == "with"), "crumpled.toml has no contact that could be left out"
        scene = folder / f"{name}.toml"
        scene.write_text(scene_text)
        allowed = 0 if name == "with" else 10**9
        overrides = ("sheet.imperfection.amplitude=0.01", f"invariants.crossings={allowed}")
        costs, row = run(program, scene, f"sheet.vertices={vertices}", *overrides)
        work = costs["work"]
        relaxations = next(part for part in costs["parts"] if part["name"].startswith("relaxation"))["counts"][0][1]
        each[name] = [costs["seconds"] / n for n in (relaxations, work["gradients"] + work["energies"])]
        share = parts(costs).get("contact", {"share": 0.0})["share"]
        last = f"{share:.0%} | {row.get('pairs of contact', '')}"
        relaxation, evaluation = (1e3 * seconds for seconds in each[name])
        crossings = row.get("crossings [pairs of triangles]", "")
        print(
            f"| {vertices}, {name} | {work['steps']} | {relaxations} | {work['iterations']} | {relaxation:.0f} | {evaluation:.2f} "
            f"| {last} | {crossings} |",
            flush=True,
        )
    ratios = [contact / free for contact, free in zip(each["with"], each["without"], strict=True)]
    print(f"| with : without | | | | {ratios[0]:.1f} | {ratios[1]:.1f} | | | |", flush=True)


def apart(program: str, folder: Path, vertices: int, thickness: float) -> None:
    """A dome under pressure whose surfaces are far from one another."""
    text = (MODELS / "policies" / "dome.toml").read_text()
    text = text.replace("thickness = 2.0", f"thickness = {thickness}")
    seconds = {}
    for name, more in (("without", ""), ("with", CONTACT)):
        scene = folder / f"{name}.toml"
        scene.write_text(text + more)
        costs, row = run(program, scene, f"sheet.vertices={vertices}", "time.until=0.5")
        seconds[name], own = costs["seconds"], parts(costs)
    others = sum(part["seconds"] for name, part in own.items() if name in ("stretching", "bending", "pressure"))
    gradients = costs["work"]["gradients"] + costs["work"]["energies"]
    each = others / gradients
    contact = own["contact"]["seconds"]
    print(
        f"| {vertices} | {thickness} | {row['pairs of contact']} | {1e3 * each:.2f} | {contact / gradients / each:.2f} "
        f"| {seconds['with'] / seconds['without']:.2f} |",
        flush=True,
    )


def main() -> None:
    """Reads the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("what", choices=["touching", "dense", "apart"])
    parser.add_argument("--vertices", type=int, nargs="+")
    parser.add_argument("--thickness", type=float, nargs="+", default=[0.25, 2.0])
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        if given.what == "touching":
            return touching(given.program, Path(folder))
        if given.what == "dense":
            head = "vertices, contact | steps | relaxations | iterations | ms a relaxation | ms an evaluation | of contact"
            print(f"| {head} | pairs | crossings |")
            print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
            for vertices in given.vertices or [400, 2000]:
                dense(given.program, Path(folder), vertices)
            return None
        print("| vertices | thickness | pairs | ms an evaluation of the others | contact, in these | run, with : without |")
        print("| --- | --- | --- | --- | --- | --- |")
        for vertices in given.vertices or [5000, 20000]:
            for thickness in given.thickness:
                apart(given.program, Path(folder), vertices, thickness)


if __name__ == "__main__":
    main()
