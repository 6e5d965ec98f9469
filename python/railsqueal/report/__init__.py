"""A report: one HTML file that needs nothing else, and tables as CSV beside it and in it."""

import json
from collections.abc import Sequence
from html import escape
from itertools import groupby
from pathlib import Path

from .. import figures
from ..errors import WRITING, ResultError
from ..measured import NONE, Measurements
from ..result import Result, lookup
from ..tables import Provenance
from ..verdict import verdict
from . import branches, curving, player, setup, shapes, stability, sweeps, uncertainty
from . import measured as measured_receptances
from .csv_tables import csv_tables, save
from .markup import CAPTIONS, WEB, Row, download, pictures, table

__all__ = ["CAPTIONS", "csv_tables", "page", "write"]
# Largest size of a page, bytes: mail and browsers take it.
LARGEST = 14_500_000
# Pictures that stand in sections of their own.
CURVING = ("curving-bogie", "curving-contacts", "curving-radius")
ELSEWHERE = (*CURVING, *sweeps.PICTURES, *branches.PICTURES, *uncertainty.PICTURES, "growth-budget", "sound-power")
# Anchors of sections and their names in the list of contents.
CONTENTS = (
    ("setup", "what was computed"),
    ("shapes", "modes in motion"),
    ("stability", "stability, budget and cures"),
    ("sweep", "sweep"),
    ("branches", "limit cycles as solutions"),
    ("uncertainty", "probability of squeal"),
    ("sound", "sound"),
    ("curving", "curving"),
    ("modes", "free modes"),
    ("pictures", "pictures"),
    ("measured", "measured receptances"),
    ("figures", "figures"),
    ("tables", "tables"),
    ("provenance", "provenance"),
)
# Names of the CSV tables for readers.
TABLES = {
    "figures": "figures",
    "modes": "free modes",
    "eigenvalues": "all eigenvalues with growth rates",
    "unstable": "unstable eigenvalues",
    "budget": "growth-rate budget",
    "balance": "energy balance",
    "sensitivities": "sensitivities and cures",
    "forces": "contact forces",
    "creep-curve": "creep curve",
    "curving": "places of contact in the curve",
    "curving-radii": "wheels over the radius",
    "receptance": "receptances",
    "track-decay": "track decay rates",
    "sweep": "points of the sweep",
    "sweep-eigenvalues": "eigenvalues of all points of the sweep",
    "limit-cycles": "limit cycles",
    "uncertainty": "samples of the uncertain inputs",
    "uncertainty-modes": "probabilities and growth rates by mode",
    "uncertainty-indices": "Sobol' indices",
    "uncertainty-cycles": "limit cycles of samples",
    "transient": "motion in time",
    "sound-power": "sound power in third octaves",
    "times": "times by stage",
}


def write(result: Result, directory: Path, measured: Measurements = NONE) -> list[Path]:
    """Writes `STEM-report.html` and the CSV tables; their paths, the report first."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        tables = [save(directory / f"{result.stem}-{name}.csv", head, rows) for name, head, rows in csv_tables(result)]
        path = directory / f"{result.stem}-report.html"
        path.write_text(page(result, tables, measured), encoding="utf-8")
    except OSError as error:
        raise ResultError(f"cannot write to {directory}: {error}", WRITING) from error
    return [path, *tables]


def page(result: Result, tables: Sequence[Path], measured: Measurements = NONE) -> str:
    """The report as HTML; receptances and decay rates with `measured` ones beside them."""
    origin = Provenance.from_result(result)
    title = str(lookup(result.job, "title") or result.stem)
    drawn = pictures(result, measured)
    sections = stability.section(result, drawn)
    sections += uncertainty.section(result, drawn)
    sections += sweeps.section(result, drawn) + branches.section(result, drawn) + player.section(result, drawn)
    sections += curving.section(result, [text for name, text in drawn.items() if name in CURVING])
    sections += stability.modes_section(result)
    others = [text for name, text in drawn.items() if name not in ELSEWHERE]
    if others or not drawn:
        sections += ['<h2 id="pictures">Pictures</h2>', *(others or ["<p>The result has nothing to draw.</p>"])]
    sections += measured_receptances.section(result, measured.receptances)
    sections.append('<h2 id="figures">Figures</h2>')
    for group, members in groupby(figures.figures_of_result(result), key=lambda f: f.group):
        sections += [f"<h3>{escape(group)}</h3>", table(("", ""), [(f.name, f.text) for f in members])]
    if tables:
        stem = f"{result.stem}-"
        names = {path: path.stem.removeprefix(stem) for path in tables}
        links = [f"<li>{download(path, TABLES.get(name, name))}</li>" for path, name in names.items()]
        sections.append(f'<h2 id="tables">Tables as CSV</h2><ul class="download">{"".join(links)}</ul>')
    sections += ['<h2 id="provenance">Where it comes from</h2>', provenance(origin)]
    job = escape(json.dumps(result.job, indent=2, ensure_ascii=False))
    sections.append(f"<details><summary>The resolved job; it can be run again</summary><pre>{job}</pre></details>")
    first = setup.section(result)
    # The modes get what room the other parts leave.
    room = LARGEST - sum(len(part.encode()) for part in (*first, *sections))
    sections = [*first, *shapes.section(result, room), *sections]
    body = "\n".join([*opening(result, origin, title), contents(sections), *sections])
    style = (WEB / "report.css").read_text(encoding="utf-8")
    head = '<meta charset="utf-8"><meta name="viewport" content="width=device-width">'
    head += f"<title>{escape(title)}</title><style>{style}</style>"
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}\n</body></html>\n'


def opening(result: Result, origin: Provenance, title: str) -> list[str]:
    """Title, verdict and warnings."""
    said = verdict(result)
    notes = "".join(f'<p class="note">{escape(note)}</p>' for note in said.notes)
    parts = [
        f"<h1>{escape(title)}</h1>",
        f'<div class="verdict {said.kind}"><p>{escape(said.sentence)}</p>{notes}</div>',
    ]
    if result.stopped:
        parts.append('<p class="warning">The run was stopped before its end: this is what it has computed so far.</p>')
    parts.append(
        f'<p class="note">{escape(result.path.name)}{", computed " + escape(origin.date) if origin.date else ""}</p>'
    )
    return parts + [f'<p class="warning">{escape(text)}</p>' for text in origin.warnings]


def contents(sections: Sequence[str]) -> str:
    """Links to the sections that are there."""
    there = "\n".join(part[:400] for part in sections)
    links = [f'<a href="#{anchor}">{name}</a>' for anchor, name in CONTENTS if f'id="{anchor}"' in there]
    return f"<nav>{''.join(links)}</nav>"


def provenance(origin: Provenance) -> str:
    """Command, versions, inputs, and times by stage with their sum."""
    rows: list[Row] = [("command", " ".join(origin.command)), ("ranks", origin.ranks or "")]
    rows += list(origin.versions.items())
    rows += [(f"input {name}", f"SHA-256 {digest}") for name, digest in origin.inputs.items()]
    return table(("", ""), [row for row in rows if row[1] != ""], kind="words") + times(origin.stages)


def times(stages: dict[str, float]) -> str:
    """Wall time of each stage and its share; the last row is their sum."""
    total = sum(stages.values())
    if not stages or total <= 0:
        return ""
    lines = []
    for name, seconds in stages.items():
        share = seconds / total
        bar = f'<span class="bar" style="width: {8 * share:.2f}rem"></span>'
        lines.append(f"<tr><td>{escape(name)}</td><td>{seconds:.2f}</td><td>{100 * share:.1f}</td><td>{bar}</td></tr>")
    lines.append(f'<tr class="sum"><td>all stages</td><td>{total:.2f}</td><td>100.0</td><td></td></tr>')
    head = "<tr><th>stage</th><th>wall time, s</th><th>share, %</th><th></th></tr>"
    return f"<h3>Times by stage</h3><table>{head}{''.join(lines)}</table>"
