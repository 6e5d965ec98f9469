#!/usr/bin/env python3
"""Makes the mesh of two brake pads on both faces of a disc: sectors of a ring of 20-node hexahedra, axle along z.

    python3 make_pads.py [--radial N] [--along N] [--through N] [pads.msh]

The outer pad is above the disc (z > 0), the inner one below it. Groups: outer_face and inner_face lie on the disc,
outer_back and inner_back behind them.
"""

import argparse
import math
import pathlib

RADII = (0.078, 0.128)  # m
ANGLE = math.radians(25.0)  # half of the sector, rad
DISC = 0.012  # thickness of the disc, m
THICKNESS = 0.014  # of a pad, m

# Corners of a hexahedron in half steps, and the pairs between which its other nodes lie, in the order of Gmsh.
CORNERS = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
EDGES = [(0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)]
HEXAHEDRON, QUADRILATERAL = 17, 16


def between(a, b):
    return tuple((p + q) // 2 for p, q in zip(a, b))


def pad(side, counts):
    """Nodes by half steps (i along the radius, j along the circle, k from the disc outwards), cells, and the faces on
    the disc and behind, of the pad at z > 0 (`side` 1) or z < 0 (-1)."""
    radial, along, through = counts
    nodes, cells, faces = {}, [], ([], [])

    def node(i, j, k):
        if (i, j, k) not in nodes:
            radius = RADII[0] + (RADII[1] - RADII[0]) * i / (2 * radial)
            angle = ANGLE * (j / along - 1.0)
            height = side * (0.5 * DISC + THICKNESS * k / (2 * through))
            nodes[i, j, k] = (radius * math.cos(angle), radius * math.sin(angle), height)
        return i, j, k

    for k in range(through):
        for j in range(along):
            for i in range(radial):
                corners = [(2 * i + a, 2 * j + b, 2 * k + c) for a, b, c in CORNERS]
                if side < 0:  # mirrored, so that the volume stays positive
                    corners = corners[4:] + corners[:4]
                cells.append([node(*c) for c in corners + [between(corners[a], corners[b]) for a, b in EDGES]])
                for of, layer, step in ((0, 0, 0), (1, through - 1, 2)):
                    if k == layer:
                        ring = [(2 * i + a, 2 * j + b, 2 * k + step) for a, b in ((0, 0), (2, 0), (2, 2), (0, 2))]
                        middles = [between(ring[n], ring[(n + 1) % 4]) for n in range(4)]
                        faces[of].append([node(*c) for c in ring + middles])
    return nodes, cells, faces


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("file", nargs="?", default=pathlib.Path(__file__).with_name("pads.msh"), type=pathlib.Path)
    for name, count in (("radial", 3), ("along", 6), ("through", 2)):
        parser.add_argument(f"--{name}", type=int, default=count, help=f"elements (default: {count})")
    wanted = parser.parse_args()
    groups = ["outer_face", "outer_back", "inner_face", "inner_back"]
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(groups) + 1)]
    lines += [f'2 {k + 1} "{name}"' for k, name in enumerate(groups)] + ['3 5 "pads"', "$EndPhysicalNames"]
    numbers, points, elements = {}, [], []
    for number, side in enumerate((1, -1)):
        nodes, cells, faces = pad(side, (wanted.radial, wanted.along, wanted.through))
        for place, point in nodes.items():
            numbers[side, place] = len(points) + 1
            points.append(point)
        tagged = [(QUADRILATERAL, 2 * number + of + 1, face) for of in (0, 1) for face in faces[of]]
        for kind, group, places in tagged + [(HEXAHEDRON, 5, cell) for cell in cells]:
            elements.append(f"{kind} 2 {group} {group} " + " ".join(str(numbers[side, p]) for p in places))
    lines += ["$Nodes", str(len(points))]
    lines += [f"{k + 1} {x:.12g} {y:.12g} {z:.12g}" for k, (x, y, z) in enumerate(points)]
    lines += ["$EndNodes", "$Elements", str(len(elements))]
    lines += [f"{k + 1} {element}" for k, element in enumerate(elements)] + ["$EndElements"]
    wanted.file.write_text("\n".join(lines) + "\n")
    print(f"{wanted.file}: {len(points)} nodes, {len(elements)} elements and faces")


if __name__ == "__main__":
    main()
