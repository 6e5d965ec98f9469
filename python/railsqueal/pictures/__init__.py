"""Pictures of a result: each module draws one subject, and nothing where the result has it not."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # no screen is needed

from ..errors import WRITING, ResultError  # noqa: E402
from ..measured import NONE, Measurements  # noqa: E402
from ..result import Result  # noqa: E402
from . import (  # noqa: E402
    branches,
    budget,
    campbell,
    contact,
    creep_curve,
    curving,
    cycles,
    modes,
    placement,
    receptance,
    slices,
    style,
    surfaces,
    sweep,
    track_decay,
    transient,
    uncertainty,
)
from .style import Canvas  # noqa: E402

__all__ = ["Canvas", "draw", "surfaces"]


def draw(result: Result, canvas: Canvas, count: int = 12, measured: Measurements = NONE) -> list[Path]:
    """Draws all that the result has, `count` modes of each body, and says which files were written.

    Receptances and track decay rates have `measured` ones beside them.
    """
    style.apply()
    try:
        canvas.directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ResultError(f"cannot write to {canvas.directory}: {error}", WRITING) from error
    made = contact.pictures(result, canvas) + modes.pictures(result, canvas, count)
    made += budget.pictures(result, canvas) + campbell.pictures(result, canvas)
    made += receptance.pictures(result, canvas, measured.receptances)
    made += track_decay.pictures(result, canvas, measured.decay)
    for subject in (sweep, slices, cycles, curving, placement, creep_curve, transient):
        made += subject.pictures(result, canvas)
    return made + branches.pictures(result, canvas) + uncertainty.pictures(result, canvas)
