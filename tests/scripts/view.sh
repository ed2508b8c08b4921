#!/usr/bin/env bash
# Opens the viewer of a result directory in a headless browser: view.sh DIR PICTURES, with Chromium in the path (or
# RUMPLE_CHROMIUM) and a Python with playwright and vtk (RUMPLE_PYTHON).
set -euo pipefail
result=$1
pictures=$2
here=$(dirname "${BASH_SOURCE[0]}")
python=${RUMPLE_PYTHON:-target/venv/bin/python}
rumple=${RUMPLE:-target/release/rumple}
browser=${RUMPLE_CHROMIUM:-$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)}
if [[ -z $browser ]]; then
    echo "left out: no Chromium"
    exit 0
fi
mkdir -p "$pictures"
"$rumple" view "$result" --out "$pictures/view.html" --force
RUMPLE_CHROMIUM=$browser timeout 120 "$python" "$here/view.py" "$pictures/view.html" "$result" --pictures "$pictures"
# The page draws pictures and movies for the program, too.
for options in "picture --field mean_curvature --map coolwarm --title curvature --dpi 192 -o $pictures/picture.png" \
    "movie --view top --size 400x300 -o $pictures/movie.gif"; do
    # shellcheck disable=SC2086
    RUMPLE_BROWSER=$browser timeout 120 "$rumple" ${options%% *} "$result" ${options#* } --force
done
"$python" - "$pictures" <<'PY'
import struct
import sys
from pathlib import Path

for name, start in ("picture.png", b"\x89PNG"), ("movie.gif", b"GIF89a"):
    data = (Path(sys.argv[1]) / name).read_bytes()
    assert data.startswith(start) and len(data) > 10_000, (name, len(data))
    if name == "picture.png":
        assert struct.unpack(">II", data[16:20] + data[41:45]) == (2400, round(192 / 0.0254)), data[:54]
PY
