"""Results to read: the kept ones of the tree, and small ones made here."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

GOLDEN = Path(__file__).parents[2] / "tests/golden"
# Growth, limit cycle and frequency of the made transient.
RATE, CYCLE, FREQUENCY, STEP = 5.0, 2e-3, 425.0, 1e-4


@pytest.fixture
def cylinders() -> Path:
    """A real result: two coarse cylinders."""
    return GOLDEN / "two-cylinders.h5"


def dataset(file: Any, name: str, values: Any, units: str = "1") -> None:
    made = file.create_dataset(name, data=values)
    made.attrs["units"], made.attrs["description"] = units, name


def cube(x: float, z: float) -> list[list[float]]:
    """Corners of a unit cube in VTK's order, its least corner at (x, 0, z)."""
    low = [[x, 0, z], [x + 1, 0, z], [x + 1, 1, z], [x, 1, z]]
    return [[float(c) for c in p] for p in low + [[a, b, c + 1] for a, b, c in low]]


@pytest.fixture
def pieces(tmp_path: Path) -> Path:
    """Two cubes side by side of body 1 in two pieces, and a third on top of the first one of body 2, in the second piece."""
    path = tmp_path / "cubes.h5"
    first, second = cube(0, -1), cube(1, -1) + cube(0, 0)
    with h5py.File(path, "w") as file:
        root = file.create_group("VTKHDF")
        dataset(root, "Points", np.array(first + second), "m")
        dataset(root, "PointData/body", np.array([1] * 16 + [2] * 8, np.int8), "-")
        # The field is x + 10 z, so that a point in the wrong place shows.
        dataset(root, "PointData/height", np.array([p[0] + 10 * p[2] for p in first + second]), "m")
        dataset(root, "Connectivity", np.array([*range(8), *range(16)]), "-")
        dataset(root, "Offsets", np.array([0, 8, 0, 8, 16]), "-")
        dataset(root, "Types", np.full(3, 12, np.uint8), "-")
        for name, counts in (("Points", [8, 16]), ("Cells", [1, 2]), ("ConnectivityIds", [8, 16])):
            dataset(root, f"NumberOf{name}", np.array(counts))
    return path


def motion(time: Any) -> Any:
    """Velocity along y that grows at RATE to the CYCLE, m/s."""
    envelope = 1 / (1 / (1e-5 * np.exp(RATE * time)) + 1 / CYCLE)
    return envelope * np.sin(2 * np.pi * FREQUENCY * time)


@pytest.fixture
def transient(tmp_path: Path) -> Callable[..., Path]:
    """Writes a transient of 3 s that grows to a cycle: a complete file, or the segments of a stopped run."""

    def write(segments: int = 0) -> Path:
        time = STEP * np.arange(1, 30001)
        velocity = np.zeros((len(time), 1, 3))
        velocity[:, 0, 1] = motion(time)
        job = '{"title": "made", "analyses": {"transient": {"points": [{"name": "rim"}]}}}'
        tables = {"time": time, "force": np.tile([0.0, -3.0, -10.0], (len(time), 1)), "closed": np.full(len(time), 4), "point_velocity": velocity}
        tables["stick"] = np.where(time > 2, 1, 0)
        path = tmp_path / "run.h5"
        if segments:
            folder = tmp_path / "run.transient"
            folder.mkdir()
            with h5py.File(folder / "000000000000.h5", "w") as file:
                dataset(file, "checkpoint/job", job, "-")
                dataset(file, "reduced/x", np.array([-1e-3, 0, 1e-3]), "m")
                dataset(file, "reduced/y", np.array([0, 1e-3, 3e-3]), "m")
            for k, part in enumerate(np.array_split(np.arange(len(time)), segments)):
                with h5py.File(folder / f"{part[-1] + 1:012d}.h5", "w") as file:
                    for name, values in tables.items():
                        dataset(file, f"transient/{name}", values[part])
            return path
        with h5py.File(path, "w") as file:
            for name, values in tables.items():
                dataset(file, f"transient/{name}", values)
            dataset(file, "transient/points/name", ["rim"], "-")
            dataset(file, "provenance/job", job, "-")
            # The mode that grows, another one that grows faster at another frequency, and a stable one.
            dataset(file, "stability/eigenvalue", np.array([9 + 2j * np.pi * 600, RATE + 2j * np.pi * FREQUENCY, -3 + 2j * np.pi * 424]), "1/s")
        return path

    return write
