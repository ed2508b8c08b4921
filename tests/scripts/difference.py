"""Differences of results from a reference: python difference.py REFERENCE RESULT... --array c

For every time that both wrote, relative to the reference and as root mean squares over the vertices:

    shape    sqrt( sum |x - X|^2 / sum Z^2 )      Z the heights of the reference
    array    sqrt( sum (c - C)^2 / sum C^2 )

Needs vtk and numpy.
"""

import argparse
import os
import xml.etree.ElementTree as ElementTree

import numpy as np

from measure import read


def frames(directory):
    """The file of every time."""
    series = ElementTree.parse(os.path.join(directory, "sheet.pvd")).getroot()
    sets = series.iter("DataSet")
    return {float(s.get("timestep")): os.path.join(directory, s.get("file")) for s in sets}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("reference")
    parser.add_argument("results", nargs="+")
    parser.add_argument("--array", required=True)
    given = parser.parse_args()
    reference = frames(given.reference)
    print(f"{'result':30} {'time':>10} {'shape':>10} {given.array:>10}")
    for result in given.results:
        files = frames(result)
        for time in sorted(t for t in files if t > 0 and t in reference):
            big_x, _, big_c, _ = read(reference[time], given.array, False)
            x, _, c, _ = read(files[time], given.array, False)
            shape = np.sqrt(np.sum((x - big_x) ** 2) / np.sum(big_x[:, 2] ** 2))
            array = np.linalg.norm(c - big_c) / np.linalg.norm(big_c)
            print(f"{result:30} {time:10g} {shape:10.2e} {array:10.2e}")


if __name__ == "__main__":
    main()
