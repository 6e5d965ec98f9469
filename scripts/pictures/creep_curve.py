"""Creep curves: friction over one creepage, the share that sticks, and the growth rate of the least stable mode."""

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
    bound, law = limit(results, force)
    unit, name = (bound, "μN") if law else (-force[:, 2], "N")
    for component, color, text in ((0, ORANGE, "F$_x$"), (1, BLUE, "F$_y$")):
        axes[0].plot(x, (force[:, component] / unit)[order], color=color, label=f"{text} on body 1", marker=".", markersize=4)
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
