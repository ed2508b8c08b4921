#!/usr/bin/env bash
# A wheel of the Python module for Linux systems with glibc 2.17 or newer (manylinux2014): linked by zig, whatever glibc this
# system has.
# usage: wheel.sh [DIRECTORY]; by default target/wheels
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

tools=target/python/zig
python3 -m venv "$tools"
"$tools/bin/pip" install --quiet --disable-pip-version-check 'maturin>=1.9,<2' ziglang cargo-zigbuild
# Objects for another linker are kept apart.
export CARGO_TARGET_DIR=${CARGO_TARGET_DIR:-$PWD/target}/zig
# maturin and cargo-zigbuild ask the first python3 for zig.
PATH=$PWD/$tools/bin:$PATH
RUMPLE_PLUGINS=$(uname -m)-unknown-linux-gnu/release \
    python/plugins.sh cargo-zigbuild zigbuild --target "$(uname -m)-unknown-linux-gnu.2.17"
maturin build --release --locked --zig --compatibility manylinux2014 \
    --manifest-path python/Cargo.toml --out "${1:-target/wheels}"
