#!/usr/bin/env python3
"""Makes a mesh of a piece of the rail 60E1 with Gmsh: triangles of its section, drawn along x to wedges of 15 nodes;
small cells at the contact.

    pip install gmsh
    python3 make_rail.py rail.msh
    python3 make_rail.py --length 8 --at -0.008 --contact-size 0.003 rail.inp

The rail stands below the plane z = 0, its crown at the origin, upright, along x. Groups: `contact` (the running surface
about the middle of the length), `foot` (what lies on the pads), `end_minus` and `end_plus` (its two ends).
"""

import argparse

import gmsh
from make_rail_section import outline

GROWTH = 0.35  # of the size of cells with the distance from the contact point
MILLI = 1e-3
TOLERANCE = 0.15  # of the outline below the head, mm


def places(half, fine, patch, size):
    """Places along x from −`half` to `half`, m: steps of `fine` within ±`patch`, larger ones away from there, up to
    `size`."""
    steps, at = [0.0], 0.0
    while at < half:
        at += min(size, fine + GROWTH * max(0.0, at - patch))
        steps.append(at)
    out = [s * half / at for s in steps]
    return [-x for x in out[:0:-1]] + out


def section(given):
    """The nodes of the meshed section, (y, z) in m by their numbers, its cells, and the edges on the head and on the
    foot, all of second order."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    arcs, foot, face = outline(0.0, given.size / MILLI, given.size / MILLI, TOLERANCE)

    def size(dim, tag, x, y, z, lc=0.0):
        away = max(0.0, ((x - given.at / MILLI) ** 2 + y**2) ** 0.5 * MILLI - given.patch)
        return min(given.size, given.contact_size + GROWTH * away) / MILLI

    gmsh.model.mesh.setSizeCallback(size)
    for option in ("MeshSizeFromPoints", "MeshSizeExtendFromBoundary"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)
    gmsh.option.setNumber("Mesh.ElementOrder", 2)
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
    gmsh.model.mesh.generate(2)
    tags, coords, _ = gmsh.model.mesh.getNodes()
    nodes = {int(t): (coords[3 * k] * MILLI, coords[3 * k + 1] * MILLI) for k, t in enumerate(tags)}

    def elements(dim, tag, kind):
        found = gmsh.model.mesh.getElementsByType(kind, tag)[1]
        per = {8: 3, 9: 6}[kind]
        return [[int(t) for t in found[k : k + per]] for k in range(0, len(found), per)]

    # The outline runs clockwise: cells are turned round, so that y, z and x are right-handed.
    cells = [[c[0], c[2], c[1], c[5], c[4], c[3]] for c in elements(2, face, 9)]
    head = [e for a in arcs for e in elements(1, a, 8)]
    return nodes, cells, head, elements(1, foot, 8)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--length", type=float, default=14.0, help="m")
    parser.add_argument(
        "--at", type=float, default=0.0, help="where on the head the cells are small, y of the upright section, m"
    )
    parser.add_argument("--size", type=float, default=0.025, help="largest edge length in the section, m")
    parser.add_argument("--along", type=float, default=0.1, help="largest edge length along the rail, m")
    parser.add_argument("--contact-size", type=float, default=0.004, help="edge length at the contact, m")
    parser.add_argument(
        "--patch", type=float, default=0.008, help="half length and half width of the place of small cells, m"
    )
    parser.add_argument("file", help="ends in .msh or .inp")
    given = parser.parse_args()
    plane, cells, head, foot = section(given)
    x = places(0.5 * given.length, given.contact_size, given.patch, given.along)

    gmsh.model.add("rail")
    number, coords = {}, []

    def node(tag, level):
        """The node of the section at twice the number of the place along x."""
        if (tag, level) not in number:
            number[tag, level] = len(number) + 1
            at = x[level // 2] if level % 2 == 0 else 0.5 * (x[level // 2] + x[level // 2 + 1])
            y, z = plane[tag]
            coords.extend([at, y, z])
        return number[tag, level]

    def wedge(cell, k):
        """Wedge over a triangle between two places along x, in Gmsh's order. y, z and x are right-handed."""
        a, b, c, ab, bc, ca = cell
        near, between, far = 2 * k, 2 * k + 1, 2 * k + 2
        corners = [(t, level) for level in (near, far) for t in (a, b, c)]
        edges = [
            (ab, near),
            (ca, near),
            (a, between),
            (bc, near),
            (b, between),
            (c, between),
            (ab, far),
            (ca, far),
            (bc, far),
        ]
        return [node(t, level) for t, level in corners + edges]

    def strip(edge, k):
        """A face of 8 nodes along an edge of the section."""
        a, b, middle = edge
        ring = [(a, 0), (b, 0), (b, 2), (a, 2), (middle, 0), (b, 1), (middle, 2), (a, 1)]
        return [node(t, 2 * k + level) for t, level in ring]

    steps = range(len(x) - 1)
    solid = [n for k in steps for cell in cells for n in wedge(cell, k)]
    middle = [k for k in steps if abs(0.5 * (x[k] + x[k + 1])) < 6 * given.patch]
    last = 2 * (len(x) - 1)
    faces = {
        "contact": (16, [n for k in middle for e in head for n in strip(e, k)]),
        "foot": (16, [n for k in steps for e in foot for n in strip(e, k)]),
        "end_minus": (9, [node(t, 0) for cell in cells for t in cell]),
        "end_plus": (9, [node(t, last) for cell in cells for t in cell]),
    }
    body = gmsh.model.addDiscreteEntity(3)
    gmsh.model.mesh.addNodes(3, body, list(number.values()), coords)
    gmsh.model.mesh.addElementsByType(body, 18, [], solid)
    gmsh.model.setPhysicalName(3, gmsh.model.addPhysicalGroup(3, [body]), "body")
    for name, (kind, nodes) in faces.items():
        surface = gmsh.model.addDiscreteEntity(2)
        gmsh.model.mesh.addElementsByType(surface, kind, [], nodes)
        gmsh.model.setPhysicalName(2, gmsh.model.addPhysicalGroup(2, [surface]), name)
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.option.setNumber("Mesh.Binary", 1)
    gmsh.write(given.file)
    print(given.file, len(number), "nodes,", len(cells) * (len(x) - 1), "cells")
    gmsh.finalize()


if __name__ == "__main__":
    main()
