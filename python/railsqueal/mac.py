"""Modal assurance criterion between the mode shapes of two results on one display mesh.

MAC(φ, ψ) = |φᴴψ|² / (φᴴφ ψᴴψ) over the points of the mesh: 1 for shapes that differ by a complex factor, 0 for
orthogonal ones. A mode whose partner belongs to a pair of equal frequencies is compared with the plane of that pair, in
which the shapes of a pair may turn: |Qᴴφ|² / φᴴφ with an orthonormal basis Q of the plane.
"""

from dataclasses import dataclass

import numpy as np

from .errors import ResultError
from .mesh import Fields
from .mode_names import ModeNames
from .result import Complexes, Floats, Integers, Result
from .tables import BODIES, ComplexModes
from .verdict import hertz

# Modes of each body that are compared, and relative distance of two frequencies that count as one.
MODES, EQUAL = 40, 1e-6
# Points of two meshes that are one, relative to the size of the mesh, and MAC below which no mode is alike.
SAME, ALIKE = 1e-3, 0.1
# Bytes that the shapes of one result take up at most; of large meshes fewer modes are compared, the first ones.
MEMORY = 400_000_000
# MAC from which a mode is the same one.
SURE = 0.999


@dataclass(frozen=True)
class Shapes:
    """Mode shapes of a result: one row for each mode, on the points of a mesh."""

    points: Floats  # [p, 3], m
    frequency: Floats  # [m], Hz
    names: list[str]  # [m]
    shape: Complexes  # [m, 3 p]


def criterion(one: Complexes, other: Complexes) -> Floats:
    """MAC of all shapes of one set, [a, k], with all of another one, [b, k]: [a, b]."""
    product = np.abs(one.conj() @ other.T) ** 2
    squares = [(np.abs(s) ** 2).sum(axis=1) for s in (one, other)]
    return np.asarray(product / np.maximum(np.outer(*squares), 1e-300))


def with_plane(shape: Complexes, plane: Complexes) -> float:
    """Share of a shape, [k], that lies in the space of some others, [n, k]."""
    basis, _ = np.linalg.qr(plane.T)
    return float((np.abs(basis.conj().T @ shape) ** 2).sum() / max(float((np.abs(shape) ** 2).sum()), 1e-300))


def partners(one: Shapes, other: Shapes) -> tuple[Integers, Floats]:
    """For each mode of one result the most alike mode of the other one, and its MAC, with the plane of a pair."""
    table = criterion(one.shape, other.shape)
    best = np.argmax(table, axis=1)
    values = table[np.arange(len(best)), best]
    for k, place in enumerate(best):
        pair = np.flatnonzero(
            np.abs(other.frequency - other.frequency[place]) <= EQUAL * max(float(other.frequency[place]), 1e-300)
        )
        if len(pair) > 1:
            values[k] = with_plane(one.shape[k], other.shape[pair])
    return np.asarray(best, dtype=np.int64), values


def in_file_order(fields: Fields) -> Integers:
    """Points of the joined mesh in the order of the file, which does not depend on where a body lies."""
    return np.asarray(np.argsort(fields.mesh.first, kind="stable"), dtype=np.int64)


def fitting(points: int) -> int:
    """Number of shapes of a mesh of so many points that have room in memory, at least one."""
    return max(1, MEMORY // (3 * 16 * max(points, 1)))


def free_shapes(result: Result, body: str) -> Shapes | None:
    """Free modes of a body of `FILE.free_modes.vtkhdf`, or None without them."""
    path = result.companion("free_modes.vtkhdf")
    if not path.exists():
        return None
    names = ModeNames.from_result(result)
    with Fields(path) as fields:
        frequency, owner, number = (fields.table(f"modes/{name}") for name in ("frequency", "body", "number"))
        which = next(n for n, word in BODIES.items() if word == body)
        steps = np.flatnonzero(owner == which)[:MODES]
        inside = in_file_order(fields)
        inside = inside[fields.mesh.body[inside] == which]
        if not len(steps) or not len(inside):
            return None
        steps = steps[: fitting(len(inside))]
        known = names.free.get(body, [])
        named = [known[int(n) - 1] if int(n) <= len(known) else f"{names.bodies[body]} mode {n}" for n in number[steps]]
        shape = np.array(
            [fields.field("shape", int(k))[inside].astype(float).reshape(-1) for k in steps], dtype=complex
        )
        return Shapes(fields.mesh.points[inside], np.asarray(frequency[steps], dtype=float), named, shape)


def complex_shapes(result: Result) -> Shapes | None:
    """Complex modes of `FILE.modes.vtkhdf`, or None without them: the motion is Re(φ e^{iθ})."""
    path = result.companion("modes.vtkhdf")
    if not path.exists() or not ComplexModes.present(result):
        return None
    table, names = ComplexModes.from_result(result), ModeNames.from_result(result)
    with Fields(path) as fields:
        place, points = np.asarray(fields.table("modes/eigenvalue"), dtype=np.int64), in_file_order(fields)
        shapes, order = [], list(dict.fromkeys(place.tolist()))[: fitting(len(points))]
        for at in order:
            steps = np.flatnonzero(place == at)
            real, later = (
                fields.field("motion", int(k))[points].astype(float) for k in (steps[0], steps[len(steps) // 4])
            )
            shapes.append((real - 1j * later).reshape(-1))
        named = [names.dominant(table, at) or "complex mode" for at in order]
        return Shapes(fields.mesh.points[points], table.frequency[order], named, np.array(shapes))


def aligned(one: Shapes, other: Shapes) -> Shapes | None:
    """The shapes of the first result turned with their mesh into the pose of the second one; None of other meshes.

    The rotation is that of least squares (Kabsch's method), because a body may lie otherwise under another contact.
    """
    if one.points.shape != other.points.shape:
        return None
    a, b = (s.points - s.points.mean(axis=0) for s in (one, other))
    left, _, right = np.linalg.svd(a.T @ b)
    mirror = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    turn = left @ mirror @ right
    size = float(np.ptp(b, axis=0).max())
    if np.abs(a @ turn - b).max() > SAME * max(size, 1e-300):
        return None
    turned = (one.shape.reshape(len(one.shape), -1, 3) @ turn).reshape(len(one.shape), -1)
    return Shapes(other.points, one.frequency, one.names, turned)


def lines(one: Result, other: Result) -> list[str]:
    """The comparison of all mode shapes that both results have, in words."""
    try:
        return compared(one, other)
    except ResultError as error:
        # Figures and tables are compared all the same.
        return ["", f"modal assurance criterion (MAC): {error}"]


def compared(one: Result, other: Result) -> list[str]:
    """The lines of the comparison; `ResultError` where a sequence cannot be read."""
    made: list[str] = []
    sets = [
        (f"free modes of the {ModeNames.from_result(one).bodies[b]}", free_shapes(one, b), free_shapes(other, b))
        for b in BODIES.values()
    ]
    for title, a, b in (*sets, ("complex modes", complex_shapes(one), complex_shapes(other))):
        if a is None or b is None:
            continue
        made += ["", f"modal assurance criterion (MAC), {title}: mode of A, mode of B that is most alike"]
        turned = aligned(a, b)
        if turned is None:
            made.append("  the display meshes differ: no MAC")
            continue
        best, values = partners(turned, b)
        change = np.where(a.frequency > 0.1, b.frequency[best] / np.maximum(a.frequency, 0.1) - 1, 0.0)
        same = (values >= SURE) & (np.abs(change) <= 1 - SURE) & (best == np.arange(len(best)))
        if same.any():
            near = f"MAC and frequency within {100 * (1 - SURE):g} % and the same number"
            made.append(f"  {int(same.sum())} of {len(best)} modes have {near}")
        left_names, right_names = ([f"{hertz(f)} {name}" for f, name in zip(s.frequency, s.names)] for s in (a, b))
        width = max(map(len, left_names + right_names))
        for k, (place, value) in enumerate(zip(best, values)):
            left, right = left_names[k], right_names[int(place)]
            if same[k]:
                continue
            if value < ALIKE:
                made.append(f"  {value:.4f}  {left:<{width}}  none")
                continue
            made.append(f"  {value:.4f}  {left:<{width}}  {right:<{width}}  {100 * change[k]:+.3f} %")
    return made
