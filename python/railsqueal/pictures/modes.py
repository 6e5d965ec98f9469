"""Modes: table of the frequencies, pictures of the shapes drawn from the outer surface of the mesh."""

import math
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize

from ..errors import WRITING, ResultError
from ..mesh import Fields
from ..mode_names import ModeNames
from ..result import Floats, Integers, Result
from ..tables import BODIES, ComplexModes, Modes, growing
from .style import Canvas

# Below this a frequency belongs to a rigid-body motion, Hz.
RIGID = 1e-2
# Largest deformation drawn, relative to the size of the body.
AMPLITUDE = 0.08
# Complex modes drawn at most, and the phases of each.
COMPLEX_MODES, PHASES = 4, 4


def pictures(result: Result, canvas: Canvas, count: int) -> list[Path]:
    if not Modes.bodies(result):
        return []
    made = [table(result, canvas)]
    shapes = result.companion("free_modes.vtkhdf")
    if shapes.exists():
        made += shape_pictures(result, shapes, canvas, count)
    motions = result.companion("modes.vtkhdf")
    if motions.exists():
        made += complex_picture(result, motions, canvas)
    return made


def table(result: Result, canvas: Canvas) -> Path:
    """The frequencies as a table of Markdown."""
    path = canvas.path("frequencies", "md")
    bodies = [Modes.from_result(result, body) for body in Modes.bodies(result)]
    lines = ["| mode | " + " | ".join(f"{modes.body} body, Hz" for modes in bodies) + " |"]
    lines.append("|---:|" + "---:|" * len(bodies))
    for k in range(max(len(modes.frequency) for modes in bodies)):
        cells = [f"{modes.frequency[k]:.3f}" if k < len(modes.frequency) else "" for modes in bodies]
        lines.append(f"| {k + 1} | " + " | ".join(cells) + " |")
    try:
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise ResultError(f"cannot write {path}: {error}", WRITING) from error
    return path


@dataclass(frozen=True)
class Surface:
    """Outer surface of one body, or of both."""

    points: Floats  # [p, 3], m
    faces: Integers  # [f, 4]

    @property
    def size(self) -> float:
        """Largest extent, m."""
        return float(np.ptp(self.points[np.unique(self.faces)], axis=0).max())

    def near_contact(self) -> "Surface":
        """Without what of a rail is further along the track than the bodies are high or wide."""
        reach = float(np.ptp(self.points[np.unique(self.faces)][:, 1:], axis=0).max())
        kept = (np.abs(self.points[self.faces, 0]) <= reach).all(axis=1)
        return Surface(self.points, self.faces[kept]) if kept.any() else self


def shape_pictures(result: Result, path: Path, canvas: Canvas, count: int) -> list[Path]:
    """Real modes of each body."""
    made, names = [], ModeNames.from_result(result)
    with Fields(path) as fields:
        frequency, body, number = (fields.table(f"modes/{name}") for name in ("frequency", "body", "number"))
        for which in np.unique(body):
            steps = np.flatnonzero((body == which) & (frequency > RIGID))[:count]
            if not len(steps):
                continue
            surface = Surface(fields.mesh.points, fields.mesh.surface(int(which)))
            columns = min(4, len(steps))
            rows = math.ceil(len(steps) / columns)
            figure, axes = plt.subplots(
                rows, columns, figsize=(2.7 * columns, 2.75 * rows + 0.7), squeeze=False, layout="constrained"
            )
            for axis in axes.flat:
                axis.axis("off")
            for axis, step in zip(axes.flat, steps):
                image = draw(axis, surface, fields.field("shape", int(step)))
                axis.set_title(f"{kind(names, BODIES[int(which)], int(number[step]))}{frequency[step]:.1f} Hz")
            bar = figure.colorbar(image, ax=axes, orientation="horizontal", shrink=0.4, aspect=40, pad=0.02)
            bar.set_label("displacement, relative to the largest of the mode")
            name = BODIES[int(which)]
            figure.suptitle(f"modes of the {names.bodies[name]}, deformation exaggerated", fontsize=11)
            made += canvas.save(figure, f"modes-{name}")
    return made


def kind(names: ModeNames, body: str, number: int) -> str:
    """Number of a mode, and its kind where that is known: `7, n = 3 axial: `."""
    known = names.free.get(body, [])
    name = known[number - 1] if number <= len(known) else ""
    words = name.partition("(")[2].removesuffix(")")
    return f"{number}, {words}: " if words else f"mode {number}: "


def complex_picture(result: Result, path: Path, canvas: Canvas) -> list[Path]:
    """Complex modes over half a period, the most unstable first: a wave travels round a body where its parts move one
    after the other."""
    table, names = (
        ComplexModes.from_result(result) if ComplexModes.present(result) else None,
        ModeNames.from_result(result),
    )
    with Fields(path) as fields:
        frequency, growth, phase, place = (
            fields.table(f"modes/{name}") for name in ("frequency", "growth_rate", "phase", "eigenvalue")
        )
        surface = Surface(fields.mesh.points, fields.mesh.surface()).near_contact()
        first = np.flatnonzero(phase == 0)
        first = first[np.argsort(-growth[first], kind="stable")][:COMPLEX_MODES]
        # As high as the bodies are seen, with their name above.
        wide, high = np.ptp(surface.points[np.unique(surface.faces)] @ view()[:2].T, axis=0)
        row = 2.3 * float(np.clip(high / wide, 0.3, 1.6)) + 0.7
        figure = plt.figure(figsize=(2.3 * PHASES, row * len(first) + 0.9), layout="constrained")
        # A part of the figure for each mode: its name stands over its own row and meets no other.
        parts = np.atleast_1d(
            np.asarray(figure.subfigures(len(first) + 1, 1, height_ratios=[row] * len(first) + [0.6]))
        )
        for part, start in zip(parts, first):
            steps = np.flatnonzero(place == place[start])
            # The motion is the real part and a quarter period later minus the imaginary one: any phase follows from two
            # steps.
            real, later = (fields.field("motion", int(k)).astype(float) for k in (steps[0], steps[len(steps) // 4]))
            largest = float(np.sqrt((real**2 + later**2).sum(axis=1)).max())
            for axis, turn in zip(part.subplots(1, PHASES), np.arange(PHASES) / (2 * PHASES)):
                axis.axis("off")
                image = draw(axis, surface, np.cos(2 * np.pi * turn) * real + np.sin(2 * np.pi * turn) * later, largest)
                axis.set_title(f"{turn:g} of the period", fontsize=9)
            made_of = names.dominant(table, int(place[start])) if table else ""
            label = "unstable" if growing(np.array([growth[start] + 2j * np.pi * frequency[start]]))[0] else "stable"
            part.suptitle(
                f"{frequency[start]:.1f} Hz, {growth[start]:+.2f} 1/s, {label}" + (f": {made_of}" if made_of else ""),
                fontsize=10,
            )
        bar = parts[-1].colorbar(image, cax=parts[-1].add_axes((0.3, 0.6, 0.4, 0.2)), orientation="horizontal")
        bar.set_label("displacement, relative to the largest amplitude of the mode")
        figure.suptitle("complex modes, deformation exaggerated", fontsize=11)
    return canvas.save(figure, "complex-modes")


def view() -> Floats:
    """Rows: to the right, up, and towards the viewer, who looks at the face of the wheel from the side and above."""
    azimuth, elevation = np.radians(-58.0), np.radians(20.0)
    towards = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    right = np.cross([0.0, 0.0, 1.0], towards)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(towards, right), towards])


def draw(axis: Axes, surface: Surface, shape: Floats, largest: float | None = None) -> ScalarMappable:
    """The deformed surface in parallel projection, faces from back to front, coloured by the displacement relative to
    the `largest`."""
    used = np.unique(surface.faces)
    size = np.linalg.norm(shape, axis=1)
    largest = largest or float(size[used].max()) or 1.0
    points = surface.points + shape * (AMPLITUDE * surface.size / largest)
    camera = view()
    quads = points[surface.faces]
    normal = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    front = normal @ camera[2] > 0
    quads, normal = quads[front], normal[front]
    order = np.argsort((quads @ camera[2]).mean(axis=1))
    light = 0.62 + 0.38 * np.clip(normal @ (camera.T @ np.array([-0.35, 0.55, 0.76])), 0, 1)
    value = (size[surface.faces].mean(axis=1) / largest)[front]
    colours = np.asarray(plt.get_cmap("viridis")(value))
    colours[:, :3] *= light[:, None]
    flat = quads @ camera[:2].T
    # Edges in the colour of the faces hide the seams between them.
    faces = PolyCollection(
        flat[order], facecolors=colours[order], edgecolors=colours[order], linewidths=0.3, rasterized=True
    )
    axis.add_collection(faces)
    axis.set_aspect("equal")
    axis.set_xlim(float(flat[..., 0].min()), float(flat[..., 0].max()))
    axis.set_ylim(float(flat[..., 1].min()), float(flat[..., 1].max()))
    return ScalarMappable(Normalize(0, 1), "viridis")
