#!/usr/bin/env bash
# Renders a series with ParaView on a machine without a screen; arguments as of render.py.
#
# Without -noreset the virtual screen restarts when its first client leaves, and ParaView, which
# probes the screen before it draws, aborts every second time.
set -euo pipefail
export LIBGL_ALWAYS_SOFTWARE=1
exec xvfb-run -a -s "-screen 0 1280x1024x24 +extension GLX -noreset" \
    pvpython "$(dirname "${BASH_SOURCE[0]}")/render.py" "$@"
