"""Modes as surfaces that turn and move in the page: data of the viewer, and the viewer itself."""

import base64
import json
from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from string import Template
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mesh import Fields
from ..mode_names import ModeNames
from ..pictures.modes import AMPLITUDE, RIGID, Surface
from ..pictures.style import LATERAL, LONGITUDINAL, NORMAL
from ..result import Floats, Result
from ..tables import BODIES, ComplexModes
from ..verdict import hertz, percent, rate
from .markup import WEB

# Free modes of each body that are shown at most, and bytes that all surfaces and motions may take up in the page.
FREE_MODES, BUDGET = 40, 9_000_000
# Colours of the map from no displacement to the largest one.
COLOURS = 17
# Bytes of library, viewer and text beside the data.
OVERHEAD = 700_000


@dataclass(frozen=True)
class Motion:
    """A mode on one of the surfaces: x + a (cos θ real + sin θ later)."""

    surface: int
    group: str
    title: str
    note: str
    real: Floats  # [p, 3], relative to the largest amplitude
    later: Floats | None  # [p, 3], a quarter period later; None of a real mode


@dataclass(frozen=True)
class Shapes:
    """Surfaces and motions that the page shows, and the number of motions that found no room."""

    surfaces: list[Surface]
    motions: list[Motion]
    left_out: int

    @classmethod
    def from_result(cls, result: Result, budget: int = BUDGET) -> "Shapes":
        """Complex modes, the most unstable first, then free modes of each body, up to a number of bytes in the page."""
        surfaces: list[Surface] = []
        motions: list[Motion] = []
        left_out, used = 0, 0
        for motion in (*complex_motions(result, surfaces), *free_motions(result, surfaces)):
            size = cost(
                motion, surfaces[motion.surface] if motion.surface not in {m.surface for m in motions} else None
            )
            if used + size > budget:
                left_out += 1
                continue
            used += size
            motions.append(motion)
        return cls(surfaces, motions, left_out)


def cost(motion: Motion, surface: Surface | None) -> int:
    """Bytes of a motion in the page, with those of its surface where that is not there yet."""
    numbers = 2 * motion.real.size * (1 if motion.later is None else 2)
    if surface is not None:
        numbers += 4 * (surface.points.size + 6 * len(surface.faces))
    return numbers * 4 // 3


def compact(surface: Surface) -> tuple[Surface, NDArray[np.int64]]:
    """The surface with the points of its faces alone, and which these are."""
    used, places = np.unique(surface.faces, return_inverse=True)
    return Surface(surface.points[used], places.reshape(surface.faces.shape)), used


def scaled(real: Floats, later: Floats | None) -> tuple[Floats, Floats | None]:
    """A motion relative to its largest amplitude."""
    square = (real**2).sum(axis=1) + (0 if later is None else (later**2).sum(axis=1))
    largest = float(np.sqrt(square.max(initial=0.0))) or 1.0
    return real / largest, None if later is None else later / largest


def complex_motions(result: Result, surfaces: list[Surface]) -> Iterator[Motion]:
    """Complex modes of `FILE.modes.vtkhdf`."""
    path = result.companion("modes.vtkhdf")
    if not path.exists() or not ComplexModes.present(result):
        return
    table, names = ComplexModes.from_result(result), ModeNames.from_result(result)
    with Fields(path) as fields:
        phase, place = (fields.table(f"modes/{name}") for name in ("phase", "eigenvalue"))
        surface, points = compact(Surface(fields.mesh.points, fields.mesh.surface()).near_contact())
        surfaces.append(surface)
        first = np.flatnonzero(phase == 0)
        for start in first[np.argsort(-table.growth_rate[place[first]], kind="stable")]:
            steps, at = np.flatnonzero(place == place[start]), int(place[start])
            real, later = (
                fields.field("motion", int(k)).astype(float)[points] for k in (steps[0], steps[len(steps) // 4])
            )
            title = f"{hertz(table.frequency[at])}: {names.dominant(table, at) or 'complex mode'}"
            state = "unstable" if table.grows[at] else "stable"
            note = f"{title}; growth rate {rate(table, at)}, damping ratio {percent(table.damping_ratio[at])}, {state}"
            yield Motion(
                len(surfaces) - 1, "Complex modes of steady rolling or sliding", title, note, *scaled(real, later)
            )


def free_motions(result: Result, surfaces: list[Surface]) -> Iterator[Motion]:
    """Free modes of `FILE.free_modes.vtkhdf`, body by body, wheels first."""
    path = result.companion("free_modes.vtkhdf")
    if not path.exists():
        return
    names = ModeNames.from_result(result)
    with Fields(path) as fields:
        frequency, body, number = (fields.table(f"modes/{name}") for name in ("frequency", "body", "number"))
        for which in sorted(np.unique(body), key=lambda b: names.bodies[BODIES[int(b)]] != "wheel"):
            word = BODIES[int(which)]
            surface, points = compact(Surface(fields.mesh.points, fields.mesh.surface(int(which))))
            surfaces.append(surface)
            for step in np.flatnonzero((body == which) & (frequency > RIGID))[:FREE_MODES]:
                known, k = names.free.get(word, []), int(number[step]) - 1
                name = known[k] if 0 <= k < len(known) else f"{names.bodies[word]} mode {number[step]}"
                title = f"{hertz(frequency[step])}: {name}"
                real = fields.field("shape", int(step)).astype(float)[points]
                group = f"Free modes of the {names.bodies[word]}"
                yield Motion(
                    len(surfaces) - 1, group, title, f"{title}; free of contact, undamped", *scaled(real, None)
                )


def packed(values: NDArray[Any], kind: str) -> str:
    """An array of little-endian numbers as text."""
    return base64.b64encode(np.ascontiguousarray(values).astype(kind).tobytes()).decode()


def quantised(values: Floats | None) -> str | None:
    """Displacements between −1 and 1 as 16-bit numbers."""
    return None if values is None else packed(np.round(32767 * np.clip(values, -1, 1)), "<i2")


def triangles(surface: Surface) -> NDArray[np.int64]:
    """Triangles [t, 3] of faces of four corners, of which a triangle repeats the last one."""
    faces = surface.faces
    second = faces[faces[:, 2] != faces[:, 3]]
    return np.concatenate([faces[:, [0, 1, 2]], second[:, [0, 2, 3]]])


def payload(shapes: Shapes, colours: Floats) -> str:
    """The data of the viewer as JSON."""
    kept = sorted({m.surface for m in shapes.motions})
    meshes = []
    for k in kept:
        surface = shapes.surfaces[k]
        numbers = {"points": packed(surface.points, "<f4"), "triangles": packed(triangles(surface), "<u4")}
        meshes.append({**numbers, "size": surface.size})
    motions = [
        {"mesh": kept.index(m.surface), "note": m.note, "re": quantised(m.real), "im": quantised(m.later)}
        for m in shapes.motions
    ]
    return json.dumps({"colours": np.round(colours, 4).tolist(), "meshes": meshes, "motions": motions})


def section(result: Result, room: int) -> list[str]:
    """The viewer with its data and its library in this many bytes; nothing where no shapes were written."""
    import matplotlib.pyplot as plt

    shapes = Shapes.from_result(result, min(BUDGET, room - OVERHEAD))
    if not shapes.motions:
        return []
    colours = np.asarray(plt.get_cmap("viridis")(np.linspace(0, 1, COLOURS)))[:, :3]
    gradient = ", ".join("rgb({:.0f} {:.0f} {:.0f})".format(*(255 * c)) for c in colours)
    options = []
    for group in dict.fromkeys(m.group for m in shapes.motions):
        inner = [
            f'<option value="{k}">{escape(m.title)}</option>' for k, m in enumerate(shapes.motions) if m.group == group
        ]
        options.append(f'<optgroup label="{escape(group)}">{"".join(inner)}</optgroup>')
    axes = "".join(
        f'<line data-part="axis-{a}" x1="0" y1="0" x2="0" y2="0" stroke="{c}" stroke-width="2"></line>'
        f'<text data-part="label-{a}" fill="{c}" text-anchor="middle" dominant-baseline="middle">{a}</text>'
        for a, c in (("x", LONGITUDINAL), ("y", LATERAL), ("z", NORMAL))
    )
    missing = (
        f"<p>{shapes.left_out} more modes are in the sequences beside the result, for ParaView.</p>"
        if shapes.left_out
        else ""
    )
    # Text of a script element must not end it.
    data = payload(shapes, colours).replace("</", "<\\/")
    scripts = "".join(
        f"<script>{(WEB / name).read_text(encoding='utf-8')}</script>" for name in ("three.min.js", "viewer.js")
    )
    page = Template((WEB / "viewer.html").read_text(encoding="utf-8")).substitute(
        options="".join(options),
        most=f"{3 * AMPLITUDE:g}",
        amplitude=f"{AMPLITUDE:g}",
        axes=axes,
        gradient=gradient,
        missing=missing,
    )
    return [
        '<h2 id="shapes">Modes in motion</h2>',
        page,
        f'<script type="application/json" id="viewer-data">{data}</script>{scripts}',
    ]
