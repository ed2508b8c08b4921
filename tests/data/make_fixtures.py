"""Writes the small meshes of this folder with the VTK Python package (9.x).

A hexagon of seven vertices and six triangles with a point array c (1 component), a point array u
(3 components) and a cell array m. Run here as `python make_fixtures.py`; the files are committed,
so that tests need no Python.
"""

import math

import vtk


def fill(grid):
    points = vtk.vtkPoints()
    points.SetDataTypeToDouble()
    points.InsertNextPoint(0.0, 0.0, 0.125)
    for k in range(6):
        points.InsertNextPoint(math.cos(k * math.pi / 3), math.sin(k * math.pi / 3), 0.0)
    cells = vtk.vtkCellArray()
    for k in range(6):
        cells.InsertNextCell(3)
        for v in (0, 1 + k, 1 + (k + 1) % 6):
            cells.InsertCellPoint(v)
    grid.SetPoints(points)
    if grid.IsA("vtkPolyData"):
        grid.SetPolys(cells)
    else:
        grid.SetCells(vtk.VTK_TRIANGLE, cells)
    c, u, m = vtk.vtkDoubleArray(), vtk.vtkFloatArray(), vtk.vtkIntArray()
    c.SetName("c")
    u.SetName("u")
    u.SetNumberOfComponents(3)
    m.SetName("m")
    for k in range(7):
        c.InsertNextValue(0.1 * k)
        u.InsertNextTuple3(k, 0.5 * k, -k)
    for k in range(6):
        m.InsertNextValue(k - 2)
    grid.GetPointData().AddArray(c)
    grid.GetPointData().AddArray(u)
    grid.GetCellData().AddArray(m)
    time = vtk.vtkDoubleArray()
    time.SetName("TimeValue")
    time.InsertNextValue(3.25)
    grid.GetFieldData().AddArray(time)
    return grid


def write(writer, name, grid, **options):
    writer.SetFileName(name)
    writer.SetInputData(grid)
    for key, value in options.items():
        getattr(writer, key)(value) if value is not None else getattr(writer, key)()
    assert writer.Write()


u = fill(vtk.vtkUnstructuredGrid())
p = fill(vtk.vtkPolyData())
U, P = vtk.vtkXMLUnstructuredGridWriter, vtk.vtkXMLPolyDataWriter
write(U(), "ascii.vtu", u, SetDataModeToAscii=None)
write(U(), "inline-zlib.vtu", u, SetDataModeToBinary=None)
write(U(), "inline-lz4-int32.vtu", u, SetDataModeToBinary=None, SetIdTypeToInt32=None, SetCompressorTypeToLZ4=None)
write(U(), "inline-plain-header64.vtu", u, SetDataModeToBinary=None, SetCompressorTypeToNone=None, SetHeaderTypeToUInt64=None)
write(U(), "appended-base64-zlib.vtu", u)
write(U(), "appended-raw-zlib.vtu", u, EncodeAppendedDataOff=None)
write(U(), "appended-raw-plain.vtu", u, EncodeAppendedDataOff=None, SetCompressorTypeToNone=None)
write(U(), "appended-raw-lzma.vtu", u, EncodeAppendedDataOff=None, SetCompressorTypeToLZMA=None)
write(U(), "big-endian.vtu", u, SetDataModeToBinary=None, SetByteOrderToBigEndian=None)
write(P(), "appended-base64-zlib.vtp", p)
write(P(), "ascii.vtp", p, SetDataModeToAscii=None)
w = vtk.vtkUnstructuredGridWriter()
w.SetFileVersion(42)
write(w, "legacy-ascii.vtk", u)
w = vtk.vtkPolyDataWriter()
w.SetFileVersion(42)
w.SetFileTypeToBinary()
write(w, "legacy-binary.vtk", p)
q = vtk.vtkUnstructuredGrid()
q.DeepCopy(u)
q.InsertNextCell(vtk.VTK_QUAD, 4, (0, 1, 2, 3))
q.GetCellData().GetArray("m").InsertNextValue(9)
write(U(), "with-a-quad.vtu", q, SetDataModeToAscii=None)
