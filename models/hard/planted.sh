#!/usr/bin/env bash
# Runs planted.toml with a plugin that has the fault of this name, and ends as the run does; with 99 if a frame is not
# whole or not listed. With `validate` as the second word the plugin is validated instead. Needs a C compiler.
#
#   planted.sh FAULT [validate]
set -euo pipefail
cc -std=c11 -O2 -shared -fPIC -w -DFAULT="$1" -I "$MODELS/../plugins/abi/include" \
    -o planted.so "$MODELS/../tests/faulty/planted.c" -lm
[[ ${2-} != validate ]] || exec "$RUMPLE" plugin validate ./planted.so --time-limit 3
cp "$MODELS/hard/planted.toml" .
code=0
"$RUMPLE" run planted.toml --out "$OUT" --threads 2 || code=$?
for frame in "$OUT"/frames/*.vtu; do
    [[ -e $frame ]] || continue
    grep -q "${frame##*/}" "$OUT/sheet.pvd" && tail -c 20 "$frame" | grep -q '</VTKFile>' || exit 99
done
exit "$code"
