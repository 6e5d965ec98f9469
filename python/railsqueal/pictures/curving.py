"""Steady curving: the bogie in its curve from above, its places of contact, and the wheels over the radius."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.ticker import NullFormatter, NullLocator

from ..curving import AXLES, WHEELS, Curving, CurvingRadii
from ..result import Floats, Result
from .style import BLUE, GREEN, GREY, ORANGE, PURPLE, RED, Canvas, heading, legend

# One colour for each wheel in all pictures; the leading wheels are drawn full, the trailing ones dashed.
COLOURS = (BLUE, RED, GREEN, ORANGE)
DASHES = ("-", "-", (0, (4, 2)), (0, (4, 2)))
AXLE_LOOKS = (("black", "-", "o"), (GREY, (0, (4, 2)), "s"))
MARKS = ("o", "s", "o", "s")
# Wheels as they are drawn, m: length and width of the tread, width of the flange.
LENGTH, TREAD, FLANGE = 0.62, 0.135, 0.03
# Largest curvature (1/m), yaw (rad) and shift (m) that are drawn, by which they are exaggerated.
MOST = (0.09, 0.28, 0.16)
# Length of the longest arrow, m.
ARROW = 0.75


def pictures(result: Result, canvas: Canvas) -> list[Path]:
    made: list[Path] = []
    if Curving.present(result):
        table = Curving.from_result(result)
        made += bogie(result, table, canvas) + contacts(result, table, canvas)
    if CurvingRadii.present(result):
        made += over_radius(result, CurvingRadii.from_result(result), canvas)
    return made


def minus(text: str) -> str:
    """The text with signs as the axes have them."""
    return text.replace("-", "−")


# ---- The bogie from above ----


def round_number(value: float) -> float:
    """The largest of 1, 2, 5, 10, … that is not above a value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(k for k in (1, 2, 5) if k * power <= value * (1 + 1e-12)))


def exaggeration(table: Curving) -> float:
    """One factor for curvature, shifts and yaws: what is parallel stays so, and angles of attack stay in proportion."""
    shifts, yaws = np.append(table.shift, table.frame[0]), np.append(table.yaw, table.frame[1])
    sizes = (abs(table.curvature), np.abs(yaws).max(), np.abs(shifts).max())
    factors = [most / size for most, size in zip(MOST, sizes) if size > 0]
    return min(200.0, round_number(min(factors))) if factors else 1.0


def turned(points: Sequence[tuple[float, float]], x: float, y: float, angle: float) -> Floats:
    """Points (x, y) turned by an angle to the right and moved to (x, y)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([(x + c * a - s * b, y + s * a + c * b) for a, b in points])


def box(x: tuple[float, float], y: tuple[float, float]) -> list[tuple[float, float]]:
    """Corners of a rectangle."""
    return [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])]


def bogie(result: Result, table: Curving, canvas: Canvas) -> list[Path]:
    """Rails, wheelsets and frame from above with the forces on the wheels; x to the right of the picture, y down."""
    factor, half = exaggeration(table), table.wheelbase / 2
    bend = factor * table.curvature
    figure, axes = plt.subplots(figsize=(8.6, 6.4), layout="constrained")
    x = np.linspace(-half - 1.15, half + 1.15, 81)
    middle = bend * x**2 / 2
    for side in (-1, 1):
        axes.plot(x, middle + side * table.circles / 2, color="#B0B0B0", linewidth=5, solid_capstyle="butt", zorder=1)
    axes.plot(x, middle, color=GREY, linewidth=0.8, linestyle=(0, (8, 3, 1, 3)), zorder=1)
    side_of_frame = table.circles / 2 + 0.16
    for across in (-side_of_frame, side_of_frame):
        draw_frame(axes, table, factor, box((-half - 0.18, half + 0.18), (across - 0.05, across + 0.05)))
    draw_frame(axes, table, factor, box((-0.09, 0.09), (-side_of_frame, side_of_frame)))
    longest = float(np.abs(wheel_forces(table)).max()) or 1e3
    for axle in range(2):
        draw_axle(axes, table, factor, axle, ARROW / longest)
    corner = draw_scale(axes, table, x, middle, longest)
    begin = (corner[0] - 0.75, corner[1])
    axes.annotate("travel", corner, xytext=begin, ha="right", va="center", arrowprops={"arrowstyle": "->"})
    axes.set_aspect("equal")
    # y to the right of the track: down, as it is seen from above.
    axes.invert_yaxis()
    axes.axis("off")
    lines = f"{table.curve()}\ncurvature, shifts and yaws drawn {factor:g} times as large"
    axes.set_title(heading(result) + lines)
    handles = [
        Line2D([], [], color=PURPLE, linewidth=2, label="creep force on the wheel, in plan"),
        Line2D([], [], color="black", linewidth=2, label="lateral force on the wheel, with that of the normal force"),
    ]
    legend(figure, [], handles, columns=1)
    return canvas.save(figure, "curving-bogie")


def draw_frame(axes: Axes, table: Curving, factor: float, corners: list[tuple[float, float]]) -> None:
    """A part of the frame at its shift and yaw."""
    points = turned(corners, 0, factor * table.frame[0], factor * table.frame[1])
    axes.add_patch(Polygon(points, facecolor="#E6E6E6", edgecolor="#909090", linewidth=0.8, zorder=2))


def wheel_forces(table: Curving) -> Floats:
    """Creep force in plan and lateral force of each wheel, [4, 2, 2], (forwards, to the right), N; sums over places."""
    made = np.zeros((len(WHEELS), 2, 2))
    for place, wheel in enumerate(table.wheel):
        longitudinal, tangential = table.creep_force[place]
        made[wheel, 0] += longitudinal, tangential * np.cos(table.contact_angle[place])
        made[wheel, 1] += 0, table.force[place, 1]
    return made


def draw_axle(axes: Axes, table: Curving, factor: float, axle: int, per_newton: float) -> None:
    """A wheelset with names, forces and its angle of attack."""
    ahead = (1 - 2 * axle) * table.wheelbase / 2
    tangent = factor * table.curvature * ahead
    y = factor * (table.curvature * ahead**2 / 2 + table.shift[axle])
    angle = tangent + factor * table.yaw[axle]
    reach = table.circles / 2
    shaft = turned(box((-0.05, 0.05), (-reach, reach)), ahead, y, angle)
    axes.add_patch(Polygon(shaft, facecolor="#C8C8C8", edgecolor=GREY, zorder=3))
    forces = wheel_forces(table)
    for wheel in (2 * axle, 2 * axle + 1):
        side = table.lateral_side(wheel)
        tread = (side * reach - TREAD / 2, side * reach + TREAD / 2)
        inside = side * (reach - TREAD / 2)
        flange = (min(inside, inside - side * FLANGE), max(inside, inside - side * FLANGE))
        for across, more in ((tread, 0.0), (flange, 0.05)):
            corners = turned(box((-LENGTH / 2 - more, LENGTH / 2 + more), across), ahead, y, angle)
            look: dict[str, Any] = {"facecolor": COLOURS[wheel], "edgecolor": "white", "linewidth": 0.6, "alpha": 0.8}
            axes.add_patch(Polygon(corners, zorder=4, **look))
        centre = turned([(0, side * reach)], ahead, y, angle)[0]
        for force, colour in zip(forces[wheel], (PURPLE, "black")):
            tip = centre + per_newton * force
            arrow(axes, centre, tip, colour)
        axes.plot(*centre, "o", color="black", markersize=3, zorder=7)
        name = turned([(0, side * (reach + 0.9))], ahead, y, tangent)[0]
        creep, lateral = np.hypot(*forces[wheel, 0]) / 1e3, forces[wheel, 1, 1] / 1e3
        text = f"creep {creep:.1f} kN, lateral {lateral:+.1f} kN"
        words = minus(f"{WHEELS[wheel]}\n{text}")
        axes.text(name[0], name[1], words, ha="center", va="center", fontsize=8.5, color=COLOURS[wheel])
    said = f"angle of attack\n{1e3 * table.yaw[axle]:+.2f} mrad\nshift\n{1e3 * table.shift[axle]:+.2f} mm"
    white = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.5}
    outwards = 0.72 * (1 - 2 * axle)
    beside = y + (tangent + factor * table.curvature * outwards / 2) * outwards - factor * table.shift[axle]
    axes.text(ahead + outwards, beside, minus(said), ha="center", va="center", fontsize=8.5, zorder=8, bbox=white)


def arrow(axes: Axes, begin: Any, tip: Any, colour: str) -> None:
    """An arrow of a force."""
    look = {"arrowstyle": "-|>", "color": colour, "linewidth": 2.2, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", tip, xytext=begin, arrowprops=look, zorder=6)


def draw_scale(axes: Axes, table: Curving, x: Floats, middle: Floats, longest: float) -> tuple[float, float]:
    """The arrow by which forces are read, below all else; a corner of the picture for the direction of travel."""
    low = max(float(middle.max()), 0.0) + table.circles / 2 + 1.4
    unit = round_number(longest)
    length = ARROW * unit / longest
    arrow(axes, (x[0], low), (x[0] + length, low), GREY)
    axes.text(x[0] + length + 0.08, low, f"{unit / 1e3:g} kN", va="center", color=GREY)
    axes.set_xlim(x[0] - 0.1, x[-1] + 0.1)
    axes.set_ylim(min(float(middle.min()), 0.0) - table.circles / 2 - 1.35, low + 0.15)
    return float(x[-1]), low


# ---- Places of contact ----


def contacts(result: Result, table: Curving, canvas: Canvas) -> list[Path]:
    """Bars of normal force, creepages, utilisation and contact angle of all places of contact."""
    order = [int(p) for wheel in range(len(WHEELS)) for p in table.places(wheel)]
    panels = [
        ("normal force N / kN", 1e-3 * table.normal_force, "{:.1f}"),
        ("longitudinal creepage ξ / %", 100 * table.creepage[:, 0], "{:+.3f}"),
        ("lateral creepage η / %", 100 * table.creepage[:, 1], "{:+.3f}"),
        ("spin φ / (1/m)", table.creepage[:, 2], "{:+.3f}"),
        ("utilisation F / (μN)", table.utilisation, "{:.2f}"),
        ("contact angle δ / °", np.degrees(table.contact_angle), "{:+.1f}"),
    ]
    rows = np.arange(len(order))
    figure, grid = plt.subplots(2, 3, sharey=True, figsize=(9.6, 1.8 + 0.62 * max(len(order), 4)), layout="constrained")
    for axes, (label, values, form) in zip(grid.flat, panels):
        shown = values[order]
        axes.barh(rows, shown, color=[COLOURS[table.wheel[p]] for p in order], height=0.65)
        axes.axvline(0, color=GREY, linewidth=0.8)
        low, high = min(float(shown.min(initial=0)), 0.0), max(float(shown.max(initial=0)), 0.0)
        width = (high - low) or 1.0
        # Numbers stand beyond the ends of the bars.
        axes.set_xlim(low - (0.36 * width if low < 0 else 0), high + (0.36 * width if high > 0 else 0))
        for row, value in zip(rows, shown):
            across = 0.02 * width * (1 if value >= 0 else -1)
            side = "left" if value >= 0 else "right"
            axes.text(value + across, row, minus(form.format(value)), ha=side, va="center", fontsize=8)
        axes.set_xlabel(label)
    grid[0, 0].set_yticks(rows, [minus(table.name(p)) for p in order])
    grid[0, 0].set_ylim(len(order) - 0.5, -0.5)
    figure.suptitle(heading(result) + f"places of contact: {table.curve()}", fontsize=10)
    return canvas.save(figure, "curving-contacts")


# ---- Over the radius ----


def over_radius(result: Result, table: CurvingRadii, canvas: Canvas) -> list[Path]:
    """Creepages, loads and axles over the radius, one colour for each wheel; radii without equilibrium are marked."""
    wheels = [
        ("longitudinal creepage ξ / %", 100 * table.creepage[:, :, 0]),
        ("lateral creepage η / %", 100 * table.creepage[:, :, 1]),
        ("spin φ / (1/m)", table.creepage[:, :, 2]),
        ("normal force N / kN", 1e-3 * table.normal_force),
        ("utilisation F / (μN)", table.utilisation),
        ("contact angle δ / °", np.degrees(table.contact_angle)),
    ]
    axles = [("angle of attack\nto the right / mrad", 1e3 * table.yaw), ("shift to the right / mm", 1e3 * table.shift)]
    figure, grid = plt.subplots(4, 2, sharex=True, figsize=(9.2, 10.6), layout="constrained")
    for axes, (label, values) in zip(grid.flat, wheels):
        for wheel, name in enumerate(WHEELS):
            look: dict[str, Any] = {"color": COLOURS[wheel], "marker": MARKS[wheel], "markersize": 4}
            axes.plot(table.radius, values[:, wheel], linestyle=DASHES[wheel], linewidth=1.2, label=name, **look)
            several = table.places[:, wheel] > 1
            axes.plot(table.radius[several], values[several, wheel], linestyle="none", markerfacecolor="white", **look)
        axes.set_ylabel(label)
    for axes, (label, values) in zip(grid.flat[len(wheels) :], axles):
        for axle, name in enumerate(AXLES):
            colour, dashes, mark = AXLE_LOOKS[axle]
            look = {"color": colour, "marker": mark, "markersize": 4}
            axes.plot(table.radius, values[:, axle], linestyle=dashes, linewidth=1.2, label=f"{name} axle", **look)
        axes.set_ylabel(label)
    for axes in grid.flat:
        axes.axhline(0, color=GREY, linewidth=0.6)
        for value in table.radius[table.failed]:
            axes.axvline(value, color=GREY, linestyle=":", linewidth=1)
    along_radius(grid[0, 0], table.radius)
    for axes in grid[-1]:
        axes.set_xlabel("radius of the curve R / m")
    handles = []
    if (table.places > 1).any():
        look = {"linestyle": "none", "marker": "o", "color": GREY, "markerfacecolor": "white"}
        handles.append(Line2D([], [], label="several places of contact", **look))
    if len(table.failed):
        handles.append(Line2D([], [], color=GREY, linestyle=":", label="no equilibrium"))
    figure.suptitle(heading(result) + "place of contact of each wheel that carries most, over the radius", fontsize=10)
    legend(figure, [grid[0, 0], grid[-1, 0]], handles, columns=4)
    return canvas.save(figure, "curving-radius")


def along_radius(axes: Axes, radius: Floats) -> None:
    """The axis of the radius: a logarithm where radii spread over more than a factor of 3."""
    low, high = float(radius.min()), float(radius.max())
    if high <= 3 * low:
        return
    axes.set_xscale("log")
    steps = [m * 10.0**p for p in range(int(np.log10(low)) - 1, int(np.log10(high)) + 2) for m in (1, 1.5, 2, 3, 4, 6)]
    ticks = [s for s in steps if low * 0.99 <= s <= high * 1.01]
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_minor_formatter(NullFormatter())
