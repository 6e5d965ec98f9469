#!/usr/bin/env python3
"""Makes three drawings that `railsqueal section` reads: a wheel as DXF, a rail and half of a wheelset as tables of
coordinates.

    pip install ezdxf
    python3 make_outlines.py --directory .

`wheel-outline.dxf` is the wheel of `wheel-section.msh`, in mm, with layers for its groups. `rail-outline.csv` is the
rail 60E1, in mm with its origin in the middle of the head; the column `bulge` makes arcs of the edges of its head.
`wheelset-outline.csv` is one half of a wheelset of our own, in mm: wheels with a curved web and a coned tread on a
solid axle, flange at +x and the middle of the axle at x = 750.
"""

import argparse
import math
from pathlib import Path

# The wheel of make_section.py, mm.
BORE, HUB, WEB, TREAD, FLANGE = 95.0, 135.0, 390.0, 460.0, 488.0
HUB_AT, RIM_AT, FLANGE_AT = (-90.0, 90.0), (-65.0, 70.0), (40.0, 70.0)
HALF_WEB, BOW = 12.0, 18.0

# 60E1 below the head's arcs: the points of make_rail_section.py, which are those of the program Rolland (M. Mantel,
# BSD-3-Clause): y from the middle, z up from the foot, mm.
HEIGHT = 172.0
SIDE = [(37.03, 136.60), (36.95, 135.94), (36.40, 134.73), (35.34, 133.90), (34.72, 133.63)]
UNDERSIDE = [(16.91, 127.15), (15.08, 126.28), (13.56, 124.94), (12.79, 123.83), (12.25, 122.59), (11.35, 119.33)]
UPPER_WEB = [(10.37, 114.69), (9.38, 108.68), (8.76, 103.30), (8.38, 97.90), (8.25, 92.49)]
LOWER_WEB = [(8.25, 59.31), (8.39, 54.58), (8.70, 49.85), (9.12, 45.81), (9.68, 41.79), (10.37, 37.78)]
FILLET = [(11.35, 33.15), (12.51, 29.26), (14.05, 27.06), (15.70, 25.88), (16.94, 25.36)]
FOOT = [(44.94, 15.18), (48.82, 13.99), (52.80, 13.20), (70.35, 11.83), (72.34, 11.51), (73.52, 10.86), (74.40, 9.84)]
TIP = [(74.99, 7.93), (75.00, 0.0)]
# Arcs of the head from the middle outwards: radius, and the distance from the middle at which it ends, mm.
ARCS = [(300.0, 10.228), (80.0, 26.0265)]
CORNER = 13.0


def wheel(path):
    """Writes the wheel: lines, and splines along the web."""
    import ezdxf

    document = ezdxf.new("R2000", units=ezdxf.units.MM)
    for layer in ("outline", "running", "bore"):
        document.layers.add(layer)
    space = document.modelspace()

    def line(start, end, layer="outline"):
        space.add_line(start, end, dxfattribs={"layer": layer})

    def web(side):
        steps = [HUB + (WEB - HUB) * k / 24 for k in range(25)]
        return [(side * HALF_WEB + BOW * math.sin(math.pi * (y - HUB) / (WEB - HUB)) ** 2, y) for y in steps]

    right, left = web(1), web(-1)
    line((HUB_AT[0], BORE), (HUB_AT[1], BORE), "bore")
    corners = [(HUB_AT[1], BORE), (HUB_AT[1], HUB), right[0]]
    rim = [right[-1], (RIM_AT[1], WEB), (FLANGE_AT[1], FLANGE), (FLANGE_AT[0], FLANGE), (FLANGE_AT[0], TREAD)]
    back = [(RIM_AT[0], TREAD), (RIM_AT[0], WEB), left[-1]]
    hub = [left[0], (HUB_AT[0], HUB), (HUB_AT[0], BORE)]
    for points in (corners, rim, back, hub):
        for start, end in zip(points, points[1:]):
            line(start, end)
    line(rim[-1], back[0], "running")
    for points in (right, left):
        # The web leaves hub and rim upright.
        space.add_cad_spline_control_frame(points, tangents=[(0, 1), (0, 1)], dxfattribs={"layer": "outline"})
    document.saveas(path)


def head():
    """Ends of the head's arcs from the middle outwards, mm, and the bulge of each arc."""
    angles = [math.asin(ARCS[0][1] / ARCS[0][0])]
    angles.append(math.asin((ARCS[1][1] - (ARCS[0][0] - ARCS[1][0]) * math.sin(angles[0])) / ARCS[1][0]))
    # The side is 1:20 from the upright.
    angles.append(math.atan(20.0))
    points, bulges, angle = [(0.0, HEIGHT)], [], 0.0
    for radius, end in zip([ARCS[0][0], ARCS[1][0], CORNER], angles):
        x, y = points[-1]
        points.append((x + radius * (math.sin(end) - math.sin(angle)), y + radius * (math.cos(end) - math.cos(angle))))
        bulges.append(math.tan((end - angle) / 4))
        angle = end
    return points, bulges


def rail(path):
    """Writes the rail, counterclockwise from the right end of the foot."""
    points, bulges = head()
    side = [*SIDE, *UNDERSIDE, *UPPER_WEB, *LOWER_WEB, *FILLET, *FOOT, *TIP]
    rows = [(x, z, "", 0.0) for x, z in reversed(side)]
    rows += [(x, z, "running", bulge) for (x, z), bulge in zip(points[:0:-1], bulges[::-1])]
    rows += [(-x, z, "running", bulge) for (x, z), bulge in zip(points, bulges)]
    rows += [(-points[-1][0], points[-1][1], "", 0.0)]
    rows += [(-x, z, "", 0.0) for x, z in side[:-1]] + [(-side[-1][0], side[-1][1], "foot", 0.0)]
    lines = [f"{x:.6f};{z - HEIGHT:.6f};{group};{bulge:.10f}" for x, z, group, bulge in rows]
    path.write_text("\n".join(["x (mm);y (mm);group;bulge", *lines]) + "\n", encoding="utf-8")


# Half of the wheelset, mm: radii of the axle from its end to its middle with the x at which they end, and the radius of
# the fillets at its shoulders. The wheel on it is the one above, its tread a cone.
AXLE = [(65.0, -100.0), (95.0, 110.0), (82.0, 750.0)]
END, SHOULDER, CONE = -350.0, 15.0, 0.025


def wheelset(path):
    """Writes the half of the wheelset, counterclockwise from the end of the axle along its centre line."""
    journal, seat, body = (radius for radius, _ in AXLE)
    (_, before), (_, behind), (_, middle) = AXLE
    quarter = math.tan(math.pi / 8)
    web = [(HUB + (WEB - HUB) * k / 24) for k in range(25)]
    faces = [[(s * HALF_WEB + BOW * math.sin(math.pi * (y - HUB) / (WEB - HUB)) ** 2, y) for y in web] for s in (1, -1)]
    # Place, group and bulge of the edge that begins there; from the middle of the axle over the wheel to its end.
    rows = [(END, 0.0, "", 0.0), (middle, 0.0, "", 0.0), (middle, body, "", 0.0)]
    # A fillet between the axle and the seat: the quarter of a circle that is as high as the step.
    rows += [(behind + seat - body, body, "", -quarter), (behind, seat, "", 0.0), (HUB_AT[1], seat, "", 0.0)]
    rows += [(HUB_AT[1], HUB, "", 0.0), *((x, y, "", 0.0) for x, y in faces[0])]
    rows += [(RIM_AT[1], WEB, "", 0.0), (FLANGE_AT[1], FLANGE, "", 0.0), (FLANGE_AT[0], FLANGE, "", 0.0)]
    rows += [(x, TREAD + CONE * x, group, 0.0) for x, group in ((FLANGE_AT[0], "running"), (RIM_AT[0], ""))]
    rows += [(RIM_AT[0], WEB, "", 0.0), *((x, y, "", 0.0) for x, y in reversed(faces[1]))]
    rows += [(HUB_AT[0], HUB, "", 0.0), (HUB_AT[0], seat, "", 0.0)]
    rows += [(before, seat, "", 0.0), (before, journal + SHOULDER, "", -quarter)]
    rows += [(before - SHOULDER, journal, "journal", 0.0), (END, journal, "", 0.0)]
    lines = [f"{x:.6f};{y:.6f};{group};{bulge:.10f}" for x, y, group, bulge in rows]
    path.write_text("\n".join(["x (mm);y (mm);group;bulge", *lines]) + "\n", encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--directory", type=Path, default=Path("."), help="where the files go")
    given = parser.parse_args()
    wheel(given.directory / "wheel-outline.dxf")
    rail(given.directory / "rail-outline.csv")
    wheelset(given.directory / "wheelset-outline.csv")


if __name__ == "__main__":
    main()
