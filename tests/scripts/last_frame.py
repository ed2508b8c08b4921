#!/usr/bin/env python3
"""Seconds until VTK shows the last frame of a series, from the opening of the file.

    last_frame.py FILE.pvd

Reads the times, then the last frame, and draws its surface off the screen. Run it under xvfb-run where there is none; the
first run of a file may also measure the disk.
"""

import pathlib
import sys
import time
import xml.etree.ElementTree as ElementTree

import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow


def main():
    path = pathlib.Path(sys.argv[1])
    start = time.perf_counter()
    entries = list(ElementTree.parse(path).getroot().iter("DataSet"))
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path.parent / entries[-1].get("file")))
    reader.Update()
    read = time.perf_counter()
    surface = vtkGeometryFilter()
    surface.SetInputData(reader.GetOutput())
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(surface.GetOutputPort())
    actor = vtkActor()
    actor.SetMapper(mapper)
    renderer = vtkRenderer()
    renderer.AddActor(actor)
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(1200, 900)
    window.AddRenderer(renderer)
    window.Render()
    shown = time.perf_counter()
    version = vtkVersion().GetVTKVersion()
    print(f"VTK {version}: {len(entries)} frames, t = {entries[-1].get('timestep')}, read in {read - start:.3f} s, shown in {shown - start:.3f} s")


main()
