#!/usr/bin/env bash
# Builds a relocatable archive and a Debian package, and tests both without source, target directory and environment.
# usage: package.sh [DIR]; DIR is target/package if not given
#
# From the programs in target/release as `cargo build --release` leaves them; debug information is stripped from copies.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

out=${1:-target/package}
release=${CARGO_TARGET_DIR:-target}/release
[[ -x $release/rumple ]] || { echo "package.sh: no $release/rumple; run cargo build --release first" >&2; exit 2; }
version=$("$release/rumple" --version | cut -d' ' -f2)
machine=$(uname -m)
name=rumple-$version-$machine-linux
plugins=(brusselator curvature-feedback gray-scott hires oregonator robertson schnakenberg tension-feedback van-der-pol)

size() { du -bc "$@" | tail -1 | cut -f1 | numfmt --to=iec; }

# Program, plugins, scenes, completions, pages and licences below a root, as bin, lib and share.
tree() {
    local root=$1
    install -Dm755 "$release/rumple" "$root/bin/rumple"
    strip "$root/bin/rumple"
    for plugin in "${plugins[@]}"; do
        local file=lib${plugin//-/_}.so
        install -Dm644 "$release/$file" "$root/lib/rumple/plugins/$file"
        strip --strip-unneeded "$root/lib/rumple/plugins/$file"
    done
    mkdir -p "$root/share/rumple" "$root/share/man/man1"
    (cd models && find . -name '*.toml' -exec cp --parents {} "$scratch/models" \;)
    cp -r "$scratch/models" "$root/share/rumple/models"
    "$root/bin/rumple" schema --out "$root/share/rumple/scene.schema.json"
    "$root/bin/rumple" man "$root/share/man/man1" >/dev/null
    gzip -9n "$root"/share/man/man1/*.1
    completion bash bash-completion/completions/rumple
    completion zsh zsh/vendor-completions/_rumple
    completion fish fish/vendor_completions.d/rumple.fish
    mkdir -p "$root/share/doc/rumple"
    cp LICENSE-MIT LICENSE-APACHE CHANGELOG.md CITATION.cff "$root/share/doc/rumple/"
}

completion() {
    mkdir -p "$root/share/$(dirname "$2")"
    "$root/bin/rumple" completions "$1" >"$root/share/$2"
}

# Runs a scene with a plugin by the program below a root, with nothing else.
try() {
    local root=$1 results
    results=$(mktemp -d "$scratch/run.XXXX")
    (
        cd "$results"
        env -i "$root/bin/rumple" plugin list >plugins.txt
        for plugin in "${plugins[@]}"; do
            grep -q "$plugin" plugins.txt || { echo "package.sh: $plugin is not found" >&2; exit 1; }
        done
        env -i "$root/bin/rumple" run "$root/share/rumple/models/model-i/small.toml" --out small --quiet \
            --set sheet.vertices=400 --set time.until=0.05 --set output.every=0.05 >/dev/null
        [[ -s small/sheet.pvd && -s small/report.html ]]
        grep -q "$root/lib/rumple/plugins/libcurvature_feedback.so" small/provenance.json
        env -i "$root/bin/rumple" new mine --from turing >/dev/null
        env -i "$root/bin/rumple" check mine.toml >/dev/null
        bash -n "$root/share/bash-completion/completions/rumple"
    )
    gunzip -c "$root/share/man/man1/rumple-run.1.gz" | grep -q '^.SH OPTIONS'
    if command -v man >/dev/null; then
        man --warnings -l "$root/share/man/man1/rumple-run.1.gz" 2>&1 >/dev/null | (! grep .)
    fi
}

mkdir -p "$out"
scratch=$(realpath "$(mktemp -d "$out/.scratch.XXXX")")
trap 'rm -rf "$scratch"' EXIT
mkdir "$scratch/models"
tree "$scratch/$name"
tar -C "$scratch" --sort=name --owner=0 --group=0 --numeric-owner -c "$name" | xz -T2 -6 >"$out/$name.tar.xz"

deb=$scratch/deb
mkdir -p "$deb/DEBIAN"
cp -r "$scratch/$name" "$deb/usr"
# The least C library that has every symbol that is used.
libc=$(objdump -T "$deb/usr/bin/rumple" "$deb"/usr/lib/rumple/plugins/*.so | grep -o 'GLIBC_[0-9.]*' | cut -d_ -f2 | sort -Vu | tail -1)
arch=$(dpkg --print-architecture)
cat >"$deb/DEBIAN/control" <<CONTROL
Package: rumple
Version: $version
Architecture: $arch
Maintainer: The Rumple developers <rumple@localhost>
Installed-Size: $(du -sk "$deb/usr" | cut -f1)
Depends: libc6 (>= $libc), libgcc-s1
Suggests: paraview
Section: science
Priority: optional
Description: mechanics of thin elastic sheets coupled to chemical kinetics
 Runs scenes of thin elastic sheets whose shape and chemistry drive one another.
 Results open in ParaView and in a browser.
CONTROL
cat LICENSE-MIT LICENSE-APACHE >"$deb/usr/share/doc/rumple/copyright"
package=$out/rumple_${version}_$arch.deb
dpkg-deb --root-owner-group --build "$deb" "$package" >/dev/null

here=$scratch
mkdir "$here/archive" "$here/installed"
tar -C "$here/archive" -xf "$out/$name.tar.xz"
dpkg -x "$package" "$here/installed"
# Not where they were made: nothing may lead back there.
rm -rf "${scratch:?}/$name" "$deb"
try "$here/archive/$name"
try "$here/installed/usr"

echo "program        $(size "$release/rumple"), stripped $(size "$here/archive/$name/bin/rumple")"
echo "plugins        $(size "$here/archive/$name"/lib/rumple/plugins/*.so), ${#plugins[@]} of them"
echo "archive        $(size "$out/$name.tar.xz")  $out/$name.tar.xz"
echo "package        $(size "$package")  $package (libc6 >= $libc)"
