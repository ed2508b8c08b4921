"""scene.py SYSTEM.npz DIR: the baseline's sphere and start as a VTU file and a scene beside it."""
import sys

import numpy as np

system, folder = np.load(sys.argv[1]), sys.argv[2]
points, triangles = system["P"], system["T"]


def array(values, name, kind, components=1):
    numbers = " ".join(map(repr, np.asarray(values).ravel().tolist()))
    return (
        f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" '
        f'format="ascii">\n{numbers}\n</DataArray>'
    )


with open(f"{folder}/sphere.vtu", "w") as file:
    cells = (
        array(triangles, "connectivity", "Int64")
        + array(3 * np.arange(1, len(triangles) + 1), "offsets", "Int64")
        + array(np.full(len(triangles), 5), "types", "UInt8")
    )
    fields = array(system["u0"], "u", "Float64") + array(system["v0"], "v", "Float64")
    file.write(
        '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" '
        'byte_order="LittleEndian"><UnstructuredGrid>\n'
        f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(triangles)}">\n'
        f"<Points>{array(points, 'Points', 'Float64', 3)}</Points>\n<Cells>{cells}</Cells>\n"
        f"<PointData>{fields}</PointData></Piece></UnstructuredGrid></VTKFile>\n"
    )
with open(f"{folder}/scene.toml", "w") as file:
    file.write(
        f"""[sheet]
file = "sphere.vtu"
[[effect]]
kind = "diffusion"
species = "u"
coefficient = {float(system["Du"])}
[[effect]]
kind = "diffusion"
species = "v"
coefficient = {float(system["Dv"])}
[kinetics]
plugin = "schnakenberg"
[kinetics.initial]
u = {{ file = "sphere.vtu", array = "u" }}
v = {{ file = "sphere.vtu", array = "v" }}
[time]
integrator = {{ kind = "monolithic", method = "bdf" }}
until = 50.0
[output]
fields = ["u", "v"]
"""
    )
