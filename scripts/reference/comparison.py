"""Compares two result files, and the sequences beside them, dataset by dataset.

Names, shapes, types and attributes must be the same, values within LIMIT of the largest of their dataset. Not compared
are provenance, checksums and counts of iterations. Residuals must not have grown. Modes are compared up to sign and,
where frequencies lie together, up to a rotation among them.
"""

import json
from fnmatch import fnmatch

import h5py
import numpy as np

LIMIT = 1e-10
# Values in single precision end with their last digit.
SINGLE = 3e-7
# Frequencies closer than this, relative, may rotate among each other.
CLUSTER = 1e-6
SKIPPED = ["provenance/*", "*/iterations", "*/products", "checksums", "checksums/*", "reduced/version"]
RESIDUALS = ["*/residual", "*/backward_error", "*/constraint_violation", "*/own_residual"]
# Small differences of large numbers: the dataset whose largest value is the measure, and a factor.
MEASURES = {
    "transient/balance": ("transient/drive_work", 1.0),
    "transient/impact_loss": ("transient/drive_work", 1.0),
    "transient/rolling_work": ("transient/drive_work", 1.0),
    "transient/damping_loss": ("transient/drive_work", 1.0),
    "transient/moment_z": ("transient/force", 0.01),
    "transient/residual": ("transient/force", 1.0),
    "contact/moment_z": ("contact/force", 0.01),
    "contact/residual": (None, 1e3),
    "stability/growth_rate": ("stability/eigenvalue", 1.0),
    "stability/growth_parts": ("stability/eigenvalue", 1.0),
    "stability/damping_ratio": (None, 1.0),
    "stability/body_energy": (None, 1.0),
    "sweep/growth_rate": ("sweep/eigenvalue", 1.0),
    "sweep/damping_ratio": (None, 1.0),
}
# What differs from the earlier program on purpose: path and reason.
INTENDED = {
    "stability/shift_radius": "another eigensolver finds other eigenvalues beside those that are wanted",
    "sweep/sticking": "is new",
    "verdict*": "is new",
    "stability/criterion*": "is new",
    "stability/confirmation*": "is new",
    "modes/*/diameters": "of bodies that rotate is new",
    "modes/*/family": "is new",
    "reduced/*/order": "is new",
    "reduced/*/family": "is new",
    "transient/sound_power/*/pressure_level_a": "is new",
}
# Looser limits, with their reasons: modes are computed to a residual of 1e-9, on which their values at the contact and
# their shares in complex modes rest; a start in steady rolling has the accuracy of that. Between the frequencies where
# radiation is known it was interpolated on a line, and is now in proportion, over the logarithm: the two per cent
# between them are the error of the lines on the wide bands of these cases.
MODES, STEADY_START, SOUND = 1e-9, 1e-8, 3e-2
LIMITS = {
    "transient/sound_power/*": SOUND,
    "reduced/*/contact_modes": MODES,
    "stability/participation": MODES,
    "modes/*/residual": MODES,
    "reduced/*/residual": MODES,
}


def intended(name):
    """Returns whether a dataset may be another one, or new."""
    return any(fnmatch(name, pattern) for pattern in INTENDED)


def results(old, new, limit=LIMIT):
    """The differences, one line each, the number of datasets compared, and the largest distance with its place."""
    found, count, worst = [], 0, (0.0, "")
    stem = lambda path: {
        p.name[len(path.stem) :]: p for p in path.parent.glob(f"{path.stem}.*") if p.suffix in (".h5", ".vtkhdf")
    }  # noqa: E731
    before, after = stem(old), stem(new)
    found += [
        f"{name}: written only by the {'earlier' if name in before else 'present'} program"
        for name in sorted(set(before) ^ set(after))
    ]
    with h5py.File(old) as tables:
        bases = clusters(tables)
    for name in sorted(set(before) & set(after)):
        with h5py.File(before[name]) as a, h5py.File(after[name]) as b:
            lines, compared, distance = files(a, b, bases, limit)
        found += [line if name == ".h5" else f"{name}: {line}" for line in lines]
        count += compared
        worst = max(worst, distance, key=lambda w: w[0])
    return found, count, worst


def clusters(tables):
    """Ranges of modes with frequencies together, of the lower body, the upper one, and both one after the other."""
    ranges = {}
    for body in ("lower", "upper"):
        for path in (f"modes/{body}/frequency", f"reduced/{body}/omega"):
            if path in tables and body not in ranges:
                f = tables[path][()]
                starts = [k for k in range(len(f)) if k == 0 or f[k] - f[k - 1] > CLUSTER * f[-1]]
                ranges[body] = list(zip(starts, starts[1:] + [len(f)]))
    lower = ranges.get("lower", [])
    shift = lower[-1][1] if lower else 0
    upper = ranges.get("upper", lower if "reduced/alike" in tables and tables["reduced/alike"][()] else [])
    ranges["both"] = lower + [(a + shift, b + shift) for a, b in upper]
    return ranges


def members(file):
    items = {}
    file.visititems(lambda name, item: items.__setitem__(name, item))
    return {name: item for name, item in items.items() if not any(fnmatch(name, s) for s in SKIPPED)}


def same(a, b):
    return np.shape(a) == np.shape(b) and np.all(np.asarray(a) == np.asarray(b))


def files(a, b, bases, limit):
    before, after = members(a), members(b)
    lines = [
        f"{n}: only in the results of the {'earlier' if n in before else 'present'} program"
        for n in sorted(set(before) ^ set(after))
        if not intended(n)
    ]
    worst, count = (0.0, ""), 0
    for name in sorted(set(before) & set(after)):
        one, two = before[name], after[name]
        for key in sorted((set(one.attrs) | set(two.attrs)) - {"sha256", "DIMENSION_LABELS"}):
            if not same(one.attrs.get(key), two.attrs.get(key)):
                lines.append(f"{name}: attribute {key} was {one.attrs.get(key)!r}, is {two.attrs.get(key)!r}")
        if isinstance(one, h5py.Group) or isinstance(two, h5py.Group):
            if type(one) is not type(two):
                lines.append(f"{name}: was a {type(one).__name__}, is a {type(two).__name__}")
            continue
        count += 1
        if one.shape != two.shape or one.dtype != two.dtype:
            lines.append(f"{name}: was {one.dtype}{list(one.shape)}, is {two.dtype}{list(two.shape)}")
            continue
        line, distance = values(
            name, one, two, a, bases, max([limit, *(v for path, v in LIMITS.items() if fnmatch(name, path))])
        )
        if intended(name):
            line, distance = None, 0.0
        if line:
            lines.append(f"{name}: {line}")
        worst = (distance, name) if distance > worst[0] else worst
    return lines, count, worst


def values(name, one, two, a, bases, limit):
    """Difference, or None; and the distance relative to the measure."""
    x, y = one[()], two[()]
    if one.dtype.kind == "O":
        read = lambda v: json.loads(v) if name.endswith("inputs") else v  # noqa: E731
        return (
            (None, 0.0)
            if (read(x) == read(y) if one.shape == () else list(x) == list(y))
            else (f"was {brief(x)}, is {brief(y)}", 0.0)
        )
    if one.dtype.kind not in "fc":
        if np.array_equal(x, y):
            return None, 0.0
        where = np.argwhere(np.asarray(x != y))
        return (
            f"{len(where)} of {np.size(x)} differ, first {list(map(int, where[0]))}: was {first(x, where)}, is "
            f"{first(y, where)}",
            0.0,
        )
    if any(fnmatch(name, r) for r in RESIDUALS):
        of = np.max(np.abs(x), initial=0.0), np.max(np.abs(y), initial=0.0)
        allowed = limit if limit > LIMIT else 0.1 * limit
        return (
            None
            if of[1] <= max(10 * of[0], allowed * measure(name, a, 1.0))
            else f"has grown from {of[0]:.1e} to {of[1]:.1e}"
        ), 0.0
    if np.any(np.isnan(x) != np.isnan(y)):
        return "not a number at other places", 0.0
    x, y = np.nan_to_num(x), np.nan_to_num(y)
    y = turned(name, x, y, a, bases)
    limit = SINGLE if one.dtype in (np.float32, np.complex64) else limit
    distance = np.abs(x - y) / (measure(name, a, np.max(np.abs(x), initial=0.0)) or 1.0)
    worst = float(np.max(distance, initial=0.0))
    if worst <= limit:
        return None, worst if limit != SINGLE else 0.0
    where = np.argwhere(distance > limit)
    top = np.unravel_index(np.argmax(distance), distance.shape)
    return (
        f"{worst:.1e} apart at {list(map(int, top))}: was {x[top]!r}, is {y[top]!r}; {len(where)} of {x.size} beyond "
        f"{limit:.0e}",
        worst,
    )


def measure(name, file, own):
    path, factor = MEASURES.get(name, (None, None))
    if factor is None:
        return own
    return factor * (np.max(np.abs(file[path][()])) if path else 1.0)


def turned(name, x, y, file, bases):
    """The second values with signs, and rotations within a cluster, that bring them nearest to the first ones."""
    if name == "VTKHDF/PointData/shape" and "modes/body" in file:
        body = file["modes/body"][()]
        columns = [x.reshape(len(body), -1).T.astype(float), y.reshape(len(body), -1).T.astype(float)]
        spans = []
        for k, label in ((1, "lower"), (2, "upper")):
            at = np.flatnonzero(body == k)
            if len(at):
                spans += [at[a:b] for a, b in bases[label if label in bases else "lower"]]
        return rotated(*columns, spans).T.reshape(x.shape)
    if name == "VTKHDF/PointData/motion" and "modes/phase" in file:
        # One step for each phase of a mode, whose sign is free.
        steps = len(file["modes/phase"])
        x, y = x.reshape(steps, -1), y.reshape(steps, -1)
        return (y * np.where((x * y).sum(axis=1) < 0, -1.0, 1.0)[:, None]).reshape(-1, 3)
    if name.endswith("/contact_modes"):
        body = name.split("/")[1]
        return rotated(x, y, [np.arange(a, b) for a, b in bases[body]])
    if name == "transient/modal_displacement":
        return rotated(x, y, [np.arange(a, b) for a, b in bases["both"]])
    if name == "stability/participation":
        # Shares within a cluster only add up.
        return y if all(b - a == 1 for a, b in bases["both"]) else shared(x, y, bases["both"])
    return y


def rotated(x, y, spans):
    """Columns of y, those of each span turned by the orthogonal matrix that fits x best."""
    y = y.copy()
    for at in spans:
        u, _, v = np.linalg.svd(y[:, at].T @ x[:, at])
        y[:, at] = y[:, at] @ (u @ v)
    return y


def shared(x, y, spans):
    y = y.copy()
    for a, b in spans:
        y[:, a:b] = x[:, a:b] + ((y[:, a:b] - x[:, a:b]).sum(axis=1, keepdims=True) / (b - a))
    return y


def brief(value):
    text = str(value.decode() if isinstance(value, bytes) else value)
    return text if len(text) < 120 else text[:117] + "..."


def first(values, where):
    return np.asarray(values)[tuple(where[0])] if np.ndim(values) else values
