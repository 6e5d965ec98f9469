"""Pieces of HTML: tables, pictures, downloads, and the style of the page."""

import base64
import re
import tempfile
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from ..result import Result

Row = Sequence[Any]
# Rows of a table on the page; the CSV has all.
ROWS = 30
# Dots per inch of the pictures on the page.
RESOLUTION = 110
# CSV files up to this many bytes are in the page as well; larger ones are only beside it.
EMBEDDED = 300_000
STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #1a1a1a; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2.2rem; border-bottom: 1px solid #ccc; } h3 { font-size: 1rem; }
table { border-collapse: collapse; margin: .6rem 0; }
th, td { padding: .15rem .7rem; text-align: right; border-bottom: 1px solid #e4e4e4; vertical-align: top; }
th { font-weight: 600; } th:first-child, td:first-child { text-align: left; } table.words td, table.words th, td.word, th.word { text-align: left; }
tr.unstable td { color: #b03a00; font-weight: 600; } tr.sum td { font-weight: 600; border-top: 1px solid #888; }
.wide { overflow-x: auto; }
figure { margin: 1.2rem 0; } figure img { max-width: 100%; } figcaption { color: #666; }
.verdict { font-size: 1.1rem; border-left: 6px solid #0072B2; background: #eef6fb; padding: .7rem 1rem; margin: 1rem 0; }
.verdict.squeal, .verdict.relaxation { border-color: #D55E00; background: #fff3e6; }
.verdict.none { border-color: #888; background: #f4f4f4; } .verdict p { margin: .2rem 0; } .verdict .note { font-size: .95rem; }
nav { font-size: .92rem; } nav a { margin-right: 1rem; white-space: nowrap; }
.warning { background: #fff3e6; border-left: 4px solid #D55E00; padding: .5rem .8rem; margin: .5rem 0; }
.note { color: #555; } .download { font-size: .9rem; }
.bar { display: inline-block; height: .7em; background: #0072B2; }
pre { background: #f5f5f5; padding: .8rem; overflow-x: auto; font-size: 13px; } code { overflow-wrap: anywhere; }
.controls { display: flex; flex-wrap: wrap; gap: .4rem 1rem; align-items: center; margin-bottom: .4rem; }
.controls select { max-width: 30rem; } .controls input { vertical-align: middle; width: 7rem; }
.stage { position: relative; height: 30rem; border: 1px solid #ddd; } .stage canvas { width: 100%; height: 100%; display: block; }
.stage svg { position: absolute; left: .4rem; bottom: .4rem; width: 5.6rem; height: 5.6rem; pointer-events: none; }
.scale { height: .6rem; max-width: 26rem; } .ends { display: flex; justify-content: space-between; max-width: 26rem; color: #666; font-size: .85rem; }
audio { width: 100%; max-width: 32rem; }
@media print {
  body { max-width: none; margin: 0; font-size: 11px; } nav, .controls, .download, audio { display: none; }
  figure, tr { break-inside: avoid; } h2, h3 { break-after: avoid; } .stage { height: 22rem; }
  .wide { overflow: visible; } .wide table { font-size: 8px; } .wide th, .wide td { padding: .1rem .25rem; }
  * { -webkit-print-color-adjust: exact; print-color-adjust: exact; }
}
"""
CAPTIONS = {
    "contact-line": "Pressure and traction along y = 0",
    "contact-map": "Stick and slip, traction and pressure",
    "modes-lower": "Modes of the lower body",
    "modes-upper": "Modes of the upper body",
    "complex-modes": "Complex modes over half a period",
    "campbell": "Campbell diagram",
    "growth-budget": "Growth-rate budget",
    "receptance": "Receptances of the contact point",
    "sweep-map": "Stability map",
    "sweep-slices": "Stability maps, one for each combination of the other keys",
    "sweep-parallel": "All points of the sweep in parallel coordinates",
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


def table(head: Row, rows: Sequence[Row], marked: Sequence[bool] = (), kind: str = "") -> str:
    """A table of HTML; marked rows stand out, and columns with words are aligned to the left."""
    lines = [f'<table class="{kind}">' if kind else "<table>"]
    worded = [any(re.search(r"[^\W\d_]{3}", str(cell)) for cell in column) for column in zip(*rows)] or [False] * len(head)

    def cells(row: Row, tag: str) -> str:
        left = (f'<{tag} class="word">' if word and k and not kind else f"<{tag}>" for k, word in enumerate(worded))
        return "".join(f"{opening}{escape(str(cell))}</{tag}>" for opening, cell in zip(left, row))

    if any(head):
        lines.append(f"<tr>{cells(head, 'th')}</tr>")
    for k, row in enumerate(rows):
        mark = ' class="unstable"' if k < len(marked) and marked[k] else ""
        lines.append(f"<tr{mark}>{cells(row, 'td')}</tr>")
    return "\n".join([*lines, "</table>"])


def cut(rows: Sequence[Row]) -> tuple[Sequence[Row], str]:
    """The first rows, and a sentence on the others."""
    return rows[:ROWS], f"<p>{len(rows) - ROWS} more are in the CSV file.</p>" if len(rows) > ROWS else ""


def download(path: Path, label: str) -> str:
    """A link to a CSV table: in the page where it is small, else to the file beside it."""
    name = escape(path.name)
    if path.stat().st_size > EMBEDDED:
        return f'<a href="{name}">{escape(label)} ({name}, beside this file)</a>'
    data = base64.b64encode(path.read_bytes()).decode()
    return f'<a download="{name}" href="data:text/csv;base64,{data}">{escape(label)} ({name})</a>'


def pictures(result: Result) -> dict[str, str]:
    """All pictures as parts of the page, by their names."""
    from ..pictures import Canvas, draw  # matplotlib takes a second, which the other commands need not wait

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


def digits(value: float, form: str) -> str:
    """A number with a true minus sign; empty where it is none."""
    return form.format(value).replace("-", "−") if value == value else ""
