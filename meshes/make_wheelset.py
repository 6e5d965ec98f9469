#!/usr/bin/env python3
"""Makes two meshes of a wheelset from one grid of its section: hexahedra of 20 nodes of the whole body, and the half of
the section in quadrilaterals of 8 nodes.

    python3 make_wheelset.py --sectors 48 wheelset.msh wheelset-half.msh

The dimensions are those of W920S-wheelset, but the axle has a bore of 20 mm, so that hexahedra go all the way round.
Lengths in m, MSH 2.2. The axle of the body lies along y, the running circle of one wheel over the origin; the half has
x along the axle and y away from it, its middle at x = 0.75 and the group `running`.
"""

import argparse
import math

TREAD, MIDDLE = 0.460, 0.75
# Places along the axle and radii between which the section is divided, and the number of cells between them.
ALONG = [(-0.35, 8), (-0.09, 1), (-0.065, 3), (-0.012, 2), (0.012, 2), (0.040, 2), (0.070, 1), (0.09, 20), (MIDDLE, 0)]
AWAY = [(0.010, 3), (0.065, 1), (0.080, 3), (0.135, 12), (0.390, 4), (0.460, 2), (0.488, 0)]
# Parts of the half: ends along the axle and radii.
PARTS = [
    (-0.35, 0.75, 0.010, 0.065),
    (-0.09, 0.75, 0.065, 0.080),
    (-0.09, 0.09, 0.080, 0.135),
    (-0.012, 0.012, 0.135, 0.390),
    (-0.065, 0.070, 0.390, 0.460),
    (0.040, 0.070, 0.460, 0.488),
]
# Edges of a hexahedron in the order in which Gmsh numbers their middles.
EDGES = [(0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)]
CORNERS = [(0, 0), (2, 0), (2, 2), (0, 2)]


def lines(divided):
    """Twice as many lines as cells: those of the corners and, between them, those of the middles."""
    out = [divided[0][0]]
    for (first, count), (last, _) in zip(divided, divided[1:]):
        out += [first + (last - first) * k / (2 * count) for k in range(1, 2 * count + 1)]
    return out


def cells(along, away):
    """Cells of the half, each by the numbers of its first lines."""
    for i in range(0, len(along) - 1, 2):
        for j in range(0, len(away) - 1, 2):
            y, r = along[i + 1], away[j + 1]
            if any(a < y < b and low < r < high for a, b, low, high in PARTS):
                yield i, j


class Mesh:
    """Nodes by key, and elements by their kind of Gmsh, physical group and nodes."""

    def __init__(self):
        self.number, self.places, self.elements = {}, [], []

    def node(self, key, place):
        if key not in self.number:
            self.number[key] = len(self.number) + 1
            self.places.append(place)
        return self.number[key]

    def write(self, path, groups):
        text = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(groups))]
        text += [f'{dim} {tag} "{name}"' for dim, tag, name in groups]
        text += ["$EndPhysicalNames", "$Nodes", str(len(self.places))]
        text += [f"{k} {x!r} {y!r} {z!r}" for k, (x, y, z) in enumerate(self.places, 1)]
        text += ["$EndNodes", "$Elements", str(len(self.elements))]
        for k, (kind, group, nodes) in enumerate(self.elements, 1):
            text.append(f"{k} {kind} 2 {group} {group} {' '.join(map(str, nodes))}")
        with open(path, "w", encoding="utf-8") as file:
            file.write("\n".join([*text, "$EndElements"]) + "\n")
        print(path, len(self.elements), "elements,", len(self.places), "nodes")


def half(along, away):
    """The section of the half in quadrilaterals of 8 nodes, and its running line."""
    mesh = Mesh()

    def node(i, j):
        return mesh.node((i, j), (along[i], away[j], 0.0))

    for i, j in cells(along, away):
        ring = [*CORNERS, (1, 0), (2, 1), (1, 2), (0, 1)]
        mesh.elements.append((16, 1, [node(i + a, j + b) for a, b in ring]))
        if away[j + 2] == TREAD and along[i + 1] < 0.040:
            mesh.elements.append((8, 2, [node(i, j + 2), node(i + 2, j + 2), node(i + 1, j + 2)]))
    return mesh


def body(along, away, sectors):
    """The whole body in hexahedra of 20 nodes."""
    mesh, last = Mesh(), len(along) - 1
    whole = [*along, *(2 * MIDDLE - y for y in reversed(along[:-1]))]
    step = math.pi / sectors

    def node(i, j, k):
        r, angle = away[j], step * (k % (2 * sectors))
        return mesh.node((i, j, k % (2 * sectors)), (r * math.sin(angle), whole[i], TREAD - r * math.cos(angle)))

    for i, j in cells(along, away):
        for first in (i, 2 * last - i - 2):
            for k in range(0, 2 * sectors, 2):
                # Radius, place along the axle, angle: x of the body grows with the angle at its lowest point.
                corner = [(first + b, j + a, k + c) for c in (0, 2) for a, b in CORNERS]
                middle = [tuple((p + q) // 2 for p, q in zip(corner[a], corner[b])) for a, b in EDGES]
                mesh.elements.append((17, 1, [node(*at) for at in corner + middle]))
    return mesh


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sectors", type=int, default=48, help="cells around the axle")
    parser.add_argument("body")
    parser.add_argument("half")
    given = parser.parse_args()
    along, away = lines(ALONG), lines(AWAY)
    body(along, away, given.sectors).write(given.body, [(3, 1, "wheelset")])
    half(along, away).write(given.half, [(2, 1, "steel"), (1, 2, "running")])


if __name__ == "__main__":
    main()
