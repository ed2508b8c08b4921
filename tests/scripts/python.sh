#!/usr/bin/env bash
# The Python module: lints, the wheel (into target/wheels), and its tests in a clean environment without Rust.
# usage: python.sh; left out where its packages cannot be installed
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

build=target/python/build
clean=target/python/clean
target=${CARGO_TARGET_DIR:-$PWD/target}

prepared() {
    python3 -m venv "$build" && python3 -m venv --clear "$clean" \
        && "$build/bin/pip" install --quiet --disable-pip-version-check 'maturin>=1.9,<2' \
        && "$clean/bin/pip" install --quiet --disable-pip-version-check numpy pytest
}
# What optional parts and their tests need: tables, fits, the tutorial.
optional=(pandas cloudpickle scipy matplotlib nbclient ipykernel jax xarray tqdm)

if ! prepared; then
    echo "left out: maturin, numpy and pytest cannot be installed"
    exit 0
fi

if ! "$clean/bin/pip" install --quiet --disable-pip-version-check "${optional[@]}"; then
    echo "left out: studies, fit and tutorial: ${optional[*]} cannot be installed"
fi

export CARGO_TARGET_DIR=$target
rm -rf target/wheels
# The source distribution has the files that it is compiled from.
source=$(mktemp -d)
trap 'rm -rf "$source"' EXIT
"$build/bin/maturin" sdist --manifest-path python/Cargo.toml --out "$source" 2>&1 | tail -1
tar -xzf "$source"/rumple-*.tar.gz -C "$source" --strip-components=1
# Its lock file loses what only other members of the workspace want, and gains nothing.
crates() { awk '/^name = /{name = $3} /^version = /{print name, $3}' "$1" | sort; }
cargo metadata --offline --format-version 1 --manifest-path "$source/python/Cargo.toml" >/dev/null
other=$(comm -13 <(crates Cargo.lock) <(crates "$source/Cargo.lock"))
[[ -z $other ]] || { echo "not in the lock file of the repository: $other"; exit 1; }
missing=$(comm -23 <(git ls-files src 'docs/book/*.md' | sort) \
    <(cd "$source" && find . -type f -printf '%P\n' | sort))
[[ -z $missing ]] || { echo "not in the source distribution: $missing"; exit 1; }
python/plugins.sh
"$build/bin/maturin" build --release --locked --quiet --manifest-path python/Cargo.toml --out target/wheels
cargo clippy --release --quiet --package rumple-python --features module -- -D warnings
"$clean/bin/pip" install --quiet --disable-pip-version-check --no-deps target/wheels/rumple-*.whl
env --default-signal=INT PATH=/usr/bin:/bin RUMPLE="${RUMPLE:-$target/release/rumple}" "$clean/bin/pytest" -q python/tests
