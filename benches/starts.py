#!/usr/bin/env python3
"""How long programs take that do next to nothing: wall milliseconds, medians of 15.

usage: starts.py [PROGRAM [PYTHON]]; target/release/rumple, and a Python that has rumple
"""

import statistics
import subprocess
import sys
import time


def main(program="target/release/rumple", python=sys.executable):
    calls = [[program, "--help"], [program, "check", "models/policies/dome.toml"]]
    calls += [[python, "-c", code] for code in ("pass", "import numpy", "import rumple")]
    for call in calls:
        spent = []
        for _ in range(15):
            began = time.perf_counter()
            subprocess.run(call, check=True, capture_output=True)
            spent.append(time.perf_counter() - began)
        print(f"{1e3 * statistics.median(spent):7.1f} ms  {' '.join(call[1:])}")


if __name__ == "__main__":
    main(*sys.argv[1:])
