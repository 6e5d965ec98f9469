#!/usr/bin/env python3
"""Makes a mesh of the wheel W920S with Gmsh: its section, as the swept wheel of the program has it, revolved about the
axle; small cells at the contact.

    pip install gmsh
    python3 make_wheel.py --cells tet10 wheel.msh
    python3 make_wheel.py --cells hex20 --size 0.03 --contact-size 0.004 wheel.inp

The wheel stands above the plane z = 0 as an upper body (--lower: below it), contact point at the origin, axle along y.
Groups: `inner` (the bore), `contact` (a patch of the tread about the contact point), `tread`.
"""

import argparse
import math

import gmsh

RADII = [0.095, 0.135, 0.390, 0.460, 0.488]  # bore, hub, web, tread, flange, m
TREAD = RADII[3]
WIDTHS = [-0.090, -0.065, -0.012, 0.012, 0.040, 0.070, 0.090]  # from the middle of the web towards the flange, m
BANDS = [(0, 6), (2, 3), (1, 5), (4, 5)]  # first and last of the widths between two radii
GROWTH = 0.35  # of the size of cells with the distance from the contact point
STEEP_RADII, STEEP_WIDTHS = (
    [0.095, 0.135],
    [-0.090, -0.012, 0.012, 0.090],
)  # where the stress is: at the ends of the clamped bore, between web and hub


def lines(ends, at, fine, patch, size, steep=(), corner=0.0):
    """Positions from the first to the last of `ends`, all of which are among them: small steps about `at`, and steps
    `corner` about the places `steep`, and larger ones away from there."""
    out = [ends[0]]
    for a, b in zip(ends, ends[1:]):

        def wanted(x):
            near = [corner + GROWTH * abs(x - place) for place in steep]
            return min(size, fine + GROWTH * max(0.0, abs(x - at) - patch), *near)

        count = [0.0]
        step = (b - a) / 400
        for k in range(400):
            count.append(count[-1] + step / wanted(a + (k + 0.5) * step))
        n = max(1, math.ceil(count[-1] - 1e-9))
        k = 0
        for i in range(1, n):
            while count[k + 1] < count[-1] * i / n:
                k += 1
            out.append(a + step * (k + (count[-1] * i / n - count[k]) / (count[k + 1] - count[k])))
        out.append(b)
    return out


def structured(given, offset, sign):
    """Hexahedra or wedges of revolution: rectangles of the section, swept through angles that grow away from the
    contact point."""
    widths = sorted(w - offset for w in WIDTHS)
    across = sorted({*widths, -given.patch, given.patch})
    across = [w for w in across if w in widths or widths[1] < w < widths[4]]
    steep = [w - offset for w in STEEP_WIDTHS]
    across = lines(across, 0.0, given.contact_size, given.patch, given.size, steep, given.corner_size)
    radii = lines(RADII, TREAD, given.contact_size, 0.0, given.size, STEEP_RADII, given.corner_size)
    half = lines([0.0, given.patch, math.pi * TREAD], 0.0, given.contact_size, given.patch, 2 * given.size)
    angles = [-s / TREAD for s in reversed(half[1:])] + [s / TREAD for s in half[:-1]]
    number, coords, cells, faces = {}, [], [], {"inner": [], "contact": [], "tread": []}

    def node(i, j, k):
        """The node at twice the numbers of the lines of angle, width and radius."""
        key = (i % (2 * len(angles)), j, k)
        if key not in number:
            number[key] = len(number) + 1

            def between(values, n):
                return values[n // 2] if n % 2 == 0 else 0.5 * (values[n // 2] + values[n // 2 + 1])

            r, y = between(radii, k), between(across, j)
            angle = between([*angles, angles[0] + 2 * math.pi], key[0])
            coords.extend([r * math.sin(angle), y, sign * (TREAD - r * math.cos(angle))])
        return number[key]

    corners = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
    if sign > 0:
        # Outwards is down: the other handedness.
        corners = corners[4:] + corners[:4]
    gmsh_edges = [(0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)]
    places = corners + [tuple((a + b) // 2 for a, b in zip(corners[p], corners[q])) for p, q in gmsh_edges]

    def face(name, i, j, k):
        ring = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
        faces[name].extend(node(2 * i + a, 2 * j + b, k) for a, b in ring)

    for k, (low, high) in enumerate(zip(radii, radii[1:])):
        band = next(b for b in range(4) if RADII[b] - 1e-9 <= low and high <= RADII[b + 1] + 1e-9)
        ends = [WIDTHS[b] - offset for b in BANDS[band]]
        for j, (left, right) in enumerate(zip(across, across[1:])):
            if left < ends[0] - 1e-9 or right > ends[1] + 1e-9:
                continue
            for i in range(len(angles)):
                cells.extend(node(2 * i + a, 2 * j + b, 2 * k + c) for a, b, c in places)
                if k == 0:
                    face("inner", i, j, 0)
                if abs(high - TREAD) < 1e-9 and right < WIDTHS[4] - offset + 1e-9:
                    middle = TREAD * (angles[i] + [*angles, angles[0] + 2 * math.pi][i + 1]) / 2
                    near = abs(middle) < given.patch and max(-left, right) < given.patch + 1e-9
                    face("contact" if near else "tread", i, j, 2 * k + 2)
    volume = gmsh.model.addDiscreteEntity(3)
    gmsh.model.mesh.addNodes(3, volume, list(number.values()), coords)
    gmsh.model.mesh.addElementsByType(volume, 17, [], cells)
    gmsh.model.setPhysicalName(3, gmsh.model.addPhysicalGroup(3, [volume]), "body")
    for name, nodes in faces.items():
        surface = gmsh.model.addDiscreteEntity(2)
        gmsh.model.mesh.addElementsByType(surface, 16, [], nodes)
        gmsh.model.setPhysicalName(2, gmsh.model.addPhysicalGroup(2, [surface]), name)


def free(given, offset, sign):
    """Tetrahedra between the surfaces of the same body."""
    occ = gmsh.model.occ
    outline = []
    for band, (a, b) in enumerate(BANDS):
        outline.append((RADII[band], WIDTHS[a] - offset))
        outline.append((RADII[band + 1], WIDTHS[a] - offset))
    for band, (a, b) in reversed(list(enumerate(BANDS))):
        outline.append((RADII[band + 1], WIDTHS[b] - offset))
        outline.append((RADII[band], WIDTHS[b] - offset))
    # The patch of the tread has ends of its own.
    at = outline.index((TREAD, WIDTHS[1] - offset))
    outline[at + 1 : at + 1] = [(TREAD, -given.patch), (TREAD, given.patch)]
    kept = [p for p, q in zip(outline, outline[1:] + outline[:1]) if p != q]
    angle = given.patch / TREAD
    points = [occ.addPoint(0, y, sign * (TREAD - r)) for r, y in kept]
    edges = [occ.addLine(p, q) for p, q in zip(points, points[1:] + points[:1])]
    section = [(2, occ.addPlaneSurface([occ.addCurveLoop(edges)]))]
    occ.rotate(section, 0, 0, sign * TREAD, 0, 1, 0, -angle)
    other = occ.copy(section)
    near = [e for e in occ.revolve(section, 0, 0, sign * TREAD, 0, 1, 0, 2 * angle) if e[0] == 3]
    far = [e for e in occ.revolve(other, 0, 0, sign * TREAD, 0, 1, 0, 2 * angle - 2 * math.pi) if e[0] == 3]
    occ.fragment(near, far)
    occ.synchronize()
    groups = {"inner": [], "contact": [], "tread": []}
    for dim, tag in gmsh.model.getEntities(2):
        if len(gmsh.model.getAdjacencies(dim, tag)[0]) != 1:
            continue
        low, high = gmsh.model.getParametrizationBounds(dim, tag)
        places = [
            gmsh.model.getValue(dim, tag, [a + t * (b - a) for a, b, t in zip(low, high, s)])
            for s in ((0.5, 0.5), (0.3, 0.6))
        ]
        radii = [math.hypot(x, z - sign * TREAD) for x, _, z in places]
        if all(abs(r - RADII[0]) < 1e-7 for r in radii):
            groups["inner"].append(tag)
        elif all(abs(r - TREAD) < 1e-7 for r in radii) and places[0][1] < WIDTHS[4] - offset:
            x0, y0, _, x1, y1, _ = gmsh.model.getBoundingBox(dim, tag)
            groups["contact" if max(-x0, x1, -y0, y1) < 1.1 * given.patch else "tread"].append(tag)
    for name, tags in groups.items():
        gmsh.model.setPhysicalName(2, gmsh.model.addPhysicalGroup(2, tags), name)
    gmsh.model.setPhysicalName(3, gmsh.model.addPhysicalGroup(3, [t for _, t in gmsh.model.getEntities(3)]), "body")

    def size(dim, tag, x, y, z, lc=0.0):
        away = math.sqrt(x * x + y * y + z * z) - given.patch
        r = math.hypot(x, z - sign * TREAD)
        bends = [
            (RADII[0], STEEP_WIDTHS[0]),
            (RADII[0], STEEP_WIDTHS[3]),
            (RADII[1], STEEP_WIDTHS[1]),
            (RADII[1], STEEP_WIDTHS[2]),
        ]
        steep = min(math.hypot(r - radius, y + offset - width) for radius, width in bends)
        return min(given.size, given.contact_size + GROWTH * max(0.0, away), given.corner_size + GROWTH * steep)

    gmsh.model.mesh.setSizeCallback(size)
    for option in ("MeshSizeFromPoints", "MeshSizeExtendFromBoundary"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)
    gmsh.option.setNumber("Mesh.ElementOrder", 2)
    gmsh.option.setNumber("Mesh.HighOrderOptimize", 1)
    gmsh.model.mesh.generate(3)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", choices=["tet10", "hex20"], default="hex20")
    parser.add_argument(
        "--size",
        type=float,
        default=0.03,
        help="largest edge length, m; of hexahedra that in a section, twice as long around the axle",
    )
    parser.add_argument("--contact-size", type=float, default=0.005, help="edge length at the contact, m")
    parser.add_argument(
        "--corner-size",
        type=float,
        default=0.01,
        help="edge length at the edges of the bore and between web and hub, m",
    )
    parser.add_argument(
        "--patch", type=float, default=0.01, help="half length and half width of the patch of the group contact, m"
    )
    parser.add_argument(
        "--offset", type=float, default=0.0, help="contact point from the middle of the web towards the flange, m"
    )
    parser.add_argument("--lower", action="store_true", help="below the plane z = 0")
    parser.add_argument("file", help="ends in .msh or .inp")
    given = parser.parse_args()
    if not WIDTHS[1] + given.patch < given.offset < WIDTHS[4] - given.patch:
        parser.error(f"the patch reaches beyond the tread, {WIDTHS[1]} to {WIDTHS[4]} m")
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    make = structured if given.cells == "hex20" else free
    make(given, given.offset, -1 if given.lower else 1)
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.option.setNumber("Mesh.Binary", 1)
    gmsh.write(given.file)
    print(given.file, len(gmsh.model.mesh.getNodes()[0]), "nodes")
    gmsh.finalize()


if __name__ == "__main__":
    main()
