"""Parts of growth rates and their derivatives, of the eigenvalues of a result."""

from dataclasses import dataclass

import numpy as np

from .labels import Quantity, number
from .result import Complexes, Floats, Integers, Result, lookup

# Parameters of `/stability/sensitivity`: quantity, and key of the job that has its value.
PARAMETERS: dict[str, tuple[Quantity, str]] = {
    "friction": (Quantity("friction", "μ", "%", 100), ""),
    "normal_load": (Quantity("normal load", "N", "kN", 1e-3), "contact.normal_load"),
    "approach": (Quantity("approach", "δ", "µm", 1e6), "contact.approach"),
    "speed": (Quantity("rolling speed", "V", "m/s", 1), "contact.speed"),
    "longitudinal": (Quantity("longitudinal creepage", "ξ", "%", 100), ""),
    "lateral": (Quantity("lateral creepage", "η", "%", 100), ""),
    "spin": (Quantity("spin", "φ", "1/m", 1), ""),
    "lower_position": (Quantity("contact on the lower body along y", "", "mm", 1e3), ""),
    "upper_position": (Quantity("contact on the upper body along y", "", "mm", 1e3), ""),
}
# Changes that are proposed at most: relative ones, creepages and spin relative to the one at work, and shifts, m.
RELATIVE, SHIFT = 1.0, 10e-3


@dataclass(frozen=True)
class Budget:
    """Parts of the growth rate of the first eigenvalues by the single-mode criterion, 1/s; NaN without a partner."""

    damping: Floats
    friction: Floats
    creep: Floats
    tilting: Floats
    growth_rate: Floats  # their sum
    mode: Integers  # free mode that is taken apart, from 0

    @classmethod
    def from_result(cls, result: Result) -> "Budget | None":
        """The budget of a result, or None where it has none."""
        path = "stability/criterion"
        if f"{path}/growth_rate" not in result:
            return None
        damping, creep, tilting, total = (
            result.array(f"{path}/{n}") for n in ("damping", "across", "tilting", "growth_rate")
        )
        return cls(damping, total - damping - creep - tilting, creep, tilting, total, result.integers(f"{path}/mode"))


@dataclass(frozen=True)
class Balance:
    """Energy balance of the complex modes that are written as motions, 1/s."""

    place: Integers  # place of each in the list of eigenvalues
    parts: Floats  # [w, 3]: damping of the lower and of the upper body, work of the contact forces

    @classmethod
    def from_result(cls, result: Result) -> "Balance | None":
        """The balance of a result, or None where it has none."""
        if "stability/growth_parts" not in result:
            return None
        return cls(result.integers("stability/shape"), result.array("stability/growth_parts"))


@dataclass(frozen=True)
class Sensitivities:
    """Derivatives of eigenvalues by parameters of the job, SI units."""

    by: dict[str, Complexes]  # parameter: [r]
    damping: Complexes  # [r, m], by the damping ratio of each free mode

    @classmethod
    def from_result(cls, result: Result) -> "Sensitivities | None":
        """The derivatives of a result, or None where it has none."""
        path = "stability/sensitivity"
        by = {name: result.complexes(f"{path}/{name}") for name in PARAMETERS if f"{path}/{name}" in result}
        if not by:
            return None
        return cls(
            by, result.complexes(f"{path}/damping") if f"{path}/damping" in result else np.zeros((0, 0), complex)
        )

    def cures(self, result: Result, place: int, growth_rate: float) -> list[tuple[str, float, str]]:
        """Changes that end the growth of an eigenvalue, each by itself and to first order: parameter, SI change, words.

        The smallest relative ones come first. Changes by more than the value itself or 10 mm are left out.
        """
        found: list[tuple[float, str, float, str]] = []
        creepage = applied_creepage(result)
        for name, slopes in self.by.items():
            slope = float(slopes[place].real) if place < len(slopes) else float("nan")
            change = -growth_rate / slope if slope else float("nan")
            if not np.isfinite(change):
                continue
            quantity, key = PARAMETERS[name]
            given = lookup(result.job, key) if key else None
            scale = {
                "friction": 1.0,
                "longitudinal": float(np.hypot(*creepage[:2])),
                "lateral": float(np.hypot(*creepage[:2])),
            }
            scale |= {"spin": abs(float(creepage[2])), "lower_position": SHIFT, "upper_position": SHIFT}
            size = scale.get(name, abs(float(given)) if isinstance(given, (int, float)) else operating(result, name))
            if size > 0 and abs(change) <= RELATIVE * size:
                shown = number(float(f"{quantity.factor * change:.3g}"))
                words = f"{quantity.name} {'+' if change > 0 else ''}{shown} {quantity.unit}"
                found.append((abs(change) / size, name, change, words))
        return [(name, change, words) for _, name, change, words in sorted(found)]


def applied_creepage(result: Result) -> Floats:
    """Creepages at work: those of the placement, else those of the job."""
    if "placement/creepage" in result:
        return result.array("placement/creepage")
    given = lookup(result.job, "contact.creepage", {}) or {}
    return np.array([float(given.get(name) or 0.0) for name in ("longitudinal", "lateral", "spin")])


def operating(result: Result, name: str) -> float:
    """Load, approach or speed of the examined state, where the job does not give it; 0 where it is not known."""
    if name == "normal_load" and "stability/force" in result:
        return abs(float(result.array("stability/force").reshape(-1)[2]))
    path = {"speed": "placement/speed", "approach": "stability/approach"}.get(name, "")
    return abs(float(result.array(path).reshape(-1)[0])) if path and path in result else 0.0
