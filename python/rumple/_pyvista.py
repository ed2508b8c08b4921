"""Surfaces as meshes of PyVista, which is imported only here."""

import numpy

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
    """The state of a simulation; images of vertices of a periodic sheet close triangles across the end of a period."""
    triangles, vertices, moved = _unfolded(simulation)
    fields = {name: values[vertices] for name, values in simulation.fields().items()}
    return mesh(simulation.positions[vertices] + moved, triangles, fields, simulation.fields(cells=True))


def _unfolded(simulation):
    """Triangles whose corners are next to one another, the vertices that their points are or are images of, and by how much
    these are moved."""
    triangles, rest, periods = simulation.triangles, simulation.rest_positions, simulation.periods
    if not len(periods):
        return triangles, slice(None), 0.0
    corners = rest[triangles]
    apart = corners[:, :1] - corners
    count = [numpy.rint(apart @ period / (period @ period)).astype(int) for period in periods]
    keys = numpy.stack([triangles, *count], axis=-1).reshape(-1, 1 + len(periods))
    moved = keys[:, 1:].any(axis=1)
    images, number = numpy.unique(keys[moved], axis=0, return_inverse=True)
    found = keys[:, 0].copy()
    found[moved] = len(rest) + number.reshape(-1)
    vertices = numpy.concatenate([numpy.arange(len(rest)), images[:, 0]])
    translations = numpy.concatenate([numpy.zeros((len(rest), 3)), images[:, 1:] @ periods])
    return found.reshape(-1, 3), vertices, translations


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
