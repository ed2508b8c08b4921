#!/usr/bin/env bash
# What accuracy costs, a study a command, beside docs/notebook/accuracy.md:
#
#     models/accuracy/studies.sh before        makes the study, prints its advice
#     models/accuracy/studies.sh               lists the studies
#
# Reports, tables and plots go to results/accuracy/NAME (STUDIES=DIR for another folder); what is complete is not made
# again. CHECK=1 only checks that every scene can be run. Run from anywhere; needs `cargo build --release`.
set -euo pipefail
here="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
rumple="${RUMPLE:-$here/target/release/rumple}"
out="${STUDIES:-$here/results/accuracy}"

# study NAME SCENE OPTION...
study() {
    local name=$1 scene=$here/models/$2
    shift 2
    if [[ -n ${CHECK:-} ]]; then
        "$rumple" check "$scene" >/dev/null
        return
    fi
    echo "== $name"
    "$rumple" accuracy "$scene" --out "$out/$name" "$@"
}

# stiff NAME SCENE OPTION...: of kinetics without space, with the absolute tolerance that they need.
stiff() {
    local name=$1 scene=$2 method kinds=() references=()
    shift 2
    for method in bdf tr-bdf2 esdirk34; do
        kinds+=(--integrator "{ kind = \"monolithic\", method = \"$method\", rtol = 1e-4, atol = 1e-8 }")
    done
    for method in esdirk34 bdf; do
        references+=(--reference "{ kind = \"monolithic\", method = \"$method\", rtol = 1e-4, atol = 1e-8 }")
    done
    study "$name" "$scene" "${kinds[@]}" "${references[@]}" --seeds 0 "$@"
}

# A dome with a gentle feedback, smooth at all times.
dome() { study dome policies/dome.toml --limit 60; }

# Model I before it buckles.
before() { study before accuracy/before.toml --limit 60; }

# Model I under drag, through its first ring.
ring() { study ring accuracy/ring.toml --limit 120 --tolerances 1e-1,3e-2,1e-2,3e-3; }

# Model II.
motors() { study motors accuracy/motors.toml --limit 120 --tolerances 1e-1,3e-2,1e-2,3e-3; }

# Schnakenberg on a sphere.
sphere() { study sphere accuracy/sphere.toml --limit 60; }

# Stiff kinetics without space.
robertson() { stiff robertson kinetics/robertson.toml --tolerances 1e-2,1e-3,1e-4,1e-5,1e-6; }
brusselator() {
    stiff brusselator kinetics/brusselator.toml --tolerances 1e-2,1e-3,1e-4,1e-5,1e-6 --set output.every=5
}
oregonator() { stiff oregonator kinetics/oregonator.toml --tolerances 1e-2,1e-3,1e-4,1e-5,1e-6; }

studies=(dome before ring motors sphere robertson oregonator brusselator)
[[ $# -gt 0 ]] || { echo "studies: ${studies[*]}, or all"; exit 0; }
[[ $1 != all ]] || set -- "${studies[@]}"
failed=()
for study in "$@"; do
    [[ " ${studies[*]} " == *" $study "* ]] || { echo "no study \`$study\`: ${studies[*]}" >&2; exit 2; }
    set +e
    (set -e; "$study")
    code=$?
    set -e
    ((code == 0)) || failed+=("$study")
    ((code <= 128)) || exit "$code"
done
((${#failed[@]} == 0)) || { echo "failed: ${failed[*]}" >&2; exit 1; }
