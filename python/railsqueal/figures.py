"""The figures by which a result is told to others: the report lists them, the comparison sets those of two results side
by side."""

from dataclasses import dataclass

import numpy as np

from . import growth
from .curving import AXLES, WHEELS, Curving
from .labels import body_words, quantity, words
from .result import Result
from .tables import (
    BODIES,
    ComplexModes,
    ContactGrid,
    CreepCurve,
    Cycles,
    History,
    Modes,
    Receptances,
    Sweep,
    contact_number,
    growing,
    numbered,
)
from .uncertainty import Uncertainty, named

# Modes of each body, and eigenvalues, that count as figures.
MODES, EIGENVALUES = 6, 6

# Creepages: name, factor and unit.
CREEPAGES = (("longitudinal creepage", 100, "%"), ("lateral creepage", 100, "%"), ("spin", 1, "1/m"))


@dataclass(frozen=True)
class Figure:
    """A number with its name and unit; a figure that is a word has it in `word`, and no number.

    Differences are relative to `scale` where the number itself may be near 0.
    """

    group: str
    name: str
    value: float
    unit: str = ""
    scale: float = 0.0
    word: str = ""

    @property
    def text(self) -> str:
        """The number with its unit."""
        if self.word:
            return self.word
        if not np.isfinite(self.value):
            return "none"
        number = f"{self.value:.0f}" if self.unit == "" and self.value == round(self.value) else f"{self.value:.6g}"
        return f"{number} {self.unit}".strip()


def figures_of_result(result: Result) -> list[Figure]:
    """All figures of a result, analysis by analysis."""
    made: list[Figure] = []
    first = (curving, placement, steady, modes, stability, creep_curve, receptances)
    for part in (*first, transient, sound_power, sweep, cycles, uncertainty):
        made += part(result)
    return made


def placement(result: Result) -> list[Figure]:
    """Point of contact of wheel and rail, and the creepages that follow."""
    wanted = (
        ("contact_angle", 1e3, "mrad"),
        ("rolling_radius", 1e3, "mm"),
        ("wheel_y", 1e3, "mm"),
        ("rail_y", 1e3, "mm"),
        ("speed", 1, "m/s"),
    )
    made: list[Figure] = []
    for group in numbered(result, "placement"):
        heading = of_contact("placement", group)
        for name, factor, unit in wanted:
            if f"{group}/{name}" in result:
                value = factor * result.number(f"{group}/{name}")
                made.append(Figure(heading, name.replace("_", " "), value, unit))
        if f"{group}/creepage" in result:
            for (name, factor, unit), value in zip(CREEPAGES, result.array(f"{group}/creepage")):
                made.append(Figure(heading, name, factor * float(value), unit, 1e-3))
    return made


def of_contact(heading: str, group: str) -> str:
    """Heading of the figures of a contact: further ones have their number."""
    number = contact_number(group)
    return f"{heading}, contact {number}" if number > 1 else heading


def curving(result: Result) -> list[Figure]:
    """Axles of a bogie in a curve, and of each wheel the load and, at the place that carries most, the creepages."""
    if not Curving.present(result):
        return []
    table, name, made = Curving.from_result(result), "curving", []
    for axle, word in enumerate(AXLES):
        made.append(Figure(name, f"{word} axle, angle of attack", 1e3 * float(table.yaw[axle]), "mrad", 1e-3))
        made.append(Figure(name, f"{word} axle, shift to the right", 1e3 * float(table.shift[axle]), "mm", 1e-3))
    for wheel, word in enumerate(WHEELS):
        places = table.places(wheel)
        made.append(Figure(name, f"{word}, places of contact", float(len(places))))
        if len(places):
            heaviest = int(places[0])
            made.append(Figure(name, f"{word}, normal force", 1e-3 * float(table.normal_force[heaviest]), "kN"))
            for (what, factor, unit), value in zip(CREEPAGES, table.creepage[heaviest]):
                made.append(Figure(name, f"{word}, {what}", factor * float(value), unit, 1e-3))
            made.append(Figure(name, f"{word}, utilisation", float(table.utilisation[heaviest]), "", 1.0))
    return made


def steady(result: Result) -> list[Figure]:
    """Steady rolling."""
    if not ContactGrid.present(result):
        return []
    return [figure for group in ContactGrid.groups(result) for figure in steady_contact(result, group)]


def steady_contact(result: Result, group: str) -> list[Figure]:
    """Steady rolling of one contact."""
    grid, name = ContactGrid.from_result(result, group), of_contact("steady rolling", group)
    size = float(np.linalg.norm(grid.force))
    made = [Figure(name, f"force {axis} on body 1", float(f), "N", size) for axis, f in zip("xyz", grid.force)]
    made.append(
        Figure(name, "friction over normal force", float(np.hypot(*grid.force[:2]) / max(-grid.force[2], 1e-300)))
    )
    made.append(
        Figure(
            name, "moment about the normal", grid.moment_z, "N m", size * float(np.sqrt(grid.weight[grid.closed].sum()))
        )
    )
    made.append(Figure(name, "approach", 1e6 * grid.approach, "µm"))
    made.append(Figure(name, "largest pressure", 1e-6 * float(grid.pressure.max()), "MPa"))
    made.append(Figure(name, "closed nodes", float(grid.closed.sum())))
    made.append(Figure(name, "share of the contact that sticks", grid.stick_share, "", 1.0))
    return made


def modes(result: Result) -> list[Figure]:
    """First modes of each body."""
    made = []
    for body in Modes.bodies(result):
        table = Modes.from_result(result, body)
        made.append(Figure(f"modes of the {body} body", "modes computed", float(len(table.frequency))))
        # Rigid-body motions have the frequency 0 but for rounding.
        scale = float(table.frequency.max(initial=0.0))
        made += [
            Figure(f"modes of the {body} body", f"mode {k + 1}", float(f), "Hz", 1e-3 * scale)
            for k, f in enumerate(table.frequency[:MODES])
        ]
    return made


def stability(result: Result) -> list[Figure]:
    """Unstable modes, or the least stable ones."""
    if not ComplexModes.present(result):
        return []
    table, name = ComplexModes.from_result(result), "stability"
    made = [
        Figure(name, "eigenvalues listed", float(len(table.eigenvalue))),
        Figure(name, "unstable", float(len(table.unstable))),
    ]
    for place in range(min(EIGENVALUES, len(table.eigenvalue))):
        source = f" ({table.source[place]})" if len(set(table.source)) > 1 else ""
        made.append(Figure(name, f"frequency {place + 1}{source}", float(table.frequency[place]), "Hz"))
        # A growth rate is known relative to the eigenvalue, not to itself.
        size = 1e-3 * float(abs(table.eigenvalue[place]))
        made.append(Figure(name, f"growth rate {place + 1}{source}", float(table.growth_rate[place]), "1/s", size))
    return made


def creep_curve(result: Result) -> list[Figure]:
    """Largest friction of a creep curve."""
    if not CreepCurve.present(result):
        return []
    curve = CreepCurve.from_result(result)
    name = f"creep curve, {curve.key}"
    made = [
        Figure(name, "points", float(len(curve.creepage))),
        Figure(name, "failed points", float((curve.status != 0).sum())),
    ]
    size = np.hypot(curve.force[:, 0], curve.force[:, 1])
    if np.isfinite(size).any():
        at = int(np.nanargmax(size))
        made += [
            Figure(name, "largest friction", float(size[at]), "N"),
            Figure(name, "creepage of the largest friction", float(curve.creepage[at])),
        ]
    if curve.eigenvalue is not None:
        made.append(Figure(name, "unstable points", float(growing(curve.eigenvalue).sum())))
    return made


def receptances(result: Result) -> list[Figure]:
    """Highest peaks of the normal receptance."""
    if not Receptances.present(result):
        return []
    table, made = Receptances.from_result(result), []
    for body, h in table.bodies.items():
        size = np.abs(h[:, 2, 2])
        made.append(Figure("receptance", f"highest normal peak, {body}", 1e9 * float(size.max()), "nm/N"))
        made.append(Figure("receptance", f"its frequency, {body}", float(table.frequency[int(size.argmax())]), "Hz"))
    return made


def transient(result: Result) -> list[Figure]:
    """Forces, motion and stick of the last quarter, and the growth before it."""
    if not History.present(result):
        return []
    history, name = History.from_result(result), "transient"
    late = slice(3 * len(history.time) // 4, None)
    moving = growth.signal(history)
    span = growth.period(moving)
    phase = growth.exponential(*growth.envelope(moving, 2 * span))
    size = float(np.linalg.norm(history.force[late].mean(axis=0)))
    made = [Figure(name, "simulated time", float(history.time[-1]), "s")]
    made += [
        Figure(name, f"mean force {axis}, last quarter", float(f), "N", size)
        for axis, f in zip("xyz", history.force[late].mean(axis=0))
    ]
    made.append(Figure(name, "largest normal force", float(-history.force[:, 2].min()), "N"))
    made.append(Figure(name, "share of nodes in stick, last quarter", float(history.stick_share[late].mean()), "", 1.0))
    made.append(Figure(name, "least number of closed nodes", float(history.closed.min())))
    made.append(Figure(name, "frequency of the cycle, last half", 1 / span, "Hz"))
    if phase:
        made.append(Figure(name, "growth rate, fitted", phase.rate, "1/s"))
        made.append(Figure(name, "fitted from", phase.begin, "s"))
        made.append(Figure(name, "fitted to", phase.end, "s"))
        rate = growth.linear(result, growth.frequency(moving, phase.begin, phase.end))
        if rate is not None:
            made.append(Figure(name, "growth rate, linear analysis of that mode", rate, "1/s"))
    if history.velocity is not None:
        for k, point in enumerate(history.points):
            v = history.velocity[late, k]
            rms = float(np.sqrt(((v - v.mean(axis=0)) ** 2).sum(axis=1).mean()))
            made.append(Figure(name, f"rms velocity of {point}, last quarter", 1e3 * rms, "mm/s"))
    return made


def sound_power(result: Result) -> list[Figure]:
    """Sound power of the bodies."""
    path = "transient/sound_power"
    bodies = [body for body in BODIES.values() if f"{path}/{body}/total_level_a" in result]
    wanted = (("total_level", "dB"), ("total_level_a", "dB(A)"))
    return [
        Figure("sound power", f"{body} body", result.number(f"{path}/{body}/{name}"), unit)
        for body in bodies
        for name, unit in wanted
    ]


def sweep(result: Result) -> list[Figure]:
    """Figures of a sweep."""
    if not Sweep.present(result):
        return []
    table, name = Sweep.from_result(result), "sweep"
    made = [
        Figure(name, "points", float(len(table.status))),
        Figure(name, "failed points", float((table.status != 0).sum())),
    ]
    made.append(Figure(name, "unstable points", float((table.unstable > 0).sum())))
    if np.isfinite(table.growth_rate).any():
        at = int(np.nanargmax(table.growth_rate))
        made.append(
            Figure(
                name,
                "largest growth rate",
                float(table.growth_rate[at]),
                "1/s",
                1e-3 * 2 * np.pi * float(table.frequency[at]),
            )
        )
        made.append(Figure(name, "its frequency", float(table.frequency[at]), "Hz"))
        for key in table.keys:
            found = quantity(key, result.units(f"sweep/values/{key}"), body_words(result.job))
            value = table.values[key][at]
            if table.values[key].dtype.kind != "f":
                made.append(Figure(name, f"its {found.name}", float("nan"), word=words(str(value))))
            else:
                made.append(Figure(name, f"its {found.name}", found.factor * float(value), found.unit))
    return made


def cycles(result: Result) -> list[Figure]:
    """Figures of the limit cycles of a sweep."""
    if not Cycles.present(result):
        return []
    table, made = Cycles.from_result(result), []
    for name, fate, kinetic, frequency in zip(table.branch, table.fate, table.kinetic, table.frequency):
        group, squeals = f"limit cycles, {name}", fate > 0
        made.append(Figure(group, "points that squeal", float(squeals.sum())))
        if squeals.any():
            at = int(np.argmax(np.where(squeals, kinetic, -1)))
            made.append(Figure(group, "largest kinetic energy", float(kinetic[at]), "J"))
            made.append(Figure(group, "its frequency", float(frequency[at]), "Hz"))
    loudest = table.loudest()
    for name, fate, level in zip(table.branch, table.fate, [] if loudest is None else loudest):
        if (fate > 0).any():
            made.append(
                Figure(f"limit cycles, {name}", "largest sound power", float(np.nanmax(level[fate > 0])), "dB(A)")
            )
    return made


def uncertainty(result: Result) -> list[Figure]:
    """Probabilities of squeal, and shares of the variance of the largest growth rate."""
    if not Uncertainty.present(result):
        return []
    table, name = Uncertainty.from_result(result), "probability of squeal"
    made = [Figure(name, "random samples", float(table.samples)), Figure(name, "failed samples", float(table.failed))]
    made.append(Figure(name, "any mode", table.probability, "", 1.0))
    made += [Figure(name, table.modes[m], float(table.mode_probability[m]), "", 1.0) for m in table.squealing]
    for key, index in zip(table.keys, [] if table.first is None else table.first):
        made.append(Figure(name, f"share of the variance, {named(result, key).name}", float(index), "", 1.0))
    return made
