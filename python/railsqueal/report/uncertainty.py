"""Section of the report on uncertain squeal: probabilities by mode, growth rates, influence of the inputs."""

from html import escape

import numpy as np

from ..result import Floats, Result
from ..uncertainty import Loudness, Uncertainty, named
from .markup import Row, cut, digits, table

PICTURES = (
    "uncertainty-probability",
    "uncertainty-growth",
    "uncertainty-indices",
    "uncertainty-scatter",
    "uncertainty-map",
    "uncertainty-levels",
)


def section(result: Result, drawn: dict[str, str]) -> list[str]:
    """The sentence, a table of modes, one of inputs, failed samples, and the pictures."""
    if not Uncertainty.present(result):
        return []
    found = Uncertainty.from_result(result)
    quantities = {key: named(result, key) for key in found.keys}
    names = {key: q.name for key, q in quantities.items()}
    parts = ['<h2 id="uncertainty">Probability of squeal</h2>', f"<p>{escape(found.sentence(names))}</p>"]
    percent = f"{100 * found.confidence:.0f} %"
    said = f"{found.samples} random samples, {found.failed} failed; intervals of {percent}, by {found.method}."
    if found.other > 0:
        said += f" Motions unlike any mode of the job's own point grow with the probability {found.other:.3f}."
    parts.append(f"<p>{escape(said)}</p>")
    low, middle, high = (int(np.argmin(np.abs(found.levels - p))) for p in (0.05, 0.5, 0.95))
    head = ("mode", "probability", "from", "to", "growth rate, 1/s: 5 %", "median", "95 %", "found in")

    def shown(name: str, p: float, ends: Floats, q: Floats, share: float) -> Row:
        rates = (digits(float(q[k]), "{:+.2f}") for k in (low, middle, high))
        return (name, f"{p:.3f}", f"{ends[0]:.3f}", f"{ends[1]:.3f}", *rates, f"{100 * share:.0f} %")

    rows = [shown("any", found.probability, found.interval, found.quantiles, 1 - found.failed / found.samples)]
    rows += [
        shown(name, *numbers)
        for name, *numbers in zip(
            found.modes, found.mode_probability, found.mode_interval, found.mode_quantiles, found.mode_found
        )
    ]
    marked = [row[1] != "0.000" for row in rows]
    parts.append(f'<div class="wide">{table(head, rows, marked)}</div>')
    if found.first is not None and found.total is not None:
        assert found.first_interval is not None and found.total_interval is not None
        order = np.argsort(-found.total, kind="stable")
        inputs = [
            (
                names[found.keys[k]],
                *(f"{v:.3f}" for v in (found.first[k], *found.first_interval[k])),
                *(f"{v:.3f}" for v in (found.total[k], *found.total_interval[k])),
            )
            for k in order
        ]
        heads: Row = ("input", "first-order index", "from", "to", "total index", "from", "to")
        parts += ["<h3>Influence of the inputs on the largest growth rate</h3>", table(heads, inputs)]
    if Loudness.present(result):
        parts += ["<h3>Limit cycles of samples</h3>", f"<p>{escape(Loudness.from_result(result).sentence())}</p>"]
    failed = np.flatnonzero(found.status != 0)
    if len(failed):
        lost = [
            (*(f"{q.factor * found.values[key][k]:.6g}" for key, q in quantities.items()), found.message[k])
            for k in failed
        ]
        shown_rows, more = cut(lost)
        heads = (*(q.axis for q in quantities.values()), "reason")
        parts += ["<h3>Samples that failed</h3>", table(heads, shown_rows, kind="words"), more]
    return parts + [drawn[name] for name in PICTURES if name in drawn]


def csv_tables(result: Result) -> list[tuple[str, Row, list[Row]]]:
    """All points, the modes, and the indices."""
    if not Uncertainty.present(result):
        return []
    found = Uncertainty.from_result(result)
    unit = {key: result.units(f"uncertainty/values/{key}") for key in found.keys}
    keys = tuple(key if unit[key] in ("1", "-") else f"{key}_{unit[key]}" for key in found.keys)
    modes = tuple(f"growth_rate_of_{f:.0f}_Hz_1/s" for f in found.mode_frequency)
    head = ("point", "part", *keys, "unstable", "growth_rate_1/s", "frequency_Hz", *modes, "status", "message")
    rows: list[Row] = [
        (
            *(k, found.part[k]),
            *(found.values[key][k] for key in found.keys),
            *(found.unstable[k], found.growth_rate[k], found.frequency[k]),
            *found.mode_growth[k],
            *(found.status[k], found.message[k]),
        )
        for k in range(len(found.status))
    ]
    made: list[tuple[str, Row, list[Row]]] = [("uncertainty", head, rows)]
    levels = tuple(f"growth_rate_{100 * p:g}_%_1/s" for p in found.levels)
    head = ("mode", "probability", "from", "to", "found", *levels)
    rows = [("any", found.probability, *found.interval, 1 - found.failed / found.samples, *found.quantiles)]
    rows += [
        (
            *(found.modes[m], found.mode_probability[m], *found.mode_interval[m]),
            *(found.mode_found[m], *found.mode_quantiles[m]),
        )
        for m in range(len(found.modes))
    ]
    made.append(("uncertainty-modes", head, rows))
    if found.first is not None and found.total is not None:
        assert found.first_interval is not None and found.total_interval is not None
        head = ("input", "first_order", "first_order_from", "first_order_to", "total", "total_from", "total_to")
        columns = zip(found.keys, found.first, found.first_interval, found.total, found.total_interval)
        made.append(("uncertainty-indices", head, [(key, s, *a, t, *b) for key, s, a, t, b in columns]))
    if Loudness.present(result):
        of = Loudness.from_result(result)
        level = of.level if of.level is not None else np.full(len(of.fate), np.nan)
        head = ("point", "fate", "frequency_Hz", "kinetic_J", "level_dB(A)", "message")
        columns = zip(of.sample, of.fate, of.frequency, of.kinetic, level, of.message)
        made.append(("uncertainty-cycles", head, [tuple(row) for row in columns]))
    return made
