#!/usr/bin/env python3
"""References of contact for `tests/effects/proximity.rs`, from ipctk and from exact arithmetic.

usage: contact.py pairs|energies|shares < records > answers

All numbers are 64-bit floats in the machine's order, record after record:

pairs     kind (0: point and triangle, 1: two edges), 12 coordinates
          → d² without any round-off before its last digit, and by ipctk, 12 derivatives, 144 second derivatives
energies  12 + 6 coordinates of two triangles now, 18 at rest, reach, stiffness
          → energy of their contact, 18 derivatives, 324 second derivatives, composed of the distances, the barrier
          and the mollifier of ipctk
shares    kind, 12 coordinates, 12 components of a step, share
          → 1 where the features touch on the share of the step, 0 where they do not, without any round-off
"""

import sys
from fractions import Fraction

TRIANGLE, EDGES = 0, 1


def squared_distance(kind, x):
    """d² with its first and second derivatives."""
    import ipctk

    name = "point_triangle" if kind == TRIANGLE else "edge_edge"
    of = [getattr(ipctk, f"{name}_distance{part}") for part in ("", "_gradient", "_hessian")]
    return [f(*x) for f in of]


def composed(kind, x, reach, stiffness):
    """The barrier of the distance, with its derivatives."""
    import ipctk
    import numpy as np

    square, by, twice = squared_distance(kind, x)
    d = np.sqrt(square)
    if not d < reach:
        return 0.0, np.zeros(12), np.zeros((12, 12))
    by, twice = by / (2 * d), twice / (2 * d) - np.outer(by, by) / (4 * d**3)
    scale = stiffness / reach
    value = scale * ipctk.barrier(d, reach)
    slope = scale * ipctk.barrier_first_derivative(d, reach)
    curvature = scale * ipctk.barrier_second_derivative(d, reach)
    return value, slope * by, slope * twice + curvature * np.outer(by, by)


def mollified(x, rest, reach, stiffness):
    """The same of two edges, times the mollifier."""
    import ipctk
    import numpy as np

    value, by, twice = composed(EDGES, x, reach, stiffness)
    bound = ipctk.edge_edge_mollifier_threshold(*rest)
    m = ipctk.edge_edge_mollifier(*x, bound)
    m_by = ipctk.edge_edge_mollifier_gradient(*x, bound)
    m_twice = ipctk.edge_edge_mollifier_hessian(*x, bound)
    mixed = np.outer(m_by, by)
    return m * value, m * by + value * m_by, m * twice + mixed + mixed.T + value * m_twice


def energy(record):
    """Energy, derivatives and second derivatives of two triangles in contact."""
    import numpy as np

    x, rest = record[:18].reshape(6, 3), record[18:36].reshape(6, 3)
    reach, stiffness = record[36:]
    area = [0.5 * np.linalg.norm(np.cross(b - a, c - a)) for a, b, c in (rest[:3], rest[3:])]
    value, by, twice = 0.0, np.zeros(18), np.zeros((18, 18))

    def add(weight, corners, of):
        nonlocal value
        places = np.concatenate([np.arange(3 * k, 3 * k + 3) for k in corners])
        value += weight * of[0]
        by[places] += weight * of[1]
        twice[np.ix_(places, places)] += weight * of[2]

    first, second = [0, 1, 2], [3, 4, 5]
    for own, other, size in ((first, second, area[0]), (second, first, area[1])):
        for v in own:
            corners = [v, *other]
            add(size / 6, corners, composed(TRIANGLE, x[corners], reach, stiffness))
    for e in ((0, 1), (1, 2), (0, 2)):
        for f in ((3, 4), (4, 5), (3, 5)):
            corners = [*e, *f]
            of = mollified(x[corners], rest[corners], 0.5 * reach, stiffness)
            add((area[0] + area[1]) / 12, corners, of)
    return np.concatenate([[value], by, twice.ravel()])


def exact(kind, x):
    """d² in rational numbers: the least over the planes, lines and corners that hold the nearest points."""
    x = [[Fraction(float(c)) for c in corner] for corner in x]
    minus = lambda a, b: [p - q for p, q in zip(a, b)]
    dot = lambda a, b: sum(p * q for p, q in zip(a, b))

    def point_edge(p, a, b):
        along, out = minus(b, a), minus(p, a)
        length, share = dot(along, along), dot(along, out)
        if share <= 0 or length == 0:
            return dot(out, out)
        if share >= length:
            return dot(minus(p, b), minus(p, b))
        return dot(out, out) - share * share / length

    # Lines or planes of both features: r + s d - t e, with least squares.
    if kind == TRIANGLE:
        p, a, b, c = x
        edges = [point_edge(p, *ends) for ends in ((a, b), (b, c), (c, a))]
        r, d, e = minus(p, a), minus(a, b), minus(c, a)
    else:
        p, q, u, v = x
        edges = [point_edge(*of) for of in ((p, u, v), (q, u, v), (u, p, q), (v, p, q))]
        r, d, e = minus(p, u), minus(q, p), minus(v, u)
    aa, bb, cc, s0, t0 = dot(d, d), dot(d, e), dot(e, e), dot(d, r), dot(e, r)
    det = aa * cc - bb * bb
    if det > 0:
        s, t = (bb * t0 - s0 * cc) / det, (aa * t0 - bb * s0) / det
        inside = s >= 0 and t >= 0 and s + t <= 1 if kind == TRIANGLE else 0 <= s <= 1 and 0 <= t <= 1
        if inside:
            out = [r[k] + s * d[k] - t * e[k] for k in range(3)]
            return min(*edges, dot(out, out))
    return min(edges)


# What follows is exact: polynomials of a time from 0 to 1 are lists of integers, their Bernstein coefficients times
# binomial ones, so that products are convolutions. A polynomial has the sign that all its coefficients have.


def times(p, q):
    out = [0] * (len(p) + len(q) - 1)
    for i, a in enumerate(p):
        for j, b in enumerate(q):
            out[i + j] += a * b
    return out


def less(p, q):
    return [a - b for a, b in zip(p, q)]


def dot(a, b):
    products = (times(p, q) for p, q in zip(a, b))
    return [sum(c) for c in zip(*products)]


def cross(a, b):
    return [less(times(a[i], b[j]), times(a[j], b[i])) for i, j in ((1, 2), (2, 0), (0, 1))]


def minus(a, b):
    return [less(p, q) for p, q in zip(a, b)]


def sign(p):
    """1 or -1 where p is shown to have this sign at all times, else 0."""
    if min(p) > 0:
        return 1
    return -1 if max(p) < 0 else 0


def planes(kind, x):
    """Normals of planes that may separate features, with the corners on their sides."""
    if kind == TRIANGLE:
        p, a, b, c = x
        ab, ac, bc = minus(b, a), minus(c, a), minus(c, b)
        normal = cross(ab, ac)
        # The corners of a triangle are equally far in its own plane.
        yield normal, [p], [a]
        for corner in (a, b, c):
            yield minus(p, corner), [p], [a, b, c]
        for edge in (ab, ac, bc):
            yield cross(normal, edge), [p], [a, b, c]
        for edge, end in ((ab, a), (ac, a), (bc, b)):
            yield cross(cross(edge, minus(p, end)), edge), [p], [a, b, c]
    else:
        p, q, u, v = x
        d, e = minus(q, p), minus(v, u)
        normal = cross(d, e)
        yield normal, [p], [u]
        for a in (p, q):
            for b in (u, v):
                yield minus(a, b), [p, q], [u, v]
        for edge in (d, e):
            yield cross(normal, edge), [p, q], [u, v]
        for edge, out in ((d, minus(u, p)), (d, minus(v, p)), (e, minus(p, u)), (e, minus(q, u))):
            yield cross(cross(edge, out), edge), [p, q], [u, v]


def apart(kind, x):
    """Whether a plane is shown to separate the features at all times."""
    for normal, first, second in planes(kind, x):
        signs = {sign(dot(normal, minus(a, b))) for a in first for b in second}
        if len(signs) == 1 and 0 not in signs:
            return True
    return False


def touches(record, depth=60):
    """Whether no bisection of the time shows that the features stay apart."""
    kind, numbers = int(record[0]), [Fraction(float(c)) for c in record[1:]]
    start, step, share = numbers[:12], numbers[12:24], numbers[24]
    both = [(x, x + share * d) for x, d in zip(start, step)]
    scale = max(c.denominator for pair in both for c in pair)
    numbers = [[int(c * scale) for c in pair] for pair in both]
    parts = [(numbers, depth)]
    while parts:
        numbers, left = parts.pop()
        if apart(kind, [numbers[3 * k : 3 * k + 3] for k in range(4)]):
            continue
        if left == 0:
            return True
        parts.append(([[low + high, 2 * high] for low, high in numbers], left - 1))
        parts.append(([[2 * low, low + high] for low, high in numbers], left - 1))
    return False


def main():
    import numpy as np

    mode = sys.argv[1]
    size = {"pairs": 13, "energies": 38, "shares": 26}[mode]
    records = np.frombuffer(sys.stdin.buffer.read()).reshape(-1, size)
    if mode == "pairs":

        def answer(record):
            square, by, twice = squared_distance(int(record[0]), record[1:].reshape(4, 3))
            known = float(exact(int(record[0]), record[1:].reshape(4, 3)))
            return np.concatenate([[known, square], by, twice.ravel()])

    elif mode == "energies":
        answer = energy
    else:

        def answer(record):
            return np.array([float(touches(record))])

    for record in records:
        sys.stdout.buffer.write(answer(record).astype(float).tobytes())


if __name__ == "__main__":
    main()
