#!/usr/bin/env python3
"""Makes the section of a worn rail with Gmsh, as a drawing of one's own would be: in millimetres, x across the track, y
up, (0, 0) in the middle of the head.

    pip install gmsh
    python3 make_rail_section.py rail-section.msh
    python3 make_rail_section.py --worn 0 60e1.msh

The rail is 60E1, its head lower by --worn mm: the arcs of the running surface moved down between its sides. Groups:
`running` (the head from side to side), `foot` (what lies on the pads), and the surface `rail`.
"""

import argparse
import math

import gmsh

HEIGHT = 172.0
# Half of the outline of 60E1 from the end of the head's arcs down to the tip of the foot: the program Rolland (M.
# Mantel, BSD-3-Clause), y from the middle, z up from the foot, mm.
SIDE = [(36.00, 157.70), (37.03, 136.60), (36.95, 135.94), (36.40, 134.73), (35.34, 133.90), (34.72, 133.63)]
UNDERSIDE = [(16.91, 127.15), (15.08, 126.28), (13.56, 124.94), (12.79, 123.83), (12.25, 122.59), (11.35, 119.33)]
WEB = [
    (10.37, 114.69),
    (9.38, 108.68),
    (8.76, 103.30),
    (8.38, 97.90),
    (8.25, 92.49),
    (8.25, 59.31),
    (8.39, 54.58),
    (8.70, 49.85),
]
FILLET = [
    (9.12, 45.81),
    (9.68, 41.79),
    (10.37, 37.78),
    (11.35, 33.15),
    (12.51, 29.26),
    (14.05, 27.06),
    (15.70, 25.88),
    (16.94, 25.36),
]
FOOT = [
    (44.94, 15.18),
    (48.82, 13.99),
    (52.80, 13.20),
    (70.35, 11.83),
    (72.34, 11.51),
    (73.52, 10.86),
    (74.40, 9.84),
    (74.99, 7.93),
    (75.00, 0.0),
]
# Arcs of the head from the middle outwards: radius, and the distance from the middle at which it ends, mm.
ARCS = [(300.0, 10.228), (80.0, 26.0265)]
CORNER = 13.0
PARTS = 12


def head(worn):
    """The running surface from the middle to the side, mm."""
    points, at, angle = [(0.0, HEIGHT - worn)], [0.0, HEIGHT - worn], 0.0
    ends = [math.asin((ARCS[0][1]) / ARCS[0][0])]
    ends.append(math.asin((ARCS[1][1] - (ARCS[0][0] - ARCS[1][0]) * math.sin(ends[0])) / ARCS[1][0]))
    # The side is 1:20 from the upright.
    ends.append(math.atan(20.0))
    for (radius, _), end in zip([*ARCS, (CORNER, 0.0)], ends):
        centre = (at[0] - radius * math.sin(angle), at[1] - radius * math.cos(angle))
        for k in range(1, PARTS + 1):
            here = angle + (end - angle) * k / PARTS
            points.append((centre[0] + radius * math.sin(here), centre[1] + radius * math.cos(here)))
        at, angle = list(points[-1]), end
    return points


def simplified(line, tolerance):
    """The points of a line without those that are nearer than `tolerance` to what is left (Douglas and Peucker)."""
    (x0, y0), (x1, y1) = line[0], line[-1]
    length = math.hypot(x1 - x0, y1 - y0)
    off = [abs((x1 - x0) * (y0 - y) - (x0 - x) * (y1 - y0)) / length for x, y in line[1:-1]]
    if not off or max(off) <= tolerance:
        return [line[0], line[-1]]
    k = off.index(max(off)) + 1
    return simplified(line[: k + 1], tolerance)[:-1] + simplified(line[k:], tolerance)


def outline(worn, size, fine, tolerance=0.0):
    """The section as geometry of Gmsh, mm: curves of the head, the curve of the foot, the surface. Edges of the length
    `size`, mm, `fine` on the head. Points of the outline below the head that are no further than `tolerance`, mm, from
    the others are left out: each is a node."""
    surface = head(worn)
    down = [p for p in SIDE if p[1] < surface[-1][1] - 0.1] + UNDERSIDE + WEB + FILLET + FOOT
    down = simplified(down, tolerance) if tolerance > 0 else down
    top = HEIGHT - worn
    geo = gmsh.model.geo

    def points(line, side):
        return [geo.addPoint(side * y, z - top, 0, fine if z > 135 else size) for y, z in line]

    crown = points(surface[:1], 1)
    right, left = points(surface[1:], 1), points(surface[1:], -1)
    falling, rising = points(down, 1), points(down, -1)

    def along(line):
        return [geo.addLine(a, b) for a, b in zip(line, line[1:])]

    # Splines between the ends of the arcs, so that edges of second order follow them.
    halves = [[*crown, *right], [*crown, *left]]
    arcs = [[geo.addSpline(half[k * PARTS : (k + 1) * PARTS + 1]) for k in range(3)] for half in halves]
    body = [along([half[-1], *line]) for half, line in zip(halves, (falling, rising))]
    foot = geo.addLine(falling[-1], rising[-1])
    loop = [*arcs[0], *body[0], foot, *(-c for c in body[1][::-1]), *(-c for c in arcs[1][::-1])]
    face = geo.addPlaneSurface([geo.addCurveLoop(loop)])
    geo.synchronize()
    return arcs[0] + arcs[1], foot, face


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--worn", type=float, default=8.0, help="by how much the head is lower, mm")
    parser.add_argument("--cells", choices=["triangle", "quad"], default="triangle")
    parser.add_argument("--order", type=int, choices=[1, 2], default=2)
    parser.add_argument("--size", type=float, default=12.0, help="edge length, mm")
    parser.add_argument("--fine", type=float, default=4.0, help="edge length on the head, mm")
    parser.add_argument("file")
    given = parser.parse_args()
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    arcs, foot, face = outline(given.worn, given.size, given.fine)
    for name, dim, tags in (("running", 1, arcs), ("foot", 1, [foot]), ("rail", 2, [face])):
        gmsh.model.setPhysicalName(dim, gmsh.model.addPhysicalGroup(dim, tags), name)
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
