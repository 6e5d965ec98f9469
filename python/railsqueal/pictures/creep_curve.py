"""Creep curves: friction over one creepage, the share that sticks, and the growth rate of the least stable mode."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from ..result import Floats, Result, lookup
from ..tables import CreepCurve, friction_law
from .contact import REFERENCES
from .style import BLUE, GREY, LATERAL, LONGITUDINAL, RED, STICK, Canvas, heading, legend

NAMES = {
    "longitudinal": ("longitudinal creepage ξ / %", 100),
    "lateral": ("lateral creepage η / %", 100),
    "spin": ("spin φ / (1/m)", 1),
}

LAWS = (
    ("linear", (0, (1, 3)), "linear theory"),
    ("shen_hedrick_elkins", "-.", "Shen, Hedrick, Elkins"),
    ("polach", (0, (5, 1, 1, 1, 1, 1)), "Polach"),
    ("fastsim", "--", "FASTSIM"),
)


def of_contact(result: Result, key: str) -> tuple[Floats, Floats] | None:
    """Creepages and forces over μN that CONTACT has for the bodies and the load of the job; none of other ones."""
    body = {
        "mesh.cylinder.outer_radius": 0.5,
        "mesh.cylinder.crown_radius": 0.5,
        "material.young": 205e9,
        "material.poisson": 0.3,
    }
    wanted = {f"bodies.{place}.{name}": value for place in ("lower", "upper") for name, value in body.items()}
    wanted |= {"contact.friction": 0.3, "contact.creepage.longitudinal": 0, "contact.creepage.spin": 0}
    table = REFERENCES / "contact_creep_forces.csv"
    if (
        key != "lateral"
        or not table.exists()
        or any(lookup(result.job, name) != value for name, value in wanted.items())
    ):
        return None
    rows = np.genfromtxt(table, delimiter=",", skip_header=3)
    rows = rows[rows[:, 0] == lookup(result.job, "contact.normal_load")]
    return (rows[:, 1], rows[:, 2]) if len(rows) else None


def limit(result: Result, force: Floats, number: int = 1) -> tuple[Floats, bool]:
    """Normal force of a contact times its coefficient of friction at rest, and whether there is friction."""
    law = friction_law(result, number) or 0
    if isinstance(law, dict):
        (law,) = law.values()
        law = law["static"] if "static" in law else law["points"][0][1]
    return (-law * force[:, 2], True) if law else (-force[:, 2], False)


def pictures(result: Result, canvas: Canvas) -> list[Path]:
    if not CreepCurve.present(result):
        return []
    curve = CreepCurve.from_result(result)
    label, factor = NAMES[curve.key]
    order = np.argsort(curve.creepage, kind="stable")
    x, force = factor * curve.creepage[order], curve.force[order]
    stable = curve.eigenvalue is not None
    rows = 2 + stable
    figure, axes = plt.subplots(
        rows,
        1,
        sharex=True,
        figsize=(6.8, 7 + 1.8 * stable),
        layout="constrained",
        height_ratios=[2] + [1] * (rows - 1),
    )
    unit, rubs = limit(result, force)
    for component, color, text in ((0, LONGITUDINAL, "F$_x$"), (1, LATERAL, "F$_y$")):
        axes[0].plot(x, force[:, component] / unit, color=color, label=f"{text} on body 1", marker=".", markersize=4)
    # Of the laws, the direction in which most happens; the linear theory leaves the picture.
    main = int(np.nanmax(np.abs(force[:, 1])) > np.nanmax(np.abs(force[:, 0])))
    for number, group in enumerate(CreepCurve.further(result), 2):
        other = result.array(f"{group}/force")[order]
        color = LATERAL if main else LONGITUDINAL
        text = f"F$_{'xy'[main]}$ of contact {number}"
        axes[0].plot(
            x, other[:, main] / limit(result, other, number)[0], color=color, linestyle=(0, (4, 2)), label=text
        )
        axes[1].plot(x, result.array(f"{group}/stick_share")[order], color=STICK, linestyle=(0, (4, 2)))
    for key_of_law, style, text in LAWS:
        if f"creep_curve/{key_of_law}" in result:
            law = (result.array(f"creep_curve/{key_of_law}")[order] / unit[:, None])[:, main]
            axes[0].plot(
                x, np.where(np.abs(law) < 1.3, law, np.nan), color=GREY, linestyle=style, linewidth=1, label=text
            )
    points = of_contact(result, curve.key)
    if points:
        axes[0].plot(
            factor * points[0], points[1], "o", color=RED, markersize=6, markerfacecolor="none", label="CONTACT"
        )
    axes[0].axhline(0, color=GREY, linewidth=0.6)
    axes[0].set_ylabel(f"friction over {'μN' if rubs else 'N'}")
    axes[0].set_title(heading(result) + "creep curve")
    axes[1].plot(x, curve.stick_share[order], color=STICK, marker=".", markersize=4)
    axes[1].set_ylabel("share of the\ncontact in stick")
    axes[1].set_ylim(-0.03, 1.03)
    if curve.eigenvalue is not None:
        growth = curve.eigenvalue.real[order]
        axes[2].plot(x, growth, color=BLUE, marker=".", markersize=4)
        axes[2].plot(
            x,
            np.where(growth > 0, growth, np.nan),
            color=RED,
            marker=".",
            markersize=4,
            label="unstable" if (growth > 0).any() else None,
        )
        axes[2].axhline(0, color=GREY, linewidth=0.6)
        axes[2].set_ylabel("largest growth\nrate σ / (1/s)")
    for value in x[curve.status[order] != 0]:
        for axis in axes:
            axis.axvline(value, color=GREY, linestyle=(0, (1, 2)), linewidth=0.8, label="failed point")
    axes[-1].set_xlabel(label + (", contact 1" if CreepCurve.further(result) else ""))
    legend(figure, list(axes))
    return canvas.save(figure, "creep-curve")
