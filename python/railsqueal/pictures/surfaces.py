"""The surfaces of meshes before a run (`railsqueal check JOB --mesh FILE.vtkhdf`): from three sides, with groups, supports and contact nodes."""

from pathlib import Path
from typing import Any

import h5py
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.lines import Line2D

from ..errors import ResultError
from ..result import Floats, Integers
from .style import BLUE, GREY, ORANGE, RED, Canvas

MM = 1e3
# What a group is for, and how it is drawn; what is not in the list is grey.
ROLES = {"contact": RED, "fixed": BLUE, "support": ORANGE}
OTHERS = ["#7fbf7b", "#af8dc3", "#c7b37f", "#7fb8c7", "#d98fa8", "#9a9a6a"]
# Looking along an axis: the two that are seen, and the sign of the third towards the eye.
VIEWS = [("from the side", 0, 2, 1, -1.0), ("along the rail", 1, 2, 0, -1.0), ("from above", 0, 1, 2, 1.0)]


class Surfaces:
    """Facets with corners [f, 4] (a triangle repeats its last one), their bodies [f] and groups [f], and the contact nodes [n, 3]."""

    def __init__(self, path: Path) -> None:
        try:
            with h5py.File(path) as file:
                self._read(file)
        except (OSError, KeyError) as error:
            raise ResultError(f"cannot read the surfaces in {path}: {error}") from error

    def _read(self, file: Any) -> None:
        grid = file["VTKHDF"]
        self.points: Floats = grid["Points"][()]
        offsets = grid["Offsets"][()]
        connectivity = grid["Connectivity"][()]
        last = np.diff(offsets) - 1
        columns = np.minimum(np.arange(4)[None, :], last[:, None])
        self.corners: Integers = connectivity[offsets[:-1, None] + columns]
        self.body: Integers = grid["CellData/body"][()]
        self.group: Integers = grid["CellData/group"][()]
        self.names = [name.decode() for name in file["surface/group"][()]]
        self.roles = [role.decode() for role in file["surface/role"][()]]
        self.contact: Floats = file["surface/contact_point"][()]

    @staticmethod
    def present(path: Path) -> bool:
        """Whether the file is one of surfaces."""
        try:
            with h5py.File(path) as file:
                return "surface/group" in file
        except OSError:
            return False

    def colours(self) -> list[Any]:
        """A colour for each group, and grey for what is in none."""
        others = iter(OTHERS * len(self.names))
        return [ROLES.get(role) or next(others) for role in self.roles] + [GREY]


def draw(path: Path, canvas: Canvas) -> list[Path]:
    """All of both bodies from three sides, and the surroundings of the contact from above and from the side."""
    surfaces = Surfaces(path)
    colours = surfaces.colours()
    figure, axes = plt.subplots(2, 3, figsize=(12.5, 8.0), layout="constrained")
    for axis, view in zip(axes[0], VIEWS, strict=True):
        painted(axis, surfaces, view, np.ones(len(surfaces.corners), dtype=bool), colours)
    near = close(surfaces)
    for axis, body in zip(axes[1, :2], (1, 2), strict=True):
        # The surface that touches is seen from the other body.
        name, a, b, c, _ = VIEWS[2]
        chosen = near & (surfaces.body == body)
        painted(axis, surfaces, (f"{'lower' if body == 1 else 'upper'} body at the contact, {name if body == 1 else 'from below'}", a, b, c, 1.0 if body == 1 else -1.0), chosen, colours)
    painted(axes[1, 2], surfaces, ("both at the contact, along the rail", 1, 2, 0, -1.0), near, colours)
    used = [k for k in range(len(surfaces.names)) if (surfaces.group == k).any()]
    words = {"contact": "contact", "fixed": "clamped", "support": "supported", "": "no support"}
    handles = [Line2D([], [], marker="s", linestyle="", color=colours[k], label=f"{surfaces.names[k]} ({words[surfaces.roles[k]]})") for k in used]
    handles.append(Line2D([], [], marker="+", linestyle="", color="black", label="contact point"))
    if len(surfaces.contact):
        handles.append(Line2D([], [], marker=".", linestyle="", color="black", label=f"{len(surfaces.contact)} contact nodes"))
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return canvas.save(figure, "surfaces")


def close(surfaces: Surfaces) -> Any:
    """Facets about the contact: those with a corner within three times the reach of the contact nodes, or within a twentieth of the bodies' size."""
    reach = 3 * abs(surfaces.contact[:, :2]).max() if len(surfaces.contact) else 0.05 * np.ptp(surfaces.points, axis=0).max()
    inside = (abs(surfaces.points) < reach).all(axis=1)
    return inside[surfaces.corners].any(axis=1)


def painted(axis: Any, surfaces: Surfaces, view: tuple[str, int, int, int, float], chosen: Any, colours: list[Any]) -> None:
    """The chosen facets that face the eye, the nearest one last."""
    title, a, b, towards, sign = view
    places = surfaces.points[surfaces.corners]
    normal = np.cross(places[:, 2] - places[:, 0], places[:, 3] - places[:, 1])
    normal = np.where((places[:, 2] == places[:, 3]).all(axis=1)[:, None], np.cross(places[:, 1] - places[:, 0], places[:, 2] - places[:, 0]), normal)
    seen = np.flatnonzero(chosen & (sign * normal[:, towards] > 1e-9 * np.linalg.norm(normal, axis=1)))
    order = seen[np.argsort(sign * places[seen, :, towards].mean(axis=1))]
    length = np.linalg.norm(normal[order], axis=1)
    light = 0.55 + 0.45 * abs(normal[order, towards]) / np.where(length > 0, length, 1)
    from matplotlib.colors import to_rgb

    base = np.array([to_rgb(c) for c in colours])[surfaces.group[order]]
    shade = 1 - (1 - base) * light[:, None]
    edges = len(order) < 6000
    axis.add_collection(PolyCollection(list(MM * places[order][:, :, [a, b]]), facecolors=shade * (0.75 + 0.25 * light[:, None]), edgecolors="#00000055" if edges else "none", linewidths=0.3))
    if len(surfaces.contact) and chosen.sum() < len(chosen):
        axis.plot(*(MM * surfaces.contact[:, [a, b]].T), ".", color="black", markersize=1.5)
    axis.plot(0, 0, "+", color="black", markersize=10)
    axis.autoscale_view()
    axis.set_aspect("equal", adjustable="datalim")
    axis.set_xlabel(f"{'xyz'[a]} / mm")
    axis.set_ylabel(f"{'xyz'[b]} / mm")
    axis.set_title(title)
