#!/usr/bin/env pvpython
"""Renders the frames of a series with ParaView.

    pvpython render.py FILE.pvd OUT.png --array NAME [--view top|oblique] [--time T|last|all]
                       [--range LOW,HIGH] [--map NAME] [--size WxH] [--title TEXT]

NAME may leave out the unit in brackets. With `--time all` the range is that of all frames and the
pictures are OUT_0000.png, OUT_0001.png, …; otherwise it is that of the frame. A range around zero
of a quantity with both signs is shown by a diverging map, everything else by viridis, unless --map
names another. Under xvfb: see render.sh.
"""

import argparse
import os
import sys

import paraview

paraview.compatibility.major, paraview.compatibility.minor = 5, 11
from paraview import servermanager, simple  # noqa: E402

SEQUENTIAL = "Viridis (matplotlib)"
DIVERGING = "Cool to Warm"
INK = [0.1, 0.1, 0.1]


def parse():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file")
    parser.add_argument("picture")
    parser.add_argument("--array", required=True)
    parser.add_argument("--view", choices=["top", "oblique"], default="oblique")
    parser.add_argument("--time", default="last")
    parser.add_argument("--range")
    parser.add_argument("--map")
    parser.add_argument("--size", default="1200x1000")
    parser.add_argument("--title", default="")
    return parser.parse_args()


def find_array(source, wanted):
    """The association and full name of the array `wanted`."""
    found = []
    for association, data in (("POINTS", source.PointData), ("CELLS", source.CellData)):
        found += [(association, data[i].Name) for i in range(data.GetNumberOfArrays())]
    for match in (lambda name: name == wanted, lambda name: name.split(" [")[0] == wanted):
        for association, name in found:
            if match(name):
                return association, name
    names = ", ".join(f"`{name}`" for _, name in found)
    sys.exit(f"no array `{wanted}`; there are {names}")


def data_range(source, association, name):
    data = source.PointData if association == "POINTS" else source.CellData
    array = data[name]
    return array.GetRange(0 if array.GetNumberOfComponents() == 1 else -1)


def choose_times(source, wanted):
    steps = source.TimestepValues
    times = list(steps) if hasattr(steps, "__len__") else [steps]
    if not times:
        sys.exit("the file lists no times")
    if wanted == "all":
        return times
    if wanted == "last":
        return times[-1:]
    return [min(times, key=lambda time: abs(time - float(wanted)))]


def fit_camera(view, bounds, kind):
    """Looks along a fixed direction at the middle of the sheet, as large as the bar lets it."""
    low, high = bounds[0::2], bounds[1::2]
    centre = [(a + b) / 2 for a, b in zip(low, high)]
    extent = [b - a for a, b in zip(low, high)]
    reach = max(sum(e * e for e in extent) ** 0.5, 1e-30)
    direction, up = ([0, 0, 1], [0, 1, 0]) if kind == "top" else ([0, -0.80, 0.60], [0, 0, 1])
    view.CameraFocalPoint = centre
    view.CameraPosition = [c + 3 * reach * d for c, d in zip(centre, direction)]
    view.CameraViewUp = up
    view.CameraParallelProjection = 1
    # Half the height of the picture in units of length: from what the corners of the box need
    # across and along the picture.
    right = [1, 0, 0]
    upward = [
        direction[1] * right[2] - direction[2] * right[1],
        direction[2] * right[0] - direction[0] * right[2],
        direction[0] * right[1] - direction[1] * right[0],
    ]
    half_width = sum(abs(r) * e for r, e in zip(right, extent)) / 2
    half_height = sum(abs(u) * e for u, e in zip(upward, extent)) / 2
    width, height = view.ViewSize
    # The picture keeps a margin of 5 % at the sides, and 12 % above and 20 % below for title and
    # colour bar.
    scale = max(half_width * height / (0.90 * width), half_height / 0.68, 1e-30)
    view.CameraParallelScale = scale
    shift = -0.04 * 2 * scale
    view.CameraFocalPoint = [c + shift * u for c, u in zip(view.CameraFocalPoint, upward)]
    view.CameraPosition = [c + shift * u for c, u in zip(view.CameraPosition, upward)]


def main():
    options = parse()
    if not os.path.isfile(options.file):
        sys.exit(f"{options.file}: no such file")
    simple._DisableFirstRenderCameraReset()
    source = simple.OpenDataFile(options.file)
    if source is None:
        sys.exit(f"ParaView cannot open {options.file}")
    source.UpdatePipelineInformation()
    times = choose_times(source, options.time)
    source.UpdatePipeline(times[-1])
    association, name = find_array(source, options.array)
    information = source.GetDataInformation()
    version = simple.GetParaViewVersion()
    print(
        f"ParaView {version.major}.{version.minor}: {information.GetNumberOfPoints()} points, "
        f"{information.GetNumberOfCells()} cells, times {', '.join(repr(t) for t in times)}"
    )

    view = simple.CreateView("RenderView")
    view.ViewSize = [int(n) for n in options.size.split("x")]
    view.UseColorPaletteForBackground = 0
    view.Background = [1, 1, 1]
    view.OrientationAxesVisibility = 0
    view.EnableRayTracing = 0
    surface = simple.Show(source, view)
    surface.Representation = "Surface"
    surface.Specular = 0.25
    surface.SpecularPower = 30
    surface.Ambient = 0.15
    surface.Diffuse = 0.9
    simple.ColorBy(surface, (association, name))

    bounds, low, high = None, None, None
    for time in times:
        source.UpdatePipeline(time)
        box = source.GetDataInformation().GetBounds()
        bounds = box if bounds is None else [
            pick(a, b) for pick, a, b in zip((min, max) * 3, bounds, box)
        ]
        a, b = data_range(source, association, name)
        low, high = (a, b) if low is None else (min(low, a), max(high, b))
    if options.range:
        low, high = (float(number) for number in options.range.split(","))
    diverging = low < 0 < high and max(-low, high) < 4 * min(-low, high)
    if diverging and not options.range:
        low, high = -max(-low, high), max(-low, high)
    if high <= low:
        low, high = low - 0.5 * max(abs(low), 1e-12), low + 0.5 * max(abs(low), 1e-12)

    colours = simple.GetColorTransferFunction(name)
    colours.AutomaticRescaleRangeMode = "Never"
    colours.ApplyPreset(options.map or (DIVERGING if diverging else SEQUENTIAL), True)
    colours.RescaleTransferFunction(low, high)
    bar = simple.GetScalarBar(colours, view)
    bar.Title, bar.ComponentTitle = name, ""
    bar.TitleColor = bar.LabelColor = INK
    bar.TitleFontSize, bar.LabelFontSize = 20, 18
    bar.Orientation = "Horizontal"
    bar.WindowLocation = "Any Location"
    bar.Position, bar.ScalarBarLength = [0.25, 0.04], 0.5
    bar.ScalarBarThickness = 18
    # Five labels of our own: those that ParaView chooses overlap when numbers are long.
    bar.AddRangeLabels = 0
    bar.AutomaticLabelFormat, bar.LabelFormat = 0, "%.3g"
    bar.UseCustomLabels = 1
    bar.CustomLabels = [low + (high - low) * quarter / 4 for quarter in range(5)]
    surface.SetScalarBarVisibility(view, True)

    label = simple.Text()
    shown = simple.Show(label, view)
    shown.Color, shown.FontSize = INK, 22
    shown.WindowLocation = "Upper Center"

    fit_camera(view, bounds, options.view)
    base, extension = os.path.splitext(options.picture)
    for number, time in enumerate(times):
        view.ViewTime = time
        label.Text = (options.title + "   " if options.title else "") + f"t = {time:.6g}"
        path = f"{base}_{number:04d}{extension}" if options.time == "all" else options.picture
        simple.Render(view)
        simple.SaveScreenshot(path, view, ImageResolution=view.ViewSize)
        if not os.path.isfile(path) or os.path.getsize(path) == 0:
            sys.exit(f"ParaView did not write {path}")
        print(f"wrote {path}")
    servermanager.Disconnect()


main()
