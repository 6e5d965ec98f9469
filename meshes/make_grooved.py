#!/usr/bin/env python3
"""Makes the drawing of a grooved rail that `railsqueal section` reads, and its running profile.

    python3 make_grooved.py --directory .

`grooved-rail.csv` is the section, in mm: x from the middle of the head, positive to the gauge side, y up from the
crown; the column `bulge` makes the arcs. `grooved-rail-head.txt` is the running profile: y to the field side, z down.

Main dimensions are those of the rail 59R2 (Ri59N) of EN 14811 as recalled, not looked up: height and foot 180 mm, head
56 mm, groove 42 mm wide and 47 mm deep, keeper 15 mm, web 12 mm, crown 225 mm, gauge corner 13 mm. All other
dimensions are chosen so that the measures are near those of 59R2, recalled as well: 74.1 cm2 (58.2 kg/m), 3214 cm4
vertically and 878 cm4 laterally. The section is one of this kind, not that of the standard.
"""

import argparse
import math
from pathlib import Path

HEIGHT, HALF_FOOT, HALF_WEB, HALF_HEAD = 180.0, 90.0, 6.0, 28.0
CROWN, GAUGE_CORNER, FIELD_CORNER = 225.0, 13.0, 8.0
GROOVE, DEPTH, KEEPER, KEEPER_BELOW = 42.0, 47.0, 15.0, 2.0
GAUGE_SLOPE = 10.0  # fall of the gauge face for each unit of width
WEB_AT, TOE, FOOT_RISE = 6.0, 7.0, 0.1  # place of the web's middle, thickness and slope of the foot
STEP = 0.25  # mm along the arcs of the running profile
HEAD = None  # stands for the head among the corners


def corners():
    """Corners of the outline (x, y above the foot) with the radius of each, anticlockwise from the foot."""
    root = TOE + FOOT_RISE * (HALF_FOOT - HALF_WEB)
    gauge = HALF_HEAD + GROOVE  # inner face of the keeper
    bottom = HEIGHT - DEPTH
    left, right = WEB_AT - HALF_WEB, WEB_AT + HALF_WEB
    return [
        (WEB_AT - HALF_FOOT, 0.0, 1.5),
        (WEB_AT + HALF_FOOT, 0.0, 1.5),
        (WEB_AT + HALF_FOOT, TOE, 3.0),
        (right, root, 20.0),
        (right, bottom - 20.0, 14.0),
        (gauge - 4.0, bottom - 9.0, 20.0),
        (gauge + KEEPER, bottom + 16.0, 12.0),
        (gauge + KEEPER, HEIGHT - KEEPER_BELOW, 3.0),
        (gauge, HEIGHT - KEEPER_BELOW, 3.0),
        (gauge - 5.0, bottom, 10.0),
        (HALF_HEAD + (DEPTH - 14.0) / GAUGE_SLOPE, bottom, 10.0),
        HEAD,
        (-HALF_HEAD, bottom + 18.0, 2.0),
        (left, bottom + 8.0, 10.0),
        (left, root, 20.0),
        (WEB_AT - HALF_FOOT, TOE, 3.0),
    ]


def rounded(before, corner, after, radius):
    """Ends of the arc that rounds a corner, and its bulge."""
    u = [before[k] - corner[k] for k in (0, 1)]
    v = [after[k] - corner[k] for k in (0, 1)]
    lu, lv = math.hypot(*u), math.hypot(*v)
    angle = math.acos((u[0] * v[0] + u[1] * v[1]) / (lu * lv))
    back = radius / math.tan(0.5 * angle)
    if back > min(lu, lv):
        raise ValueError(f"the corner {corner} has no room for a radius of {radius} mm")
    turn = u[0] * v[1] - u[1] * v[0]  # negative: the outline turns left there
    bulge = math.copysign(math.tan(0.25 * (math.pi - angle)), -turn)
    first, last = ([corner[k] + back * w[k] / length for k in (0, 1)] for w, length in ((u, lu), (v, lv)))
    return first, last, bulge


def head():
    """The head from the groove to the field side: starts of its edges (x, y above the foot) with their bulges.

    The gauge face, the gauge corner, the crown and the field corner meet tangentially.
    """
    steep = math.atan(GAUGE_SLOPE)
    # The gauge face passes x = 28 mm 14 mm below the crown; the corner touches it and the crown from within.
    inner = CROWN - GAUGE_CORNER
    normal = (math.sin(steep), math.cos(steep))
    # Centre of the corner: at `inner` from the centre of the crown, GAUGE_CORNER from the face.
    c0 = (0.0, HEIGHT - CROWN)
    face = HALF_HEAD * normal[0] + (HEIGHT - 14.0) * normal[1] - GAUGE_CORNER
    reach = face - c0[1] * normal[1]
    # inner (sin a sin s + cos a cos s) = reach: cos(a - s) = reach/inner
    a = steep - math.acos(reach / inner)
    c1 = (c0[0] + inner * math.sin(a), c0[1] + inner * math.cos(a))
    low = (c1[0] + GAUGE_CORNER * normal[0], c1[1] + GAUGE_CORNER * normal[1])
    top = (c0[0] + CROWN * math.sin(a), c0[1] + CROWN * math.cos(a))
    # Field corner: upright face at x = -HALF_HEAD.
    b = math.asin((HALF_HEAD - FIELD_CORNER) / (CROWN - FIELD_CORNER))
    field = (-CROWN * math.sin(b), c0[1] + CROWN * math.cos(b))
    c2y = c0[1] + (CROWN - FIELD_CORNER) * math.cos(b)
    return {
        "low": low,
        "top": top,
        "field": field,
        "side": (-HALF_HEAD, c2y),
        "corner": c1,
        "bulges": [math.tan(0.25 * (steep - a)), math.tan(0.25 * (a + b)), math.tan(0.25 * (0.5 * math.pi - b))],
        "angles": (steep, a, b),
        "centre": c0,
    }


def outline():
    """Starts of edges, x and y above the foot, with group and bulge of each edge."""
    h = head()
    given = corners()
    at = given.index(HEAD)
    ring = given[:at] + [(*h["low"], 0.0), (*h["side"], 0.0)] + given[at + 1 :]
    edges = []
    for k, (x, y, radius) in enumerate(ring):
        if radius == 0.0:
            if k == at:
                edges.append([*h["low"], "running", h["bulges"][0]])
                edges.append([*h["top"], "running", h["bulges"][1]])
                edges.append([*h["field"], "running", h["bulges"][2]])
            else:
                edges.append([x, y, "", 0.0])
            continue
        first, last, bulge = rounded(ring[k - 1], (x, y), ring[(k + 1) % len(ring)], radius)
        edges.append([*first, "", bulge])
        edges.append([*last, "foot" if k == 0 else "", 0.0])
    return edges


def measures(edges, parts=64):
    """Area (cm2), height of the centroid (mm), second moments (cm4) of the outline, its arcs in chords."""
    points = []
    for (x, y, _, bulge), (u, v, _, _) in zip(edges, edges[1:] + edges[:1]):
        if bulge == 0.0:
            points.append((x, y))
            continue
        half = 2.0 * math.atan(bulge)
        length = math.hypot(u - x, v - y)
        radius = 0.5 * length / math.sin(half)
        apothem = radius * math.cos(half)
        mx, my = 0.5 * (x + u) - apothem * (v - y) / length, 0.5 * (y + v) + apothem * (u - x) / length
        start = math.atan2(y - my, x - mx)
        points += [
            (
                mx + abs(radius) * math.cos(start + 2 * half * k / parts),
                my + abs(radius) * math.sin(start + 2 * half * k / parts),
            )
            for k in range(parts)
        ]
    a = sx = sy = ix = iy = 0.0
    for (x, y), (u, v) in zip(points, points[1:] + points[:1]):
        c = x * v - u * y
        a, sx, sy = a + c / 2, sx + (x + u) * c / 6, sy + (y + v) * c / 6
        ix, iy = ix + (y * y + y * v + v * v) * c / 12, iy + (x * x + x * u + u * u) * c / 12
    return a / 100, sy / a, (ix - sy * sy / a) / 1e4, (iy - sx * sx / a) / 1e4


def running():
    """Points (y to the field side, z down, mm) of the running profile from the gauge face to the field corner."""
    h = head()
    steep, a, b = h["angles"]
    points = []

    def arc(centre, radius, start, end):
        count = max(2, math.ceil(abs(end - start) * radius / STEP))
        for k in range(count + 1):
            angle = start + (end - start) * k / count
            points.append((centre[0] + radius * math.sin(angle), centre[1] + radius * math.cos(angle)))

    # Down the gauge face to 24 mm below the crown.
    count = 40
    x, y = h["low"]
    for k in range(count):
        down = (HEIGHT - 24.0 - y) * (1 - k / count)
        points.append((x - down / GAUGE_SLOPE, y + down))
    arc(h["corner"], GAUGE_CORNER, steep, a)
    arc(h["centre"], CROWN, a, -b)
    arc((-HALF_HEAD + FIELD_CORNER, h["side"][1]), FIELD_CORNER, -b, -1.4)
    unique = [p for k, p in enumerate(points) if k == 0 or math.dist(p, points[k - 1]) > 1e-6]
    return [(-x, HEIGHT - y) for x, y in unique]


def main():
    """Writes the drawing and the running profile, and prints the measures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--directory", type=Path, default=Path("."))
    directory = parser.parse_args().directory
    edges = outline()
    lines = ["x (mm);y (mm);group;bulge"]
    lines += [f"{x:.6f};{y - HEIGHT:.6f};{group};{bulge:.10f}" for x, y, group, bulge in edges]
    (directory / "grooved-rail.csv").write_text("\n".join(lines) + "\n")
    profile = ["# Running profile of a grooved rail: y to the field side, z down, mm"]
    profile += [f"{y:.6f} {z:.6f}" for y, z in running()]
    (directory / "grooved-rail-head.txt").write_text("\n".join(profile) + "\n")
    area, centroid, vertical, lateral = measures(edges)
    print(
        f"{area:.2f} cm2, {0.785 * area:.2f} kg/m, second moments {vertical:.0f} cm4 vertically and {lateral:.0f} cm4 "
        f"laterally, centroid {centroid:.1f} mm above the underside"
    )


if __name__ == "__main__":
    main()
