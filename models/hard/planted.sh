#!/usr/bin/env bash
# Runs planted.toml with a plugin that has the fault of this name, and ends as the run does; with 99 if a frame is not
# whole or not listed. Needs a C compiler.
#
#   planted.sh FAULT OPTION...     options of the run
set -euo pipefail
fault=$1
shift
cc -std=c11 -O2 -shared -fPIC -w -DFAULT="$fault" -DWIDTH=0.003 -I "$MODELS/../plugins/abi/include" \
    -o planted.so "$MODELS/../tests/faulty/planted.c" -lm
cp "$MODELS/hard/planted.toml" .
# A leak shows after hundreds of calls.
[[ $fault != LEAKS ]] || set -- "$@" --set time.until=15
[[ " $* " != *" --isolate "* ]] || set -- "$@" --plugin-limit 1
code=0
"$RUMPLE" run planted.toml --out "$OUT" --threads 2 "$@" || code=$?
for frame in "$OUT"/frames/*.vtu; do
    [[ -e $frame ]] || continue
    grep -q "${frame##*/}" "$OUT/sheet.pvd" && tail -c 20 "$frame" | grep -q '</VTKFile>' || exit 99
done
exit "$code"
