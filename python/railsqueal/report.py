"""A report: one HTML file that needs nothing else, and tables as CSV beside it."""

import base64
import csv
import json
import tempfile
from collections.abc import Iterable, Sequence
from html import escape
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from . import figures
from .curving import AXLES, WHEELS, Curving, CurvingRadii
from .errors import WRITING, ResultError
from .result import Result, lookup
from .tables import BODIES, ComplexModes, ContactGrid, CreepCurve, Modes, Provenance, Receptances, Sweep

Row = Sequence[Any]
# Rows of a table in the report; the CSV has all.
ROWS = 30
# Pictures of the section on curving.
CURVING = ("curving-bogie", "curving-contacts", "curving-radius")
# Dots per inch of the pictures in it.
RESOLUTION = 110
STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #1a1a1a; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2.2rem; border-bottom: 1px solid #ccc; }
table { border-collapse: collapse; margin: .6rem 0; } th, td { padding: .15rem .7rem; text-align: right; border-bottom: 1px solid #e4e4e4; }
th { font-weight: 600; } th:first-child, td:first-child { text-align: left; } tr.unstable td { color: #b03a00; font-weight: 600; }
figure { margin: 1.2rem 0; } figure img { max-width: 100%; } figcaption { color: #666; }
.warning { background: #fff3e6; border-left: 4px solid #D55E00; padding: .5rem .8rem; margin: .5rem 0; }
pre { background: #f5f5f5; padding: .8rem; overflow-x: auto; font-size: 13px; } code { overflow-wrap: anywhere; }
"""
CAPTIONS = {
    "contact-line": "Pressure and traction along y = 0",
    "contact-map": "Stick and slip, traction and pressure",
    "modes-lower": "Modes of the lower body",
    "modes-upper": "Modes of the upper body",
    "complex-modes": "Complex modes over half a period",
    "campbell": "Campbell diagram",
    "receptance": "Receptances of the contact point",
    "sweep-map": "Stability map",
    "sweep-loci": "Root loci",
    "limit-cycles": "Limit cycles",
    "limit-cycles-map": "Energy of the limit cycles",
    "curving-bogie": "The bogie in the curve, from above",
    "curving-contacts": "Places of contact",
    "curving-radius": "The wheels over the radius of the curve",
    "placement": "Wheel on rail",
    "creep-curve": "Creep curve",
    "growth": "Growth",
    "spectrogram": "Spectrogram, and spectrum of the last quarter",
    "cycle": "Stick and slip over the last period",
    "loops": "Friction over creep and normal force",
    "sound-power": "Sound power",
}
# Columns of the tables of steady curving as CSV.
CURVING_HEADS = (
    *("wheel", "wheel_y_m", "rail_y_m", "contact_angle_rad", "rolling_radius_m", "normal_force_N"),
    *("creepage_longitudinal", "creepage_lateral", "spin_1/m", "creep_force_forwards_N", "creep_force_tangent_N"),
    *("force_forwards_N", "force_right_N", "force_down_N", "friction", "utilisation"),
)
# Columns of the table in the report: column of the CSV, head, factor, format.
CURVING_COLUMNS = (
    ("wheel_y_m", "place on the wheel, mm", 1e3, "{:+.2f}"),
    ("contact_angle_rad", "contact angle, °", 180 / np.pi, "{:+.2f}"),
    ("rolling_radius_m", "rolling radius, mm", 1e3, "{:.2f}"),
    ("normal_force_N", "normal force, kN", 1e-3, "{:.2f}"),
    ("creepage_longitudinal", "longitudinal creepage, %", 100, "{:+.4f}"),
    ("creepage_lateral", "lateral creepage, %", 100, "{:+.4f}"),
    ("spin_1/m", "spin, 1/m", 1, "{:+.4f}"),
    ("creep_force_forwards_N", "creep force forwards, kN", 1e-3, "{:+.2f}"),
    ("creep_force_tangent_N", "creep force along the tangent, kN", 1e-3, "{:+.2f}"),
    ("force_right_N", "lateral force, kN", 1e-3, "{:+.2f}"),
    ("friction", "friction", 1, "{:.3f}"),
    ("utilisation", "utilisation", 1, "{:.3f}"),
)
RADII_HEADS = (
    *("radius_m", "wheel", "places", "axle_shift_m", "axle_yaw_rad"),
    *("contact_angle_rad", "rolling_radius_m", "normal_force_N"),
    *("creepage_longitudinal", "creepage_lateral", "spin_1/m"),
    *("force_forwards_N", "force_right_N", "force_down_N", "utilisation", "message"),
)


def write(result: Result, directory: Path) -> list[Path]:
    """Writes `STEM-report.html` and the CSV tables; their paths, the report first."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        tables = [save(directory / f"{result.stem}-{name}.csv", head, rows) for name, head, rows in csv_tables(result)]
        path = directory / f"{result.stem}-report.html"
        path.write_text(page(result, tables), encoding="utf-8")
    except OSError as error:
        raise ResultError(f"cannot write to {directory}: {error}", WRITING) from error
    return [path, *tables]


def save(path: Path, head: Row, rows: Iterable[Row]) -> Path:
    """A CSV file; numbers in full precision."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(head)
        writer.writerows([[repr(float(c)) if isinstance(c, (float, np.floating)) else c for c in row] for row in rows])
    return path


# ---- Tables ----


def csv_tables(result: Result) -> list[tuple[str, Row, list[Row]]]:
    """Name, head and rows of each table that the result has."""
    made: list[tuple[str, Row, list[Row]]] = []
    if Modes.bodies(result):
        made.append(("modes", ("body", "mode", "frequency_Hz", "residual", "nodal_diameters"), mode_rows(result)))
    if ComplexModes.present(result):
        head = ("place", "frequency_Hz", "growth_rate_1/s", "damping_ratio", "source", "made_of")
        made.append(("unstable", head, complex_rows(ComplexModes.of(result), unstable=True)))
    forces = force_rows(result)
    if forces:
        made.append(("forces", ("analysis", "point", "force_x_N", "force_y_N", "force_z_N"), forces))
    if Curving.present(result):
        made.append(("curving", CURVING_HEADS, curving_rows(Curving.of(result))))
    if CurvingRadii.present(result):
        made.append(("curving-radii", RADII_HEADS, radii_rows(CurvingRadii.of(result))))
    if Receptances.present(result):
        receptances = Receptances.of(result)
        entries = [f"{body}_{a}{b}" for body in receptances.bodies for a in "xyn" for b in "xyn"]
        heads = ["frequency_Hz", *(f"{entry}_{part}_m/N" for entry in entries for part in ("re", "im"))]
        made.append(("receptance", heads, receptance_rows(receptances)))
    return made


def mode_rows(result: Result) -> list[Row]:
    """Free modes of the bodies."""
    rows: list[Row] = []
    for body in Modes.bodies(result):
        table = Modes.of(result, body)
        diameters = table.diameters if table.diameters is not None else [""] * len(table.frequency)
        rows += [(body, k + 1, f, r, d) for k, (f, r, d) in enumerate(zip(table.frequency, table.residual, diameters))]
    return rows


def complex_rows(table: ComplexModes, unstable: bool) -> list[Row]:
    """Eigenvalues: the unstable ones, or all."""
    places = table.unstable if unstable else range(len(table.eigenvalue))
    columns = (table.frequency, table.growth_rate, table.damping_ratio, table.source)
    return [(int(k), *(column[k] for column in columns), table.made_of(int(k))) for k in places]


def force_rows(result: Result) -> list[Row]:
    """Contact forces on body 1 of each analysis; of a transient the mean over the last quarter."""
    rows: list[Row] = []
    if ContactGrid.present(result):
        rows.append(("steady", "", *result.array("contact/force")))
    if "stability/force" in result:
        rows.append(("stability", "", *result.array("stability/force")))
    if CreepCurve.present(result):
        curve = CreepCurve.of(result)
        rows += [("creep_curve", f"{curve.key} {c!r}", *f) for c, f in zip(curve.creepage.tolist(), curve.force)]
    if Sweep.present(result) and "sweep/force" in result:
        sweep = Sweep.of(result)
        names = [", ".join(f"{key} {sweep.values[key][k]}" for key in sweep.keys) for k in range(len(sweep.status))]
        rows += [("sweep", name, *f) for name, f in zip(names, result.array("sweep/force"))]
    if "transient/force" in result:
        force = result.array("transient/force")
        rows.append(("transient", "mean of the last quarter", *force[3 * len(force) // 4 :].mean(axis=0)))
    return rows


def curving_rows(table: Curving) -> list[Row]:
    """Places of contact of a bogie in a curve, wheel by wheel, the one that carries most first."""
    order = [int(place) for wheel in range(len(WHEELS)) for place in table.places(wheel)]
    geometry = (table.wheel_y, table.rail_y, table.contact_angle, table.rolling_radius)
    forces = (*table.creep_force.T, *table.force.T)
    columns = (*geometry, table.normal_force, *table.creepage.T, *forces, table.friction, table.utilisation)
    return [(WHEELS[table.wheel[k]], *(float(column[k]) for column in columns)) for k in order]


def radii_rows(table: CurvingRadii) -> list[Row]:
    """Equilibria over the radius: a row for each wheel of each curve."""
    rows: list[Row] = []
    for k, radius in enumerate(table.radius):
        for wheel, name in enumerate(WHEELS):
            geometry = (table.contact_angle, table.rolling_radius, table.normal_force)
            used = table.utilisation[k, wheel]
            at = (*(n[k, wheel] for n in geometry), *table.creepage[k, wheel], *table.force[k, wheel], used)
            axle = (table.shift[k, wheel // 2], table.yaw[k, wheel // 2])
            rows.append((float(radius), name, int(table.places[k, wheel]), *map(float, (*axle, *at)), table.message[k]))
    return rows


def receptance_rows(table: Receptances) -> list[Row]:
    """Receptances, real and imaginary parts."""
    parts = [np.stack([h.real, h.imag], axis=-1).reshape(len(h), -1) for h in table.bodies.values()]
    return [list(map(float, row)) for row in np.column_stack([table.frequency, *parts])]


# ---- The page ----


def page(result: Result, tables: list[Path]) -> str:
    """The report as HTML."""
    origin = Provenance.of(result)
    title = str(lookup(result.job, "title") or result.stem)
    parts = [f"<h1>{escape(title)}</h1>", f"<p>{escape(result.path.name)}{', computed ' + escape(origin.date) if origin.date else ''}</p>"]
    if result.stopped:
        parts.append('<p class="warning">The run was stopped before its end: this is what it has computed so far.</p>')
    parts += [f'<p class="warning">{escape(text)}</p>' for text in origin.warnings]
    parts += ["<h2>What was computed</h2>", table(("", ""), [*computed(result.job), *damped(origin)])]
    parts.append("<h2>Figures</h2>")
    for group, members in groupby(figures.of(result), key=lambda f: f.group):
        parts += [f"<h3>{escape(group)}</h3>", table(("", ""), [(f.name, f.text) for f in members])]
    drawn = pictures(result)
    parts += section_curving(result, [text for name, text in drawn.items() if name in CURVING])
    parts += section_stability(result) + section_modes(result) + section_sweep(result)
    others = [text for name, text in drawn.items() if name not in CURVING]
    if others or not drawn:
        parts += ["<h2>Pictures</h2>", *(others or ["<p>The result has nothing to draw.</p>"])]
    if tables:
        names = ", ".join(f'<a href="{escape(p.name)}">{escape(p.name)}</a>' for p in tables)
        parts.append(f"<h2>Tables beside this file</h2><p>{names}</p>")
    parts += ["<h2>Where it comes from</h2>", provenance(origin)]
    job = escape(json.dumps(result.job, indent=2, ensure_ascii=False))
    parts.append(f"<details><summary>The resolved job; it can be run again</summary><pre>{job}</pre></details>")
    body = "\n".join(parts)
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{STYLE}</style>'
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}\n</body></html>\n'


def table(head: Row, rows: Sequence[Row], marked: Sequence[bool] = ()) -> str:
    """A table of HTML; marked rows stand out."""
    lines = ["<table>"]
    if any(head):
        lines.append("<tr>" + "".join(f"<th>{escape(str(cell))}</th>" for cell in head) + "</tr>")
    for k, row in enumerate(rows):
        kind = ' class="unstable"' if k < len(marked) and marked[k] else ""
        lines.append(f"<tr{kind}>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>")
    return "\n".join([*lines, "</table>"])


def computed(job: dict[str, Any]) -> list[Row]:
    """The job in a few lines."""
    rows: list[Row] = []
    for body in BODIES.values():
        given = lookup(job, f"bodies.{body}")
        if isinstance(given, dict):
            rows.append((f"{body} body", made_of(given)))
    contact = lookup(job, "contact", {})
    if isinstance(contact, dict):
        for name, value in contact.items():
            # The creepages of a wheel on a rail follow from its placement and are among the figures.
            if name not in ("points", "patch") and not (name == "creepage" and contact.get("placement")):
                rows.append((f"contact: {name.replace('_', ' ')}", value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)))
    analyses = [name for name, given in (lookup(job, "analyses", {}) or {}).items() if given is not None]
    rows.append(("analyses", ", ".join(name.replace("_", " ") for name in analyses)))
    return rows


def damped(origin: Provenance) -> list[Row]:
    """The damping of each body, as the summary of the run told it."""
    return [tuple(line.split(": ", 1)) for line in origin.damping if ": " in line]


def made_of(body: dict[str, Any]) -> str:
    """A body in words."""
    words = []
    for name in ("mesh", "matrices", "profile", "rigid"):
        given = body.get(name)
        if isinstance(given, dict):
            kind, inner = next(iter(given.items()), (name, ""))
            size = numbers(inner) if isinstance(inner, dict) else str(inner)
            words.append(f"{name}: {kind}{' (' + size + ')' if size else ''}")
        elif given is not None:
            words.append(f"{name}: {given}")
    material = body.get("material")
    if isinstance(material, dict):
        words.append(numbers(material))
    if body.get("rotation"):
        words.append(f"rotation: {body['rotation']}")
    return "; ".join(words)


def numbers(given: dict[str, Any]) -> str:
    """The numbers of a part of the job, by name."""
    return ", ".join(f"{name.replace('_', ' ')} {value:g}" for name, value in given.items() if isinstance(value, (int, float)))


def cut(rows: Sequence[Row]) -> tuple[Sequence[Row], str]:
    """The first rows, and what to say of the others."""
    return rows[:ROWS], f"<p>{len(rows) - ROWS} more are in the result file.</p>" if len(rows) > ROWS else ""


def section_curving(result: Result, drawn: list[str]) -> list[str]:
    """Axles and places of contact of a bogie in a curve, radii without equilibrium, and the pictures of both."""
    if not Curving.present(result):
        return []
    curving = Curving.of(result)
    left = f"residual {curving.residual:.1e}, relative to the load of an axle"
    parts = ["<h2>Curving</h2>", f"<p>{escape(curving.curve())}; {left}.</p>"]
    columns = (AXLES, curving.shift, curving.yaw, curving.angular_speed)
    axles = [(name, f"{1e3 * y:+.3f}", f"{1e3 * yaw:+.3f}", f"{speed:.4f}") for name, y, yaw, speed in zip(*columns)]
    heads = ("axle", "shift to the right, mm", "angle of attack to the right, mrad", "rotation, rad/s")
    parts.append(table(heads, axles))
    rows = []
    for wheel, *values in curving_rows(curving):
        given = dict(zip(CURVING_HEADS[1:], values))
        rows.append((wheel, *(form.format(factor * given[name]) for name, _, factor, form in CURVING_COLUMNS)))
    parts.append(table(("wheel", *(head for _, head, *_ in CURVING_COLUMNS)), rows))
    if CurvingRadii.present(result):
        radii = CurvingRadii.of(result)
        if len(radii.failed):
            failed, more = cut([(f"{radii.radius[k]:g}", radii.message[k]) for k in radii.failed])
            parts += ["<h3>Radii without equilibrium</h3>", table(("radius, m", "reason"), failed), more]
    return parts + drawn


def section_stability(result: Result) -> list[str]:
    """The eigenvalues."""
    if not ComplexModes.present(result):
        return []
    modes = ComplexModes.of(result)
    every, more = cut(complex_rows(modes, unstable=False))
    rows = [(f"{f:.2f}", f"{g:+.4f}", f"{100 * d:+.4f} %", s, m) for _, f, g, d, s, m in every]
    head = ("frequency, Hz", "growth rate, 1/s", "damping ratio", "source", "made of")
    source = np.array(modes.source)
    counted = [f"{modes.grows[source == s].sum()} unstable of {(source == s).sum()} eigenvalues of the {s} model" for s in dict.fromkeys(modes.source)]
    said = f"<p>{'; '.join(counted)}.</p>"
    return ["<h2>Stability</h2>", said, table(head, rows, list(modes.grows[: len(every)])), more]


def section_modes(result: Result) -> list[str]:
    """The free modes."""
    if not Modes.bodies(result):
        return []
    rows, more = cut(mode_rows(result))
    diameters = any(row[4] != "" for row in rows)
    shown = [(b, k, f"{f:.3f}", f"{r:.1e}", *([f"{d:.0f}" if d != "" else ""] if diameters else [])) for b, k, f, r, d in rows]
    return ["<h2>Modes</h2>", table(("body", "mode", "frequency, Hz", "residual", *(["nodal diameters"] if diameters else [])), shown), more]


def section_sweep(result: Result) -> list[str]:
    """Points of a sweep that failed, with their reasons."""
    if not Sweep.present(result):
        return []
    sweep = Sweep.of(result)
    failed = [k for k in range(len(sweep.status)) if sweep.status[k] != 0]
    if not failed:
        return []
    rows, more = cut([(*(sweep.values[key][k] for key in sweep.keys), sweep.message[k] if k < len(sweep.message) else "") for k in failed])
    return ["<h2>Points of the sweep that failed</h2>", table((*sweep.keys, "what went wrong"), rows), more]


def pictures(result: Result) -> dict[str, str]:
    """All pictures as parts of the page, by their names."""
    from .pictures import Canvas, draw  # matplotlib takes a second, which the other commands need not wait

    parts: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as folder:
        canvas = Canvas(Path(folder), result.stem, resolution=RESOLUTION)
        for path in draw(result, canvas):
            if path.suffix == ".png":
                name = path.stem.removeprefix(f"{result.stem}-")
                caption = escape(CAPTIONS.get(name, name))
                data = base64.b64encode(path.read_bytes()).decode()
                image = f'<img alt="{caption}" src="data:image/png;base64,{data}">'
                parts[name] = f"<figure>{image}<figcaption>{caption}</figcaption></figure>"
    return parts


def provenance(origin: Provenance) -> str:
    """Command, versions, inputs and times."""
    rows: list[Row] = [("command", " ".join(origin.command)), ("ranks", origin.ranks or "")]
    rows += list(origin.versions.items())
    rows += [(f"input {name}", f"SHA-256 {digest}") for name, digest in origin.inputs.items()]
    rows += [(f"time: {name}", f"{seconds:.1f} s") for name, seconds in origin.stages.items()]
    return table(("", ""), [row for row in rows if row[1] != ""])
