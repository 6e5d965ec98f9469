"""Growth-rate budget: parts of the growth rate of each mode by the single-mode criterion."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from ..mode_names import ModeNames
from ..result import Result
from ..stability import Budget
from ..tables import ComplexModes
from .style import NAMES_OF_PARTS, PARTS, Canvas, heading, legend

# Modes drawn at most.
MOST = 12


def pictures(result: Result, canvas: Canvas) -> list[Path]:
    budget = Budget.from_result(result)
    if budget is None or not ComplexModes.present(result):
        return []
    table, names = ComplexModes.from_result(result), ModeNames.from_result(result)
    places = [
        k for k in range(len(budget.growth_rate)) if np.isfinite(budget.growth_rate[k]) and k < len(table.frequency)
    ][:MOST]
    if not places:
        return []
    figure, axes = plt.subplots(figsize=(8.4, 1.6 + 0.62 * len(places)), layout="constrained")
    for name, colour in PARTS.items():
        values = getattr(budget, name)[places]
        # Parts of one sign are stacked on each other.
        before = [below(budget, name, k) for k in places]
        label = NAMES_OF_PARTS.get(name, name)
        axes.barh(range(len(places)), values, left=before, height=0.6, color=colour, label=label)
    axes.plot(budget.growth_rate[places], range(len(places)), "D", color="black", markersize=6, label="growth rate")
    axes.axvline(0, color="black", linewidth=0.8)
    axes.set_yticks(
        range(len(places)),
        [f"{table.frequency[k]:.0f} Hz\n{names.dominant(table, k)}".strip() for k in places],
        fontsize=8,
    )
    axes.invert_yaxis()
    axes.set_xlabel("parts of the growth rate σ / (1/s)")
    axes.set_title(heading(result) + "growth-rate budget")
    legend(figure, [axes], columns=5)
    return canvas.save(figure, "growth-budget")


def below(budget: Budget, name: str, place: int) -> float:
    """Sum of the parts of the same sign that are stacked before this one."""
    own, total = float(getattr(budget, name)[place]), 0.0
    for other in PARTS:
        if other == name:
            return total
        value = float(getattr(budget, other)[place])
        total += value if (value > 0) == (own > 0) else 0.0
    return total
