"""The surfaces of meshes before a run (`railsqueal check JOB --mesh FILE.vtkhdf`): from three sides, with groups,
supports and contact nodes, those of the meshes or of a common grid."""

from pathlib import Path
from typing import Any

import h5py
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ..errors import ResultError
from ..result import Floats, Integers
from .style import BELOW, BLUE, GREY, ORANGE, RED, Canvas

MM = 1e3
# What a group is for, and how it is drawn; what is not in the list is grey.
ROLES = {"contact": RED, "fixed": BLUE, "support": ORANGE}
# Contact nodes and the lines between them, and nodes that are not on the surface.
GRID, OFF = "black", "#d000d0"
BODIES = {1: "lower", 2: "upper"}
OTHERS = ["#7fbf7b", "#af8dc3", "#c7b37f", "#7fb8c7", "#d98fa8", "#9a9a6a"]
# Looking along an axis: the two that are seen, and the sign of the third towards the eye.
VIEWS = [("from the side", 0, 2, 1, -1.0), ("along the rail", 1, 2, 0, -1.0), ("from above", 0, 1, 2, 1.0)]


class Surfaces:
    """Facets with corners [f, 4] (a triangle repeats its last one), their bodies [f] and groups [f], and the contact
    nodes [n, 3].

    Nodes are of the bodies `contact_body` [n]; where `on_face` [n] is False the contact grid leaves the surface.
    `common` is the number of nodes along x and y of a common grid, (0, 0) where the nodes are those of the meshes.
    """

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
        self.contact_body: Integers = file["surface/contact_body"][()]
        self.on_face: NDArray[np.bool_] = file["surface/contact_on_face"][()] > 0
        nx, ny = (int(n) for n in file["surface/common_grid"][()])
        self.common = (nx, ny)

    def lines(self, body: int) -> list[Floats]:
        """Lines of the common grid on the surface of a body, places [k, 3] of each: those along x, then those along y.
        None where there is no such grid."""
        nodes = self.contact[self.contact_body == body]
        nx, ny = self.common
        if not nx or len(nodes) != nx * ny:
            return []
        grid = nodes.reshape(ny, nx, 3)
        return [*grid, *grid.swapaxes(0, 1)]

    @staticmethod
    def present(path: Path) -> bool:
        """Returns whether the file is one of surfaces."""
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
        for body in BODIES:
            outlined(axis, surfaces, body, view)
    near = close(surfaces)
    for axis, body in zip(axes[1, :2], BODIES, strict=True):
        # The surface that touches is seen from the other body.
        name, a, b, c, _ = VIEWS[2]
        chosen = near & (surfaces.body == body)
        view = (
            f"{BODIES[body]} body at the contact, {name if body == 1 else 'from below'}",
            a,
            b,
            c,
            1.0 if body == 1 else -1.0,
        )
        painted(axis, surfaces, view, chosen, colours)
        nodes(axis, surfaces, body, view)
    view = ("both at the contact, along the rail", 1, 2, 0, -1.0)
    painted(axes[1, 2], surfaces, view, near, colours)
    for body in BODIES:
        nodes(axes[1, 2], surfaces, body, view)
    used = [k for k in range(len(surfaces.names)) if (surfaces.group == k).any()]
    words = {"contact": "contact", "fixed": "clamped", "support": "supported", "": "no support"}
    handles = [
        Line2D(
            [],
            [],
            marker="s",
            linestyle="",
            color=colours[k],
            label=f"{surfaces.names[k]} ({words[surfaces.roles[k]]})",
        )
        for k in used
    ]
    handles.append(Line2D([], [], marker="+", linestyle="", color="black", label="contact point"))
    handles += node_handles(surfaces)
    figure.legend(handles=handles, ncols=4, **BELOW)
    return canvas.save(figure, "surfaces")


def node_handles(surfaces: Surfaces) -> list[Line2D]:
    """Legend of the contact nodes: the body they belong to, and how many are beside the surface."""
    nx, ny = surfaces.common
    found: list[Line2D] = []
    if nx:
        spacing = MM * np.ptp(surfaces.contact[:nx, 0]) / (nx - 1)
        found.append(
            Line2D([], [], color=GRID, linewidth=0.6, label=f"common grid: {nx} x {ny} nodes, {spacing:.3g} mm")
        )
    elif len(surfaces.contact):
        found.append(
            Line2D([], [], marker=".", linestyle="", color=GRID, label=f"{len(surfaces.contact)} contact nodes")
        )
    for body, name in BODIES.items():
        off = int((~surfaces.on_face & (surfaces.contact_body == body)).sum())
        if off:
            found.append(
                Line2D([], [], marker="x", linestyle="", color=OFF, label=f"{name}: {off} of them off its surface")
            )
    return found


def outlined(axis: Any, surfaces: Surfaces, body: int, view: tuple[str, int, int, int, float]) -> None:
    """The border of the common grid of a body, to be found among all of it."""
    _, a, b, _, _ = view
    nx, ny = surfaces.common
    lines = surfaces.lines(body)
    for line in (lines[0], lines[ny - 1], lines[ny], lines[ny + nx - 1]) if lines else ():
        axis.plot(*(MM * line[:, [a, b]].T), color=GRID, linewidth=0.8)


def nodes(axis: Any, surfaces: Surfaces, body: int, view: tuple[str, int, int, int, float]) -> None:
    """The contact nodes of a body, and the lines of a common grid; nodes that are not on the surface are crosses."""
    _, a, b, _, _ = view
    lines = surfaces.lines(body)
    for line in lines:
        axis.plot(*(MM * line[:, [a, b]].T), color=GRID, linewidth=0.4 if len(lines) < 40 else 0.2)
    own = surfaces.contact_body == body
    # Crossing lines show where nodes are.
    dots = own & surfaces.on_face & (not lines)
    for chosen, marker, colour, size in ((dots, ".", GRID, 1.5), (own & ~surfaces.on_face, "x", OFF, 3.0)):
        if chosen.any():
            axis.plot(
                *(MM * surfaces.contact[chosen][:, [a, b]].T),
                marker,
                color=colour,
                markersize=size,
                markeredgewidth=0.6,
            )


def close(surfaces: Surfaces) -> Any:
    """Facets about the contact: those with a corner within three times the reach of the contact nodes, or within a
    twentieth of the bodies' size."""
    reach = (
        3 * abs(surfaces.contact[:, :2]).max()
        if len(surfaces.contact)
        else 0.05 * np.ptp(surfaces.points, axis=0).max()
    )
    inside = (abs(surfaces.points) < reach).all(axis=1)
    return inside[surfaces.corners].any(axis=1)


def painted(
    axis: Any, surfaces: Surfaces, view: tuple[str, int, int, int, float], chosen: Any, colours: list[Any]
) -> None:
    """The chosen facets that face the eye, the nearest one last."""
    title, a, b, towards, sign = view
    places = surfaces.points[surfaces.corners]
    normal = np.cross(places[:, 2] - places[:, 0], places[:, 3] - places[:, 1])
    normal = np.where(
        (places[:, 2] == places[:, 3]).all(axis=1)[:, None],
        np.cross(places[:, 1] - places[:, 0], places[:, 2] - places[:, 0]),
        normal,
    )
    seen = np.flatnonzero(chosen & (sign * normal[:, towards] > 1e-9 * np.linalg.norm(normal, axis=1)))
    order = seen[np.argsort(sign * places[seen, :, towards].mean(axis=1))]
    length = np.linalg.norm(normal[order], axis=1)
    light = 0.55 + 0.45 * abs(normal[order, towards]) / np.where(length > 0, length, 1)
    from matplotlib.colors import to_rgb

    base = np.array([to_rgb(c) for c in colours])[surfaces.group[order]]
    shade = 1 - (1 - base) * light[:, None]
    edges = len(order) < 6000
    axis.add_collection(
        PolyCollection(
            list(MM * places[order][:, :, [a, b]]),
            facecolors=shade * (0.75 + 0.25 * light[:, None]),
            edgecolors="#00000055" if edges else "none",
            linewidths=0.3,
        )
    )
    axis.plot(0, 0, "+", color="black", markersize=10)
    axis.autoscale_view()
    axis.set_aspect("equal", adjustable="datalim")
    axis.set_xlabel(f"{'xyz'[a]} / mm")
    axis.set_ylabel(f"{'xyz'[b]} / mm")
    axis.set_title(title)
