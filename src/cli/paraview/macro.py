"""Opens the results of a run in ParaView: coloured, with the range of all frames, at the last one.

    paraview --script=open-in-paraview.py          opens the window
    pvbatch open-in-paraview.py [PICTURE.png]      writes the last frame as a picture, by default last.png beside this file

Written by `rumple paraview`; the names below may be changed.
"""

import os
import sys

from paraview import simple
from paraview.modules.vtkRemotingCore import vtkProcessModule

ARRAY = @ARRAY@
ASSOCIATION = @ASSOCIATION@
# Range of the colours, as (0.0, 1.0); of all frames where it is None.
RANGE = None

here = os.path.dirname(os.path.abspath(__file__ if "__file__" in globals() else sys.argv[0]))
simple._DisableFirstRenderCameraReset()
source = simple.OpenDataFile(os.path.join(here, "sheet.pvd"))
if source is None:
    sys.exit(f"ParaView cannot open {here}/sheet.pvd")
simple.RenameSource(os.path.basename(here) or "sheet", source)
source.UpdatePipelineInformation()
steps = source.TimestepValues
times = list(steps) if hasattr(steps, "__len__") else [steps]

view = simple.GetActiveViewOrCreate("RenderView")
view.UseColorPaletteForBackground = 0
view.Background = [1, 1, 1]
simple.GetAnimationScene().UpdateAnimationUsingDataTimeSteps()
simple.GetAnimationScene().AnimationTime = view.ViewTime = times[-1]
source.UpdatePipeline(times[-1])
surface = simple.Show(source, view)
surface.Representation = "Surface"
simple.ColorBy(surface, (ASSOCIATION, ARRAY))
colours = simple.GetColorTransferFunction(ARRAY)
colours.AutomaticRescaleRangeMode = "Never"
colours.ApplyPreset("Viridis (matplotlib)", True)
if RANGE is None:
    surface.RescaleTransferFunctionToDataRangeOverTime()
else:
    colours.RescaleTransferFunction(*RANGE)
bar = simple.GetScalarBar(colours, view)
bar.Title, bar.ComponentTitle = ARRAY, ""
bar.TitleColor = bar.LabelColor = [0.1, 0.1, 0.1]
surface.SetScalarBarVisibility(view, True)
label = simple.Show(simple.AnnotateTimeFilter(source, Format="t = {time:g}"), view)
label.Color = [0.1, 0.1, 0.1]

# A flat sheet is seen from above, others obliquely.
x0, x1, y0, y1, z0, z1 = source.GetDataInformation().GetBounds()
flat = z1 - z0 <= 0.02 * max(x1 - x0, y1 - y0)
view.CameraParallelProjection = 1
view.CameraFocalPoint = [0, 0, 0]
view.CameraPosition, view.CameraViewUp = ([0, 0, 1], [0, 1, 0]) if flat else ([0, -0.8, 0.6], [0, 0, 1])
simple.ResetCamera(view)
simple.SetActiveSource(source)
simple.Render(view)

if vtkProcessModule.GetProcessType() == vtkProcessModule.PROCESS_BATCH:
    picture = sys.argv[1] if len(sys.argv) > 1 else os.path.join(here, "last.png")
    view.ViewSize = [1200, 900]
    simple.SaveScreenshot(picture, view, ImageResolution=[1200, 900])
    if not os.path.isfile(picture) or os.path.getsize(picture) == 0:
        sys.exit(f"ParaView did not write {picture}")
    low, high = colours.RGBPoints[0], colours.RGBPoints[-4]
    print(f"wrote {picture}: {len(times)} frames, t = {times[-1]:g}, {ARRAY} from {low:g} to {high:g}")
