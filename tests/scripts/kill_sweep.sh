#!/usr/bin/env bash
# Kills a sweep again and again at random instants, resumes it each time, and compares the end with a sweep
# that was left alone: kill_sweep.sh [KILLS]
#
# Every third kill is of the sweep (signal 9), of one of its members (signal 9), or asks the sweep to end
# (SIGTERM). Measures must be equal to the last digit, and the files of every member to the last byte;
# members that are complete must not be run again.
set -euo pipefail
kills=${1:-20}
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
program=$here/target/release/rumple
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# Sixteen short members, so that kills meet all moments of their lives.
sweep=("$program" sweep "$here/models/model-i/small.toml" --quiet --jobs 2
    --over "material.thickness=0.5..2:4" --over "kinetics.parameters.c_star=0.1..0.4:4"
    --set sheet.vertices=600 --set time.until=0.5)
"${sweep[@]}" --out "$work/whole"
declare -A complete
interrupted=0
for ((k = 0; k < kills; k++)); do
    "${sweep[@]}" --out "$work/killed" >/dev/null 2>&1 &
    parent=$!
    sleep "0.$((RANDOM % 9))$((RANDOM % 10))"
    case $((k % 3)) in
        0) kill -9 "$parent" 2>/dev/null || true ;;
        1)
            child=$(pgrep -P "$parent" | shuf -n 1 || true)
            [[ -n $child ]] && kill -9 "$child" 2>/dev/null || true
            kill -TERM "$parent" 2>/dev/null || true
            ;;
        2) kill -TERM "$parent" 2>/dev/null || true ;;
    esac
    wait "$parent" && ended=0 || ended=$?
    ((ended != 0)) && interrupted=$((interrupted + 1))
    for status in "$work"/killed/members/*/status.json; do
        [[ -e $status ]] || continue
        if [[ -n ${complete[$status]:-} ]]; then
            [[ ${complete[$status]} == "$(sha256sum <"$status")" ]] || {
                echo "$status: a complete member was run again" >&2
                exit 1
            }
        elif grep -q '"status": "complete"' "$status"; then
            complete[$status]=$(sha256sum <"$status")
        fi
    done
done
"${sweep[@]}" --out "$work/killed"
# Without status, costs and the columns of what it cost.
measures() { python3 - "$1" <<'PY'
import csv, sys
for row in csv.DictReader(open(sys.argv[1])):
    print({k: v for k, v in row.items() if k not in ("CPU [s]", "memory [MB]")})
PY
}
cmp <(measures "$work/whole/sweep.csv") <(measures "$work/killed/sweep.csv")
files=0
while read -r file; do
    cmp "$work/whole/members/$file" "$work/killed/members/$file"
    files=$((files + 1))
done < <(cd "$work/whole/members" && find . -name '*.vtu' -o -name '*.pvd' -o -name measures.csv -o -name resolved.toml)
echo "$interrupted of $kills kills met the sweep at work; 16 members equal, $files files to the last byte"
