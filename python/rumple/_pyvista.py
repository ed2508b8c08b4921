"""Surfaces as meshes of PyVista, which is imported only here."""

from ._rumple import Error


def _pyvista():
    try:
        import pyvista
    except ImportError as error:
        raise Error("pyvista is not installed: pip install pyvista") from error
    return pyvista


def mesh(points, triangles, fields, cell_fields):
    """A PolyData with fields as point and cell data."""
    surface = _pyvista().PolyData.from_regular_faces(points, triangles)
    surface.point_data.update(fields)
    surface.cell_data.update(cell_fields)
    return surface


def mesh_of(simulation):
    """The state of a simulation."""
    return mesh(
        simulation.positions, simulation.triangles, simulation.fields(), simulation.fields(cells=True)
    )


def series(frames):
    """A MultiBlock of frames in the order of time, with their times as the field `time`."""
    blocks = _pyvista().MultiBlock()
    times = []
    for number, frame in enumerate(frames):
        times.append(float(number) if frame.time is None else frame.time)
        surface = frame.to_pyvista()
        surface.field_data["time"] = times[-1:]
        blocks.append(surface, f"time {times[-1]:g}")
    blocks.field_data["time"] = times
    return blocks
