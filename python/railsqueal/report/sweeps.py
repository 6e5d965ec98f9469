"""Section of the report on sweeps: the points with the fastest growth, failed points, maps."""

import numpy as np

from ..labels import body_words, quantity
from ..result import Result
from ..tables import Sweep
from .markup import Row, cut, digits, table

PICTURES = ("sweep-map", "sweep-slices", "sweep-parallel", "sweep-loci", "limit-cycles", "limit-cycles-map")


def section(result: Result, drawn: dict[str, str]) -> list[str]:
    """Points by falling growth rate, reasons of failed ones, and the pictures of the sweep."""
    if not Sweep.present(result):
        return []
    sweep, names = Sweep.from_result(result), body_words(result.job)
    quantities = {key: quantity(key, result.units(f"sweep/values/{key}"), names) for key in sweep.keys}
    heads = tuple(q.axis for q in quantities.values())

    def shown(point: int) -> Row:
        cells = []
        for key, q in quantities.items():
            value = sweep.values[key][point]
            text = q.text(float(value) if isinstance(value, (float, np.floating)) else str(value))
            cells.append(text.removesuffix(q.unit).strip() if q.unit else text)
        return cells

    computed = np.flatnonzero(sweep.status == 0)
    order = computed[np.argsort(-sweep.growth_rate[computed], kind="stable")]
    rows, more = cut([(*shown(int(k)), *growth_cells(sweep, int(k))) for k in order])
    marked = [bool(sweep.unstable[k] > 0) for k in order[: len(rows)]]
    parts = ['<h2 id="sweep">Sweep</h2>', "<h3>Points by falling growth rate</h3>"]
    head = (*heads, "modes that grow", "largest growth rate, 1/s", "its frequency, Hz")
    parts += [f'<div class="wide">{table(head, rows, marked)}</div>', more]
    failed = np.flatnonzero(sweep.status != 0)
    if len(failed):
        rows, more = cut([(*shown(int(k)), sweep.message[k] if k < len(sweep.message) else "") for k in failed])
        parts += ["<h3>Points that failed</h3>", table((*heads, "reason"), rows, kind="words"), more]
    return parts + [drawn[name] for name in PICTURES if name in drawn]


def growth_cells(sweep: Sweep, point: int) -> tuple[int, str, str]:
    """Numbers of a point; growth without oscillation has no frequency."""
    at = sweep.frequency[point]
    frequency = "none: stick–slip relaxation" if sweep.unstable[point] > 0 and at < 1e-3 else digits(at, "{:.1f}")
    return int(sweep.unstable[point]), digits(sweep.growth_rate[point], "{:+.4f}"), frequency
