"""Modes: table of the frequencies, pictures of the shapes drawn from the outer surface of the mesh."""

import math

import h5py
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection
from results import ResultsError
from style import save

NAMES = {1: "lower", 2: "upper"}
# Faces of a hexahedron in VTK's numbering, outward.
FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
# Below this a frequency belongs to a rigid-body motion, Hz.
RIGID = 1e-2
# Largest deformation drawn, relative to the size of the body.
AMPLITUDE = 0.08


def pictures(results, out, count):
    made = []
    bodies = [name for name in NAMES.values() if f"modes/{name}/frequency" in results]
    if not bodies:
        return made
    made.append(table(results, bodies, out / f"{results.stem}-frequencies.md"))
    shapes = results.companion("free_modes.vtkhdf")
    if shapes.exists():
        made += shape_pictures(shapes, results.stem, out, count)
    motions = results.companion("modes.vtkhdf")
    if motions.exists():
        made.append(complex_picture(motions, results.stem, out))
    return made


def table(results, bodies, path):
    columns = [results[f"modes/{name}/frequency"] for name in bodies]
    lines = ["| mode | " + " | ".join(f"{name} body, Hz" for name in bodies) + " |"]
    lines.append("|---:|" + "---:|" * len(bodies))
    for k in range(max(len(column) for column in columns)):
        cells = [f"{column[k]:.3f}" if k < len(column) else "" for column in columns]
        lines.append(f"| {k + 1} | " + " | ".join(cells) + " |")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


class Surface:
    """Outer surface of one body of a VTKHDF file, or of several."""

    def __init__(self, root, *numbers):
        points, body = root["Points"][()], root["PointData/body"][()]
        sizes = [root[f"NumberOf{name}"][()] for name in ("Points", "ConnectivityIds")]
        connectivity = root["Connectivity"][()]
        starts = np.concatenate([[0], np.cumsum(sizes[0])[:-1]])
        cells = (connectivity + np.repeat(starts, sizes[1])).reshape(-1, 8)
        cells = cells[np.isin(body[cells[:, 0]], numbers)]
        if not len(cells):
            raise ResultsError(f"the mode file has no cells of body {numbers}")
        # Pieces repeat the points they share: points of equal position are one.
        size = np.ptp(points, axis=0).max()
        _, first, same = np.unique(np.round(points / (1e-7 * size)), axis=0, return_index=True, return_inverse=True)
        faces = cells[:, FACES].reshape(-1, 4)
        key = np.sort(same.reshape(-1)[faces], axis=1)
        _, index, times = np.unique(key, axis=0, return_index=True, return_counts=True)
        self.faces = first[same.reshape(-1)[faces[index[times == 1]]]]
        self.points = points
        self.size = np.ptp(points[np.unique(self.faces)], axis=0).max()


def shape_pictures(path, stem, out, count):
    made = []
    with h5py.File(path) as file:
        root = file["VTKHDF"]
        frequency, body, number = (file[f"modes/{name}"][()] for name in ("frequency", "body", "number"))
        n = int(root["NumberOfPoints"][()].sum())
        for which in np.unique(body):
            steps = np.flatnonzero((body == which) & (frequency > RIGID))[:count]
            if not len(steps):
                continue
            surface = Surface(root, which)
            columns = min(4, len(steps))
            rows = math.ceil(len(steps) / columns)
            figure, axes = plt.subplots(
                rows, columns, figsize=(2.7 * columns, 2.75 * rows + 0.7), squeeze=False, layout="constrained"
            )
            for axis in axes.flat:
                axis.axis("off")
            for axis, step in zip(axes.flat, steps):
                shape = root["PointData/shape"][step * n : (step + 1) * n]
                image = draw(axis, surface, shape)
                axis.set_title(f"mode {number[step]}: {frequency[step]:.1f} Hz")
            bar = figure.colorbar(image, ax=axes, orientation="horizontal", shrink=0.4, aspect=40, pad=0.02)
            bar.set_label("displacement, relative to the largest of the mode")
            figure.suptitle(f"modes of the {NAMES[int(which)]} body, deformation exaggerated", fontsize=11)
            made.append(save(figure, out / f"{stem}-modes-{NAMES[int(which)]}.png"))
    return made


# Complex modes drawn at most, and the phases of each.
COMPLEX_MODES, PHASES = 4, 4


def complex_picture(path, stem, out):
    """Complex modes over half a period, the most unstable first: a wave travels round a body where its parts move one after the other."""
    with h5py.File(path) as file:
        root = file["VTKHDF"]
        frequency, growth, phase, place = (
            file[f"modes/{name}"][()] for name in ("frequency", "growth_rate", "phase", "eigenvalue")
        )
        n = int(root["NumberOfPoints"][()].sum())
        surface = Surface(root, *NAMES)
        first = np.flatnonzero(phase == 0)
        first = first[np.argsort(-growth[first], kind="stable")][:COMPLEX_MODES]
        figure, axes = plt.subplots(
            len(first), PHASES, figsize=(2.3 * PHASES, 4.1 * len(first) + 0.6), squeeze=False, layout="constrained"
        )
        for row, start in zip(axes, first):
            steps = np.flatnonzero(place == place[start])
            for axis, turn in zip(row, np.arange(PHASES) / (2 * PHASES)):
                # The motion is the real part and a quarter period later minus the imaginary one: any phase follows from two steps.
                real, later = (root["PointData/motion"][k * n : (k + 1) * n] for k in (steps[0], steps[len(steps) // 4]))
                motion = np.cos(2 * np.pi * turn) * real + np.sin(2 * np.pi * turn) * later
                largest = np.sqrt((real.astype(float) ** 2 + later.astype(float) ** 2).sum(axis=1)).max()
                axis.axis("off")
                image = draw(axis, surface, motion, largest)
                axis.set_title(f"{turn:g} of the period", fontsize=9)
            label = "unstable" if growth[start] > 0 else "stable"
            row[0].set_title(f"{frequency[start]:.1f} Hz, {growth[start]:+.2f} 1/s, {label}\n", fontsize=9, loc="left")
        bar = figure.colorbar(image, ax=axes, orientation="horizontal", shrink=0.4, aspect=40, pad=0.02)
        bar.set_label("displacement, relative to the largest amplitude of the mode")
        figure.suptitle("complex modes, deformation exaggerated", fontsize=11)
    return save(figure, out / f"{stem}-complex-modes.png")


def view():
    """Rows: to the right, up, and towards the viewer, who looks at the face of the wheel from the side and above."""
    azimuth, elevation = np.radians(-58.0), np.radians(20.0)
    towards = np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    right = np.cross([0.0, 0.0, 1.0], towards)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(towards, right), towards])


def draw(axis, surface, shape, largest=None):
    """The deformed surface in parallel projection, faces from back to front, coloured by the displacement relative to the `largest`."""
    used = np.unique(surface.faces)
    size = np.linalg.norm(shape, axis=1)
    largest = largest or size[used].max() or 1.0
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
    colours = plt.get_cmap("viridis")(value)
    colours[:, :3] *= light[:, None]
    flat = quads @ camera[:2].T
    # Edges in the colour of the faces hide the seams between them.
    axis.add_collection(PolyCollection(flat[order], facecolors=colours[order], edgecolors=colours[order], linewidths=0.3))
    axis.set_aspect("equal")
    axis.set_xlim(flat[..., 0].min(), flat[..., 0].max())
    axis.set_ylim(flat[..., 1].min(), flat[..., 1].max())
    return plt.cm.ScalarMappable(plt.Normalize(0, 1), "viridis")
