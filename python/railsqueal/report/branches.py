"""Section of the report on branches of limit cycles: thresholds, special points, the diagram."""

from ..labels import body_words, quantity
from ..result import Result
from ..tables import Branches
from .markup import cut, digits, table

PICTURES = ("branches",)


def section(result: Result, drawn: dict[str, str]) -> list[str]:
    """Stability changes of rest, special points of the branches, why they end, and their diagram."""
    if not Branches.present(result):
        return []
    branch = Branches.from_result(result)
    quantities = quantity(branch.along, result.units("cycles/key"), body_words(result.job))
    axis, factor = quantities.axis, quantities.factor
    parts = ['<h2 id="branches">Limit cycles as solutions</h2>']
    sides = {1: "above", 0: "below"}
    kinds = {-1: "subcritical: jumps to a finite amplitude", 0: "", 1: "supercritical: grows from small cycles"}
    onsets = [
        (digits(factor * key, "{:.6f}"), sides[int(above)], digits(frequency, "{:.3f}"), kinds[int(critical)])
        for key, above, frequency, mode, critical in zip(
            branch.onset_key,
            branch.onset_above,
            branch.onset_frequency,
            branch.onset_mode,
            branch.onset_criticality,
        )
        if mode == 0
    ]
    if onsets:
        parts += ["<h3>Squeal starts by itself</h3>", table((axis, "side", "frequency, Hz", "squeal"), onsets)]
    cells = [
        (
            branch.special[k],
            digits(factor * branch.key[k], "{:.6f}"),
            digits(branch.frequency[k], "{:.3f}"),
            digits(branch.kinetic[k], "{:.4g}"),
            digits(branch.second_frequency[k], "{:.3f}") if branch.special[k] == "torus" else "",
            digits(factor * branch.special_error[k], "{:.1e}"),
        )
        for k in range(len(branch.key))
        if branch.special[k]
    ]
    if cells:
        rows, more = cut(cells)
        head = ("special point", axis, "frequency, Hz", "energy, J", "second frequency, Hz", "error of its place")
        parts += ["<h3>Special points of the branches</h3>", table(head, rows), more]
    ends = [
        (origin, digits(factor * branch.key[branch.places(number)[k]], "{:.6f}"), text)
        for number, (origin, both) in enumerate(zip(branch.origin, branch.end))
        for k, text in zip((0, -1), both)
    ]
    parts += ["<h3>Ends of the branches</h3>", table(("begun at", axis, "it ends"), ends, kind="words")]
    return parts + [drawn[name] for name in PICTURES if name in drawn]
