"""What each ingredient adds to an evaluation of forces and rates.

A disc with stretching, bending and one species that diffuses, under drag, by explicit Euler steps too short to move anything;
and the same with one ingredient more, of no strength. A step is one evaluation; its processor time is from runs of two
lengths. The script ends with an error where the work differs from that of the scene without: steps, gradients, calls of the
law, evaluations of what both list. Internal variables, which explicit methods refuse, are compared by steps of `staggered`.

    python3 benches/ingredients.py [--rumple target/release/rumple] [--vertices 5000] [--rounds 3]
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

STRETCHING = '{ kind = "stretching" }'
BENDING = '{ kind = "bending" }'
DIFFUSION = '{ kind = "diffusion", species = "c", coefficient = 1.0 }'
EXPLICIT = 'integrator = { kind = "explicit", method = "euler", step = 1e-12 }'
STAGGERED = 'integrator = { kind = "staggered", method = "euler", step = 1e-12 }'

# Name, and what of the scene it changes: the three effects, further ones, keys of [material] and [kinetics].
INGREDIENTS = {
    "thickness by formula": {"material": {"thickness": '"0.5 + 0*x"'}},
    "rest shape of the mesh": {"bending": '{ kind = "bending", rest = "mesh" }'},
    "spontaneous curvature": {"bending": '{ kind = "bending", curvature = "0*x" }'},
    "spontaneous curvature by the law": {"kinetics": {"curvature": '"1e-12*c"'}},
    "length factor by the law": {"kinetics": {"length_factor": '"1 + 1e-12*c"'}},
    "the same along fibres": {
        "kinetics": {"length_factor": '"1 + 1e-12*c"'},
        "more": '{ kind = "directed-growth", fibre = [1, 0, 0] }',
    },
    "growth in time": {"more": '{ kind = "growth", factor = "1 + 1e-12*t" }'},
    "growth along fibres in time": {"more": '{ kind = "growth", along = "1 + 1e-12*t", fibre = [1, 0, 0] }'},
    "active tension": {"more": '{ kind = "active-tension", value = 1e-12 }'},
    "active tension along fibres": {"more": '{ kind = "active-tension", value = 1e-12, fibre = [1, 0, 0] }'},
    "active tension by a species": {"more": '{ kind = "active-tension", value = "1e-12*c" }'},
    "foundation by formula": {"more": '{ kind = "foundation", where = "all", stiffness = "1e-12*(2 + 0*x)" }'},
    "diffusion by formula": {"diffusion": DIFFUSION.replace("1.0", '"1 + 0*x"')},
    "advection": {"more": '{ kind = "advection", species = "c", velocity = ["1e-12*y", 0, 0] }'},
    "flux through the rim": {"more": '{ kind = "flux", species = "c", where = "rim", value = 1e-12 }'},
    "exchange": {"more": '{ kind = "exchange", species = "c", where = "all", rate = 1e-12, reference = 0.0 }'},
    "held values": {"more": '{ kind = "hold", species = "c", where = "rim", value = 0.0 }'},
}
INTERNAL = {"remodelling": {"more": '{ kind = "remodelling", time = 1e12 }'}}


def scene(vertices, time, change):
    """The text of the scene with one ingredient; `time` has the integrator and the number of steps."""
    effects = [STRETCHING, change.get("bending", BENDING), change.get("diffusion", DIFFUSION)]
    effects += [change["more"]] if "more" in change else []
    material = {"young": "1e3", "poisson": "0.3333333333333333", "thickness": "0.5", "drag": "1.0"}
    material |= change.get("material", {})
    kinetics = {"rates.c": '"-c"', "initial.c": "0.1"} | change.get("kinetics", {})
    integrator, steps = time
    return "\n".join(
        [
            f"effect = [{', '.join(effects)}]",
            f'sheet = {{ shape = "disc", radius = 10.0, vertices = {vertices}, bump = {{ amplitude = 1.0, width = 3.0 }} }}',
            f"material = {{ {', '.join(f'{key} = {value}' for key, value in material.items())} }}",
            f'time = {{ policy = "simultaneous", until = {steps}e-12, {integrator} }}',
            "output.every = 1.0",
            "[kinetics]",
            *(f"{key} = {value}" for key, value in kinetics.items()),
        ]
    )


def run(rumple, folder, text):
    """The costs of a run."""
    path = Path(folder) / "scene.toml"
    path.write_text(text)
    out = Path(folder) / "out"
    subprocess.run([rumple, "run", path, "--out", out, "--force", "--quiet", "--threads", "1"], check=True)
    return json.loads((out / "costs.json").read_text())


def counts(costs):
    """What must not depend on an ingredient: the work, and evaluations of energies, transports and laws."""
    work = {key: costs["work"][key] for key in ("steps", "gradients", "law_calls")}
    parts = {}
    for part in costs["parts"]:
        known = {name: count for name, count in part["counts"] if name in ("energy and gradient", "rates")}
        if part["group"] in ("effect", "law") and known:
            parts[part["name"]] = known
    return work, parts


def evaluation(rumple, folder, texts):
    """Processor seconds of a step, and the counts of the longer run."""
    short, long = (run(rumple, folder, text) for text in texts)
    more = long["work"]["steps"] - short["work"]["steps"]
    return (long["cpu_seconds"] - short["cpu_seconds"]) / more, counts(long)


def compare(options, folder, integrator, ingredients):
    """Prints a row for every ingredient; whether all counts are those of the scene without."""
    texts = {
        name: [scene(options.vertices, (integrator, steps), change) for steps in options.steps]
        for name, change in ({"without": {}} | ingredients).items()
    }
    seconds = {name: [] for name in texts}
    same = True
    for _ in range(options.rounds):
        found = {}
        for name, pair in texts.items():
            time, found[name] = evaluation(options.rumple, folder, pair)
            seconds[name].append(time)
        work, parts = found["without"]
        for name in ingredients:
            other_work, other_parts = found[name]
            calls = other_work["law_calls"] if "kinetics" in ingredients[name] else work["law_calls"]
            wrong = other_work != work | {"law_calls": calls}
            wrong |= any(other_parts.get(part) != known for part, known in parts.items())
            if wrong:
                same = False
                print(f"{name}: {other_work} {other_parts}, without it {work} {parts}", file=sys.stderr)
    without = seconds["without"]
    print(f"| without, `{integrator.split(chr(34))[1]}` | {1e3 * statistics.median(without):.3f} ms | |")
    for name in ingredients:
        ratios = [time / base for time, base in zip(seconds[name], without)]
        print(f"| {name} | {statistics.median(ratios):.2f} | {min(ratios):.2f} to {max(ratios):.2f} |")
    return same


def main():
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rumple", default="target/release/rumple")
    parser.add_argument("--vertices", type=int, default=5000)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--steps", type=int, nargs=2, default=(100, 500))
    options = parser.parse_args()
    print("| ingredient | step over that without | of all rounds |\n| --- | ---: | ---: |")
    with tempfile.TemporaryDirectory() as folder:
        same = compare(options, folder, EXPLICIT, INGREDIENTS)
        same &= compare(options, folder, STAGGERED, INTERNAL)
    sys.exit(0 if same else "the work differs")


if __name__ == "__main__":
    main()
