#!/usr/bin/env bash
# Builds a relocatable archive and a Debian package, installs and tests both without source, target directory and environment.
# usage: package.sh [DIR]; DIR is target/package if not given
#
# The programs are linked by zig from PyPI for glibc 2.31 or newer; where it cannot be installed, and with RUMPLE_NATIVE=1, they are
# those that `cargo build --release` has left in target/release. Debug information is stripped from copies.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

out=${1:-target/package}
oldest=2.31
zig=target/python/zig
if [[ -z ${RUMPLE_NATIVE:-} ]] && python3 -m venv "$zig" \
    && "$zig/bin/pip" install --quiet --disable-pip-version-check ziglang cargo-zigbuild; then
    # Objects for another linker are kept apart; cargo-zigbuild asks the first python3 for zig.
    built=${CARGO_TARGET_DIR:-$PWD/target}/zig
    CARGO_TARGET_DIR=$built PATH=$PWD/$zig/bin:$PATH \
        cargo-zigbuild zigbuild --release --locked --target "$(uname -m)-unknown-linux-gnu.$oldest"
    release=$built/$(uname -m)-unknown-linux-gnu/release
else
    echo "left out: a link for glibc $oldest by zig; the C library of this system is needed"
    release=${CARGO_TARGET_DIR:-target}/release oldest=
fi
[[ -x $release/rumple ]] || { echo "package.sh: no $release/rumple; run cargo build --release first" >&2; exit 2; }
version=$("$release/rumple" --version | cut -d' ' -f2)
machine=$(uname -m)
name=rumple-$version-$machine-linux
author=$(sed -n 's/^authors = \["\(.*\)"\]$/\1/p' Cargo.toml)
plugins=(brusselator curvature-feedback gray-scott hires oregonator robertson schnakenberg tension-feedback van-der-pol)

size() { du -bc "$@" | tail -1 | cut -f1 | numfmt --to=iec; }

# Program, plugins, scenes, SDK, completions, pages, book and licences below a root, as bin, lib and share.
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
    # Scenes of the hard cases want files that their tests make.
    (cd models && find . \( -name '*.toml' -o -name '*.svg' -o -name '*.msh' \) -not -path './hard/*' \
        -exec cp --parents {} "$scratch/models" \;)
    cp -r "$scratch/models" "$root/share/rumple/models"
    sdk "$root/share/rumple/plugins"
    "$root/bin/rumple" schema --out "$root/share/rumple/scene.schema.json"
    "$root/bin/rumple" man "$root/share/man/man1" >/dev/null
    gzip -9n "$root"/share/man/man1/*.1
    completion bash bash-completion/completions/rumple
    completion zsh zsh/vendor-completions/_rumple
    completion fish fish/vendor_completions.d/rumple.fish
    mkdir -p "$root/share/doc/rumple"
    cp LICENSE-MIT LICENSE-APACHE CHANGELOG.md CITATION.cff README.md "$root/share/doc/rumple/"
    # The book beside the scenes that it links to.
    git ls-files docs/book | xargs cp --parents -t "$root/share/doc/rumple"
    ln -s ../../rumple/models "$root/share/doc/rumple/models"
}

# The crates that a plugin in Rust is built with, as a workspace with the tables of this one that they refer to.
sdk() {
    local crate
    mkdir -p "$1"
    for crate in abi sdk; do
        (cd plugins && git ls-files "$crate" | grep -v "/tests/" | xargs -I{} cp --parents {} "$1")
        sed -i '/^\[dev-dependencies\]/,$d' "$1/$crate/Cargo.toml"
    done
    {
        printf '[workspace]\nmembers = ["abi", "sdk"]\nresolver = "3"\n\n'
        sed -n '/^\[workspace.package\]/,/^\[package\]/p' Cargo.toml | sed '/^\[package\]/d'
        printf '[workspace.dependencies]\nrumple-plugin-abi = { path = "abi", version = "%s" }\n' "$version"
    } >"$1/Cargo.toml"
}

completion() {
    mkdir -p "$root/share/$(dirname "$2")"
    "$root/bin/rumple" completions "$1" >"$root/share/$2"
}

# The first minutes with the program below a root, with nothing else: plugins, a run, a second run, a scene of one's own.
try() {
    local root=$1 rumple results
    rumple=$root/bin/rumple
    results=$(mktemp -d "$scratch/run.XXXX")
    (
        cd "$results"
        env -i "$rumple" plugin list >plugins.txt
        for plugin in "${plugins[@]}"; do
            grep -q "$plugin" plugins.txt || { echo "package.sh: $plugin is not found" >&2; exit 1; }
        done
        small=("$root/share/rumple/models/model-i/small.toml" --out small --quiet)
        small+=(--set sheet.vertices=400 --set time.until=0.05 --set output.every=0.05)
        env -i "$rumple" run "${small[@]}" >/dev/null
        [[ -s small/sheet.pvd && -s small/report.html ]]
        grep -q "$root/lib/rumple/plugins/libcurvature_feedback.so" small/provenance.json
        # Results are not written over unless that is asked for; then they are the same.
        sha256sum small/frames/* >frames.txt
        ! env -i "$rumple" run "${small[@]}" >/dev/null 2>again.txt
        grep -q -- --force again.txt
        env -i "$rumple" run "${small[@]}" --force >/dev/null
        sha256sum --quiet -c frames.txt
        # Scenes with a mesh and an outline beside them.
        for scene in petal oak; do
            env -i "$rumple" check "$root/share/rumple/models/plates/$scene.toml" >/dev/null
        done
        env -i "$rumple" new mine --from turing >/dev/null
        env -i "$rumple" run mine.toml --out mine --quiet --set sheet.vertices=200 --set time.until=0.1 \
            --set output.every=0.1 >/dev/null
        [[ -s mine/report.html ]]
        env -i "$rumple" plugin new own-growth >/dev/null
        grep -q "$root/share/rumple/plugins/sdk" own-growth/Cargo.toml
        bash -n "$root/share/bash-completion/completions/rumple"
        # As a shell does it: `rumple ru<tab>`.
        bash -c 'source "$1"; COMP_WORDS=(rumple ru); COMP_CWORD=1; _rumple rumple ru rumple; echo "${COMPREPLY[*]}"' \
            - "$root/share/bash-completion/completions/rumple" | grep -qw run
    )
    (
        cd "$root/share/doc/rumple"
        grep -o '(docs/book/[^)#]*' README.md | tr -d '(' | xargs ls >/dev/null
        [[ -s docs/book/manual/first-run.md && -s models/model-i/small.toml ]]
    )
    gunzip -c "$root/share/man/man1/rumple-run.1.gz" | grep -q '^.SH OPTIONS'
    if command -v man >/dev/null; then
        man --warnings -l "$root/share/man/man1/rumple-run.1.gz" 2>&1 >/dev/null | (! grep .)
        # Found by its name, as a user looks it up.
        man -M "$root/share/man" -w rumple-run | grep -q rumple-run.1.gz
    fi
}

# Installs the package by dpkg into a root of its own, tries it there, and removes it again. The root knows of the packages
# that it depends on, and of no others.
installed() {
    local package=$1 root=$2 admin=$2/var/lib/dpkg as=() dpkg
    if ((EUID != 0)); then
        as=(unshare --map-root-user)
        "${as[@]}" true 2>/dev/null || { echo "left out: installation by dpkg needs root or user namespaces"; return; }
    fi
    mkdir -p "$admin/info" "$admin/updates"
    dpkg-query --status libc6 libgcc-s1 >"$admin/status"
    touch "$admin"/info/{libc6,libgcc-s1}:"$arch".list
    dpkg=(env PATH="$PATH:/usr/sbin:/sbin" "${as[@]}" dpkg --root="$root" --log=/dev/null)
    "${dpkg[@]}" --install "$package" >/dev/null
    [[ $(dpkg-query --admindir="$admin" --show --showformat='${db:Status-Status}' rumple) == installed ]]
    try "$root/usr"
    alone "$root"
    "${dpkg[@]}" --purge rumple >/dev/null
    # Without a file of another package nothing is left of usr.
    [[ ! -e $root/usr || -z $(find "$root/usr" -iname '*rumple*') ]]
    echo "dpkg           installed, tried, removed"
}

# Runs the program with the root as all of its file system, to which only the libraries of libc6 and libgcc-s1 are added.
alone() {
    local root=$1 library
    mkdir -p "$root/proc" "$root/dev" "$root/tmp"
    for library in $(ldd "$root/usr/bin/rumple" "$root"/usr/lib/rumple/plugins/*.so | grep -o '/[^ )]*\.so[^ )]*' | sort -u); do
        [[ $library == "$root"/* ]] || install -D "$(realpath "$library")" "$root$library"
    done
    unshare --map-root-user --mount --pid --fork bash -c '
        mount -t proc proc "$1/proc" || exit 9
        chroot "$1" /usr/bin/rumple run /usr/share/rumple/models/model-i/small.toml --out /tmp/small --quiet \
            --set sheet.vertices=400 --set time.until=0.05 --set output.every=0.05 >/dev/null
    ' - "$root" 2>"$scratch/alone" || {
        (($? == 9)) && { echo "left out: a root that is all of the file system: $(head -1 "$scratch/alone")"; return; }
        cat "$scratch/alone" >&2
        return 1
    }
    [[ -s $root/tmp/small/report.html ]]
    grep -q '"/usr/lib/rumple/plugins/libcurvature_feedback.so"' "$root/tmp/small/provenance.json"
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
[[ -z $oldest || $(printf '%s\n' "$libc" "$oldest" | sort -V | tail -1) == "$oldest" ]] \
    || { echo "package.sh: the program needs glibc $libc, newer than $oldest" >&2; exit 1; }
arch=$(dpkg --print-architecture)
cat >"$deb/DEBIAN/control" <<CONTROL
Package: rumple
Version: $version
Architecture: $arch
Maintainer: $author <rumple@users.noreply.github.com>
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
# Not where they were made: nothing may lead back there.
rm -rf "${scratch:?}/$name" "$deb"
try "$here/archive/$name"
installed "$package" "$here/installed"

# A plugin of one's own by the installed SDK.
"$here/archive/$name/bin/rumple" plugin new own-growth --dir "$here/own" >/dev/null
CARGO_TARGET_DIR=$here/own/target cargo build --offline --release --quiet --manifest-path "$here/own/Cargo.toml"
"$here/archive/$name/bin/rumple" plugin validate "$here/own/target/release/libown_growth.so" >/dev/null

# What a registry would be given; only what is committed is complete there.
cargo package --offline --workspace --exclude rumple-python --exclude rumple-tests --exclude rumple-tests-dense --no-verify --allow-dirty --quiet --target-dir "$here/crates"
crates=("$here"/crates/package/rumple*.crate)
((${#crates[@]} == 10))
echo "crates         $(size "${crates[@]}"), ${#crates[@]} of them"

echo "program        $(size "$release/rumple"), stripped $(size "$here/archive/$name/bin/rumple")"
echo "plugins        $(size "$here/archive/$name"/lib/rumple/plugins/*.so), ${#plugins[@]} of them"
echo "archive        $(size "$out/$name.tar.xz")  $out/$name.tar.xz"
echo "package        $(size "$package")  $package (libc6 >= $libc)"
