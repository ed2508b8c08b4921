#!/usr/bin/env bash
# CVODE and SciPy beside the integrators of this program, in the same plots: kinetics without space.
#
#   benches/peers.sh [PROBLEM...]        robertson, oregonator, brusselator
#
# Makes the study of models/accuracy/studies.sh, runs the others at the same tolerances and output times into its folder
# peers/, and gathers the report again: errors are against the same reference, by the same measure. Needs gcc, SUNDIALS
# (Debian: libsundials-dev) and /usr/bin/python3 with SciPy (python3-scipy), which are installed if this is root.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
studies=${STUDIES:-$PWD/results/accuracy}
[[ $# -gt 0 ]] || set -- robertson oregonator brusselator
packages=()
command -v gcc >/dev/null || packages+=(gcc libc6-dev)
[[ -f /usr/include/cvode/cvode.h ]] || packages+=(libsundials-dev)
/usr/bin/python3 -c "import scipy" 2>/dev/null || packages+=(python3-scipy)
if ((${#packages[@]})); then
    ((EUID == 0)) || { echo "please install: ${packages[*]}" >&2; exit 1; }
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${packages[@]}" >/dev/null
fi
cargo build --release --workspace
mkdir -p target/peers
gcc -O3 -march=native benches/peers/cvode.c -o target/peers/cvode \
    -lsundials_cvode -lsundials_nvecserial -lsundials_sunmatrixdense -lsundials_sunlinsoldense -lm

# peer STUDY NAME TOLERANCE COMMAND...: three times, for the time; what COMMAND prints is its account.
peer() {
    local folder=$studies/$1/peers/$2-$3 name=$2 tolerance=$3 seconds=() line=() failed=null
    shift 3
    mkdir -p "$folder"
    for _ in 1 2 3; do
        if ! read -r -a line < <("$@" "$folder/states.bin" 2>"$folder/log"); then
            failed="\"$(tail -n 1 "$folder/log" | tr -d '"\\')\""
            line=(0 0 0 0)
            break
        fi
        seconds+=("${line[0]}")
    done
    local all
    all=$(IFS=,; echo "${seconds[*]}")
    printf '{ "integrator": "%s", "tolerance": %s, "seconds": [%s], "steps": %s, "evaluations": %s, ' \
        "${name//_/ }" "$tolerance" "$all" "${line[@]:1:2}" >"$folder/peer.json"
    printf '"factorisations": %s, "failed": %s }\n' "${line[3]}" "$failed" >>"$folder/peer.json"
}

for problem in "$@"; do
    case $problem in
    robertson) until=40 every=40 ;;
    oregonator) until=360 every=360 ;;
    brusselator) until=50 every=5 ;;
    *) echo "no problem $problem: robertson, oregonator, brusselator" >&2; exit 2 ;;
    esac
    models/accuracy/studies.sh "$problem"
    for tolerance in 1e-2 1e-3 1e-4 1e-5 1e-6 1e-7; do
        absolute=$(/usr/bin/python3 -c "print(1e-4 * $tolerance)")
        peer "$problem" CVODE,_BDF "$tolerance" target/peers/cvode "$problem" "$tolerance" "$absolute" $until $every
        for method in BDF Radau; do
            peer "$problem" "SciPy,_$method" "$tolerance" /usr/bin/python3 benches/peers/scipy_peer.py \
                "$problem" $method "$tolerance" "$absolute" $until $every
        done
    done
    target/release/rumple accuracy "$studies/$problem"
done
