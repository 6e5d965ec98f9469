#!/usr/bin/env python3
"""Makes the small meshes of this folder: a flat block (lower body) and a block with a doubly curved running surface
(upper body).

    pip install gmsh
    python3 make_blocks.py [--binary] [--elements N] [--output-directory DIR]

Both blocks have the same 3 x 3 plan: a patch of equal quadrilaterals in the middle, graded columns around it.
Transfinite surfaces extruded in layers give hexahedra, and contact surfaces whose nodes lie at the same x and y on both
bodies.
"""

import argparse
import math
import pathlib

import gmsh

HALF_PATCH = 6e-3  # half-length and half-width of the contact patch, m
HALF_LENGTH = 20e-3  # of the blocks in x, m
HALF_WIDTH = 16e-3  # in y, m
HEIGHT = 20e-3  # in z, m
RADIUS = 0.1  # of the upper body's surface along x, m
CROWN = 0.2  # of the upper body's surface along y, m


def profile(x, y):
    """Height of the upper body's surface above the contact plane."""
    return RADIUS - math.sqrt(RADIUS**2 - x**2) + CROWN - math.sqrt(CROWN**2 - y**2)


def block(name, sign, surface, n, path, binary):
    """A block from z = 0 to z = sign * HEIGHT whose contact surface is moved to z = surface(x, y)."""
    gmsh.model.add(name)
    geo = gmsh.model.geo
    xs = [-HALF_LENGTH, -HALF_PATCH, HALF_PATCH, HALF_LENGTH]
    ys = [-HALF_WIDTH, -HALF_PATCH, HALF_PATCH, HALF_WIDTH]
    point = [[geo.addPoint(x, y, 0.0) for x in xs] for y in ys]
    outer = max(2, n // 3)

    def division(k):  # number of elements and growth towards +axis of the k-th of three intervals
        return (n, 1.0) if k == 1 else (outer, 1.5 if k == 2 else 1 / 1.5)

    along_x = [[geo.addLine(point[j][i], point[j][i + 1]) for i in range(3)] for j in range(4)]
    along_y = [[geo.addLine(point[j][i], point[j + 1][i]) for i in range(4)] for j in range(3)]
    for k in range(3):
        elements, growth = division(k)
        for line in [row[k] for row in along_x] + along_y[k]:
            geo.mesh.setTransfiniteCurve(line, elements + 1, "Progression", growth)
    surfaces = []
    for j in range(3):
        for i in range(3):
            loop = geo.addCurveLoop([along_x[j][i], along_y[j][i + 1], -along_x[j + 1][i], -along_y[j][i]])
            surfaces.append(geo.addPlaneSurface([loop]))
            geo.mesh.setTransfiniteSurface(surfaces[-1])
            geo.mesh.setRecombine(2, surfaces[-1])
    # Layers from the contact surface into the body, each 1.6 times the one before.
    layers = max(3, n // 2)
    heights = [(1.6**k - 1) / (1.6**layers - 1) for k in range(1, layers + 1)]
    geo.extrude([(2, s) for s in surfaces], 0, 0, sign * HEIGHT, [1] * layers, heights, recombine=True)
    geo.removeAllDuplicates()
    geo.synchronize()

    contact, base, sides = [], [], []
    for _, tag in gmsh.model.getEntities(2):
        x0, y0, z0, x1, y1, z1 = gmsh.model.getBoundingBox(2, tag)
        if z1 - z0 < 1e-4:
            if abs(z0) < 1e-4:
                if max(abs(x0), abs(x1), abs(y0), abs(y1)) < HALF_PATCH + 1e-4:
                    contact.append(tag)
            else:
                base.append(tag)
        elif any(
            abs(a) > h - 1e-4 and abs(b) > h - 1e-4 and a * b > 0
            for a, b, h in [(x0, x1, HALF_LENGTH), (y0, y1, HALF_WIDTH)]
        ):
            sides.append(tag)
    for title, tags in [("contact", contact), ("base", base), ("sides", sides)]:
        gmsh.model.addPhysicalGroup(2, tags, name=title)
    gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)], name="body")
    gmsh.model.mesh.generate(3)

    # The surface is curved by moving the nodes, fewer the deeper they lie: x and y stay on the grid.
    tags, coords, _ = gmsh.model.mesh.getNodes()
    for k, tag in enumerate(tags):
        x, y, z = coords[3 * k : 3 * k + 3]
        gmsh.model.mesh.setNode(tag, [x, y, z + surface(x, y) * (1 - abs(z) / HEIGHT)], [])
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.option.setNumber("Mesh.Binary", int(binary))
    gmsh.write(str(path))
    count = sum(len(t) for t in gmsh.model.mesh.getElements(3)[1])
    print(f"{path}: {count} hexahedra")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", action="store_true", help="write binary files (*-binary.msh)")
    parser.add_argument("--elements", type=int, default=6, help="elements along each side of the patch (default 6)")
    parser.add_argument("--output-directory", type=pathlib.Path, default=pathlib.Path(__file__).parent)
    arguments = parser.parse_args()
    ending = "-binary.msh" if arguments.binary else ".msh"
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 2)
    for name, sign, surface in [("block-lower", -1, lambda x, y: 0.0), ("block-upper", 1, profile)]:
        block(name, sign, surface, arguments.elements, arguments.output_directory / (name + ending), arguments.binary)
    gmsh.finalize()


if __name__ == "__main__":
    main()
