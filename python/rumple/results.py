"""The results of a run: ledger and frames of a result directory."""

from __future__ import annotations

import csv
import html
import json
import os
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _html
from ._rumple import Error, draw, read_surface, report

# NumPy takes longer to import than all else: it is imported where arrays are made.
if TYPE_CHECKING:
    from numpy import float64
    from numpy.typing import NDArray

__all__ = ["Frame", "Frames", "Results", "read"]


def read(directory: str | os.PathLike[str]) -> Results:
    """The results of `rumple run` in `directory`."""
    return Results(directory)


class Results:
    """The results of a run: `ledger`, `frames` and `status`."""

    def __init__(self, directory: str | os.PathLike[str]):
        self.directory = Path(directory)
        if not (self.directory / "ledger.csv").is_file():
            raise Error(f"{self.directory} has no ledger.csv: it is not a result directory of a run")
        self._ledger: Any = None

    @property
    def ledger(self) -> Any:
        """The ledger, a row a step: a DataFrame of pandas, or without pandas a dict of arrays by column."""
        if self._ledger is None:
            self._ledger = _ledger(self.directory / "ledger.csv")
        return self._ledger

    @property
    def vertices(self) -> int:
        """Vertices of the sheet. Frames of a periodic sheet have these first, and then images of some of them."""
        path = self.directory / "provenance.json"
        return int(json.loads(path.read_text(encoding="utf-8"))["mesh"]["vertices"])

    @property
    def status(self) -> dict[str, Any]:
        """How the run stands: `status` (`complete`, `interrupted`, `failed`, `running`), `reason`, `time`, costs."""
        path = self.directory / "status.json"
        return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}

    @property
    def frames(self) -> Frames:
        """The frames, each read when it is asked for."""
        for name in ("sheet.vtkhdf", "sheet.vtk.series"):
            if (old := self.directory / name).is_file():
                raise Error(f"{old}: frames are read from .vtu files alone; ParaView opens these, and saves them as such")
        folder = self.directory / "frames"
        files = os.listdir(folder) if folder.is_dir() else []
        return Frames(folder / name for name in sorted(files) if name.endswith(".vtu"))

    def to_xarray(self) -> Any:
        """All frames as a Dataset of xarray: `position` (time, vertex, axis), every field over time and vertex or triangle, with
        its unit in `attrs["units"]`, and the triangles."""
        try:
            import xarray
        except ImportError as error:
            raise Error("xarray is not installed: pip install xarray") from error
        frames = list(self.frames)
        if not frames:
            raise Error(f"{self.directory} has no frames")

        def stacked(pick: Any, place: str) -> dict[str, Any]:
            names = [name for name in pick(frames[0]) if all(name in pick(frame) for frame in frames)]
            return {name: _variable([pick(frame)[name] for frame in frames], name, place) for name in names}

        fields = stacked(lambda frame: frame.fields, "vertex")
        # A field may live in both places.
        for name, (dims, *rest) in stacked(lambda frame: frame.cell_fields, "triangle").items():
            fields[f"{name} of triangles" if name in fields else name] = (dims, *rest)
        points = _stacked([frame.points for frame in frames])
        data = {name.split(" [")[0]: variable for name, variable in fields.items()}
        data["position"] = (("time", "vertex", "axis"), points, {"units": "length"})
        data["triangles"] = (("triangle", "corner"), frames[0].triangles)
        times = [float(k) if frame.time is None else frame.time for k, frame in enumerate(frames)]
        return xarray.Dataset(data, coords={"time": times, "axis": ["x", "y", "z"]})

    def to_pyvista(self) -> Any:
        """All frames as a MultiBlock of PyVista, a block a frame; `field_data["time"]` of it and of every block has the times."""
        from ._pyvista import series

        return series(self.frames)

    def show(self, height: int | None = None) -> Any:
        """Shows the viewer of the results, the file `report.html`: within a notebook, or else in a browser.

        It is written if it is not there yet. In a notebook it is as wide as the cell, and `height` pixels high, by default four
        fifths of the window.
        """
        path = self.directory / "report.html"
        if not path.is_file():
            path = report(self.directory)
        ipython = sys.modules.get("IPython")
        shell = ipython.get_ipython() if ipython else None
        # A terminal has no kernel.
        if getattr(shell, "kernel", None) is None:
            import webbrowser

            return webbrowser.open(path.absolute().as_uri())
        from IPython.display import HTML

        page = html.escape(path.read_text(encoding="utf-8"), quote=True)
        size = "80vh" if height is None else f"{height}px"
        frame = f'<iframe srcdoc="{page}" style="width: 100%; height: {size}; border: 0"></iframe>'
        return HTML(f"<div>{frame}</div>")

    def picture(
        self, path: str | os.PathLike[str], *, time: float | None = None, force: bool = False, **drawing: Any
    ) -> Any:
        """Draws the frame nearest to `time`, or the last one, into a PNG file, as `rumple picture` does.

        `drawing`: `field`, `range` ("all", "frame" or a pair), `map`, `view` (a name, or azimuth and elevation in
        degrees), `zoom`, `size` (width and height at 96 pixels an inch), `dpi`, `title`, `edges`, `light`. In a notebook the picture is shown. Needs
        Chromium or Chrome. Raises `Error`.
        """
        draw((self.directory, Path(path), force), json.dumps(drawing), time, None)
        return _shown("Image", path)

    def movie(
        self, path: str | os.PathLike[str], *, rate: float = 8.0, frames: int = 300, force: bool = False, **drawing: Any
    ) -> Any:
        """Draws all frames, at most `frames`, into a GIF, MP4 or WebM file at `rate` a second, as `rumple movie` does.

        `drawing` is that of `picture`. MP4 and WebM need ffmpeg. In a notebook the movie is shown.
        """
        draw((self.directory, Path(path), force), json.dumps(drawing), None, (frames, rate))
        return _shown("Image" if Path(path).suffix.lower() == ".gif" else "Video", path)

    def _repr_html_(self) -> str:
        status = self.status
        about = [("status", f"{status.get('status', 'unknown')}: {status.get('reason', '')}"), ("frames", len(self.frames))]
        about += [(name, status[name]) for name in ("time", "cpu_seconds", "peak_resident_bytes") if name in status]
        about += [("note", note) for note in status.get("notes", [])]
        return _html.table(self.directory, about)

    def __repr__(self) -> str:
        return f"<rumple.Results {self.directory}, {len(self.frames)} frames>"


class Frames:
    """Frames in the order of time."""

    def __init__(self, paths: Iterable[Path]):
        self._paths = list(paths)

    def __len__(self) -> int:
        return len(self._paths)

    def __getitem__(self, number: Any) -> Any:
        if isinstance(number, slice):
            return Frames(self._paths[number])
        return Frame(self._paths[number])

    def __iter__(self) -> Iterator[Frame]:
        return (Frame(path) for path in self._paths)


class Frame:
    """A frame: `points` (n × 3), `triangles` (m × 3), `fields` and `cell_fields` by name with unit, `time`."""

    def __init__(self, path: str | os.PathLike[str]):
        self.path = Path(path)
        read = read_surface(self.path)
        self.points, self.triangles, self.fields, self.cell_fields, self.time = read

    def field(self, name: str, *, cells: bool = False) -> NDArray[float64]:
        """A field, with or without its unit in the name: on vertices, or on triangles with `cells`."""
        fields = self.cell_fields if cells else self.fields
        for title, values in fields.items():
            if name in (title, title.split(" [")[0]):
                return values
        raise KeyError(f"{self.path} has no field {name!r}; it has: {', '.join(fields)}")

    def to_pyvista(self) -> Any:
        """The surface with its fields as a mesh of PyVista."""
        from ._pyvista import mesh

        return mesh(self.points, self.triangles, self.fields, self.cell_fields)

    def _repr_html_(self) -> str:
        return _html.frame(self)

    def __repr__(self) -> str:
        return f"<rumple.Frame {self.path.name} at time {self.time}>"


def _stacked(arrays: list[Any]) -> Any:
    import numpy

    return numpy.stack(arrays)


def _variable(frames: list[Any], name: str, place: str) -> tuple[Any, ...]:
    """A field of all frames as xarray takes it."""
    values = _stacked(frames)
    dims = ("time", place) if values.ndim == 2 else ("time", place, "axis" if values.shape[2] == 3 else f"{name} component")
    unit = name.split(" [")[1].rstrip("]") if " [" in name else ""
    return dims, values, {"units": unit}


def _shown(kind: str, path: str | os.PathLike[str]) -> Any:
    """A file as a notebook shows it; its path elsewhere."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython else None
    if getattr(shell, "kernel", None) is None:
        return Path(path)
    import IPython.display

    return getattr(IPython.display, kind)(filename=os.fspath(path), embed=True)


def _ledger(path: Path) -> Any:
    import numpy

    with open(path, newline="", encoding="utf-8") as file:
        text = file.read()
    # A killed run can leave a last row without its end.
    rows = list(csv.reader(text[: text.rfind("\n") + 1].splitlines()))
    if not rows:
        raise Error(f"{path} is empty")
    # Cells of what is not finite are empty.
    cells = [[cell or "nan" for cell in row] for row in rows[1:]]
    body = numpy.array(cells, dtype=float).reshape(len(rows) - 1, len(rows[0]))
    columns = {title: body[:, k].copy() for k, title in enumerate(rows[0])}
    try:
        import pandas
    except ImportError:
        return columns
    return pandas.DataFrame(columns)
