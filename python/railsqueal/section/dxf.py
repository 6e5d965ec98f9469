"""Outlines from DXF drawings, read by ezdxf: lines, arcs, circles, ellipses, polylines with bulges, splines, and blocks
of them.

The layer of a curve is its group; layers that are off or frozen are left out.
"""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import USAGE, InputError
from .curves import Affine, Arc, Curve, Floats, Line, Spline
from .drawing import Drawing

# $INSUNITS of DXF: number and unit.
_INSUNITS = {1: "in", 4: "mm", 5: "cm", 6: "m"}
_CURVES = ("LINE", "ARC", "CIRCLE", "ELLIPSE", "LWPOLYLINE", "POLYLINE", "SPLINE")
# Depth of blocks in blocks.
_DEEPEST = 16
# Largest |z| of a plane drawing, over its size.
_FLAT = 1e-6


def read(path: Path, ignored: Sequence[str]) -> Drawing:
    """The curves of the model space but those of ignored layers."""
    document, damage = _document(path)
    ignored = [name.lower() for name in ignored]
    hidden = {layer.dxf.name.lower() for layer in document.layers if layer.is_off() or layer.is_frozen()}
    curves: list[Curve] = []
    layers: Counter[str] = Counter()
    passed: Counter[str] = Counter()
    left_out: Counter[str] = Counter()
    kinds: Counter[str] = Counter()
    for entity in _entities(document.modelspace(), 0, path):
        kind, layer = entity.dxftype(), entity.dxf.layer
        if kind not in _CURVES:
            passed[kind] += 1
        elif layer.lower() in ignored or layer.lower() in hidden:
            left_out[layer] += 1
        else:
            curves += _curves(entity, path)
            layers[layer] += 1
            kinds[kind] += 1
    unknown = [name for name in ignored if name not in {key.lower() for key in left_out} and name not in hidden]
    if unknown:
        there = ", ".join(sorted([*layers, *left_out])) or "none"
        raise InputError(f"--ignore: {path} has no curves on the layer {unknown[0]!r}; there are {there}", USAGE)
    if not curves:
        there = ", ".join(f"{n} {kind}" for kind, n in (passed + left_out).items()) or "nothing"
        raise InputError(
            f"{path} has no lines, arcs, polylines or splines in its model space that are shown (there is {there})"
        )
    remarks = damage
    if left_out:
        remarks.append("layers left out: " + ", ".join(f"{name} ({n})" for name, n in left_out.items()))
    if passed:
        remarks.append("left out: " + ", ".join(f"{n} {kind}" for kind, n in passed.items()))
    number = int(document.header.get("$INSUNITS", 0))
    unit = _INSUNITS.get(number)
    if number and unit is None:
        remarks.append(f"$INSUNITS is {number}, no unit that is known here (1 in, 4 mm, 5 cm, 6 m)")
    made_of = ", ".join(f"{n} {kind}" for kind, n in kinds.items())
    summary = f"DXF {document.acad_release}, {made_of} on the layers {', '.join(layers)}"
    return Drawing(curves, unit, f"$INSUNITS = {number}", summary, remarks)


def _document(path: Path) -> tuple[Any, list[str]]:
    """The document of a file, with a remark where it is damaged; `InputError` where ezdxf cannot read it."""
    try:
        from ezdxf import recover
        from ezdxf.filemanagement import readfile
        from ezdxf.lldxf.const import DXFStructureError
    except ImportError as error:
        raise InputError("DXF files are read by the module ezdxf: pip install 'railsqueal[section]'", USAGE) from error
    try:
        with open(path, "rb") as file:
            head = file.read(4096)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from error
    if not head.strip():
        raise InputError(f"{path} is empty; expected a DXF drawing")
    if head[:4] == b"AC10":
        raise InputError(f"{path} is a DWG file; export it as DXF from the program that made it")
    try:
        try:
            return readfile(path), []
        except DXFStructureError:
            document = recover.readfile(path)[0]
            return document, [
                "the file is damaged and was read as far as possible: compare the picture with the drawing"
            ]
    except MemoryError:
        raise
    except Exception as error:
        # A damaged file meets any error in a reader that trusts it.
        words = f"{type(error).__name__}: {error}".splitlines()[0][:200]
        raise InputError(
            f"{path} is no DXF drawing that can be read ({words}); export it as DXF (R2000 or later, ASCII)"
        ) from error


def _entities(container: Any, depth: int, path: Path) -> Iterator[Any]:
    """Entities, those of inserted blocks in their place."""
    if depth > _DEEPEST:
        raise InputError(f"{path}: blocks are nested deeper than {_DEEPEST}")
    for entity in container:
        if entity.dxftype() == "INSERT":
            yield from _entities(entity.virtual_entities(), depth + 1, path)
        else:
            yield entity


def _curves(entity: Any, path: Path) -> list[Curve]:
    """The curves of an entity."""
    kind, layer = entity.dxftype(), entity.dxf.layer
    handle = entity.dxf.get("handle")
    source = f"{kind} {'#' + handle + ' ' if handle else ''}on the layer {layer!r}"
    made = _MAKERS[kind](entity, "" if layer == "0" else layer, source)
    for curve in made:
        ends = curve.ends
        if not np.isfinite(ends).all():
            raise InputError(f"{path}: {source} has coordinates that are no numbers")
    return made


def _plane(points: Sequence[Any], source: str) -> Floats:
    """x and y of points, which lie in one plane z = const."""
    values = np.array([[p[0], p[1], p[2] if len(p) > 2 else 0.0] for p in points], dtype=float)
    size = float(np.abs(values).max(initial=0.0))
    if np.ptp(values[:, 2]) > _FLAT * size:
        raise InputError(
            f"{source} reaches from z = {values[:, 2].min():g} to {values[:, 2].max():g}; expected a plane drawing, z "
            "= const"
        )
    return values[:, :2]


def _frame(entity: Any, source: str) -> Affine:
    """The map from the coordinates of an entity to those of the drawing: DXF draws from below what is mirrored."""
    normal = entity.dxf.get("extrusion", (0.0, 0.0, 1.0))
    x, y, z = (float(v) for v in normal)
    size = math.hypot(x, y, z)
    if not abs(z) > (1.0 - 1e-9) * size:
        raise InputError(f"{source} is not drawn in the plane of x and y (extrusion {x:g}, {y:g}, {z:g})")
    return Affine(np.diag([-1.0 if z < 0 else 1.0, 1.0]), np.zeros(2))


def _line(entity: Any, group: str, source: str) -> list[Curve]:
    ends = _plane([entity.dxf.start, entity.dxf.end], source)
    return [Line(group, source, ends[0], ends[1])]


def _arc(entity: Any, group: str, source: str) -> list[Curve]:
    first, last = math.radians(entity.dxf.start_angle), math.radians(entity.dxf.end_angle)
    last = first + ((last - first) % (2 * math.pi) or 2 * math.pi)
    centre = _plane([entity.dxf.center], source)[0]
    arc = Arc.circular(group, source, centre, float(entity.dxf.radius), (first, last))
    return [arc.transformed(_frame(entity, source))]


def _circle(entity: Any, group: str, source: str) -> list[Curve]:
    centre, radius = _plane([entity.dxf.center], source)[0], float(entity.dxf.radius)
    halves = ((0.0, math.pi), (math.pi, 2 * math.pi))
    return [
        Arc.circular(group, source, centre, radius, angles).transformed(_frame(entity, source)) for angles in halves
    ]


def _ellipse(entity: Any, group: str, source: str) -> list[Curve]:
    _frame(entity, source)  # in the coordinates of the drawing, whose plane it has to have
    centre = _plane([entity.dxf.center], source)[0]
    major, minor = (np.array([axis.x, axis.y]) for axis in (entity.dxf.major_axis, entity.minor_axis))
    first, last = float(entity.dxf.start_param), float(entity.dxf.end_param)
    while last <= first + 1e-12:
        last += 2 * math.pi
    arc = Arc(group, source, centre, major, minor, first, last)
    if last - first < 2 * math.pi - 1e-9:
        return [arc]
    middle = 0.5 * (first + last)
    return [Arc(group, source, centre, major, minor, *angles) for angles in ((first, middle), (middle, last))]


def _lwpolyline(entity: Any, group: str, source: str) -> list[Curve]:
    rows = [tuple(map(float, row)) for row in entity.get_points("xyb")]
    return _bulged(rows, bool(entity.closed), group, source, _frame(entity, source))


def _polyline(entity: Any, group: str, source: str) -> list[Curve]:
    if entity.is_polygon_mesh or entity.is_poly_face_mesh:
        raise InputError(f"{source} is a mesh; expected lines of an outline")
    places = _plane([vertex.dxf.location for vertex in entity.vertices], source)
    bulges = [0.0 if entity.is_3d_polyline else float(vertex.dxf.get("bulge", 0.0)) for vertex in entity.vertices]
    frame = Affine.identity() if entity.is_3d_polyline else _frame(entity, source)
    return _bulged([(*p, b) for p, b in zip(places.tolist(), bulges)], bool(entity.is_closed), group, source, frame)


def _bulged(rows: Sequence[tuple[float, ...]], closed: bool, group: str, source: str, frame: Affine) -> list[Curve]:
    """The edges of a polyline of rows (x, y, bulge)."""
    pairs = list(zip(rows, [*rows[1:], rows[0]]))
    if closed and len(rows) > 1 and rows[0][:2] == rows[-1][:2]:
        pairs = pairs[:-1]
    elif not closed:
        pairs = pairs[:-1]
    curves: list[Curve] = []
    for k, (one, other) in enumerate(pairs):
        ends, name = np.array([one[:2], other[:2]]), f"edge {k + 1} of {source}"
        curve = Arc.of_bulge(group, name, ends, one[2]) if one[2] else Line(group, name, ends[0], ends[1])
        curves.append(curve.transformed(frame))
    return curves


def _spline(entity: Any, group: str, source: str) -> list[Curve]:
    try:
        spline = entity.construction_tool()
        knots = tuple(float(k) for k in spline.knots())
        _plane(spline.control_points, source)
    except (ValueError, TypeError, ZeroDivisionError, IndexError) as error:
        raise InputError(f"{source} is a spline that cannot be evaluated: {error}") from error
    degree, count = spline.degree, len(spline.control_points)
    inner = (knots[degree], knots[count])
    # A knot as often as the degree is a corner.
    often = [k for k, n in Counter(knots).items() if n >= degree and inner[0] < k < inner[1]]
    cuts = [inner[0], *sorted(often), inner[1]]
    start, end = _plane([spline.point(inner[0]), spline.point(inner[1])], source)
    closed = bool(
        np.linalg.norm(end - start) <= 1e-9 * np.linalg.norm(np.ptp(_plane(spline.control_points, source), axis=0))
    )
    if len(cuts) == 2 and closed:
        cuts.insert(1, 0.5 * (inner[0] + inner[1]))
    return [Spline(group, source, spline, Affine.identity(), low, high, knots) for low, high in zip(cuts, cuts[1:])]


_MAKERS = {
    "LINE": _line,
    "ARC": _arc,
    "CIRCLE": _circle,
    "ELLIPSE": _ellipse,
    "LWPOLYLINE": _lwpolyline,
    "POLYLINE": _polyline,
    "SPLINE": _spline,
}
