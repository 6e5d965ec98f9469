"""Section of the report with the sound of a transient."""

import base64
import tempfile
from html import escape
from pathlib import Path

from .. import sound
from ..errors import ResultError
from ..labels import body_words
from ..result import Result
from ..tables import BODIES, History
from .markup import table

# Longest sound in the page, s; of a longer one this is the end.
LONGEST = 20.0


def section(result: Result, drawn: dict[str, str]) -> list[str]:
    """A player for each body with sound power, or for the first point; levels in third octaves."""
    if not History.present(result):
        return []
    points = History.from_result(result).points[:1]
    bodies = [b for b in BODIES.values() if f"transient/sound_power/{b}/mode_resistance" in result]
    parts, missing = [], []
    for name in bodies or points:
        try:
            data, said = recording(result, name)
        except ResultError as error:
            missing.append(str(error))
            continue
        source = f"data:audio/wav;base64,{base64.b64encode(data).decode()}"
        parts.append(f'<figure><audio controls src="{source}"></audio><figcaption>{escape(said)}</figcaption></figure>')
    path, names = "transient/sound_power", body_words(result.job)
    levels = [
        (names[b], *(f"{result.number(f'{path}/{b}/{name}'):.1f}" for name in ("total_level", "total_level_a")))
        for b in BODIES.values()
        if f"{path}/{b}/total_level_a" in result
    ]
    if levels:
        parts.append(table(("body", "sound power level, dB re 1 pW", "A-weighted, dB(A)"), levels))
    parts += [f'<p class="note">{escape(text)}</p>' for text in missing] if parts else []
    if "sound-power" in drawn:
        parts.append(drawn["sound-power"])
    return ['<h2 id="sound">Sound</h2>', *parts] if parts else []


def recording(result: Result, name: str) -> tuple[bytes, str]:
    """The sound file of a body or point, at most `LONGEST` seconds, and its caption."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sound.wav"
        said = sound.write(result, name, path, LONGEST)
        said = said.replace(f"{path}: ", "").replace("\n", "; ")
        for body, word in body_words(result.job).items():
            said = said.replace(
                f"{body} body at", f"modes of the {word}, heard at" if word != f"{body} body" else f"{body} body at"
            )
        return path.read_bytes(), said
