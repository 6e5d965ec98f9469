"""The way from a drawing to the axes of a section: unit, origin, axes, groups; and what the section of a wheel or a
rail has to be."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..errors import USAGE, InputError
from .curves import Affine, Curve, Floats
from .drawing import UNITS, Drawing
from .edges import Edge
from .outline import Outline, place

# Radius of a wheel and height of a rail, m, between which a drawing is believed.
_SIZES = {"wheel": ("radius", 0.1, 1.0), "wheelset": ("radius", 0.1, 1.0), "rail": ("height", 0.04, 0.4)}
# Groups by which the job names edges; layers of these names in other case are these.
_KNOWN = ("running", "bore", "journal", "foot")
# Furthest that the middle of a rail's head may lie from x = 0 without a remark, m.
_OFF_MIDDLE = 1e-3


@dataclass(frozen=True)
class Options:
    """How a drawing is read. Points are in the unit and the axes of the drawing."""

    kind: str  # wheel, wheelset (the half with the flange towards its middle) or rail
    unit: str | None = None
    axis: str = "x"  # the axis of the drawing along the axle or across the track
    mirror: bool = False
    origin: tuple[float, float] = (0.0, 0.0)
    size: float = 6e-3  # m
    fine: float | None = None  # m, on the running line
    tolerance: float = 1e-5  # m
    groups: dict[str, str] = field(default_factory=dict)  # of layer (lower case): group
    picks: Sequence[tuple[str, float, float]] = ()  # group and a point near its curve
    ignored: Sequence[str] = ()
    density: float = 7860.0  # kg/m³

    @property
    def running_size(self) -> float:
        """Edge length on the running line, m: 3 mm or less on rails, whose arcs are short."""
        if self.fine is not None:
            return self.fine
        return min(self.size, 3e-3) if self.kind == "rail" else self.size


def unit_of(drawing: Drawing, path: Path, options: Options) -> str:
    """The unit of the drawing: that of its file or that of --unit, which must agree, and which must fit its size."""
    if drawing.unit and options.unit and drawing.unit != options.unit:
        raise InputError(
            f"--unit {options.unit}: {path} says {drawing.unit} ({drawing.unit_source}); leave the option out, or "
            "correct the unit in the drawing",
            USAGE,
        )
    what, least, most = _SIZES[options.kind]
    points = np.concatenate([curve.chords() for curve in drawing.curves])
    away = _axes(options)(points)[:, 1]
    size = float(np.ptp(away) if options.kind == "rail" else np.abs(away).max())
    fitting = [name for name, length in UNITS.items() if least <= size * length <= most]
    fits = (
        f"the unit that fits is {' or '.join(fitting)}"
        if fitting
        else (
            f"no unit makes that {what} {least:g} to {most:g} m: is the axle at y = 0 (--origin), and the axis right "
            "(--axis)?"
        )
    )
    unit = options.unit or drawing.unit
    if unit is None:
        raise InputError(f"{path} does not say its unit; give --unit: {fits} ({what} {size:g} in the drawing)", USAGE)
    if unit not in fitting:
        source = "--unit" if options.unit else drawing.unit_source
        raise InputError(
            f"{path}: a {options.kind} with the {what} {size * UNITS[unit]:.6g} m (in {unit}, by {source}), expected "
            f"{least:g} to {most:g} m; {fits}"
        )
    return unit


def _axes(options: Options) -> Affine:
    """The map from the drawing to x along the axle or across the track and y away or up, in the unit of the drawing."""
    matrix = np.eye(2) if options.axis == "x" else np.array([[0.0, 1.0], [1.0, 0.0]])
    if options.mirror:
        matrix = np.diag([-1.0, 1.0]) @ matrix
    return Affine(matrix, -matrix @ np.array(options.origin))


def placed(drawing: Drawing, unit: str, options: Options) -> tuple[list[Curve], list[str]]:
    """The curves in m in the axes of a section, with the groups that were asked for, and remarks."""
    frame = _axes(options)
    curves = [curve.in_group(_group(curve.group, options)) for curve in drawing.curves]
    curves = _picked(curves, options, UNITS[unit])
    scale = UNITS[unit]
    frame = Affine(scale * frame.matrix, scale * frame.shift)
    remarks = []
    if options.kind != "rail":
        points = frame(np.concatenate([curve.chords() for curve in curves]))
        # The axle of a wheelset is solid, and its outline goes along y = 0.
        reached = points[:, 1].min() < -options.tolerance if options.kind == "wheelset" else points[:, 1].min() <= 0
        if points[:, 1].max() <= options.tolerance:
            frame = Affine(np.diag([1.0, -1.0]), np.zeros(2)).after(frame)
            remarks.append("the half below the axle was drawn: y has the other sign")
        elif reached:
            lowest = points[int(np.argmin(points[:, 1]))]
            verb = "crosses" if options.kind == "wheelset" else "reaches"
            raise InputError(
                f"the outline {verb} the axle y = 0 at {place(lowest)}; expected one half of a wheel, above the axle "
                "(--origin X Y, "
                "--axis and --ignore tell where it is and what belongs to it)"
            )
    return [curve.transformed(frame) for curve in curves], remarks


def _group(name: str, options: Options) -> str:
    lower = name.lower()
    return options.groups.get(lower, lower if lower in _KNOWN else name)


def _picked(curves: list[Curve], options: Options, scale: float) -> list[Curve]:
    """The curves with the groups of --pick, each that of the curve nearest to a point."""
    for name, x, y in options.picks:
        distances = [_distance(curve, np.array([x, y])) for curve in curves]
        k = int(np.argmin(distances))
        if distances[k] * scale > 1e-3:
            raise InputError(
                f"--pick {name}={x:g},{y:g}: the nearest curve, {curves[k].source}, is "
                f"{1e3 * scale * distances[k]:.4g} mm away; "
                "expected at most 1 mm (the point is in the unit and the axes of the drawing)",
                USAGE,
            )
        curves = [*curves[:k], curves[k].in_group(name), *curves[k + 1 :]]
    return curves


def _distance(curve: Curve, point: Floats) -> float:
    """Distance of a point from a curve, by chords."""
    line = curve.chords(32)
    start, step = line[:-1], np.diff(line, axis=0)
    share = np.clip(((point - start) * step).sum(axis=1) / (step * step).sum(axis=1), 0.0, 1.0)
    return float(np.linalg.norm(start + share[:, None] * step - point, axis=1).min())


def middle_of(outline: Outline, options: Options) -> float:
    """x of the cut through the middle of a wheelset, m; `InputError` where its outline does not end in one."""
    middle = float(outline.box()[1, 0])
    cuts = [curve.chords() for curve in outline.curves]
    if not any(np.abs(points[:, 0] - middle).max() <= options.tolerance for points in cuts):
        raise InputError(
            f"the outline ends at x = {1e3 * middle:.2f} mm in a corner; expected one half of a wheelset, up to a "
            "straight cut through the middle of its axle, on the side of the flange (--mirror turns it)"
        )
    return middle


def expect_groups(outline: Outline, options: Options) -> None:
    """`InputError` where the section lacks a group that its kind needs, or the program could not read a name."""
    there = sorted(outline.group_lengths())
    for name in there:
        if '"' in name or "\n" in name or not name.strip():
            raise InputError(f"the group {name!r} has a name that a mesh file cannot hold; rename its layer")
    for name in ("running", "foot") if options.kind == "rail" else ("running",):
        if name not in there:
            known = f"the drawing has {', '.join(there)}" if there else "the drawing names none"
            raise InputError(
                f"no edge is in the group {name!r} ({known}); draw it on a layer of that name (in a table: the column "
                "group), "
                f"or give --group {name}=LAYER or --pick {name}=X,Y"
            )


class RunningLine:
    """The running line of a section, from large to small x as the loop goes."""

    def __init__(self, edges: Sequence[Edge]) -> None:
        """Takes the edges of a loop, counterclockwise; `InputError` where the running line has a hole or turns back."""
        running = [edge.curve.group == "running" for edge in edges]
        starts = [k for k in range(len(edges)) if running[k] and not running[k - 1]]
        if len(starts) != 1:
            places = "; ".join(place(edges[k].point(0.0)) for k in starts)
            raise InputError(
                f"the running line is in {len(starts)} pieces, which begin at {places}; expected one"
                if starts
                else "the whole outline is the running line; expected the tread or the head alone"
            )
        order = [*range(starts[0], len(edges)), *range(starts[0])]
        self.edges = [edges[k] for k in order if running[k]]
        for edge in self.edges:
            a, m, b = (edge.point(s)[0] for s in (0.0, 0.5, 1.0))
            if not (4 * m - 3 * a - b < 0 and 3 * b + a - 4 * m < 0):
                raise InputError(
                    f"the running line is not a function of x between {place(edge.point(0.0))} and "
                    f"{place(edge.point(1.0))}; put edges that "
                    "stand upright or hang over into another group (a rail's sides, the back of a flange)"
                )

    @property
    def reach(self) -> tuple[float, float]:
        """Smallest and largest x, m."""
        return float(self.edges[-1].point(1.0)[0]), float(self.edges[0].point(0.0)[0])

    def height(self, x: float) -> float:
        """y of the running line at x, m, by bisection."""
        edge = next(edge for edge in self.edges if edge.point(1.0)[0] <= x <= edge.point(0.0)[0])
        low, high = 0.0, 1.0
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if edge.point(middle)[0] > x else (low, middle)
        return float(edge.point(0.5 * (low + high))[1])


def remarks(outline: Outline, running: RunningLine, options: Options) -> list[str]:
    """Doubts about axes and groups."""
    found = []
    low, high = running.reach
    if options.kind != "rail":
        points = np.concatenate([curve.chords() for curve in outline.curves])
        top = points[int(np.argmax(points[:, 1]))]
        if top[0] < 0.5 * (low + high) and top[1] - running.height(0.5 * (low + high)) > 0.01:
            found.append(
                f"the largest radius is at x = {1e3 * top[0]:.1f} mm: the flange is to be at +x; --mirror turns it"
            )
        if not low <= 0 <= high:
            found.append(
                f"x = 0 is not on the running line ({1e3 * low:.1f} to {1e3 * high:.1f} mm); with contact.placement it "
                "is to be the running circle: --origin X Y"
            )
        if options.kind == "wheel" and "bore" not in outline.group_lengths():
            found.append("no edge is in the group 'bore': the job needs another group to hold the wheel by")
        if options.kind == "wheelset" and "journal" not in outline.group_lengths():
            found.append("no edge is in the group 'journal': the job needs the places of the bearings (suspension)")
    elif abs(low + high) > 2 * _OFF_MIDDLE:
        found.append(
            f"the running line reaches from x = {1e3 * low:.2f} to {1e3 * high:.2f} mm; x = 0 is to be the middle of "
            "the head: --origin X Y"
        )
    return found
