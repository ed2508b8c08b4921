"""error.py SYSTEM.npz REFERENCE.bin RESULT…: relative L2 errors of the last frames of runs (folders)
or of solutions (files of interleaved doubles)."""
import glob
import os
import sys

import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

mass = np.repeat(np.load(sys.argv[1])["M"], 2)
reference = np.fromfile(sys.argv[2])
for result in sys.argv[3:]:
    if os.path.isdir(result):
        reader = vtk.vtkXMLUnstructuredGridReader()
        reader.SetFileName(sorted(glob.glob(f"{result}/frames/*.vtu"))[-1])
        reader.Update()
        data = reader.GetOutput().GetPointData()
        values = np.empty_like(reference)
        values[::2] = vtk_to_numpy(data.GetArray("u"))
        values[1::2] = vtk_to_numpy(data.GetArray("v"))
    else:
        values = np.fromfile(result)
    square = (mass * (values - reference) ** 2).sum() / (mass * reference**2).sum()
    print(f"{os.path.basename(result):24s} relative L2 error {np.sqrt(square):.2e}")
