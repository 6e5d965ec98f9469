"""Section of the report on measured receptances beside the computed ones."""

from html import escape

from ..labels import body_words
from ..measured.overlay import Overlay
from ..result import Result
from .markup import table


def section(result: Result, overlay: Overlay | None) -> list[str]:
    """A table of the measured receptances with their levels over the computed ones."""
    if overlay is None:
        return []
    head = (
        "body",
        "direction",
        "dataset",
        "measured as",
        "nodes",
        "frequencies, Hz",
        "level over the computed one, dB",
    )
    names = body_words(result.job)
    rows = [(names.get(row[0], row[0]), *row[1:]) for row in overlay.rows(result)]
    said = f"From {overlay.path.name}, in the frame of the job; levels are 20 lg of the ratio of amplitudes, mean and "
    said += "standard deviation over the measured frequencies that the result covers."
    if overlay.left:
        said += f" {overlay.left} frequency responses of other nodes are left out."
    return ['<h2 id="measured">Measured receptances</h2>', f"<p>{escape(said)}</p>", table(head, rows)]
