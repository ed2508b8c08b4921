#!/usr/bin/env bash
# Other programs beside the integrators of this one, against the same references.
#
#   benches/peers.sh [PROBLEM...]
#
#   robertson, oregonator, brusselator    kinetics without space: CVODE and SciPy
#   before                                Model I in equilibrium: explicit Euler with relaxations by PETSc's TAO, and by the
#                                         descent of the paper; with BENCH=FOLDER, where its energy is in C (seed/, A/)
#
# Makes the study of models/accuracy/studies.sh, runs the others at the same tolerances and output times into its folder
# peers/, and prints their errors against the reference of the study and their times (peers/errors.py). Needs gcc, SUNDIALS
# (Debian: libsundials-dev) and /usr/bin/python3 with SciPy and petsc4py (python3-scipy, python3-petsc4py), which are
# installed if this is root.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
studies=${STUDIES:-$PWD/results/accuracy}
[[ $# -gt 0 ]] || set -- robertson oregonator brusselator ${BENCH:+before}
[[ " $* " != *" before "* || -f ${BENCH:-}/seed/sheetlib.c ]] || {
    echo "before: needs BENCH=FOLDER with seed/sheetlib.c, seed/sheet.h and A/sheet.py" >&2
    exit 2
}
packages=()
command -v gcc >/dev/null || packages+=(gcc libc6-dev)
[[ -f /usr/include/cvode/cvode.h ]] || packages+=(libsundials-dev)
for module in scipy petsc4py; do
    /usr/bin/python3 -c "import $module" 2>/dev/null || packages+=("python3-$module")
done
if ((${#packages[@]})); then
    ((EUID == 0)) || { echo "please install: ${packages[*]}" >&2; exit 1; }
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${packages[@]}" >/dev/null
fi
cargo build --release
mkdir -p target/peers
gcc -O3 -march=native benches/peers/cvode.c -o target/peers/cvode \
    -lsundials_cvode -lsundials_nvecserial -lsundials_sunmatrixdense -lsundials_sunlinsoldense -lm

# peer STUDY NAME TOLERANCE COMMAND...: REPEATS times, for the time; what COMMAND prints is its account.
peer() {
    local folder=$studies/$1/peers/$2-$3 name=$2 tolerance=$3 seconds=() line=() failed=null
    shift 3
    mkdir -p "$folder"
    for ((k = 0; k < ${REPEATS:-3}; k++)); do
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
    printf '"factorisations": %s, "failed": %s, "fixed_steps": %s }\n' "${line[3]}" "$failed" "${FIXED:-false}" \
        >>"$folder/peer.json"
}

# Model I by explicit Euler, the step a share of the whole time, and relaxations after every step. Forces are left at a
# share that makes errors of the size that the steps make: tighter ones take longer and err alike.
sheet() {
    local folder=$studies/before start share force relaxation
    mkdir -p target/peers/A target/peers/seed
    cp "$BENCH/A/sheet.py" target/peers/A/
    gcc -O3 -march=native -fopenmp -shared -fPIC "$BENCH/seed/sheetlib.c" -o target/peers/seed/libsheet.so -lm
    target/release/rumple mesh generate disc radius=32 --vertices 2000 --seed 1 --out target/peers/before.obj \
        --force >/dev/null
    models/accuracy/studies.sh before
    start=$(ls "$folder"/members/*/states.bin | head -n 1)
    for relaxation in blmvm descent; do
        local name=Euler,_TAO_blmvm
        [[ $relaxation == blmvm ]] || name="Euler,_the_paper's_descent"
        for share in 1e-1 3e-2 1e-2 3e-3 1e-3; do
            force=$(/usr/bin/python3 -c "print(1e-2 * $share)")
            FIXED=true REPEATS=1 peer before "$name" "$share" /usr/bin/python3 benches/peers/sheet_peer.py "$relaxation" "$share" \
                "$force" 1.5 1.0 0.25 target/peers/before.obj "$start" target/peers/A
        done
    done
    /usr/bin/python3 benches/peers/errors.py "$folder"
}

for problem in "$@"; do
    case $problem in
    before) sheet; continue ;;
    robertson) until=40 every=40 ;;
    oregonator) until=360 every=360 ;;
    brusselator) until=50 every=5 ;;
    *) echo "no problem $problem: robertson, oregonator, brusselator, before" >&2; exit 2 ;;
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
    /usr/bin/python3 benches/peers/errors.py "$studies/$problem"
done
