"""What ranks compute and send in an iteration, and a model of parallel efficiency on a cluster from it.

    ranks.py COSTS LOG ONE VERTICES

COSTS is the `costs.json` of a run over ranks, LOG what the run printed with `PETSC_OPTIONS=-log_view`; ONE is the `costs.json` of one
process with the same scene and solver, VERTICES are those of the sheet. Counts are those of one rank: PETSc's, of the linear
solver, from its log (means over the ranks), the engine's own from `ranks` in `costs.json`.

    T(n, P) = n c + M α + B/β + R τ(P),    τ(P) = log₂P · α        efficiency = n c / T

n vertices a rank, c processor time of an iteration and vertex, M messages and B bytes sent in an iteration, R reductions. Bytes
grow by √n. α and β are those of InfiniBand EDR to HDR; τ is recursive doubling (Thakur, Rabenseifner & Gropp, Int. J. High
Perform. Comput. Appl. 19 (2005), doi:10.1177/1094342005051521).
"""

import json
import math
import re
import sys

LATENCY = 1.5e-6
BANDWIDTH = 12.5e9
RANKS = [64, 1024, 16384]
SIZES = [3_000, 10_000, 30_000, 100_000]


def events(log):
    """Rows of the table of events: count, flops of a rank, messages of all ranks, mean length, reductions."""
    rows = {}
    number = r"(\S+)"
    row = re.compile(r"^(\w+)\s+(\d+) +\S+ +" + " +".join([number] * 7))
    for line in log.splitlines():
        found = row.match(line)
        if found:
            name, count, _, _, flops, _, messages, length, reductions = found.groups()
            rows[name] = [float(n) for n in (count, flops, messages, length, reductions)]
    return rows


def per_iteration(costs, log):
    part = next(part for part in costs["parts"] if part["group"] == "ranks")
    own = dict(part["counts"])
    iterations = costs["work"]["iterations"]
    size = int(re.search(r"with (\d+) processors?,", log).group(1))
    table = events(log)
    print(f"{size} ranks, {iterations} iterations of L-BFGS, {costs['work']['factorisations']} hierarchies")
    print(f"{'':24} {'count':>9} {'Mflop':>9} {'messages':>9} {'kB':>9} {'reductions':>10}   each, a rank")
    for name in ["PCSetUp", "KSPSolve", "PCApply", "MatMult"]:
        if name in table:
            count, flops, messages, length, reductions = table[name]
            each = [flops / 1e6, messages / size, messages / size * length / 1e3, reductions]
            print(f"{name:24} {count:9.0f} " + " ".join(f"{value / count:9.2f}" for value in each))
    halo = [own["halo messages"], own["halo bytes"] / 1e3, own["reductions"]]
    print(f"{'engine, an iteration':24} {iterations:9} {'':9} " + " ".join(f"{v / iterations:9.2f}" for v in halo))
    petsc = [table[name] for name in ["PCSetUp", "KSPSolve"]]
    return {
        "messages": (sum(row[2] for row in petsc) / size + own["halo messages"]) / iterations,
        "bytes": (sum(row[2] * row[3] for row in petsc) / size + own["halo bytes"]) / iterations,
        "reductions": (sum(row[4] for row in petsc) + own["reductions"]) / iterations,
    }


def model(each, owned, cost):
    print(f"\n{each['messages']:.1f} messages, {each['bytes'] / 1e3:.1f} kB and {each['reductions']:.1f} reductions an iteration, "
          f"hierarchies included, and rank of {owned} vertices; {1e6 * cost:.2f} µs of processor a vertex")
    print(f"α = {1e6 * LATENCY} µs, β = {BANDWIDTH / 1e9} GB/s: efficiency by vertices a rank and ranks")
    print(f"{'vertices':>9} " + " ".join(f"{ranks:>8}" for ranks in RANKS))
    for n in SIZES:
        compute = n * cost
        sent = each["messages"] * LATENCY + each["bytes"] * math.sqrt(n / owned) / BANDWIDTH
        times = [compute + sent + each["reductions"] * math.log2(ranks) * LATENCY for ranks in RANKS]
        print(f"{n:9} " + " ".join(f"{compute / time:8.3f}" for time in times))


if __name__ == "__main__":
    with open(sys.argv[1], encoding="utf-8") as file:
        COSTS = json.load(file)
    with open(sys.argv[2], encoding="utf-8") as file:
        LOG = file.read()
    with open(sys.argv[3], encoding="utf-8") as file:
        ONE = json.load(file)
    vertices = int(sys.argv[4])
    size = int(re.search(r"with (\d+) processors?,", LOG).group(1))
    cost = ONE["cpu_seconds"] / ONE["work"]["iterations"] / vertices
    model(per_iteration(COSTS, LOG), vertices // size, cost)
