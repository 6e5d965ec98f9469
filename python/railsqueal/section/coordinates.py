"""Outlines from tables of coordinates: columns (y, r), (x, y) or (x, z), and optional columns `group` and `bulge`.

The edge that begins at a row has its group and its bulge (the tangent of a quarter of the arc's angle, > 0
counterclockwise, as of DXF polylines). The last point is joined to the first.
"""

from pathlib import Path

import numpy as np

from ..errors import InputError
from ..table_reader import Table
from .curves import Arc, Curve, Floats, Line
from .drawing import UNITS, Drawing

# Coordinates in the order of the columns: across (along the axle), then away from the axle or up.
_ACROSS_FIRST = ("x", "y", "z", "r")
_EXTRA = ("group", "bulge")
_EXPECTED = (
    "expected the columns y and r (wheel), y and z or x and z (rail), or x and y, and optionally group and bulge"
)


def read(path: Path) -> Drawing:
    """The outline of a table."""
    table = Table.read(path, texts=("group",))
    across, away, extra, unit = _columns(table)
    points = np.stack([table.numbers(across), table.numbers(away)], axis=1)
    groups = table.texts(extra["group"]) if "group" in extra else [""] * len(points)
    bulges = table.numbers(extra["bulge"]) if "bulge" in extra else np.zeros(len(points))
    lines = table.lines
    closed = len(points) > 1 and np.array_equal(points[0], points[-1])
    if closed:
        points, groups, bulges, lines = points[:-1], groups[:-1], bulges[:-1], lines[:-1]
    if len(points) < 3 and not bulges.any() or len(points) < 2:
        raise InputError(f"{path} has {len(points)} different points; expected at least 3")
    _expect_different(path, points, lines)
    curves: list[Curve] = []
    for k in range(len(points)):
        ends = np.stack([points[k], points[(k + 1) % len(points)]])
        source = f"the edge from line {lines[k]}"
        if bulges[k]:
            curves.append(Arc.of_bulge(groups[k], source, ends, float(bulges[k])))
        else:
            curves.append(Line(groups[k], source, ends[0], ends[1]))
    remarks = []
    if not closed:
        gap = float(np.linalg.norm(points[0] - points[-1]))
        remarks.append(f"closed from the last point to the first one, {gap:.6g} away in the unit of the table")
    return Drawing(curves, unit, "the header", f"table of {table.understood}", remarks)


def _columns(table: Table) -> tuple[int, int, dict[str, int], str | None]:
    """Numbers of the columns across and away, of the others by name, and the unit that the header names."""
    path, width = table.path, len(table.rows[0])
    headings = table.headings(_ACROSS_FIRST + _EXTRA)
    if headings is None:
        if width == 2 and not table.counts(0):
            return 0, 1, {}, None
        hint = "without a header they have no meaning"
        if table.counts(0):
            hint = "its first column looks like a number of the point"
        raise InputError(
            f"{path}, line {table.lines[0]}: {width} columns without a header: {hint}; give two columns, or a header: "
            f"{_EXPECTED}"
        )
    places: dict[str, int] = {}
    units = set()
    for at, heading in enumerate(headings):
        if table.is_index(at, heading):
            continue
        has_unit = heading.known and (heading.unit is None or heading.unit in UNITS)
        if heading.name not in _ACROSS_FIRST + _EXTRA or not has_unit:
            raise InputError(
                f"{path}: the column {heading.title!r} has no meaning here; {_EXPECTED}, with a unit as in 'x (mm)' if "
                "you like"
            )
        if heading.name in places:
            raise InputError(f"{path}: two columns {heading.name!r}; {_EXPECTED}")
        places[heading.name] = at
        units |= {heading.unit} if heading.unit is not None else set()
    coordinates = sorted((n for n in places if n in _ACROSS_FIRST), key=_ACROSS_FIRST.index)
    if len(coordinates) != 2:
        raise InputError(f"{path}: coordinates {', '.join(coordinates) or 'none'} in the header; {_EXPECTED}")
    across, away = ("z", "r") if coordinates == ["z", "r"] else coordinates
    if len(units) > 1:
        raise InputError(f"{path}: the header names several units, {', '.join(sorted(units))}; expected one")
    extra = {name: at for name, at in places.items() if name in _EXTRA}
    return places[across], places[away], extra, units.pop() if units else None


def _expect_different(path: Path, points: Floats, lines: list[int]) -> None:
    """`InputError` where a point is given twice."""
    seen: dict[tuple[float, ...], int] = {}
    for n, point in zip(lines, map(tuple, points.tolist())):
        if point in seen:
            raise InputError(
                f"{path}, line {n}: the point ({point[0]:g}, {point[1]:g}) is that of line {seen[point]}; expected "
                "every point once "
                "(the first one may be repeated at the end)"
            )
        seen[point] = n
