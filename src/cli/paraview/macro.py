"""Opens the results of a run in ParaView: coloured, with the range of all frames and the camera set.

    paraview --script=@NAME@          opens the window
    pvbatch @NAME@ [PICTURE.png]      writes the last frame as a picture, by default last.png beside this file

Written by `rumple paraview`; the numbers below may be changed.
"""

import os
import sys

from paraview import servermanager, simple
from paraview.modules.vtkRemotingCore import vtkProcessModule

SERIES = @SERIES@
ARRAY = @ARRAY@
ASSOCIATION = @ASSOCIATION@
RANGE = @RANGE@
LOW_CORNER = @LOW@
HIGH_CORNER = @HIGH@
# View direction, and the up vector of the picture.
DIRECTION = @DIRECTION@
UP = @UP@

here = os.path.dirname(os.path.abspath(__file__ if "__file__" in globals() else sys.argv[0]))
path = os.path.join(here, SERIES)
version = simple.GetParaViewVersion()
if SERIES.endswith(".vtkhdf") and (version.major, version.minor) < (5, 12):
    sys.exit(
        f"ParaView {version.major}.{version.minor} does not read temporal VTKHDF: version 5.12 does. "
        'With format = "vtu" in [output] a run writes frames for any version.'
    )
simple._DisableFirstRenderCameraReset()
source = simple.OpenDataFile(path)
if source is None:
    sys.exit(f"ParaView cannot open {path}")
simple.RenameSource(os.path.basename(here) or "sheet", source)
source.UpdatePipelineInformation()
steps = source.TimestepValues
times = list(steps) if hasattr(steps, "__len__") else [steps]

view = simple.GetActiveViewOrCreate("RenderView")
view.UseColorPaletteForBackground = 0
view.Background = [1, 1, 1]
surface = simple.Show(source, view)
surface.Representation = "Surface"
simple.ColorBy(surface, (ASSOCIATION, ARRAY))
colours = simple.GetColorTransferFunction(ARRAY)
colours.AutomaticRescaleRangeMode = "Never"
low, high = RANGE
colours.ApplyPreset("Cool to Warm" if low == -high else "Viridis (matplotlib)", True)
colours.RescaleTransferFunction(low, high)
bar = simple.GetScalarBar(colours, view)
bar.Title, bar.ComponentTitle = ARRAY, ""
bar.TitleColor = bar.LabelColor = [0.1, 0.1, 0.1]
surface.SetScalarBarVisibility(view, True)
label = simple.AnnotateTimeFilter(source, Format="t = {time:g}")
shown = simple.Show(label, view)
shown.Color = [0.1, 0.1, 0.1]

centre = [(a + b) / 2 for a, b in zip(LOW_CORNER, HIGH_CORNER)]
reach = max(sum((b - a) ** 2 for a, b in zip(LOW_CORNER, HIGH_CORNER)) ** 0.5 / 2, 1e-30)
view.CameraParallelProjection = 1
view.CameraFocalPoint = centre
view.CameraPosition = [c + 4 * reach * d for c, d in zip(centre, DIRECTION)]
view.CameraViewUp = UP
view.CameraParallelScale = 0.95 * reach
simple.GetAnimationScene().UpdateAnimationUsingDataTimeSteps()
simple.GetAnimationScene().AnimationTime = times[-1]
view.ViewTime = times[-1]
simple.SetActiveSource(source)
simple.Render(view)

if vtkProcessModule.GetProcessType() == vtkProcessModule.PROCESS_BATCH:
    picture = sys.argv[1] if len(sys.argv) > 1 else os.path.join(here, "last.png")
    view.ViewSize = [1200, 900]
    simple.SaveScreenshot(picture, view, ImageResolution=[1200, 900])
    if not os.path.isfile(picture) or os.path.getsize(picture) == 0:
        sys.exit(f"ParaView did not write {picture}")
    print(f"wrote {picture}: {len(times)} frames, t = {times[-1]:g}, {ARRAY} from {low:g} to {high:g}")
