"""The picture of a section: outline with its groups, mesh, and properties."""

import io
from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from PIL import Image

from ..errors import USAGE, WRITING, ResultError
from ..pictures import style
from .mesh import PlaneMesh
from .outline import Outline

_COLOURS = (style.RED, style.BLUE, style.GREEN, style.ORANGE, style.PURPLE, style.SKY)
# Dots per inch.
_RESOLUTION = 110


def draw(path: Path, title: str, outline: Outline, mesh: PlaneMesh, lines: list[str]) -> None:
    """Writes the picture; `lines` stand below it."""
    if path.suffix.lower().removeprefix(".") not in style.FORMATS:
        raise ResultError(f"--picture {path}: expected a name that ends in .{', .'.join(style.FORMATS)}", USAGE)
    style.apply()
    (left, low), (right, high) = 1e3 * outline.box()
    tall = (high - low) / (right - left)
    figure = Figure(figsize=(6.4, min(9.0, 1.6 + 4.2 * max(tall, 0.8))), layout="constrained")
    axes = figure.subplots()
    corners = 1e3 * mesh.nodes[mesh.triangles[:, :3]]
    sides = np.concatenate([corners[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    axes.add_collection(LineCollection(list(sides), colors="#bbbbbb", linewidths=0.3))
    names = list(outline.group_lengths())
    colour = dict(zip(names, _COLOURS * (1 + len(names) // len(_COLOURS))))
    shown = set()
    for curve in outline.curves:
        points = 1e3 * curve.chords(16)
        label = curve.group if curve.group and curve.group not in shown else None
        shown.add(curve.group)
        axes.plot(
            *points.T, color=colour.get(curve.group, style.GREY), linewidth=2.2 if curve.group else 1.1, label=label
        )
    joints = np.array([1e3 * curve.ends[0] for curve in outline.curves])
    axes.plot(*joints.T, ".", color="black", markersize=2.5, label="ends of curves" if len(joints) < 400 else None)
    axes.axvline(0.0, color=style.GREY, linewidth=0.6, linestyle="--")
    axes.set_aspect("equal")
    axes.set_xlabel("\n".join(["x, mm", "", *lines]), fontsize=9)
    axes.set_ylabel("y, mm")
    axes.set_title(title)
    style.legend(figure, [axes], columns=4)
    ending = path.suffix.lower().removeprefix(".")
    made = io.BytesIO()
    figure.savefig(made, format=ending, dpi=_RESOLUTION)
    if ending == "png":
        # A palette halves the size of the file.
        image = Image.open(made).convert("RGB").quantize(48, dither=Image.Dither.NONE)
        made = io.BytesIO()
        image.save(made, "png", optimize=True)
    try:
        path.write_bytes(made.getvalue())
    except OSError as error:
        raise ResultError(f"cannot write {path}: {error.strerror}", WRITING) from error
