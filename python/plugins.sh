#!/usr/bin/env bash
# Puts the plugins that ship, stripped, into the package, whose wheel then has them.
# usage: plugins.sh [BUILD COMMAND…], by default cargo build; a target directory other than release in $RUMPLE_PLUGINS
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

plugins=(brusselator curvature-feedback gray-scott hires oregonator robertson schnakenberg tension-feedback van-der-pol)
(($#)) || set -- cargo build
"$@" --release --locked --quiet "${plugins[@]/#/-p=}"
built=${CARGO_TARGET_DIR:-target}/${RUMPLE_PLUGINS:-release}
rm -rf python/rumple/plugins
for plugin in "${plugins[@]}"; do
    file=lib${plugin//-/_}.so
    install -Dm644 "$built/$file" "python/rumple/plugins/$file"
    strip --strip-unneeded "python/rumple/plugins/$file"
done
