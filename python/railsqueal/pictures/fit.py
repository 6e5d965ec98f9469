"""Measured frequency responses with the modes fitted to them: amplitudes, and circles in the complex plane."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from ..measured.modal_fit import BandFit
from ..measured.universal import MeasuredResponse
from . import style
from .style import BLUE, GREY, RED, Canvas, legend

# Bands with a row of their own; the loudest of more.
ROWS = 12
UNITS = {"receptance": "m/N", "mobility": "m/s/N", "accelerance": "m/s²/N"}


def draw(canvas: Canvas, responses: list[MeasuredResponse], fits: list[BandFit]) -> list[Path]:
    """Draws each band of the response that is largest in it."""
    style.apply()
    shown = [one for one in fits if one.modes]
    if len(shown) > ROWS:
        loud = sorted(shown, key=lambda one: -np.abs(one.model).max())[:ROWS]
        shown = [one for one in shown if any(one is other for other in loud)]
    rows = len(shown)
    figure, axes = plt.subplots(rows, 2, figsize=(8.4, 0.6 + 2.6 * rows), squeeze=False, layout="constrained")
    for (left, right), one in zip(axes, shown):
        k = int(np.abs(one.model).max(axis=1).argmax())
        response = responses[k]
        at = (response.frequency >= one.band[0]) & (response.frequency <= one.band[1])
        measured, model = response.measured[at], one.model[k]
        left.plot(one.frequency, np.abs(measured), ".", color=GREY, markersize=3, label="measured")
        left.plot(one.frequency, np.abs(model), color=BLUE, label="fitted")
        for mode in one.modes:
            left.axvline(mode.frequency, color=RED, linewidth=0.8, linestyle=":")
        left.set_yscale("log")
        left.set_ylabel(f"{response.quantity} / ({UNITS[response.quantity]})")
        left.set_xlabel("frequency f / Hz")
        names = ", ".join(f"{mode.frequency:.2f} Hz (ζ = {mode.damping_ratio:.2e})" for mode in one.modes)
        left.set_title(names, fontsize=8)
        right.plot(measured.real, measured.imag, ".", color=GREY, markersize=3)
        right.plot(model.real, model.imag, color=BLUE)
        right.set_aspect("equal", adjustable="datalim")
        right.set_xlabel("real part")
        right.set_ylabel("imaginary part")
        right.set_title(f"dataset {response.dataset}", fontsize=8)
    legend(figure, list(axes[:, 0]))
    return canvas.save(figure, "fit")
