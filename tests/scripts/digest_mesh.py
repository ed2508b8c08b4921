#!/usr/bin/env python3
"""Prints the SHA-256 of the points and triangles of a mesh file (.vtu, .vtp) as VTK reads it.

Points are little-endian doubles, vertex numbers 64-bit integers. Exit status 1 if VTK complains or
finds anything but triangles.
"""

import hashlib
import sys

from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import VTK_TRIANGLE
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLUnstructuredGridReader

path = sys.argv[1]
ending = path.rsplit(".", 1)[1]
reader = {"vtp": vtkXMLPolyDataReader, "vtu": vtkXMLUnstructuredGridReader}[ending]()
complaints = []
for event in ("ErrorEvent", "WarningEvent"):
    reader.AddObserver(event, lambda _caller, name: complaints.append(name))
reader.SetFileName(path)
reader.Update()
mesh = reader.GetOutput()
kinds = {mesh.GetCellType(i) for i in range(mesh.GetNumberOfCells())}
if complaints or kinds != {VTK_TRIANGLE}:
    sys.exit(f"{path}: {complaints}, cell types {kinds}")
cells = mesh.GetPolys() if mesh.IsA("vtkPolyData") else mesh.GetCells()
digest = hashlib.sha256(vtk_to_numpy(mesh.GetPoints().GetData()).astype("<f8").tobytes())
digest.update(vtk_to_numpy(cells.GetConnectivityArray()).astype("<i8").tobytes())
print(digest.hexdigest())
