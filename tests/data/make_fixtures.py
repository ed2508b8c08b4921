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
LU, LP = vtk.vtkUnstructuredGridWriter, vtk.vtkPolyDataWriter
# vtkio reads no field data here.
for data in (u, p):
    data.GetFieldData().Initialize()
write(LU(), "legacy-42-ascii.vtk", u, SetFileVersion=42)
write(LP(), "legacy-42-binary.vtk", p, SetFileVersion=42, SetFileTypeToBinary=None)
write(LP(), "legacy-51-ascii.vtk", p, SetFileVersion=51)
write(LU(), "legacy-51-binary.vtk", u, SetFileVersion=51, SetFileTypeToBinary=None)
q = vtk.vtkUnstructuredGrid()
q.DeepCopy(u)
q.InsertNextCell(vtk.VTK_QUAD, 4, (0, 1, 2, 3))
q.GetCellData().GetArray("m").InsertNextValue(9)
write(U(), "with-a-quad.vtu", q, SetDataModeToAscii=None)
write(LU(), "legacy-with-a-quad.vtk", q, SetFileVersion=51)

# What else attributes can be: active ones, escaped names, names of components, colours.
a = vtk.vtkUnstructuredGrid()
a.DeepCopy(u)
a.GetFieldData().Initialize()
for name, count in (("T", 9), ("N", 3), ("a b% [µ]", 1), ("named", 2)):
    array = vtk.vtkDoubleArray()
    array.SetName(name)
    array.SetNumberOfComponents(count)
    array.SetNumberOfTuples(7)
    for c in range(count):
        array.FillComponent(c, 0.25 + c)
    if name == "named":
        array.SetComponentName(0, "first")
    a.GetPointData().AddArray(array)
a.GetPointData().SetActiveScalars("c")
a.GetPointData().SetActiveVectors("u")
a.GetPointData().SetActiveTensors("T")
a.GetPointData().SetActiveNormals("N")
rgb = vtk.vtkUnsignedCharArray()
rgb.SetName("rgb")
rgb.SetNumberOfComponents(3)
rgb.SetNumberOfTuples(6)
rgb.Fill(7)
a.GetCellData().SetScalars(rgb)
write(LU(), "legacy-attributes-ascii.vtk", a, SetFileVersion=42)
write(LU(), "legacy-attributes-binary.vtk", a, SetFileVersion=51, SetFileTypeToBinary=None)
