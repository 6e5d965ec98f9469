"""Two results: keys of the job that differ, figures side by side, tables that differ, and likeness of mode shapes."""

import json
from typing import Any

import numpy as np

from . import figures, mac
from .figures import Figure
from .result import Result
from .tables import ContactGrid

# Tables of results; what tells of the solver's own work (residuals, iterations) is none.
TABLES = (
    "contact/pressure",
    "contact/traction",
    "contact/creep",
    "contact/gap",
    "contact/force",
    "contact/state",
    "modes/lower/frequency",
    "modes/upper/frequency",
    "stability/eigenvalue",
    "receptance/lower",
    "receptance/upper",
    "creep_curve/force",
    "curving/axles/shift",
    "curving/axles/yaw",
    "curving/contacts/creepage",
    "curving/contacts/normal_force",
    "curving/radii/creepage",
    "curving/radii/normal_force",
    "sweep/status",
    "sweep/growth_rate",
    "sweep/frequency",
    "transient/force",
    "transient/point_velocity",
    "transient/contact_state",
)


def keys(job: Any, path: str = "") -> dict[str, str]:
    """Values of a job by their dotted paths, as JSON."""
    if isinstance(job, dict) and job:
        return {k: v for name, value in job.items() for k, v in keys(value, f"{path}.{name}" if path else name).items()}
    return {path: json.dumps(job, ensure_ascii=False)}


def difference(one: Figure, other: Figure) -> float:
    """Relative difference of two figures; 0 of two that are not there, infinite of two words that differ."""
    if one.word != other.word:
        return float("inf")
    if np.isnan(one.value) and np.isnan(other.value):
        return 0.0
    if one.value == other.value:
        return 0.0
    scale = max(abs(one.value), abs(other.value), one.scale, other.scale)
    apart = abs(one.value - other.value) / scale
    return float(apart) if np.isfinite(apart) else float("inf")


def table_difference(one: Any, other: Any) -> float:
    """Largest difference of two arrays of one shape over the largest value; infinite where a value is missing in one of
    them."""
    a, b = (np.asarray(v, dtype=np.complex128 if np.iscomplexobj(v) else np.float64) for v in (one, other))
    missing = np.isnan(a)
    if not np.array_equal(missing, np.isnan(b)):
        return float("inf")
    a, b = a[~missing], b[~missing]
    scale = max(np.abs(a).max(initial=0.0), np.abs(b).max(initial=0.0))
    return float(np.abs(a - b).max(initial=0.0) / scale) if scale > 0 else 0.0


def text(one: Result, other: Result, tolerance: float) -> tuple[str, bool]:
    """The comparison in words, and whether figures and tables agree within a relative tolerance."""
    lines = [f"A: {one.path}", f"B: {other.path}", ""]
    jobs = keys(one.job), keys(other.job)
    changed = [key for key in dict.fromkeys([*jobs[0], *jobs[1]]) if jobs[0].get(key) != jobs[1].get(key)]
    lines.append(f"keys of the job that differ: {len(changed)}")
    lines += [f"  {key}: {jobs[0].get(key, 'not there')} | {jobs[1].get(key, 'not there')}" for key in changed]
    rows, same = side_by_side(one, other, tolerance)
    lines += ["", f"figures (* differs by more than {tolerance:g}, relative)", *rows]
    found, tables_same = tables(one, other, tolerance)
    lines += [
        "",
        f"tables that differ by more than {tolerance:g}, relative to their largest value: {len(found)}",
        *found,
    ]
    if not rows and not any(name in one and name in other for name in TABLES):
        return "\n".join([*lines, "", "the two results have nothing in common that could be compared"]), False
    # Shapes are told for readers; where frequencies are close they turn by small changes, so they do not decide.
    lines += mac.lines(one, other)
    agree = same and tables_same
    return "\n".join([*lines, "", "the results agree" if agree else "the results differ"]), agree


def side_by_side(one: Result, other: Result, tolerance: float) -> tuple[list[str], bool]:
    """Figures of both, and whether they agree; one that the other result does not have differs."""
    named = [{(f.group, f.name, f.unit): f for f in figures.figures_of_result(result)} for result in (one, other)]
    rows, same, group = [], True, ""
    for key in dict.fromkeys([*named[0], *named[1]]):
        pair = [side.get(key) for side in named]
        apart = difference(pair[0], pair[1]) if pair[0] and pair[1] else float("inf")
        if key[0] != group:
            group = key[0]
            rows.append(f"  {group}")
        differs = apart > tolerance
        same &= not differs
        cells = [f.text if f else "not there" for f in pair]
        words = "" if apart == 0 else (f"{apart:.1e}" if np.isfinite(apart) else "")
        rows.append(f"  {'*' if differs else ' '} {key[1]:<44} {cells[0]:>22} {cells[1]:>22}  {words}".rstrip())
    return rows, same


def tables(one: Result, other: Result, tolerance: float) -> tuple[list[str], bool]:
    """Tables that differ, in words, and whether there is none."""
    found = []
    groups = dict.fromkeys(group for side in (one, other) for group in ContactGrid.groups(side)[1:])
    first = [name for name in TABLES if name.startswith("contact/")]
    further = [name.replace("contact/", f"{group}/") for group in groups for name in first]
    for name in (*TABLES, *further):
        if (name in one) != (name in other):
            found.append(f"  {name}: only in {'A' if name in one else 'B'}")
        elif name in one:
            a, b = one[name], other[name]
            if np.shape(a) != np.shape(b):
                found.append(f"  {name}: shapes {np.shape(a)} and {np.shape(b)}")
            elif (apart := table_difference(a, b)) > tolerance:
                found.append(
                    f"  {name}: {apart:.1e}"
                    if np.isfinite(apart)
                    else f"  {name}: values that are missing in one of them"
                )
    return found, not found
