#!/usr/bin/env bash
# Races the monolithic integrator against CVODE (BDF, GMRES, ILU(0)) on a stiff reaction-diffusion
# system: Schnakenberg kinetics on a 20 000-vertex sphere to t = 50, the same matrix, start and core.
#
#   benches/stiff.sh --bench DIR
#
# DIR holds the baselines (mesh/make_mesh.py, B/make_sys.py, B/cvode_B.c). Needs gcc, the SUNDIALS and
# SuiteSparse headers (Debian: libsundials-dev libsuitesparse-dev) and a Python with numpy, scipy and
# vtk, named by $PYTHON (default: target/venv/bin/python of tests/run.sh with scipy added).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
[[ "${1:-}" == --bench && -d "${2:-}" ]] || { echo "usage: benches/stiff.sh --bench DIR" >&2; exit 2; }
bench=$(realpath "$2")
python=$(realpath -s "${PYTHON:-target/venv/bin/python}")
root=$PWD
cargo build --release
work=target/stiff
mkdir -p "$work/mesh" "$work/B"
cp -r "$bench/B/." "$work/B/"
cd "$work/B"
[[ -f ../mesh/sphere_20000.txt ]] \
    || "$python" "$bench/mesh/make_mesh.py" 20000 ../mesh/sphere_20000.txt --sphere --R 1
[[ -f sys.bin ]] || "$python" make_sys.py
gcc -O3 -march=native -I/usr/include/suitesparse cvode_B.c -o cvode_B -lsundials_cvode \
    -lsundials_nvecserial -lsundials_sunmatrixsparse -lsundials_sunlinsolklu \
    -lsundials_sunlinsolspgmr -lklu -lm
"$python" "$root/benches/stiff/scene.py" sys.npz .
[[ -f ref.bin ]] || ./cvode_B 1e-10 1e-13 ilu ref.bin
# Three rounds, turn by turn: the machine's clock drifts.
for round in 1 2 3; do
    ./cvode_B 1e-6 1e-9 ilu cvode.bin
    for rtol in 1e-5 3e-6; do
        /usr/bin/time -f "rumple rtol $rtol cpu %U s, %M KiB" \
            "$root/target/release/rumple" run scene.toml --threads 1 --out "rtol-$rtol" --force \
            --quiet --set "time.integrator.rtol=$rtol" --set time.integrator.atol=1e-8 2>&1 \
            | tail -1
    done
done
"$python" "$root/benches/stiff/error.py" sys.npz ref.bin cvode.bin rtol-1e-5 rtol-3e-6
