"""Makes the meshes of this folder with Gmsh: every kind of cell in MSH 4.1 and 2.2, ASCII and binary. Needs the Python
package `gmsh` (4.15 was used)."""

import gmsh

BOX = (0.3, 0.2, 0.1)


def facets_named(name, height):
    """The facets at z = height become a physical group."""
    eps = 1e-6
    found = gmsh.model.getEntitiesInBoundingBox(-eps, -eps, height - eps, BOX[0] + eps, BOX[1] + eps, height + eps, 2)
    tag = gmsh.model.addPhysicalGroup(2, [t for _, t in found])
    gmsh.model.setPhysicalName(2, tag, name)


def box(cells):
    if cells == "tetrahedra":
        gmsh.model.occ.addBox(0, 0, 0, *BOX)
    else:
        base = gmsh.model.occ.addRectangle(0, 0, 0, BOX[0], BOX[1])
        gmsh.model.occ.extrude([(2, base)], 0, 0, BOX[2], numElements=[2], recombine=True)
    gmsh.model.occ.synchronize()
    if cells == "hexahedra":
        for _, line in gmsh.model.getEntities(1):
            gmsh.model.mesh.setTransfiniteCurve(line, 3)
        for _, surface in gmsh.model.getEntities(2):
            gmsh.model.mesh.setTransfiniteSurface(surface)
            gmsh.model.mesh.setRecombine(2, surface)
    gmsh.option.setNumber("Mesh.MeshSizeMin", 0.15)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.15)
    gmsh.model.mesh.generate(3)


def pyramids():
    """A brick of six pyramids."""
    x, y, z = BOX
    volume = gmsh.model.addDiscreteEntity(3)
    bottom, top = gmsh.model.addDiscreteEntity(2), gmsh.model.addDiscreteEntity(2)
    corners = [
        (0, 0, 0),
        (x, 0, 0),
        (x, y, 0),
        (0, y, 0),
        (0, 0, z),
        (x, 0, z),
        (x, y, z),
        (0, y, z),
        (x / 2, y / 2, z / 2),
    ]
    gmsh.model.mesh.addNodes(3, volume, list(range(1, 10)), [v for p in corners for v in p])
    bases = [[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]]
    gmsh.model.mesh.addElementsByType(volume, 7, [], [n + 1 for base in bases for n in base + [8]])
    gmsh.model.mesh.addElementsByType(bottom, 3, [], [1, 2, 3, 4])
    gmsh.model.mesh.addElementsByType(top, 3, [], [5, 6, 7, 8])
    for name, surface in (("bottom", bottom), ("top", top)):
        gmsh.model.setPhysicalName(2, gmsh.model.addPhysicalGroup(2, [surface]), name)


def make(name, cells, order, incomplete):
    gmsh.clear()
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", incomplete)
    if cells == "pyramids":
        pyramids()
    else:
        box(cells)
        facets_named("bottom", 0)
        facets_named("top", BOX[2])
    gmsh.model.setPhysicalName(3, gmsh.model.addPhysicalGroup(3, [t for _, t in gmsh.model.getEntities(3)]), "body")
    if order == 2:
        gmsh.model.mesh.setOrder(2)
    for version in ("4.1", "2.2"):
        for binary in (0, 1):
            gmsh.option.setNumber("Mesh.MshFileVersion", float(version))
            gmsh.option.setNumber("Mesh.Binary", binary)
            gmsh.write(f"{name}-{version}{'-binary' if binary else ''}.msh")


gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
for name, cells, order, incomplete in [
    ("tet4", "tetrahedra", 1, 1),
    ("tet10", "tetrahedra", 2, 1),
    ("hex8", "hexahedra", 1, 1),
    ("hex20", "hexahedra", 2, 1),
    ("hex27", "hexahedra", 2, 0),
    ("wedge6", "wedges", 1, 1),
    ("wedge15", "wedges", 2, 1),
    ("wedge18", "wedges", 2, 0),
    ("pyramid5", "pyramids", 1, 1),
    ("pyramid13", "pyramids", 2, 1),
]:
    make(name, cells, order, incomplete)
gmsh.finalize()
