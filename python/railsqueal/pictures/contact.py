"""Contact: traction and pressure along y = 0, and the map of stick and slip."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ..errors import ResultError
from ..result import Floats, Result, lookup
from ..tables import SLIP, STICK, ContactGrid, contact_name, contact_number, friction_law
from .style import GREY, LATERAL, LONGITUDINAL, NORMAL, Canvas, heading, legend
from .style import SLIP as SLIP_COLOUR
from .style import STICK as STICK_COLOUR

# What other programs computed for some of the jobs; beside the pictures where the package lies in its checkout.
REFERENCES = Path(__file__).parents[3] / "docs/data"
MM, MPA = 1e3, 1e-6


@dataclass(frozen=True)
class Drawn:
    """The contact in mm and MPa, and the result that it is of."""

    result: Result
    grid: ContactGrid
    group: str  # `contact`, or `contact_2` and so on

    @property
    def placement(self) -> str:
        """Group of the placement of this contact."""
        return self.group.replace("contact", "placement")

    @property
    def x(self) -> Floats:
        return MM * self.grid.x

    @property
    def y(self) -> Floats:
        return MM * self.grid.y

    @property
    def pressure(self) -> Floats:
        return MPA * self.grid.pressure

    @property
    def traction(self) -> Floats:
        return MPA * self.grid.traction

    def along_axis(self, field: Floats) -> Floats:
        """A field on y = 0, between grid lines if need be."""
        return np.array([np.interp(0.0, self.y, field[:, i]) for i in range(len(self.x))])


def of_contact(picture: str, group: str) -> str:
    """Name of a picture of a contact by its group: `contact-map`, or `contact-map-2` and so on."""
    number = contact_number(group)
    return f"{picture}-{number}" if number > 1 else picture


def pictures(result: Result, canvas: Canvas) -> list[Path]:
    if not ContactGrid.present(result):
        return []
    all_contacts = [
        Drawn(result, ContactGrid.from_result(result, group), group) for group in ContactGrid.groups(result)
    ]
    # One of several contacts may be open.
    closed = [drawn for drawn in all_contacts if drawn.grid.closed.any()]
    if not closed:
        raise ResultError(f"{result.path}: no contact node is closed, so there is no contact to draw")
    made: list[Path] = []
    for drawn in closed:
        made += line(drawn, canvas) + stick_slip_map(drawn, canvas)
    return made


def reference(job: dict[str, Any]) -> tuple[Floats, Floats, Floats] | None:
    """CONTACT's curve as (x, pressure, traction) in mm and MPa if the job is its case, or None."""
    same: list[tuple[str, float]] = [
        ("contact.friction", 0.3),
        ("contact.normal_load", 70e3),
        ("contact.creepage.longitudinal", 0.0),
        ("contact.creepage.lateral", 0.003),
        ("contact.creepage.spin", 0.0),
    ]
    for body in ("lower", "upper"):
        same += [
            (f"bodies.{body}.material.young", 205e9),
            (f"bodies.{body}.material.poisson", 0.3),
            (f"bodies.{body}.mesh.cylinder.outer_radius", 0.5),
            (f"bodies.{body}.mesh.cylinder.crown_radius", 0.5),
        ]
    for path, value in same:
        given = lookup(job, path, 0.0 if path.startswith("contact.creepage") else None)
        if not isinstance(given, (int, float)) or not math.isclose(given, value, rel_tol=1e-9, abs_tol=1e-12):
            return None
    table = REFERENCES / "contact_n70_eta03_y0.csv"
    if not table.exists():
        return None
    with table.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(row for row in file if not row.startswith("#")))

    def column(name: str, factor: float) -> Floats:
        return factor * np.array([float(row[name]) for row in rows])

    return column("x_m", MM), column("pressure_Pa", MPA), column("traction_y_Pa", MPA)


def case(drawn: Drawn) -> str:
    """Title of a picture: the title of the job, if it has one, and below it the load and the creepages."""
    result, several = drawn.result, len(ContactGrid.groups(drawn.result)) > 1
    words = [contact_name(result, contact_number(drawn.group))] if several else []
    words.append(f"N = {-drawn.grid.force[2] / 1e3:.4g} kN")
    friction = friction_law(result, contact_number(drawn.group))
    if isinstance(friction, (int, float)):
        words.append(f"μ = {friction:g}")
    elif isinstance(friction, dict):
        (name, law), *_ = friction.items()
        values = f" from {law['static']:g} to {law['kinetic']:g}" if {"static", "kinetic"} <= set(law) else ""
        words.append(f"μ{values} ({name.replace('_', ' ')})")
    placed = result.optional(f"{drawn.placement}/creepage")
    names = (("longitudinal", "ξ", 100, " %"), ("lateral", "η", 100, " %"), ("spin", "φ", 1, " 1/m"))
    for place, (name, symbol, factor, unit) in enumerate(names):
        # Creepages of the job go before those of the placement; further contacts have those of their placement.
        given = lookup(result.job, f"contact.creepage.{name}") if contact_number(drawn.group) == 1 else None
        value = given or (placed[place] if placed is not None else 0)
        if value:
            words.append(f"{symbol} = {factor * value:.4g}{unit}")
    return heading(result) + ", ".join(words)


def bound(drawn: Drawn) -> Floats | None:
    """Limit of the traction at every node, MPa; None if the result does not say."""
    friction = friction_law(drawn.result, contact_number(drawn.group))
    varying = drawn.result.optional(f"{drawn.group}/friction")
    if varying is not None:
        return varying.reshape(drawn.pressure.shape) * drawn.pressure
    return friction * drawn.pressure if isinstance(friction, (int, float)) else None


def line(drawn: Drawn, canvas: Canvas) -> list[Path]:
    """Pressure and traction along y = 0."""
    result, x = drawn.result, drawn.x
    compared = reference(result.job)
    compliance = {"fe": "finite elements", "half_space": "half-space"}.get(
        lookup(result.job, "contact.compliance"), "computed"
    )
    traction = [drawn.along_axis(drawn.traction[:, :, c]) for c in (0, 1)]
    state = drawn.grid.state[np.argmin(np.abs(drawn.y))]
    reach = x[drawn.grid.closed.any(axis=0)]
    # The open nodes beside the contact show where it ends.
    margin = max(0.12 * (reach.max() - reach.min()), 1.1 * float(np.diff(x).max()))

    figure, (upper, lower) = plt.subplots(
        2, 1, sharex=True, figsize=(6.4, 7.0), height_ratios=[1, 1.5], layout="constrained"
    )
    figure.suptitle(case(drawn), fontsize=10)
    pressure = drawn.along_axis(drawn.pressure)
    upper.plot(x, pressure, color=NORMAL, marker="o", markersize=3, label=f"pressure, {compliance}")
    if compared:
        upper.plot(compared[0], compared[1], "k--", linewidth=1.1, label="CONTACT (half-space)")
    upper.set_ylabel("pressure p / MPa")
    upper.set_ylim(bottom=0)

    limit = bound(drawn)
    if limit is not None:
        along = drawn.along_axis(limit)
        lower.fill_between(x, -along, along, color=GREY, alpha=0.13, linewidth=0)
        lower.plot(x, along, color=GREY, linewidth=1, label="±μp")
        lower.plot(x, -along, color=GREY, linewidth=1)
    largest = max(np.abs(t).max() for t in traction)
    for c in (0, 1):
        if np.abs(traction[c]).max() <= 1e-2 * largest:
            continue
        color = (LONGITUDINAL, LATERAL)[c]
        lower.plot(x, traction[c], color=color, label=f"traction $t_{'xy'[c]}$, {compliance}")
        for code, face in ((STICK, color), (SLIP, "white")):
            at = state == code
            lower.plot(x[at], traction[c][at], "o", color=color, markerfacecolor=face, markersize=4.5)
    if compared:
        lower.plot(compared[0], compared[2], "k--", linewidth=1.1, label="CONTACT (half-space)")
    dots = [
        Line2D([], [], color=GREY, marker="o", markerfacecolor=face, linestyle="none", markersize=4.5, label=label)
        for face, label in ((GREY, "stick"), ("white", "slip"))
    ]
    legend(figure, [upper, lower], dots)
    lower.axhline(0, color="black", linewidth=0.6)
    lower.set_ylabel("traction on the lower body, y = 0 / MPa")
    lower.set_xlabel("longitudinal position x / mm")
    lower.set_xlim(reach.min() - margin, reach.max() + margin)
    for text, place, align in (("← leading edge (rolling)", 0.01, "left"), ("trailing edge →", 0.99, "right")):
        upper.text(place, 1.01, text, transform=upper.transAxes, ha=align, va="bottom", fontsize=9, color=GREY)
    return canvas.save(figure, of_contact("contact-line", drawn.group))


def edges(centres: Floats) -> Floats:
    """Borders of the cells around grid nodes."""
    between = 0.5 * (centres[1:] + centres[:-1])
    first, last = 2 * centres[0] - between[0], 2 * centres[-1] - between[-1]
    return np.concatenate([[first], between, [last]])


def painted(axes: Axes, grid: ContactGrid, field: Floats, colour: str) -> None:
    """The cells of the nodes where the field is a number, in one colour."""
    axes.pcolormesh(edges(MM * grid.x), edges(MM * grid.y), field, cmap=ListedColormap([colour]), alpha=0.6)


def stick_slip_map(drawn: Drawn, canvas: Canvas) -> list[Path]:
    """Stick and slip with the traction, and the pressure."""
    closed = drawn.grid.closed
    rows, columns = closed.any(axis=1), closed.any(axis=0)
    farthest = max(np.abs(drawn.x[columns]).max(), np.abs(drawn.y[rows]).max())
    reach = max(1.18 * farthest, farthest + 0.7 * max(np.diff(drawn.x).max(), np.diff(drawn.y).max()))
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.4, 5.6), layout="constrained")
    figure.suptitle(case(drawn), fontsize=10)

    x, y = edges(drawn.x), edges(drawn.y)
    colours = ListedColormap(["white", STICK_COLOUR, SLIP_COLOUR])
    left.pcolormesh(x, y, drawn.grid.state, cmap=colours, vmin=-0.5, vmax=2.5, edgecolors="white", linewidth=0.15)
    # Some 14 arrows across the patch, whatever the grid.
    step = max(1, math.ceil(columns.sum() / 14))
    take = (slice(rows.argmax() % step, None, step), slice(columns.argmax() % step, None, step))
    gx, gy = np.meshgrid(drawn.x, drawn.y)
    shown = closed[take]
    t = drawn.traction[take][shown]
    largest = np.linalg.norm(drawn.traction, axis=2).max()
    spacing = np.diff(drawn.x[columns]).mean() * step if columns.sum() > 1 else reach / 8
    if largest > 0:
        left.quiver(
            gx[take][shown],
            gy[take][shown],
            t[:, 0],
            t[:, 1],
            angles="xy",
            scale_units="xy",
            scale=largest / (0.95 * spacing),
            width=0.004,
            color="black",
            pivot="tail",
        )
    left.set_title(f"stick and slip; traction on the lower body, at most {largest:.4g} MPa")
    legend(figure, [], [Patch(facecolor=STICK_COLOUR, label="stick"), Patch(facecolor=SLIP_COLOUR, label="slip")])

    pressure = np.where(closed, drawn.pressure, np.nan)
    image = right.pcolormesh(x, y, pressure, cmap="cividis", vmin=0)
    figure.colorbar(image, ax=right, label="pressure p / MPa", shrink=0.85)
    right.set_title("pressure")
    for axes in (left, right):
        axes.set_aspect("equal")
        axes.set_xlim(-reach, reach)
        axes.set_ylim(-reach, reach)
        axes.set_xlabel("longitudinal position x / mm   (leading edge at the left)")
        axes.set_ylabel("lateral position y / mm")
    return canvas.save(figure, of_contact("contact-map", drawn.group))
