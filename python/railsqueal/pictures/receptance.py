"""Receptances of the contact point of each body: amplitude and phase over frequency, measured ones beside them."""

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from ..labels import body_words
from ..measured.overlay import Overlay
from ..result import Result, lookup
from ..tables import Receptances, contact_name, contact_number
from .contact import of_contact
from .style import GREY, LATERAL, LONGITUDINAL, NORMAL, PURPLE, Canvas, heading, legend

CURVES = [
    (2, 2, "normal n by n", NORMAL),
    (1, 1, "lateral y by y", LATERAL),
    (0, 0, "longitudinal x by x", LONGITUDINAL),
]
CROSS = (1, 2, "lateral y by normal n", PURPLE)
SPREAD = {"uniform": ", force spread evenly", "pressure": ", force spread as the pressure"}


def pictures(result: Result, canvas: Canvas, measured: Overlay | None = None) -> list[Path]:
    if measured is None and not Receptances.present(result):
        return []
    if measured is not None:
        measured.expect_one_contact(result)
    groups = Receptances.groups(result) or ["receptance"]
    return [path for group in groups for path in contact_receptances(result, group, canvas, measured)]


def contact_receptances(result: Result, group: str, canvas: Canvas, measured: Overlay | None) -> list[Path]:
    table, several = Receptances.from_result(result, group), len(Receptances.groups(result)) > 1
    bodies = list(table.bodies.items())
    if measured is None and len(bodies) == 2 and np.allclose(bodies[0][1], bodies[1][1], rtol=1e-9, atol=0):
        bodies = [("either", bodies[0][1])]
    size = (5.6 * len(bodies), 6.8)
    figure, axes = plt.subplots(
        2,
        len(bodies),
        sharex=True,
        sharey="row",
        squeeze=False,
        figsize=size,
        height_ratios=[1.7, 1],
        layout="constrained",
    )
    spread = SPREAD.get(lookup(result.job, "analyses.receptance.spread"), "")
    where = f", {contact_name(result, contact_number(group))}" if several else ""
    figure.suptitle(heading(result) + f"receptance of the contact point{where}{spread}", fontsize=10)
    for column, (name, h) in enumerate(bodies):
        upper, lower = axes[:, column]
        # A cross term that symmetry forbids is rounding.
        shown = CURVES + ([CROSS] if np.abs(h[:, 1, 2]).max() > 1e-6 * np.abs(h[:, 2, 2]).max() else [])
        for a, b, label, color in shown:
            value, dashes = h[:, a, b], "-" if a == b else "--"
            upper.plot(table.frequency, 1e9 * np.abs(value), label=label, color=color, linewidth=1.2, linestyle=dashes)
            lower.plot(table.frequency, np.degrees(np.angle(value)), color=color, linewidth=1.2, linestyle=dashes)
        if measured is not None:
            draw_measured(measured, name, upper, lower)
        upper.set_yscale("log")
        upper.set_title(body_words(result.job).get(name, f"{name} body"))
        lower.set_xlabel("frequency f / Hz")
        lower.set_yticks([-180, -90, 0, 90, 180])
        lower.set_ylim(-195, 195)
    axes[0, 0].set_ylabel("amplitude |H| / (nm/N)")
    axes[1, 0].set_ylabel("phase / °")
    legend(figure, list(axes[0]), columns=4 if len(bodies) > 1 else 2)
    return canvas.save(figure, of_contact("receptance", group))


def draw_measured(measured: Overlay, body: str, upper: Axes, lower: Axes) -> None:
    """Draws the measured receptances of a body as points, in the colours of the computed ones."""
    shown = {(a, b): (label, color) for a, b, label, color in [*CURVES, CROSS]}
    look: dict[str, Any] = {"linestyle": "none", "marker": ".", "markersize": 2.5}
    for curve in measured.on_body(body):
        a, b = curve.directions
        label, color = shown.get((a, b)) or shown.get((b, a)) or (f"{curve.name}", GREY)
        upper.plot(curve.frequency, 1e9 * np.abs(curve.receptance), label=f"measured, {label}", color=color, **look)
        lower.plot(curve.frequency, np.degrees(np.angle(curve.receptance)), color=color, **look)
