"""ParaView macro: the contact of a result of railsqueal, coloured by its pressure.

In ParaView: Macros > Import new macro..., open FILE.hdf, Apply, and start the macro. Without a window:

    pvpython scripts/paraview/contact.py FILE.hdf [PICTURE.png]

prints how many cells the contact grid and the contact have, and makes a picture. Works with ParaView 5.11 and later.
"""

import sys

from paraview import simple


def cells(source):
    """Number of cells of a source."""
    source.UpdatePipeline()
    return source.GetDataInformation().GetNumberOfCells()


def part(surface, lowest, name):
    """Cells of the surface whose nodes all have at least this state: 0 open, 1 stick, 2 slip; other nodes have none."""
    chosen = simple.Threshold(registrationName=name, Input=surface)
    chosen.Scalars = ["POINTS", "state"]
    chosen.ThresholdMethod = "Between"
    chosen.LowerThreshold, chosen.UpperThreshold = lowest, 2
    chosen.AllScalars = 1
    return chosen


def main():
    given = [word for word in sys.argv[1:] if word.endswith((".h5", ".hdf"))]
    # ParaView knows .hdf by its name; a file of another name is given to the reader itself.
    opened = (
        simple.OpenDataFile if given and given[0].endswith(".hdf") else lambda name: simple.VTKHDFReader(FileName=name)
    )
    source = opened(given[0]) if given else simple.GetActiveSource()
    if source is None:
        raise SystemExit("open a result first, FILE.hdf, and press Apply; or: pvpython contact.py FILE.hdf")
    surface = simple.ExtractSurface(registrationName="surface", Input=source)
    grid, contact = part(surface, 0, "contact grid"), part(surface, 1, "contact")
    print(f"contact grid of both bodies: {cells(grid)} cells; contact: {cells(contact)} cells")
    pictures = [word for word in sys.argv[1:] if word.endswith(".png")]
    if given and not pictures:
        return
    view = simple.GetActiveViewOrCreate("RenderView")
    simple.Hide(source, view)
    shown = simple.Show(grid, view)
    simple.ColorBy(shown, ("POINTS", "pressure"))
    shown.RescaleTransferFunctionToDataRange(True)
    shown.SetScalarBarVisibility(view, True)
    simple.ResetCamera(view)
    for picture in pictures:
        simple.SaveScreenshot(picture, view, ImageResolution=[900, 700])


main()
