#!/usr/bin/env python3
"""Makes the annular cylinder of docs/data/annulus_modes.csv (radii 0.1 and 0.5 m, width 0.1 m) with Gmsh, of any
kind of cell: a check of meshes from files against frequencies that are known otherwise.

    python3 make_ring.py --cells hex20 --size 0.03 ring.msh
    railsqueal run jobs/annulus.json --set bodies.lower.mesh='{"file": "ring.msh"}'
"""

import argparse
import math

import gmsh

INNER, OUTER, WIDTH = 0.1, 0.5, 0.1
GROWTH, PATCH = 0.3, 0.01  # of the size of cells with the distance from the contact point, beyond so many m
CELLS = {  # first-order shape, order, without nodes in the faces
    "tet4": ("tetrahedra", 1, 1),
    "tet10": ("tetrahedra", 2, 1),
    "wedge6": ("wedges", 1, 1),
    "wedge15": ("wedges", 2, 1),
    "wedge18": ("wedges", 2, 0),
    "hex8": ("hexahedra", 1, 1),
    "hex20": ("hexahedra", 2, 1),
    "hex27": ("hexahedra", 2, 0),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", choices=CELLS, default="hex20")
    parser.add_argument("--size", type=float, default=0.03, help="edge length, m")
    parser.add_argument(
        "--contact-size",
        type=float,
        help="edge length of tetrahedra about the contact point at the origin, m; makes the group contact, the running "
        "surface",
    )
    parser.add_argument("--version", default="4.1", choices=["4.1", "2.2"])
    parser.add_argument("--ascii", action="store_true")
    parser.add_argument("file")
    given = parser.parse_args()
    shape, order, incomplete = CELLS[given.cells]

    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    occ = gmsh.model.occ
    # The side at y = -WIDTH/2, about the axle through (0, 0, -OUTER), and the width by extrusion.
    disc = occ.addDisk(0, 0, 0, OUTER, OUTER)
    bore = occ.addDisk(0, 0, 0, INNER, INNER)
    ring = occ.cut([(2, disc)], [(2, bore)])[0]
    if shape == "hexahedra":
        # Four quarters, which can be meshed in lines.
        lines = [
            (1, occ.addLine(occ.addPoint(0, 0, 0), occ.addPoint(x, y, 0)))
            for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1))
        ]
        ring = [e for e in occ.fragment(ring, lines)[0] if e[0] == 2]
    occ.rotate(ring, 0, 0, 0, 1, 0, 0, math.pi / 2)
    occ.translate(ring, 0, -WIDTH / 2, -OUTER)
    layers = max(1, round(WIDTH / given.size))
    if shape == "tetrahedra":
        occ.extrude(ring, 0, WIDTH, 0)
    else:
        occ.extrude(ring, 0, WIDTH, 0, numElements=[layers], recombine=True)
    occ.synchronize()

    bounds = {"inner": INNER, "outer": OUTER}
    groups = {name: [] for name in bounds}
    for dim, surface in gmsh.model.getEntities(2):
        low, high = gmsh.model.getParametrizationBounds(dim, surface)
        places = [[a + t * (b - a) for a, b, t in zip(low, high, at)] for at in ((0.5, 0.5), (0.2, 0.7))]
        radii = [math.hypot(x, z + OUTER) for x, _, z in (gmsh.model.getValue(dim, surface, p) for p in places)]
        for name, radius in bounds.items():
            if all(abs(r - radius) < 1e-6 for r in radii):
                groups[name].append(surface)
    if given.contact_size:
        groups["contact"] = groups["outer"]
    for name, surfaces in groups.items():
        gmsh.model.setPhysicalName(2, gmsh.model.addPhysicalGroup(2, surfaces), name)
    volumes = [tag for _, tag in gmsh.model.getEntities(3)]
    gmsh.model.setPhysicalName(3, gmsh.model.addPhysicalGroup(3, volumes), "body")

    if shape == "hexahedra":
        around = max(3, round(math.pi / 2 * 0.3 / given.size))
        across = max(2, round((OUTER - INNER) / given.size))
        for dim, line in gmsh.model.getEntities(1):
            kind = gmsh.model.getType(dim, line)
            low, high = (gmsh.model.getBoundingBox(dim, line)[k] for k in (1, 4))
            if kind == "Circle":
                gmsh.model.mesh.setTransfiniteCurve(line, around + 1)
            elif high - low < WIDTH / 2:
                gmsh.model.mesh.setTransfiniteCurve(line, across + 1)
        for dim, surface in gmsh.model.getEntities(2):
            if gmsh.model.getType(dim, surface) == "Plane":
                gmsh.model.mesh.setTransfiniteSurface(surface)
                gmsh.model.mesh.setRecombine(dim, surface)
    if given.contact_size:

        def size(dim, tag, x, y, z, lc=0.0):
            return min(given.size, given.contact_size + GROWTH * max(0.0, math.sqrt(x * x + y * y + z * z) - PATCH))

        gmsh.model.mesh.setSizeCallback(size)
    else:
        gmsh.option.setNumber("Mesh.MeshSizeMin", given.size)
    gmsh.option.setNumber("Mesh.MeshSizeMax", given.size)
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", incomplete)
    gmsh.option.setNumber("Mesh.ElementOrder", order)
    gmsh.option.setNumber("Mesh.HighOrderOptimize", 0)
    gmsh.model.mesh.generate(3)
    gmsh.option.setNumber("Mesh.MshFileVersion", float(given.version))
    gmsh.option.setNumber("Mesh.Binary", 0 if given.ascii else 1)
    gmsh.write(given.file)
    print(given.file, len(gmsh.model.mesh.getNodes()[0]), "nodes")
    gmsh.finalize()


if __name__ == "__main__":
    main()
