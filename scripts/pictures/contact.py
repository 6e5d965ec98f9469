"""Contact: traction and pressure along y = 0, and the map of stick and slip."""

import csv
import math
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from results import ResultsError, lookup
from style import BLUE, GREEN, GREY, ORANGE, SKY, save

REFERENCE = Path(__file__).parents[2] / "docs/reference/contact_n70_eta03_y0.csv"
MM, MPA = 1e3, 1e-6
STICK, SLIP = 1, 2


class Patch2d:
    """The contact grid with its fields, in mm and MPa, as arrays [ny, nx]."""

    def __init__(self, results):
        x, y = results["contact/x"], results["contact/y"]
        if "contact/shape" in results:
            nx, ny = (int(n) for n in results["contact/shape"])
        else:
            nx, ny = len(np.unique(x)), len(np.unique(y))
        if nx * ny != len(x):
            raise ResultsError(f"{results.path}: /contact has {len(x)} nodes, which is no grid of {nx} x {ny}")
        self.x, self.y = MM * x.reshape(ny, nx)[0], MM * y.reshape(ny, nx)[:, 0]
        self.pressure = MPA * results["contact/pressure"].reshape(ny, nx)
        self.traction = MPA * results["contact/traction"].reshape(ny, nx, 2)
        self.state = results["contact/state"].reshape(ny, nx)
        self.closed = self.state > 0
        if not self.closed.any():
            raise ResultsError(f"{results.path}: no contact node is closed, so there is no contact to draw")

    def along_axis(self, field):
        """A field on y = 0, between grid lines if need be."""
        return np.array([np.interp(0.0, self.y, field[:, i]) for i in range(len(self.x))])


def pictures(results, out):
    if "contact/pressure" not in results:
        return []
    patch = Patch2d(results)
    job = results.job
    return [
        line(patch, job, results, out / f"{results.stem}-contact-line.png"),
        stick_slip_map(patch, job, results, out / f"{results.stem}-contact-map.png"),
    ]


def reference(job):
    """CONTACT's curve as (x, pressure, traction) in mm and MPa if the job is its case, or None."""
    same = [
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
    if not REFERENCE.exists():
        return None
    with REFERENCE.open() as file:
        rows = list(csv.DictReader(row for row in file if not row.startswith("#")))
    column = lambda name, factor: factor * np.array([float(row[name]) for row in rows])  # noqa: E731
    return column("x_m", MM), column("pressure_Pa", MPA), column("traction_y_Pa", MPA)


def case(job, results):
    """What was computed: the title of the job, if it has one, and below it the load and the creepages."""
    force = results["contact/force"]
    words = [f"N = {-force[2] / 1e3:.4g} kN"]
    friction = lookup(job, "contact.friction")
    if isinstance(friction, (int, float)):
        words.append(f"μ = {friction:g}")
    elif law := lookup(job, "contact.friction.exponential"):
        words.append(f"μ from {law['static']:g} to {law['kinetic']:g} over {law['decay_velocity']:g} m/s")
    for name, symbol, factor, unit in (
        ("longitudinal", "ξ", 100, " %"),
        ("lateral", "η", 100, " %"),
        ("spin", "φ", 1, " 1/m"),
    ):
        value = lookup(job, f"contact.creepage.{name}", 0)
        if value:
            words.append(f"{symbol} = {factor * value:g}{unit}")
    title = lookup(job, "title")
    return (f"{title}\n" if title else "") + ", ".join(words)


def coefficients(friction, patch, results):
    """Coefficient of friction at every node, at its own creep velocity where the law falls; None if the job does not say."""
    if isinstance(friction, (int, float)):
        return np.full(patch.state.shape, float(friction))
    law = lookup(friction, "exponential") if isinstance(friction, dict) else None
    if law is None:
        return None
    # A sticking node has the coefficient at rest.
    creep = np.linalg.norm(results["contact/creep"].reshape(*patch.state.shape, 2), axis=2)
    velocity = np.where(patch.state == STICK, 0.0, creep)
    return law["kinetic"] + (law["static"] - law["kinetic"]) * np.exp(-velocity / law["decay_velocity"])


def line(patch, job, results, path):
    friction = lookup(job, "contact.friction")
    compared = reference(job)
    compliance = {"fe": "finite elements", "half_space": "half-space"}.get(lookup(job, "contact.compliance"), "computed")
    pressure = patch.along_axis(patch.pressure)
    traction = [patch.along_axis(patch.traction[:, :, c]) for c in (0, 1)]
    state = patch.state[np.argmin(np.abs(patch.y))]
    reach = patch.x[patch.closed.any(axis=0)]
    margin = 0.12 * (reach.max() - reach.min())

    figure, (upper, lower) = plt.subplots(
        2, 1, sharex=True, figsize=(6.4, 6.6), height_ratios=[1, 1.5], constrained_layout=True
    )
    figure.suptitle(case(job, results), fontsize=10)
    upper.plot(patch.x, pressure, color=BLUE, marker="o", markersize=3, label=f"pressure, {compliance}")
    if compared:
        upper.plot(compared[0], compared[1], "k--", linewidth=1.1, label="pressure, CONTACT (half-space)")
    upper.set_ylabel("pressure p / MPa")
    upper.set_ylim(bottom=0, top=1.38 * pressure.max())
    upper.legend(loc="upper right", ncols=1)

    coefficient = coefficients(friction, patch, results)
    if coefficient is not None:
        bound = patch.along_axis(coefficient * patch.pressure)
        lower.fill_between(patch.x, -bound, bound, color=GREY, alpha=0.13, linewidth=0)
        lower.plot(patch.x, bound, color=GREY, linewidth=1, label="±μp")
        lower.plot(patch.x, -bound, color=GREY, linewidth=1)
    largest = max(np.abs(t).max() for t in traction)
    drawn = [c for c in (0, 1) if np.abs(traction[c]).max() > 1e-2 * largest]
    for c in drawn:
        color = (GREEN, BLUE)[c]
        lower.plot(patch.x, traction[c], color=color, label=f"traction $t_{'xy'[c]}$, {compliance}")
        for code, face in ((STICK, color), (SLIP, "white")):
            at = state == code
            lower.plot(patch.x[at], traction[c][at], "o", color=color, markerfacecolor=face, markersize=4.5)
    if compared:
        lower.plot(compared[0], compared[2], "k--", linewidth=1.1, label="$t_y$, CONTACT (half-space)")
    handles, _ = lower.get_legend_handles_labels()
    handles.append(Line2D([], [], color=GREY, marker="o", linestyle="none", markersize=4.5, label="stick"))
    handles.append(
        Line2D([], [], color=GREY, marker="o", markerfacecolor="white", linestyle="none", markersize=4.5, label="slip")
    )
    top = bound.max() if coefficient is not None else largest
    # The legend stands on the side where there is less to see.
    below = sum(traction[c].sum() for c in drawn) < 0
    lower.set_ylim((-1.12 * top, 1.75 * top) if below else (-1.75 * top, 1.12 * top))
    lower.legend(handles=handles, loc="upper center" if below else "lower center", ncols=2)
    lower.axhline(0, color="black", linewidth=0.6)
    lower.set_ylabel("traction on the lower body, y = 0 / MPa")
    lower.set_xlabel("longitudinal position x / mm")
    lower.set_xlim(reach.min() - margin, reach.max() + margin)
    for text, x, align in (("← leading edge (rolling)", 0.01, "left"), ("trailing edge →", 0.99, "right")):
        upper.text(x, 1.01, text, transform=upper.transAxes, ha=align, va="bottom", fontsize=9, color=GREY)
    return save(figure, path)


def edges(centres):
    """Borders of the cells around grid nodes."""
    between = 0.5 * (centres[1:] + centres[:-1])
    first, last = 2 * centres[0] - between[0], 2 * centres[-1] - between[-1]
    return np.concatenate([[first], between, [last]])


def stick_slip_map(patch, job, results, path):
    rows, columns = patch.closed.any(axis=1), patch.closed.any(axis=0)
    reach = max(np.abs(patch.x[columns]).max(), np.abs(patch.y[rows]).max()) * 1.18
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.4, 5.2), constrained_layout=True)
    figure.suptitle(case(job, results), fontsize=10)

    x, y = edges(patch.x), edges(patch.y)
    colours = ListedColormap(["white", SKY, ORANGE])
    left.pcolormesh(x, y, patch.state, cmap=colours, vmin=-0.5, vmax=2.5, edgecolors="white", linewidth=0.15)
    # Some 16 arrows across the patch, whatever the grid.
    step = max(1, math.ceil(columns.sum() / 14))
    take = (slice(rows.argmax() % step, None, step), slice(columns.argmax() % step, None, step))
    gx, gy = np.meshgrid(patch.x, patch.y)
    shown = patch.closed[take]
    t = patch.traction[take][shown]
    largest = np.linalg.norm(patch.traction, axis=2).max()
    spacing = np.diff(patch.x[columns]).mean() * step if columns.sum() > 1 else reach / 8
    if largest > 0:
        arrows = left.quiver(
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
        round_value = float(f"{largest:.1g}")
        left.quiverkey(arrows, 0.80, 0.05, round_value, f"{round_value:g} MPa", labelpos="E", coordinates="axes")
    left.set_title("stick and slip, with the traction on the lower body")
    left.legend(
        handles=[Patch(facecolor=SKY, label="stick"), Patch(facecolor=ORANGE, label="slip")],
        loc="upper right",
        borderaxespad=0.2,
    )

    pressure = np.ma.masked_where(~patch.closed, patch.pressure)
    image = right.pcolormesh(x, y, pressure, cmap="cividis", vmin=0)
    figure.colorbar(image, ax=right, label="pressure p / MPa", shrink=0.85)
    right.set_title("pressure")
    for axes in (left, right):
        axes.set_aspect("equal")
        axes.set_xlim(-reach, reach)
        axes.set_ylim(-reach, reach)
        axes.set_xlabel("longitudinal position x / mm   (leading edge at the left)")
        axes.set_ylabel("lateral position y / mm")
    return save(figure, path)
