#!/usr/bin/env bash
# Races the solver against the baselines of a folder, on one core, both sides in one run:
#
#   benches/race.sh --bench DIR [--sizes 5000,20000] [--only A|B|loose] [--method NAME]... [--help]
#
# Installs what the baselines need (Debian packages, as root), builds the engine and its plugin, and
# hands everything else to the program in benches/race. The folder is only read.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
here=$OLDPWD

arguments=()
while (($#)); do
    if [[ $1 == --bench ]]; then
        (($# > 1)) || { echo "--bench needs the folder of the baselines" >&2; exit 2; }
        folder=$(cd "$here" && cd "$2" && pwd) || { echo "no folder $2" >&2; exit 2; }
        arguments+=(--baselines "$folder")
        shift 2
    else
        arguments+=("$1")
        shift
    fi
done

packages=()
command -v gcc >/dev/null || packages+=(gcc libc6-dev)
for module in petsc4py numpy scipy; do
    /usr/bin/python3 -c "import $module" 2>/dev/null || packages+=("python3-$module")
done
if ((${#packages[@]})); then
    if ((EUID != 0)); then
        echo "please install: ${packages[*]}" >&2
        exit 1
    fi
    echo "installing ${packages[*]}" >&2
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive \
        apt-get install -y -qq --no-install-recommends "${packages[@]}" >/dev/null
fi

# The default members, plugins among them.
cargo build --release
exec cargo bench --quiet --bench race -- "${arguments[@]}"
