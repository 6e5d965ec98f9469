"""A drawing as it was read: its curves in the unit and the axes of the file."""

from dataclasses import dataclass, field

from .curves import Curve

# Units of drawings, m.
UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}


@dataclass(frozen=True)
class Drawing:
    """Curves in the unit of the file, the unit that the file names (None: none), and remarks on what was read."""

    curves: list[Curve]
    unit: str | None
    unit_source: str  # where the file names its unit
    summary: str
    remarks: list[str] = field(default_factory=list)
