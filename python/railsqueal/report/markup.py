"""Pieces of HTML: tables, pictures, downloads, and the style of the page."""

import base64
import re
import tempfile
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from ..labels import body_words
from ..measured import NONE, Measurements
from ..result import Result

Row = Sequence[Any]
# Rows of a table on the page; the CSV has all.
ROWS = 30
# Dots per inch of the pictures on the page.
RESOLUTION = 110
# Style, viewer and its library.
WEB = Path(__file__).parent / "web"
# CSV files up to this many bytes are in the page as well; larger ones are only beside it.
EMBEDDED = 300_000
CAPTIONS = {
    "contact-line": "Pressure and traction along y = 0",
    "contact-map": "Stick and slip, traction and pressure",
    "modes-lower": "Modes of the lower body",
    "modes-upper": "Modes of the upper body",
    "complex-modes": "Complex modes over half a period",
    "campbell": "Campbell diagram",
    "growth-budget": "Growth-rate budget",
    "receptance": "Receptances of the contact point",
    "track-decay": "Track decay rates",
    "sweep-map": "Stability map",
    "sweep-slices": "Stability maps, one for each combination of the other keys",
    "sweep-parallel": "All points of the sweep in parallel coordinates",
    "sweep-loci": "Root loci",
    "limit-cycles": "Limit cycles",
    "branches": "Branch of limit cycles: stable parts full, unstable ones dashed",
    "limit-cycles-map": "Energy of the limit cycles",
    "uncertainty-probability": "Probability of squeal by mode",
    "uncertainty-growth": "Distribution of growth rates",
    "uncertainty-indices": "Influence of the inputs",
    "uncertainty-scatter": "Samples over the inputs",
    "uncertainty-map": "Probability of squeal where two inputs are known",
    "uncertainty-levels": "Levels of the limit cycles of samples",
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
    worded = [any(re.search(r"[^\W\d_]{3}", str(cell)) for cell in column) for column in zip(*rows)] or [False] * len(
        head
    )

    def cells(row: Row, tag: str) -> str:
        left = (f'<{tag} class="word">' if word and k and not kind else f"<{tag}>" for k, word in enumerate(worded))
        return "".join(f"{opening}{escape(str(cell))}</{tag}>" for opening, cell in zip(left, row))

    if any(head):
        lines.append(f"<thead><tr>{cells(head, 'th')}</tr></thead>")
    lines.append("<tbody>")
    for k, row in enumerate(rows):
        mark = ' class="unstable"' if k < len(marked) and marked[k] else ""
        lines.append(f"<tr{mark}>{cells(row, 'td')}</tr>")
    return "\n".join([*lines, "</tbody></table>"])


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


def pictures(result: Result, measured: Measurements = NONE) -> dict[str, str]:
    """All pictures as parts of the page, by their names; receptances and decay rates with `measured` ones."""
    from ..pictures import Canvas, draw  # matplotlib takes a second, which the other commands need not wait

    parts: dict[str, str] = {}
    names = body_words(result.job)
    with tempfile.TemporaryDirectory() as folder:
        canvas = Canvas(Path(folder), result.stem, resolution=RESOLUTION)
        for path in draw(result, canvas, measured=measured):
            if path.suffix == ".png":
                name = path.stem.removeprefix(f"{result.stem}-")
                # Pictures of further contacts have their number behind the name.
                first, _, number = name.rpartition("-")
                text = f"{CAPTIONS[first]}, contact {number}" if number.isdigit() and first in CAPTIONS else name
                caption = escape(named(CAPTIONS.get(name, text), names))
                data = base64.b64encode(path.read_bytes()).decode()
                image = f'<img alt="{caption}" src="data:image/png;base64,{data}">'
                parts[name] = f"<figure>{image}<figcaption>{caption}</figcaption></figure>"
    return parts


def named(caption: str, names: dict[str, str]) -> str:
    """A caption with the names of the bodies."""
    for body, word in names.items():
        caption = caption.replace(f"{body} body", word)
    return caption


def digits(value: float, form: str) -> str:
    """A number with a true minus sign; empty where it is none."""
    return form.format(value).replace("-", "−") if value == value else ""
