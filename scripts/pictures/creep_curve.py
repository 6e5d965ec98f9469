"""Creep curves: friction over one creepage, the share that sticks, and the growth rate of the least stable mode."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from results import lookup
from style import BLUE, GREEN, GREY, ORANGE, RED, save
from sweep import heading

NAMES = {
    "longitudinal": ("longitudinal creepage ξ / %", 100),
    "lateral": ("lateral creepage η / %", 100),
    "spin": ("spin φ / (1/m)", 1),
}

LAWS = (
    ("linear", (0, (1, 3)), "linear theory"),
    ("shen_hedrick_elkins", "-.", "Shen, Hedrick, Elkins"),
    ("polach", ":", "Polach"),
    ("fastsim", "--", "FASTSIM"),
)
REFERENCE = Path(__file__).parents[2] / "docs/reference/contact_creep_forces.csv"


def of_contact(results, key):
    """Creepages and forces over μN that CONTACT has for the bodies and the load of the job; none of other ones."""
    body = {"mesh.cylinder.outer_radius": 0.5, "mesh.cylinder.crown_radius": 0.5, "material.young": 205e9, "material.poisson": 0.3}
    wanted = {f"bodies.{place}.{name}": value for place in ("lower", "upper") for name, value in body.items()}
    wanted |= {"contact.friction": 0.3, "contact.creepage.longitudinal": 0, "contact.creepage.spin": 0}
    if key != "lateral" or any(lookup(results.job, name) != value for name, value in wanted.items()):
        return None
    rows = np.genfromtxt(REFERENCE, delimiter=",", skip_header=3)
    rows = rows[rows[:, 0] == lookup(results.job, "contact.normal_load")]
    return (rows[:, 1], rows[:, 2]) if len(rows) else None


def limit(results, force):
    """Normal force times the coefficient of friction at rest; the coefficient."""
    law = lookup(results.job, "contact.friction", 0)
    if isinstance(law, dict):
        (law,) = law.values()
        law = law["static"] if "static" in law else law["points"][0][1]
    return -law * force[:, 2], law


def pictures(results, out):
    if "creep_curve/force" not in results:
        return []
    key = next(k for k in NAMES if f"creep_curve/{k}" in results)
    label, factor = NAMES[key]
    creepage, force = factor * results[f"creep_curve/{key}"], results["creep_curve/force"]
    stable = "creep_curve/eigenvalue" in results
    order = np.argsort(creepage, kind="stable")
    x = creepage[order]
    figure, axes = plt.subplots(
        2 + stable, 1, sharex=True, figsize=(6.8, 6.4 + 1.8 * stable), constrained_layout=True, height_ratios=[2] + [1] * (1 + stable)
    )
    bound, coefficient = limit(results, force)
    unit, name = (bound, "μN") if coefficient else (-force[:, 2], "N")
    for component, color, text in ((0, ORANGE, "F$_x$"), (1, BLUE, "F$_y$")):
        axes[0].plot(x, (force[:, component] / unit)[order], color=color, label=f"{text} on body 1", marker=".", markersize=4)
    for key_of_law, style, text in LAWS:
        law = results[f"creep_curve/{key_of_law}"] / unit[:, None]
        # That in which most happens; the linear theory leaves the picture.
        main = int(np.nanmax(np.abs(force[:, 1])) > np.nanmax(np.abs(force[:, 0])))
        shown = np.where(np.abs(law[order, main]) < 1.3, law[order, main], np.nan)
        axes[0].plot(x, shown, color=GREY, linestyle=style, linewidth=1, label=text)
    points = of_contact(results, key)
    if points:
        axes[0].plot(factor * points[0], points[1], "o", color=RED, markersize=6, markerfacecolor="none", label="CONTACT")
    axes[0].axhline(0, color=GREY, linewidth=0.6)
    axes[0].set_ylabel(f"friction over {name}")
    axes[0].set_title(heading(results) + "creep curve")
    axes[0].legend()
    axes[1].plot(x, results["creep_curve/stick_share"][order], color=GREEN, marker=".", markersize=4)
    axes[1].set_ylabel("share of the\ncontact in stick")
    axes[1].set_ylim(-0.03, 1.03)
    if stable:
        growth = results["creep_curve/eigenvalue"].real[order]
        axes[2].plot(x, growth, color=BLUE, marker=".", markersize=4)
        axes[2].plot(x, np.where(growth > 0, growth, np.nan), color=RED, marker=".", markersize=4, label="unstable")
        axes[2].axhline(0, color=GREY, linewidth=0.6)
        axes[2].set_ylabel("largest growth\nrate σ / (1/s)")
        if (growth > 0).any():
            axes[2].legend()
    axes[-1].set_xlabel(label)
    return [save(figure, out / f"{results.stem}-creep-curve.png")]
