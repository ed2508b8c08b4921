"""Measures a pattern: python measure.py FRAME.vtu --array c --threshold 0.1 [--cells] [--ring R]

Regions are connected sets where the array is above the threshold: vertices along edges, or triangles
across edges with --cells and where only triangles have the array. With N regions of area A_act on a sheet
of area A_tot, in the deformed state, prints

    d = 2 (sqrt(A_tot / (pi N)) - sqrt(A_act / (pi N)))      (Zakharov & Dasbiswas 2021)

the mean distance between nearest centres of regions, and the share of the sheet's area above the
threshold. With --ring, the strongest Fourier mode around the centre of z at distance R (+- 3 %).
Needs vtk and numpy; prints JSON. Of a result directory in place of a frame, and for several thresholds, prints
a table: a row an output time.
"""

import argparse
import json
import os
import xml.etree.ElementTree as ElementTree

import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy


def read(path, name, cells):
    reader = vtk.vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    x = vtk_to_numpy(grid.GetPoints().GetData())
    triangles = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 3)
    places = [(grid.GetPointData(), "points"), (grid.GetCellData(), "cells")]
    for data, where in reversed(places) if cells else places:
        for k in range(data.GetNumberOfArrays()):
            # Units follow the name: "c", "mean_curvature [1/length]".
            if data.GetArrayName(k).split(" [")[0] == name:
                return x, triangles, vtk_to_numpy(data.GetArray(k)), where
    raise SystemExit(f"{path} has no array {name}")


def components(active, pairs):
    """Labels of the connected sets of active nodes, by union and find."""
    parent = np.arange(len(active))

    def root(i):
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for a, b in pairs[active[pairs].all(axis=1)]:
        parent[root(a)] = root(b)
    return np.array([root(i) if active[i] else -1 for i in range(len(active))])


def measure(path, name, threshold, cells, ring):
    x, triangles, value, where = read(path, name, cells)
    corner = x[triangles]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1) / 2
    edges = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
    if where == "points":
        weight = np.bincount(triangles.ravel(), np.repeat(area / 3, 3), minlength=len(x))
        centre, pairs = x, np.unique(edges, axis=0)
    else:
        weight, centre = area, corner.mean(axis=1)
        order = np.lexsort((edges[:, 1], edges[:, 0]))
        same = (edges[order][1:] == edges[order][:-1]).all(axis=1)
        pairs = np.stack([order[:-1][same] // 3, order[1:][same] // 3], axis=1)
    active = value > threshold
    label = components(active, pairs)
    names = np.unique(label[active])
    middle = np.array([np.average(centre[label == k], axis=0, weights=weight[label == k]) for k in names])
    total, above, n = area.sum(), weight[active].sum(), len(names)
    found = {"regions": n, "share above": above / total}
    if n:
        found["d"] = 2 * (np.sqrt(total / (np.pi * n)) - np.sqrt(above / (np.pi * n)))
    if n > 1:
        apart = np.linalg.norm(middle[:, None] - middle[None], axis=2)
        np.fill_diagonal(apart, np.inf)
        found["nearest centres"] = apart.min(axis=1).mean()
    found["height"] = [float(x[:, 2].min()), float(x[:, 2].max())]
    if ring:
        radius = np.hypot(x[:, 0], x[:, 1])
        near = np.abs(radius / ring - 1) < 0.03
        angle = np.arctan2(x[near, 1], x[near, 0])
        modes = [abs(np.mean(x[near, 2] * np.exp(-1j * m * angle))) for m in range(1, 40)]
        found["strongest mode"] = 1 + int(np.argmax(modes))
    return found


def table(result, name, thresholds, cells):
    """Prints the measures of every frame, as Markdown."""
    heads = [f"{head}, {name} > {t:g}" for t in thresholds for head in ("regions", "share", "d", "nearest")]
    print("| t | " + " | ".join(heads) + " |")
    print("| --- |" + " --- |" * len(heads))
    series = ElementTree.parse(os.path.join(result, "sheet.pvd")).getroot()
    for frame in series.iter("DataSet"):
        row = [f"{float(frame.get('timestep')):g}"]
        for threshold in thresholds:
            found = measure(os.path.join(result, frame.get("file")), name, threshold, cells, None)
            row += [str(found["regions"]), f"{found['share above']:.2f}"]
            row += [f"{found[k]:.1f}" if k in found else "-" for k in ("d", "nearest centres")]
        print("| " + " | ".join(row) + " |")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("frame")
    parser.add_argument("--array", default="c")
    parser.add_argument("--threshold", type=float, nargs="+", default=[0.1])
    parser.add_argument("--cells", action="store_true")
    parser.add_argument("--ring", type=float)
    given = parser.parse_args()
    if os.path.isdir(given.frame):
        table(given.frame, given.array, given.threshold, given.cells)
    else:
        found = measure(given.frame, given.array, given.threshold[0], given.cells, given.ring)
        print(json.dumps(found, indent=1, default=float))
