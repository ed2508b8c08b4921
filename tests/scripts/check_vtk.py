#!/usr/bin/env python3
"""Reads a result directory with the real VTK and says whether it is right.

    check_vtk.py DIR [--digest] [--allow-nan]

DIR holds one .pvd and the frames it lists. Checked: every frame is read without a complaint; the
time in the index, the field array TimeValue and the time step that VTK reports are one number to
the last bit, and times ascend; all cells are triangles on points that exist; points are doubles;
all frames have the same numbers of points and cells and the same arrays; nothing is NaN or
infinite. --digest prints the SHA-256 of the little-endian bytes of every array as VTK holds them.
Exit status: 0 right, 1 wrong, 2 not a result directory.
"""

import argparse
import hashlib
import pathlib
import struct
import sys
import xml.etree.ElementTree as ElementTree

import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkCommonDataModel import VTK_TRIANGLE
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader


def bits(number):
    return struct.pack("<d", number)


class Checker:
    def __init__(self, options):
        self.options = options
        self.complaints = []
        self.shape = None
        self.ranges = {}

    def complain(self, where, what):
        self.complaints.append(f"{where}: {what}")

    def read(self, path):
        reader = vtkXMLUnstructuredGridReader()
        events = []
        for event in ("ErrorEvent", "WarningEvent"):
            reader.AddObserver(event, lambda _caller, name: events.append(name))
        reader.SetFileName(str(path))
        reader.UpdateInformation()
        key = vtkStreamingDemandDrivenPipeline.TIME_STEPS()
        information = reader.GetOutputInformation(0)
        steps = [
            information.Get(key, i)
            for i in range(information.Length(key) if information.Has(key) else 0)
        ]
        reader.Update()
        if events or reader.GetErrorCode():
            self.complain(path.name, f"VTK complains ({', '.join(events) or reader.GetErrorCode()})")
        return reader.GetOutput(), steps

    def array(self, frame, kind, name, values):
        if self.options.digest:
            little = numpy.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
            print("digest", kind, name, hashlib.sha256(little.tobytes()).hexdigest(), sep="\t")
        if values.dtype != numpy.float64:
            self.complain(frame, f"{kind} array `{name}` is {values.dtype}, expected float64")
        finite = numpy.isfinite(values)
        if not finite.all():
            first = numpy.argwhere(~finite)[0]
            if not self.options.allow_nan:
                self.complain(
                    frame,
                    f"{kind} array `{name}` has {(~finite).sum()} values that are not finite, "
                    f"first at {tuple(int(i) for i in first)}",
                )
        if finite.any():
            low, high = values[finite].min(), values[finite].max()
            old = self.ranges.get((kind, name), (low, high))
            self.ranges[kind, name] = (min(low, old[0]), max(high, old[1]))

    def frame(self, path, time):
        frame = path.name
        grid, steps = self.read(path)
        points, cells = grid.GetNumberOfPoints(), grid.GetNumberOfCells()
        if points == 0 or cells == 0:
            self.complain(frame, f"{points} points and {cells} cells")
            return
        value = grid.GetFieldData().GetArray("TimeValue")
        if value is None or value.GetNumberOfTuples() != 1:
            self.complain(frame, "no single TimeValue")
        else:
            if self.options.digest:
                print("time", bits(value.GetValue(0))[::-1].hex(), sep="\t")
            if bits(value.GetValue(0)) != bits(time):
                self.complain(frame, f"TimeValue {value.GetValue(0)!r}, index says {time!r}")
        if [bits(step) for step in steps] != [bits(time)]:
            self.complain(frame, f"VTK reports the times {steps}, index says {time!r}")
        self.array(frame, "points", "points", vtk_to_numpy(grid.GetPoints().GetData()))
        names = []
        for kind, data in (("point", grid.GetPointData()), ("cell", grid.GetCellData())):
            for i in range(data.GetNumberOfArrays()):
                array = data.GetArray(i)
                names.append((kind, array.GetName(), array.GetNumberOfComponents()))
                self.array(frame, kind, array.GetName(), vtk_to_numpy(array))
        self.cells(frame, grid, points, cells)
        shape = (points, cells, tuple(names))
        self.shape = self.shape or shape
        if shape != self.shape:
            self.complain(frame, f"has {shape}, the first frame has {self.shape}")

    def cells(self, frame, grid, points, cells):
        kinds = {grid.GetCellType(i) for i in range(cells)}
        if kinds != {VTK_TRIANGLE}:
            self.complain(frame, f"cell types {sorted(kinds)}, expected only triangles")
        corners = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
        if len(corners) != 3 * cells or corners.min() < 0 or corners.max() >= points:
            self.complain(frame, f"connectivity does not fit {cells} triangles on {points} points")
            return
        triangles = corners.reshape(-1, 3)
        first, second, third = triangles.T
        if ((first == second) | (second == third) | (third == first)).any():
            self.complain(frame, "a triangle has one point twice")
        if self.options.digest:
            little = triangles.astype("<i8").tobytes()
            print("digest", "cells", "connectivity", hashlib.sha256(little).hexdigest(), sep="\t")


def listed_in(index):
    """Times and names of the frames in a .pvd."""
    found = ElementTree.parse(index).getroot().iter("DataSet")
    return [(float(entry.get("timestep")), entry.get("file")) for entry in found]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("directory", type=pathlib.Path)
    parser.add_argument("--digest", action="store_true", help="print a hash of every array")
    parser.add_argument("--allow-nan", action="store_true", help="values may be NaN or infinite")
    options = parser.parse_args()
    indices = list(options.directory.glob("*.pvd"))
    if len(indices) != 1:
        print(f"{options.directory}: expected one index, found {len(indices)}", file=sys.stderr)
        return 2
    entries = [(time, options.directory / name) for time, name in listed_in(indices[0])]
    checker = Checker(options)
    if not entries:
        checker.complain(indices[0].name, "lists no frame")
    times = [time for time, _ in entries]
    if any(b <= a for a, b in zip(times, times[1:])):
        checker.complain(indices[0].name, "times do not ascend")
    for time, path in entries:
        if path.is_file():
            checker.frame(path, time)
        else:
            checker.complain(path.name, "is listed but missing")
    listed = {path.resolve() for _, path in entries}
    for path in sorted(options.directory.rglob("*.vtu")) + sorted(options.directory.rglob(".*.part")):
        if path.resolve() not in listed:
            checker.complain(path.name, "is there but not listed")

    print(f"VTK {vtkVersion().GetVTKVersion()}: {len(entries)} frames", end="")
    if times:
        print(f", times {times[0]!r} to {times[-1]!r}", end="")
    if checker.shape:
        print(f", {checker.shape[0]} points, {checker.shape[1]} triangles")
        components = {(kind, name): n for kind, name, n in checker.shape[2]}
        for (kind, name), (low, high) in checker.ranges.items():
            print(f"  {kind:6} {name} × {components.get((kind, name), 3)}: {low:.6g} to {high:.6g}")
    else:
        print()
    for complaint in checker.complaints:
        print(f"WRONG {complaint}", file=sys.stderr)
    return 1 if checker.complaints else 0


if __name__ == "__main__":
    sys.exit(main())
