#!/usr/bin/env python3
"""Compares the frames of a .vtkhdf with those of a .pvd of the same run, both read by VTK.

    check_vtkhdf.py FILE.vtkhdf FILE.pvd

Times, points, cells and all arrays must have the same bits; names differ by a slash that is " per " in the first.
Exit status: 0 the same, 1 not.
"""

import pathlib
import sys
import xml.etree.ElementTree as ElementTree

import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader


def arrays(data):
    found = {}
    for i in range(data.GetNumberOfArrays()):
        array = data.GetArray(i)
        found[array.GetName().replace("/", " per ")] = vtk_to_numpy(array).copy()
    return found


def content(grid):
    found = {"points": vtk_to_numpy(grid.GetPoints().GetData()).copy()}
    found["cells"] = vtk_to_numpy(grid.GetCells().GetConnectivityArray()).astype("i8")
    found["types"] = numpy.array([grid.GetCellType(i) for i in range(grid.GetNumberOfCells())])
    for place, data in (("point", grid.GetPointData()), ("cell", grid.GetCellData())):
        for name, values in arrays(data).items():
            found[f"{place} {name}"] = values
    for name, values in arrays(grid.GetFieldData()).items():
        # Each reader has a name of its own for the time.
        if name not in ("Time", "TimeValue"):
            found[f"whole {name}"] = values
    return found


def main():
    one, many = map(pathlib.Path, sys.argv[1:3])
    complaints = []
    reader = vtkHDFReader()
    for event in ("ErrorEvent", "WarningEvent"):
        reader.AddObserver(event, lambda _caller, name: complaints.append(name))
    reader.SetFileName(str(one))
    reader.UpdateInformation()
    key = vtkStreamingDemandDrivenPipeline.TIME_STEPS()
    information = reader.GetOutputInformation(0)
    times = [information.Get(key, i) for i in range(information.Length(key))]
    entries = list(ElementTree.parse(many).getroot().iter("DataSet"))
    if times != [float(entry.get("timestep")) for entry in entries]:
        complaints.append(f"times {times}")
    for time, entry in zip(times, entries):
        reader.UpdateTimeStep(time)
        found = content(reader.GetOutput())
        other = vtkXMLUnstructuredGridReader()
        other.SetFileName(str(many.parent / entry.get("file")))
        other.Update()
        expected = content(other.GetOutput())
        if found.keys() != expected.keys():
            complaints.append(f"t = {time}: {sorted(found)} instead of {sorted(expected)}")
            continue
        for name, values in expected.items():
            if found[name].shape != values.shape or found[name].tobytes() != values.tobytes():
                complaints.append(f"t = {time}: {name} differs")
    for complaint in complaints:
        print(f"WRONG {complaint}", file=sys.stderr)
    if not complaints:
        print(f"VTK {vtkVersion().GetVTKVersion()}: {len(times)} frames are the same")
    return bool(complaints)


if __name__ == "__main__":
    sys.exit(main())
