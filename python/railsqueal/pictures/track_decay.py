"""Track decay rates in third octaves, vertical and lateral, with lower limits and measured ones."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from ..result import Result
from ..track_decay import DIRECTIONS, LIMITS, MeasuredDecay, TrackDecay
from .style import GREY, LATERAL, NORMAL, Canvas, heading, legend

COLOURS = {"vertical": NORMAL, "lateral": LATERAL}


def pictures(result: Result, canvas: Canvas, measured: MeasuredDecay | None = None) -> list[Path]:
    if measured is None and not TrackDecay.present(result):
        return []
    table = TrackDecay.from_result(result)
    figure, panels = plt.subplots(1, 2, sharey=True, figsize=(9.6, 4.4), layout="constrained")
    figure.suptitle(heading(result) + "track decay rates, EN 15461", fontsize=10)
    for axes, name in zip(panels, DIRECTIONS):
        look = {"color": COLOURS[name], "markersize": 4}
        axes.loglog(table.frequency, table.rate[name], "o-", label=f"{name}, computed", **look)
        if measured is not None and name in measured.rate:
            axes.loglog(measured.frequency, measured.rate[name], "s", color="black", markersize=4, label="measured")
        if len(table.frequency) == len(LIMITS[name]):
            label = "lower limit of ISO 3095"
            axes.loglog(table.frequency, LIMITS[name], "--", color=GREY, linewidth=1.2, label=label)
        label = "twice the lowest rate that is told"
        axes.axhline(2 * table.least, color=GREY, linewidth=1, linestyle=":", label=label)
        axes.set_title(name)
        axes.set_xlabel("third octave / Hz")
        axes.set_xticks(table.frequency, [f"{f:g}" for f in table.frequency], rotation=60, fontsize=8)
        axes.set_xticks([], minor=True)
        values = np.concatenate(list(table.rate.values()))
        axes.set_ylim(min(0.05, values.min()), max(20.0, 1.2 * values.max()))
    panels[0].set_ylabel("decay rate / (dB/m)")
    legend(figure, list(panels), columns=3)
    return canvas.save(figure, "track-decay")
