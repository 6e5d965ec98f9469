"""Section of the report on what was computed: bodies, track, damping, contact, vehicle and analyses, with units."""

from typing import Any

from ..labels import Quantity, body_words, leaves, plain, quantity, words
from ..result import Result, lookup
from ..tables import BODIES, Provenance
from .markup import Row, table

# Keys of a body that have a row of their own, in this order: path, name.
SECTIONS = {
    "revolved": "swept wheel, section",
    "extruded": "swept rail, section",
    "cylinder": "built-in cylinder, three-dimensional mesh",
    "file": "three-dimensional mesh from a file",
}


def section(result: Result) -> list[str]:
    """The table of both bodies, and that of contact, curve and vehicle."""
    job, parts = result.job, ['<h2 id="setup">What was computed</h2>']
    bodies = bodies_table(result)
    if bodies:
        names = body_words(job)
        heads = ("", *(f"{names[b]} ({b})" if names[b] != f"{b} body" else names[b] for b in BODIES.values()))
        parts.append(table(heads, bodies, kind="words"))
    rows = [row for path in ("curve", "vehicle", "contact") for row in rows_of_keys(lookup(job, path), path)]
    rows = [row for row in rows if not placed_creepage(job, row)]
    analyses = [
        name.replace("_", " ") for name, inner in (lookup(job, "analyses", {}) or {}).items() if inner is not None
    ]
    rows.append(("analyses", ", ".join(analyses)))
    limit = lookup(job, "analyses.stability.max_frequency") or lookup(job, "analyses.modes.max_frequency")
    if isinstance(limit, (int, float)):
        rows.append(("modes up to", f"{limit:g} Hz"))
    parts += ["<h3>Contact, vehicle and analyses</h3>", table(("", ""), rows, kind="words")]
    return parts


def bodies_table(result: Result) -> list[Row]:
    """Rows of quantities, with a cell for each body."""
    cells: dict[str, dict[str, str]] = {}
    said = damping_in_words(result)
    for body in BODIES.values():
        about = lookup(result.job, f"bodies.{body}")
        if not isinstance(about, dict):
            continue
        for name, text in body_rows(body, about):
            cells.setdefault(name, {})[body] = text
        if body in said:
            # The program has said the damping that it took, defaults included.
            for name in [n for n in cells if n.startswith(("loss factors", "Rayleigh"))]:
                cells[name].pop(body, None)
            cells.setdefault("damping", {})[body] = said[body]
    return [
        (name, *(texts.get(b, "") for b in BODIES.values())) for name, texts in cells.items() if any(texts.values())
    ]


def damping_in_words(result: Result) -> dict[str, str]:
    """Damping of each body as the program has said it: `damping of upper: loss factors …`."""
    made = {}
    for line in Provenance.from_result(result).damping:
        head, _, text = line.partition(": ")
        made.update({body: text for body in BODIES.values() if text and head.split()[-1] == body})
    return made


def body_rows(body: str, about: dict[str, Any]) -> list[tuple[str, str]]:
    """Names and texts of all that the job says of a body, its section or mesh and its profile first."""
    rows: list[tuple[str, str]] = []
    mesh = about.get("mesh")
    if isinstance(mesh, dict) and mesh:
        kind, inner = next(iter(mesh.items()))
        named = inner.get("section") if isinstance(inner, dict) else None
        label = words(named) if isinstance(named, str) else (" ".join(named) if isinstance(named, dict) else "")
        path = inner.get("path") if isinstance(inner, dict) else inner
        rows.append(
            ("body", f"{SECTIONS.get(kind, kind)} {label or (path if kind == 'file' and path else '')}".strip())
        )
    elif "matrices" in about:
        rows.append(("body", "matrices from files"))
    elif about.get("profile") is not None:
        rows.append(("body", "elastic half-space without modes"))
    if about.get("profile") is not None:
        rows.append(("running profile", words(about["profile"])))
    # A short rail of 14 m and its ends are of the model, the pads of the track.
    for path, value in leaves({k: v for k, v in about.items() if k != "profile"}, f"bodies.{body}"):
        key = plain(path)
        if key.endswith((".section", ".transform")) or (
            isinstance(value, (int, float)) and value == 0 and "damping" in key
        ):
            continue
        if key.endswith("rotation"):
            rows.append(("rotation", words(value) if isinstance(value, str) else f"{value:g} rad/s"))
        elif key.endswith("fixed"):
            rows.append(("clamped groups", words(value)))
        else:
            found = named_quantity(path)
            rows.append((found.axis.split(" / ")[0], found.text(value)))
    return rows


def named_quantity(path: str) -> Quantity:
    """The quantity of a key without the name of its body, with the number of an entry of a list."""
    found = quantity(path, bodies=None)
    index = next((part for part in path.split(".") if part.isdigit()), "")
    return Quantity(f"{found.name}, {index}", found.symbol, found.unit, found.factor) if index else found


def rows_of_keys(about: Any, path: str) -> list[Row]:
    """Names and values with units of a part of the job; objects of friction laws stay one value."""
    if about is None:
        return []
    if not isinstance(about, dict):
        return [(path.replace("_", " "), words(about))]
    rows: list[Row] = []
    for key, value in about.items():
        inner = f"{path}.{key}"
        if key in ("points",) and isinstance(value, list):
            rows.append(("contact points", str(len(value))))
        elif key == "friction" and isinstance(value, dict):
            rows.append(("coefficient of friction μ", words(value)))
        else:
            for place, leaf in leaves(value, inner):
                found = named_quantity(place)
                rows.append((found.axis.split(" / ")[0], found.text(leaf)))
    return rows


def placed_creepage(job: dict[str, Any], row: Row) -> bool:
    """True of creepages that follow from a placement or a curve: those are among the figures."""
    placed = lookup(job, "contact.placement") or lookup(job, "contact.from")
    return bool(placed) and str(row[0]).startswith(("longitudinal creepage", "lateral creepage", "spin"))
