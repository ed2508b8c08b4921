"""scipy_peer.py PROBLEM METHOD RTOL ATOL UNTIL EVERY STATES: SciPy's BDF or Radau on kinetics without space.

Prints a line: seconds steps evaluations factorisations. Writes the states as `cvode.c` does.
"""
import struct
import sys
import time

import numpy as np
from scipy.integrate import solve_ivp


def robertson(_, c):
    slow, middle, fast = 0.04 * c[0], 1e4 * c[1] * c[2], 3e7 * c[1] * c[1]
    return [middle - slow, slow - middle - fast, fast]


def oregonator(_, c):
    return [
        77.27 * (c[1] + c[0] * (1 - 8.375e-6 * c[0] - c[1])),
        (c[2] - (1 + c[0]) * c[1]) / 77.27,
        0.161 * (c[0] - c[2]),
    ]


def brusselator(_, c):
    q = c[0] * c[0] * c[1]
    return [1 + q - 4 * c[0], 3 * c[0] - q]


PROBLEMS = {
    "robertson": (robertson, [1.0, 0.0, 0.0]),
    "oregonator": (oregonator, [1.0, 2.0, 3.0]),
    "brusselator": (brusselator, [1.0, 1.0]),
}

problem, method, rtol, atol, until, every, states = sys.argv[1:]
rates, start = PROBLEMS[problem]
until, every = float(until), float(every)
outputs = np.unique(np.append(np.arange(0.0, until, every), until))
begin = time.process_time()
found = solve_ivp(rates, (0.0, until), start, method, outputs, rtol=float(rtol), atol=float(atol))
seconds = time.process_time() - begin
if not found.success:
    sys.exit(f"scipy: {found.message}")
with open(states, "wb") as file:
    file.write(b"rumple states 1\n")
    for when, values in zip(found.t, found.y.T):
        file.write(struct.pack("<d3Q", when, 0, 1, len(values)) + struct.pack(f"<{len(values)}Q", *[1] * len(values)))
        file.write(struct.pack("<3d", 0, 0, 0) + values.tobytes())
print(seconds, 0, found.nfev, found.nlu)
