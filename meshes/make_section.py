#!/usr/bin/env python3
"""Makes the section of a wheel with a curved web with Gmsh, as a drawing of one's own would be: in millimetres, x along
the axle, y away from it.

    pip install gmsh
    python3 make_section.py wheel-section.msh
    python3 make_section.py --straight --cells quad w920s.msh

With --straight it is the built-in section W920S. Groups: `running` (the tread), `bore`, and the surface `wheel`.
"""

import argparse
import math

import gmsh

BORE, HUB, WEB, TREAD, FLANGE = 95.0, 135.0, 390.0, 460.0, 488.0
HUB_AT, RIM_AT, FLANGE_AT = (-90.0, 90.0), (-65.0, 70.0), (40.0, 70.0)
HALF_WEB = 12.0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", choices=["triangle", "quad"], default="triangle")
    parser.add_argument("--order", type=int, choices=[1, 2], default=2)
    parser.add_argument("--size", type=float, default=12.0, help="edge length, mm")
    parser.add_argument("--bow", type=float, default=18.0, help="how far the web bows towards the flange, mm")
    parser.add_argument("--straight", action="store_true", help="a straight web")
    parser.add_argument("file")
    given = parser.parse_args()
    bow = 0.0 if given.straight else given.bow

    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    geo = gmsh.model.geo
    point = lambda x, y: geo.addPoint(x, y, 0)  # noqa: E731

    def web(side, upwards):
        """One face of the web from hub to rim or back, with its points between."""
        steps = [HUB + (WEB - HUB) * k / 12 for k in range(13)]
        places = [(side * HALF_WEB + bow * math.sin(math.pi * (y - HUB) / (WEB - HUB)) ** 2, y) for y in steps]
        return [point(*p) for p in (places if upwards else places[::-1])]

    left, right = web(-1, False), web(1, True)
    # Round the section: hub, right face of the web, rim, flange, tread, left face of the web.
    corners = [point(HUB_AT[0], BORE), point(HUB_AT[1], BORE), point(HUB_AT[1], HUB), *right]
    rim = [point(RIM_AT[1], WEB), point(FLANGE_AT[1], FLANGE), point(FLANGE_AT[0], FLANGE), point(FLANGE_AT[0], TREAD)]
    end = [point(RIM_AT[0], TREAD), point(RIM_AT[0], WEB), *left, point(HUB_AT[0], HUB)]
    bore = geo.addLine(corners[0], corners[1])
    curves = [bore, geo.addLine(corners[1], corners[2]), geo.addLine(corners[2], right[0]), geo.addSpline(right)]
    curves += [geo.addLine(a, b) for a, b in zip([right[-1], *rim], rim)]
    running = geo.addLine(rim[-1], end[0])
    curves += [running, geo.addLine(end[0], end[1]), geo.addLine(end[1], left[0]), geo.addSpline(left)]
    curves += [geo.addLine(left[-1], end[-1]), geo.addLine(end[-1], corners[0])]
    surface = geo.addPlaneSurface([geo.addCurveLoop(curves)])
    geo.synchronize()
    for name, dim, tag in (("bore", 1, bore), ("running", 1, running), ("wheel", 2, surface)):
        gmsh.model.setPhysicalName(dim, gmsh.model.addPhysicalGroup(dim, [tag]), name)
    gmsh.option.setNumber("Mesh.MeshSizeMin", given.size)
    gmsh.option.setNumber("Mesh.MeshSizeMax", given.size)
    if given.cells == "quad":
        gmsh.option.setNumber("Mesh.RecombineAll", 1)
    gmsh.option.setNumber("Mesh.ElementOrder", given.order)
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 0)
    gmsh.model.mesh.generate(2)
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.write(given.file)
    print(given.file, len(gmsh.model.mesh.getNodes()[0]), "nodes")
    gmsh.finalize()


if __name__ == "__main__":
    main()
