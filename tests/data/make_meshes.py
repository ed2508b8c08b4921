"""Writes the small meshes of other programs in this folder: gmsh-*.msh and gmsh-*.stl by Gmsh, *.ply by VTK.

Run here as `python make_meshes.py` with the Python packages gmsh and vtk; the files are committed, so that tests need
neither. All are of one ellipse with the semi-axes 2 and 1.5, of triangles or (quads) of quadrilaterals and triangles.
"""

import gmsh
import vtk

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
gmsh.model.add("ellipse")
gmsh.model.occ.addDisk(0, 0, 0, 2, 1.5)
gmsh.model.occ.synchronize()
gmsh.option.setNumber("Mesh.MeshSizeMin", 0.9)
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.9)


def write(name, version=4.1, binary=False):
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.write(name)


gmsh.model.mesh.generate(2)
write("gmsh-22-ascii.msh", 2.2)
write("gmsh-22-binary.msh", 2.2, True)
write("gmsh-40-ascii.msh", 4.0)
write("gmsh-41-ascii.msh", 4.1)
write("gmsh-41-binary.msh", 4.1, True)
write("gmsh-ascii.stl")
write("gmsh-binary.stl", binary=True)
gmsh.model.mesh.clear()
gmsh.option.setNumber("Mesh.RecombineAll", 1)
gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 0)
gmsh.model.mesh.generate(2)
write("gmsh-41-quads.msh", 4.1, True)
write("gmsh-22-quads.msh", 2.2)

tags, coordinates, _ = gmsh.model.mesh.getNodes()
order = {int(tag): k for k, tag in enumerate(tags)}
points, cells = vtk.vtkPoints(), vtk.vtkCellArray()
for k in range(len(tags)):
    points.InsertNextPoint(coordinates[3 * k : 3 * k + 3])
for kind, _, nodes in zip(*gmsh.model.mesh.getElements(2)):
    corners = {2: 3, 3: 4}[int(kind)]
    for start in range(0, len(nodes), corners):
        cells.InsertNextCell(corners)
        for node in nodes[start : start + corners]:
            cells.InsertCellPoint(order[int(node)])
data = vtk.vtkPolyData()
data.SetPoints(points)
data.SetPolys(cells)
for name, binary, big in [("quads-ascii", 0, 0), ("quads-little", 1, 0), ("quads-big", 1, 1)]:
    writer = vtk.vtkPLYWriter()
    writer.SetInputData(data)
    writer.SetFileName(f"{name}.ply")
    writer.SetFileTypeToBinary() if binary else writer.SetFileTypeToASCII()
    writer.SetDataByteOrderToBigEndian() if big else writer.SetDataByteOrderToLittleEndian()
    assert writer.Write()
gmsh.finalize()

# A rectangle of two halves, which physical groups name: one by a name with a space, one by its number alone.
gmsh.model.add("groups")
left = gmsh.model.occ.addRectangle(-2, -1, 0, 2, 2)
right = gmsh.model.occ.addRectangle(0, -1, 0, 2, 2)
gmsh.model.occ.fragment([(2, left)], [(2, right)])
gmsh.model.occ.synchronize()
gmsh.model.addPhysicalGroup(2, [left], 3, "left half")
gmsh.model.addPhysicalGroup(2, [right], 7)
gmsh.option.setNumber("Mesh.RecombineAll", 0)
gmsh.model.mesh.generate(2)
write("groups-22-ascii.msh", 2.2)
write("groups-22-binary.msh", 2.2, True)
write("groups-40-ascii.msh", 4.0)
gmsh.model.addPhysicalGroup(1, [1], 1, "lower side")
gmsh.model.addPhysicalGroup(2, [left, right], 9, "both")
write("groups-41-ascii.msh", 4.1)
write("groups-41-binary.msh", 4.1, True)
