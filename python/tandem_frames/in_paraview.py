"""Opens the frames of a run in ParaView, with colours set.

    paraview --script=python/tandem_frames/in_paraview.py            # asks TANDEM_RUN, else the present folder, for the run
    TANDEM_RUN=runs/silo pvpython python/tandem_frames/in_paraview.py motion.png

Points are squares coloured by speed, bodies grey with outlines, contacts lines coloured and thickened by their force. With the
name of a picture (or film, .avi) it writes that instead of staying open.
"""

import os
import sys

from paraview import simple


def opened(run):
    """The sources of a run, by name: points, bodies, contacts, as far as it has them."""
    reader = simple.PVDReader(FileName=os.path.join(run, "frames", "frames.pvd"))
    reader.UpdatePipeline()
    hierarchy = reader.GetDataInformation().DataInformation.GetHierarchy()
    there = [hierarchy.GetNodeName(node) for node in hierarchy.GetChildNodes(0, False)]
    parts = {}
    for name in there:
        parts[name] = simple.ExtractBlock(registrationName=name, Input=reader, Selectors=[f"/Root/{name}"])
    return parts


def shown(parts, view):
    """Shows what there is."""
    if "points" in parts:
        speed = simple.Calculator(registrationName="speed", Input=parts["points"])
        speed.ResultArrayName, speed.Function = "speed [m/s]", "mag(velocity)"
        points = simple.Show(speed, view)
        points.SetRepresentationType("Point Gaussian")
        simple.ColorBy(points, ("POINTS", "speed [m/s]"))
        points.ShaderPreset = "Plain circle"
        points.GaussianRadius = _spacing(parts["points"])
        _coloured(points, "speed [m/s]", "Viridis (matplotlib)", view, "Lower Left Corner")
    if "bodies" in parts:
        bodies = simple.Show(parts["bodies"], view)
        bodies.SetRepresentationType("Surface With Edges")
        bodies.ColorArrayName = ["POINTS", ""]
        bodies.DiffuseColor = bodies.AmbientColor = [0.88, 0.88, 0.88]
        bodies.EdgeColor = [0.0, 0.0, 0.0]
    if "contacts" in parts:
        force = simple.Calculator(registrationName="force", Input=parts["contacts"])
        force.AttributeType = "Cell Data"
        force.ResultArrayName, force.Function = "contact force [N/m]", "mag(force)"
        contacts = simple.Show(force, view)
        contacts.SetRepresentationType("Wireframe")
        contacts.LineWidth = 3.0
        simple.ColorBy(contacts, ("CELLS", "contact force [N/m]"))
        _coloured(contacts, "contact force [N/m]", "Inferno (matplotlib)", view, "Lower Right Corner")


def _coloured(shown, array, colours, view, corner):
    """Colours over the range that the array has at this time, and what they say."""
    shown.RescaleTransferFunctionToDataRange(True, False)
    table = simple.GetColorTransferFunction(array)
    table.ApplyPreset(colours, True)
    bar = simple.GetScalarBar(table, view)
    bar.Title, bar.ComponentTitle = array, ""
    bar.Orientation, bar.WindowLocation, bar.ScalarBarLength = "Horizontal", corner, 0.33
    bar.TitleColor = bar.LabelColor = [0.0, 0.0, 0.0]
    bar.TitleFontSize = bar.LabelFontSize = 12
    shown.SetScalarBarVisibility(view, True)


def _spacing(points):
    """Half the side of a point's square, from the mean volume; a guess where frames have no volumes."""
    points.UpdatePipeline()
    volume = points.PointData.GetArray("volume")
    low, high = volume.GetRange() if volume else (1e-6, 1e-6)
    return 0.5 * (0.5 * (low + high)) ** 0.5


def main():
    run = os.environ.get("TANDEM_RUN", ".")
    view = simple.GetActiveViewOrCreate("RenderView")
    view.InteractionMode = "2D"
    view.OrientationAxesVisibility = 0
    view.UseColorPaletteForBackground, view.Background = 0, [1.0, 1.0, 1.0]
    parts = opened(run)
    scene = simple.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    scene.GoToLast()
    shown(parts, view)
    simple.ResetCamera(view)
    if len(sys.argv) > 1:
        out = sys.argv[1]
        if out.endswith(".png"):
            simple.SaveScreenshot(out, view, ImageResolution=[1600, 1000])
        else:
            simple.SaveAnimation(out, view, ImageResolution=[1600, 1000])
    else:
        simple.Render(view)


main()
