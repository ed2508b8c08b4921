"""Strong and weak scaling of one sheet over ranks: seconds of a run of about as many iterations on every number of ranks.

    ranks_scaling.py PROGRAM OUT [--vertices N…] [--ranks P…] [--threads T…] [--option SETTING…]

PROGRAM is rumple with the feature `mpi`; OUT takes the runs of benches/ranks.toml (a lattice whose edges are as long whatever their
number: the sheet grows), nearly flat, with relaxations of ten iterations at most. `--threads` adds runs of one process with as many
threads and the solver that `auto` is there. A row: seconds after the preparation, iterations of L-BFGS, hierarchies (or factors) and
their mean time, solutions with them and theirs, all else an iteration, seconds of the preparation, memory of the first rank.
"""

import argparse
import json
import math
import os
import pathlib
import subprocess

WORK = [
    "sheet.bump.amplitude=0.001",
    "kinetics.initial.c.gaussian.amplitude=0.05",
    "material.drag=1",
    "time.until=0.01",
    "output.every=0.01",
    "equilibrium.max_iterations=10",
]
SCENE = pathlib.Path(__file__).parent / "ranks.toml"
ENVIRONMENT = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"} | os.environ


def run(args, vertices, ranks, threads):
    out = args.out / f"{vertices}-{ranks}-{threads}"
    width = math.sqrt(vertices / 2.0)
    settings = [*WORK, f"sheet.vertices={vertices}", f"sheet.width={width}", f"sheet.height={width}", *args.option]
    launcher = ["mpirun", *args.mpirun.split(), "-n", str(ranks)] if ranks else []
    own = [] if ranks else ["--set", "equilibrium={}"]
    command = [*launcher, args.program, "run", str(SCENE), "--threads", str(threads), "--out", str(out), *own]
    command += [word for setting in settings for word in ("--set", setting)]
    with open(f"{out}.log", "w", encoding="utf-8") as log:
        subprocess.run(command, stdout=log, stderr=log, env=ENVIRONMENT, timeout=args.seconds, check=True)
    return json.loads((out / "costs.json").read_text(encoding="utf-8"))


def row(costs, vertices, ranks, threads):
    parts = {part["name"]: part["seconds"] for part in costs["parts"]}
    work = costs["work"]
    made, solved = parts["factors of the Hessian"], parts["solutions with the Hessian"]
    before = parts["sheet, plugins, start, other tables"]
    total = costs["seconds"] - before
    on = f"{ranks} ranks" if ranks else f"{threads} threads"
    print(
        f"| {vertices} | {on} | {total:.2f} | {work['iterations']} | {work['factorisations']} of {made / work['factorisations']:.3f} | "
        f"{work['solves']} of {solved / work['solves']:.4f} | {(total - made - solved) / work['iterations']:.4f} | {before:.1f} | "
        f"{costs['peak_resident_bytes'] / 1e9:.2f} |",
        flush=True,
    )


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--vertices", type=int, nargs="*", default=[80_000])
    parser.add_argument("--ranks", type=int, nargs="*", default=[])
    parser.add_argument("--threads", type=int, nargs="*", default=[])
    parser.add_argument("--seconds", type=float, default=3600.0)
    parser.add_argument("--mpirun", default="--bind-to core", help="options of mpirun")
    parser.add_argument("--option", nargs="*", default=[])
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    print("| vertices | on | s | iterations | hierarchies of s | solutions of s | else, s an iteration | preparation, s | GB |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for vertices in args.vertices:
        for ranks, threads in [(0, t) for t in args.threads] + [(p, 1) for p in args.ranks]:
            row(run(args, vertices, ranks, threads), vertices, ranks, threads)


if __name__ == "__main__":
    main()
