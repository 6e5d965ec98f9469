"""Receptances of the contact point of each body: amplitude and phase over frequency."""

import matplotlib.pyplot as plt
import numpy as np
from results import lookup
from style import BLUE, GREEN, ORANGE, PURPLE, save

CURVES = [(2, 2, "normal n by n", BLUE), (1, 1, "lateral y by y", ORANGE), (0, 0, "longitudinal x by x", GREEN)]
CROSS = (1, 2, "lateral y by normal n", PURPLE)


def pictures(results, out):
    if "receptance/frequency" not in results:
        return []
    frequency = results["receptance/frequency"]
    bodies = [(name, results[f"receptance/{name}"]) for name in ("lower", "upper")]
    if np.allclose(bodies[0][1], bodies[1][1], rtol=1e-9, atol=0):
        bodies = [("either", bodies[0][1])]
    figure, axes = plt.subplots(
        2,
        len(bodies),
        sharex=True,
        sharey="row",
        squeeze=False,
        figsize=(5.6 * len(bodies), 6.4),
        height_ratios=[1.7, 1],
        constrained_layout=True,
    )
    title = lookup(results.job, "title")
    spread = {"uniform": "evenly", "pressure": "as the pressure"}.get(lookup(results.job, "analyses.receptance.spread"), "")
    figure.suptitle((f"{title}\n" if title else "") + f"receptance of the contact point, force spread {spread}", fontsize=10)
    order = np.argsort(frequency, kind="stable")
    for column, (name, h) in enumerate(bodies):
        upper, lower = axes[:, column]
        # A cross term that symmetry forbids is rounding.
        shown = CURVES + ([CROSS] if np.abs(h[:, 1, 2]).max() > 1e-6 * np.abs(h[:, 2, 2]).max() else [])
        for a, b, label, color in shown:
            value = h[order, a, b]
            style = {"color": color, "linewidth": 1.2, "linestyle": "-" if a == b else "--"}
            upper.plot(frequency[order], 1e9 * np.abs(value), label=label, **style)
            lower.plot(frequency[order], np.degrees(np.angle(value)), **style)
        upper.set_yscale("log")
        upper.set_title(f"{name} body")
        lower.set_xlabel("frequency f / Hz")
        lower.set_yticks([-180, -90, 0, 90, 180])
        lower.set_ylim(-195, 195)
    axes[0, 0].set_ylabel("amplitude |H| / (nm/N)")
    axes[1, 0].set_ylabel("phase / °")
    axes[0, 0].legend(loc="upper right")
    return [save(figure, out / f"{results.stem}-receptance.png")]
