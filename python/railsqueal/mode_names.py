"""Names of modes for readers: body, nodal diameters and kind of motion."""

from dataclasses import dataclass

import numpy as np

from .labels import body_words
from .result import Result
from .tables import BODIES, ComplexModes, Modes

# Share of a kind of free mode in a complex mode below which it is not named.
LEAST_SHARE = 0.1


@dataclass(frozen=True)
class ModeNames:
    """Names of the free modes of both bodies, [m] in the order of `stability/mode_body`."""

    bodies: dict[str, str]  # lower, upper: their names
    free: dict[str, list[str]]  # body: name of each of its modes
    kind: dict[str, list[str]]  # body: the same without the number, equal for modes of one kind

    @classmethod
    def from_result(cls, result: Result) -> "ModeNames":
        """The names of a result."""
        bodies, free, kind = body_words(result.job), {}, {}
        for body in Modes.bodies(result):
            table, word = Modes.from_result(result, body), bodies[body]
            free[body] = [one(table, k, word) for k in range(len(table.frequency))]
            kind[body] = [of_kind(table, k, word) for k in range(len(table.frequency))]
        return cls(bodies, free, kind)

    def shares(self, table: ComplexModes, place: int) -> list[tuple[str, str, float]]:
        """Body, kind of free mode, and its share in the motion of an eigenvalue by elastic energy, largest first."""
        if table.participation is None or table.mode_body is None:
            return []
        summed: dict[tuple[str, str], float] = {}
        number = {body: 0 for body in BODIES.values()}
        for body_number, share in zip(table.mode_body, table.participation[place]):
            body = BODIES[int(body_number)]
            names = self.kind.get(body, [])
            k = number[body]
            number[body] += 1
            name = names[k] if k < len(names) else f"{self.bodies[body]} mode {k + 1}"
            summed[body, name] = summed.get((body, name), 0.0) + float(share)
        order = sorted(summed.items(), key=lambda item: -item[1])
        return [(body, name, share) for (body, name), share in order if np.isfinite(share)]

    def dominant(self, table: ComplexModes, place: int) -> str:
        """Kinds of free modes that make most of a complex mode, with the direction of travel of its wave."""
        shares = self.shares(table, place)
        named = [(body, name) for body, name, share in shares[:2] if share >= LEAST_SHARE]
        if not named:
            return ""
        # A second kind is named where the first one has less than four fifths.
        named = named[:1] if shares[0][2] >= 0.8 else named
        words = " with ".join(name for _, name in named)
        travel = travelling(table, place, named[0][0])
        return f"{words}, {travel}" if travel else words

    def made_of(self, table: ComplexModes, place: int) -> str:
        """Kinds with their shares, such as `98 % wheel mode n = 3 axial`."""
        shares = [item for item in self.shares(table, place)[:3] if item[2] >= LEAST_SHARE]
        return ", ".join(f"{100 * share:.0f} % {name}" for _, name, share in shares)


def travelling(table: ComplexModes, place: int, body: str) -> str:
    """Direction in which the wave of a motion runs round a body that rotates; empty of a standing one."""
    if table.diameters is None:
        return ""
    number = float(table.diameters[place, list(BODIES.values()).index(body)])
    if not np.isfinite(number) or abs(number) < 0.5:
        return ""
    return "travelling with the rotation" if number > 0 else "travelling against the rotation"


def family(table: Modes, k: int) -> str:
    """Kind of motion: `axial` of the first one with these nodal diameters, `axial 1` of the next one."""
    return table.family[k].removesuffix(" 0")


def of_kind(table: Modes, k: int, word: str) -> str:
    """Name that modes of one kind share: `wheel mode n = 3 axial`; all modes of a rail on its track are `rail`."""
    if table.diameters is None or not np.isfinite(table.diameters[k]):
        return f"{word} mode {k + 1}"
    kind = family(table, k)
    if kind:
        return f"{word} mode n = {table.diameters[k]:.0f} {kind}"
    # Rails have hundreds of modes between their ends, which stand for its waves together.
    return word if word == "rail" else f"{word} mode n = {table.diameters[k]:.0f} of {table.frequency[k]:.0f} Hz"


def one(table: Modes, k: int, word: str) -> str:
    """Name of one free mode with its number in the list of its body."""
    if table.diameters is None or not np.isfinite(table.diameters[k]):
        return f"{word} mode {k + 1}"
    if word == "rail":
        return f"rail mode {k + 1} ({table.diameters[k]:.0f} waves on its length)"
    kind = family(table, k)
    return f"{word} mode {k + 1} (n = {table.diameters[k]:.0f}{' ' + kind if kind else ''})"
