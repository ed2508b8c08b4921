"""Surfaces as meshes of PyVista, which is imported only here."""

from ._rumple import Error


def mesh(points, triangles, fields, cell_fields):
    """A PolyData with fields as point and cell data."""
    try:
        import pyvista
    except ImportError as error:
        raise Error("pyvista is not installed: pip install pyvista") from error
    surface = pyvista.PolyData.from_regular_faces(points, triangles)
    surface.point_data.update(fields)
    surface.cell_data.update(cell_fields)
    return surface


def mesh_of(simulation):
    """The state of a simulation."""
    return mesh(
        simulation.positions, simulation.triangles, simulation.fields(), simulation.fields(cells=True)
    )
