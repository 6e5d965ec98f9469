"""Sections of the report on eigenvalues, growth-rate budget, cures, and free modes."""

from collections.abc import Iterator
from html import escape

import numpy as np

from ..mode_names import ModeNames
from ..result import Result
from ..stability import Balance, Budget, Sensitivities
from ..tables import ComplexModes, Modes
from ..verdict import LOSS_FACTOR, extra_loss_factor, hertz, relaxing, rounded, squealing
from .markup import ROWS, Row, cut, digits, table

# Cures that are named for each mode.
CURES = 5
RELAXATION = (
    "Growth without oscillation is a stick–slip relaxation of the contact: friction falls so steeply with the slip "
    "velocity that the contact itself runs away. It is no mode of the bodies, and its rate says nothing of a tone."
)


def section(result: Result, drawn: dict[str, str]) -> list[str]:
    """Squealing modes with their budget and cures, growth without oscillation, and the list of eigenvalues."""
    if not ComplexModes.present(result):
        return []
    table_of, names = ComplexModes.from_result(result), ModeNames.from_result(result)
    parts = ['<h2 id="stability">Stability</h2>', counted(table_of)]
    parts += budget_part(result, table_of, names)
    if "growth-budget" in drawn:
        parts.append(drawn["growth-budget"])
    parts += balance_part(result, table_of, names) + cures_part(result, table_of, names)
    growing = relaxing(table_of)
    if len(growing):
        parts += ["<h3>Growth without oscillation</h3>", f"<p>{RELAXATION}</p>"]
        parts.append(
            table(
                ("eigenvalue", "growth rate, 1/s"),
                [(int(k) + 1, digits(table_of.growth_rate[k], "{:+.4g}")) for k in growing],
            )
        )
    places = np.flatnonzero(table_of.oscillates)
    every, more = cut([eigenvalue_row(table_of, names, int(k)) for k in places])
    head = ("frequency, Hz", "growth rate, 1/s", "damping ratio, %", "source", "shares of the free modes")
    parts += ["<h3>Eigenvalues that oscillate, by falling growth rate</h3>"]
    parts += [table(head, every, list(table_of.grows[places[: len(every)]])), more]
    return parts


def eigenvalue_row(table_of: ComplexModes, names: ModeNames, place: int) -> Row:
    """A row of the list of eigenvalues."""
    numbers = (table_of.frequency[place], table_of.growth_rate[place], 100 * table_of.damping_ratio[place])
    return (
        *(digits(n, f) for n, f in zip(numbers, ("{:.2f}", "{:+.4f}", "{:+.4f}"))),
        table_of.source[place],
        names.made_of(table_of, place),
    )


def counted(table_of: ComplexModes) -> str:
    """Numbers of eigenvalues, source by source."""
    source, parts = np.array(table_of.source), []
    for s in dict.fromkeys(table_of.source):
        squeals = int((table_of.grows & table_of.oscillates)[source == s].sum())
        relaxes = int((table_of.grows & ~table_of.oscillates)[source == s].sum())
        apart = f" and {relaxes} growing without oscillation" if relaxes else ""
        parts.append(f"{squeals} squealing{apart} of {(source == s).sum()} eigenvalues of the {s} model")
    return f"<p>{'; '.join(parts)}.</p>"


def budget_part(result: Result, table_of: ComplexModes, names: ModeNames) -> list[str]:
    """Parts of the growth rates by the single-mode criterion."""
    budget = Budget.from_result(result)
    if budget is None:
        return []
    rows, marks = [], []
    for k in range(len(budget.growth_rate)):
        if k < len(table_of.frequency) and np.isfinite(budget.growth_rate[k]):
            parts = (budget.damping, budget.friction, budget.creep, budget.tilting, budget.growth_rate)
            rows.append(
                (hertz(table_of.frequency[k]), names.dominant(table_of, k), *(digits(p[k], "{:+.3f}") for p in parts))
            )
            marks.append(bool(table_of.grows[k]))
    if not rows:
        return []
    head = ("frequency", "mode", "structural damping", "friction", "creep damping", "contact tilt", "sum")
    words = (
        "Parts of the growth rate in 1/s by the single-mode criterion: structural damping of the mode itself; friction "
        "through the compliance of everything else; creep damping, by motion along the surface, which turns the "
        "friction; contact tilt."
    )
    return ["<h3>Growth-rate budget</h3>", f"<p>{words}</p>", table(head, rows, marks)]


def balance_part(result: Result, table_of: ComplexModes, names: ModeNames) -> list[str]:
    """Energy balance of the complex modes that are written as motions."""
    balance = Balance.from_result(result)
    if balance is None:
        return []
    rows = []
    for place, parts in zip(balance.place, balance.parts):
        numbers = (digits(p, "{:+.3f}") for p in (*parts, parts.sum()))
        rows.append((hertz(table_of.frequency[place]), names.dominant(table_of, int(place)), *numbers))
    head = (
        "frequency",
        "mode",
        *(f"damping of the {names.bodies[b]}" for b in ("lower", "upper")),
        "work of the contact",
        "sum",
    )
    return ["<h3>Energy balance of the complex modes, 1/s</h3>", table(head, rows)]


def cures_part(result: Result, table_of: ComplexModes, names: ModeNames) -> list[str]:
    """Changes that would end the growth of each squealing mode, each by itself."""
    unstable = squealing(table_of)
    if not len(unstable):
        return []
    rows = list(cure_rows(result, table_of, names, unstable.tolist()))
    head = ["frequency", "mode", "higher loss factor", "or, each by itself"]
    if not Sensitivities.from_result(result):
        head, rows = head[:3], [row[:3] for row in rows]
    asked = (
        ""
        if Sensitivities.from_result(result)
        else " Other changes are listed with <code>analyses.stability.sensitivities</code>."
    )
    words = f"Linear estimates for each mode by itself: the smallest changes that bring its growth rate to zero.{asked}"
    return ["<h3>Cures</h3>", f"<p>{words}</p>", table(head, rows, kind="words")]


def cure_rows(result: Result, table_of: ComplexModes, names: ModeNames, unstable: list[int]) -> Iterator[Row]:
    """A row for each squealing mode."""
    slopes = Sensitivities.from_result(result)
    for place in unstable[:ROWS]:
        extra = extra_loss_factor(table_of, names, place)
        loss = (
            f"{names.bodies[extra[0]]} +{rounded(extra[1])}" if extra and extra[1] <= LOSS_FACTOR else "none below 0.1"
        )
        others = (
            [words for _, _, words in slopes.cures(result, place, float(table_of.growth_rate[place]))][:CURES]
            if slopes
            else []
        )
        yield hertz(table_of.frequency[place]), names.dominant(table_of, place), loss, "; ".join(others)


def modes_section(result: Result) -> list[str]:
    """Free modes of each body by name, wheels first."""
    bodies = Modes.bodies(result)
    if not bodies:
        return []
    names = ModeNames.from_result(result)
    parts = ['<h2 id="modes">Free modes</h2>']
    parts.append(
        "<p>Undamped modes of each body without contact. n is the number of nodal diameters; a number after the kind "
        "of motion counts, from 0, the modes of this kind with the same n.</p>"
    )
    for body in sorted(bodies, key=lambda b: names.bodies[b] != "wheel"):
        rows, more = cut(list(mode_rows(Modes.from_result(result, body), names.free[body])))
        parts += [
            f"<h3>{escape(names.bodies[body].capitalize())}</h3>",
            table(("frequency, Hz", "mode", "relative residual"), rows),
            more,
        ]
    return parts


def mode_rows(modes: Modes, free: list[str]) -> Iterator[Row]:
    """Modes by name; neighbours of one name and one frequency are one row."""
    k = 0
    while k < len(modes.frequency):
        pair = (
            k + 1 < len(modes.frequency)
            and abs(modes.frequency[k + 1] - modes.frequency[k]) <= 1e-6 * modes.frequency[k]
        )
        same = (
            pair
            and modes.diameters is not None
            and modes.diameters[k] == modes.diameters[k + 1]
            and modes.diameters[k] > 0
        )
        name = free[k].replace(f"mode {k + 1} ", f"modes {k + 1} and {k + 2} ") if same else free[k]
        yield f"{modes.frequency[k]:.2f}", name, digits(modes.residual[k], "{:.1e}")
        k += 2 if same else 1
