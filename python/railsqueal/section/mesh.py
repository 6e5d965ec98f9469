"""Plane meshes of triangles with 6 nodes within an outline: triangulated by Netgen, written as MSH 4.1."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import USAGE, WRITING, InputError, ResultError
from .curves import Floats
from .edges import Edge

Integers = NDArray[np.int64]
# How fast elements grow away from small edges (Netgen): 0 slowly, 1 at once.
_GRADING = 0.3


@dataclass(frozen=True)
class PlaneMesh:
    """Triangles of second order: corners counterclockwise, then the middles of the edges 12, 23, 31."""

    nodes: Floats  # [n, 2], m
    triangles: Integers  # [e, 6]
    edges: Integers  # [b, 3] on the boundary: first, last, middle node
    groups: list[str]  # [b], the group of each edge; empty: none

    def jacobians(self) -> Floats:
        """Determinants at the nodes of each triangle, [e, 6], twice the area of a straight one."""
        x = self.nodes[self.triangles]
        found = []
        for a, b in ((0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5)):
            c = 1 - a - b
            by_a = np.array([1 - 4 * c, 4 * a - 1, 0, 4 * (c - a), 4 * b, -4 * b])
            by_b = np.array([1 - 4 * c, 0, 4 * b - 1, -4 * a, 4 * a, 4 * (c - b)])
            da, db = np.einsum("n,enk->ek", by_a, x), np.einsum("n,enk->ek", by_b, x)
            found.append(da[:, 0] * db[:, 1] - da[:, 1] * db[:, 0])
        return np.stack(found, axis=1)

    def area(self) -> float:
        """Area of the elements, m²; exact, as the determinant is quadratic."""
        return float(self.jacobians()[:, 3:].sum() / 6)


def triangulate(edges: list[Edge], size: float) -> PlaneMesh:
    """The mesh within a closed loop of edges, counterclockwise; `size` is the length of edges inside, m."""
    corners = np.array([edge.point(0.0) for edge in edges])
    nodes, triangles, border = _netgen(corners, size)
    points = [np.asarray(p) for p in nodes]
    # Netgen may divide an edge; its nodes then go onto the curve.
    divided: list[tuple[int, int, Edge]] = []
    for a, b, k in border:
        start, chord = corners[k], corners[(k + 1) % len(corners)] - corners[k]
        low, high = (float((points[n] - start) @ chord / (chord @ chord)) for n in (a, b))
        if low > high:
            a, b, low, high = b, a, high, low
        divided.append((a, b, edges[k].between(round(low, 9), round(high, 9))))
    for a, _, edge in divided:
        nodes[a] = edge.point(0.0)
    middles: dict[tuple[int, int], int] = {}
    made = list(nodes)
    boundary = []
    for a, b, edge in divided:
        middles[min(a, b), max(a, b)] = len(made)
        boundary.append((a, b, len(made)))
        made.append(edge.point(0.5))
    quadratic = []
    for face in triangles:
        row = list(face)
        for a, b in zip(face, (*face[1:], face[0])):
            key = min(a, b), max(a, b)
            if key not in middles:
                middles[key] = len(made)
                made.append(0.5 * (nodes[a] + nodes[b]))
            row.append(middles[key])
        quadratic.append(row)
    groups = [edge.curve.group for _, _, edge in divided]
    mesh = PlaneMesh(np.array(made), np.array(quadratic), np.array(boundary), groups)
    worst = mesh.jacobians().min(axis=1)
    if worst.min() <= 0:
        x, y = 1e3 * mesh.nodes[mesh.triangles[int(np.argmin(worst)), :3]].mean(axis=0)
        raise InputError(
            f"the triangle at (x = {x:.3f}, y = {y:.3f}) mm is inverted by its curved edge; give a smaller --size"
        )
    return mesh


def _netgen(corners: Floats, size: float) -> tuple[Floats, list[list[int]], list[tuple[int, int, int]]]:
    """Nodes, triangles (counterclockwise), and edges of the boundary with the number of their side, of a polygon."""
    try:
        from netgen.geom2d import SplineGeometry
    except ImportError as error:
        message = f"sections are meshed by the module netgen-mesher: pip install 'railsqueal[section]' ({error})"
        raise InputError(message, USAGE) from error
    geometry: Any = SplineGeometry()
    # In units of the size: Netgen joins points that are close in absolute terms.
    scaled = corners / size
    count = len(corners)
    numbers = [geometry.AppendPoint(float(x), float(y)) for x, y in scaled]
    for k in range(count):
        length = float(np.linalg.norm(scaled[(k + 1) % count] - scaled[k]))
        ends = ["line", numbers[k], numbers[(k + 1) % count]]
        geometry.Append(ends, bc=k + 1, leftdomain=1, rightdomain=0, maxh=1.01 * length)
    try:
        made = geometry.GenerateMesh(maxh=1.0, grading=_GRADING, quad_dominated=False)
    except Exception as error:
        raise InputError(
            f"Netgen could not mesh the section: {error}; give another --size, or remove very short edges"
        ) from error
    nodes = np.array([[p[0], p[1]] for p in (point.p for point in made.Points())]) * size
    triangles = [[v.nr - 1 for v in element.vertices] for element in made.Elements2D()]
    border = [(e.vertices[0].nr - 1, e.vertices[1].nr - 1, e.index - 1) for e in made.Elements1D()]
    oriented = []
    for a, b, c in triangles:
        (ux, uy), (vx, vy) = nodes[b] - nodes[a], nodes[c] - nodes[a]
        oriented.append([a, b, c] if ux * vy - uy * vx > 0 else [a, c, b])
    return nodes, oriented, border


def write(mesh: PlaneMesh, path: Path, surface: str) -> None:
    """Writes MSH 4.1 as text, in m, with a physical curve for each group and one physical surface."""
    names = sorted({group for group in mesh.groups if group})
    titles = {name: k + 1 for k, name in enumerate(names)}
    # One curve entity a group, and the last one for edges without a group, which are not saved.
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    box = f"{low[0]:.9g} {low[1]:.9g} 0 {high[0]:.9g} {high[1]:.9g} 0"
    lines = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(names) + 1)]
    lines += [f'1 {titles[name]} "{name}"' for name in names] + [f'2 {len(names) + 1} "{surface}"', "$EndPhysicalNames"]
    lines += ["$Entities", f"0 {len(names)} 1 0"]
    lines += [f"{titles[name]} {box} 1 {titles[name]} 0" for name in names]
    lines += [f"1 {box} 1 {len(names) + 1} 0", "$EndEntities"]
    count = len(mesh.nodes)
    lines += ["$Nodes", f"1 {count} 1 {count}", f"2 1 0 {count}", *(str(k + 1) for k in range(count))]
    lines += [f"{x:.16g} {y:.16g} 0" for x, y in mesh.nodes]
    lines += ["$EndNodes"]
    kept = {name: [e for e, group in zip(mesh.edges.tolist(), mesh.groups) if group == name] for name in names}
    total = sum(map(len, kept.values())) + len(mesh.triangles)
    lines += ["$Elements", f"{len(names) + 1} {total} 1 {total}"]
    number = 0
    for name, edges in kept.items():
        lines.append(f"1 {titles[name]} 8 {len(edges)}")
        for edge in edges:
            number += 1
            lines.append(f"{number} " + " ".join(str(n + 1) for n in edge))
    lines.append(f"2 1 9 {len(mesh.triangles)}")
    for triangle in mesh.triangles.tolist():
        number += 1
        lines.append(f"{number} " + " ".join(str(n + 1) for n in triangle))
    lines.append("$EndElements")
    try:
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise ResultError(f"cannot write {path}: {error.strerror}", WRITING) from error
