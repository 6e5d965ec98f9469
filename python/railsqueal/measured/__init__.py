"""Measurements beside computed results: universal files, receptances on those of a result, and modes fitted to them."""

from dataclasses import dataclass

from ..track_decay import MeasuredDecay
from .overlay import Overlay


@dataclass(frozen=True)
class Measurements:
    """Measured values that are drawn beside those of a result."""

    receptances: Overlay | None = None
    decay: MeasuredDecay | None = None


NONE = Measurements()
