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
    """Two cubes side by side of body 1 in two pieces, and a third on top of the first one of body 2, in the second
    piece."""
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
        tables = {
            "time": time,
            "force": np.tile([0.0, -3.0, -10.0], (len(time), 1)),
            "closed": np.full(len(time), 4),
            "point_velocity": velocity,
        }
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
            dataset(
                file,
                "stability/eigenvalue",
                np.array([9 + 2j * np.pi * 600, RATE + 2j * np.pi * FREQUENCY, -3 + 2j * np.pi * 424]),
                "1/s",
            )
        return path

    return write


# Places of contact of the made bogie in a curve to the right of 300 m: wheel, position on it, contact angle,
# rolling radius, normal force, creepages, creep force, lateral force.
PLACES = (
    (0, 14.7e-3, -8.1e-3, 0.459747, 56381.0, (0.34e-2, -0.6615e-2, -0.0157), (-9766.0, -17148.0), -17602.0),
    (1, -38.4e-3, 1.2225, 0.472032, 9084.0, (-1.8241e-2, -1.9381e-2, 2.033), (1810.0, -2614.0), 7647.0),
    (1, -33.2e-3, 0.5732, 0.465496, 57274.0, (-0.4092e-2, -0.7873e-2, 1.1741), (7500.0, -18590.0), 15443.0),
    (2, -8.2e-3, -65.5e-3, 0.460399, 62361.0, (-0.3302e-2, -0.0371e-2, -0.139), (18524.0, -52.0), -4135.0),
    (3, 5.2e-3, 19.7e-3, 0.459864, 57738.0, (0.2851e-2, -0.037e-2, 0.0461), (-18547.0, -2488.0), -1352.0),
)
# Radii of the made curves, falling; the last one has no equilibrium.
RADII = (600.0, 300.0, 150.0, 100.0)


@pytest.fixture
def curving(tmp_path: Path) -> Path:
    """A bogie in a curve whose leading outer wheel touches at two places, and other radii; creepages go as 1/R."""
    path = tmp_path / "bogie.h5"
    wheel, wheel_y, angle, radius, normal, creepage, creep, lateral = (np.array(column) for column in zip(*PLACES))
    tables = {
        "wheel_y": (wheel_y, "m"),
        "rail_y": (wheel_y, "m"),
        "position": (np.column_stack([0 * wheel_y, np.where(wheel % 2 == 0, 0.75, -0.75)]), "m"),
        "contact_angle": (angle, "rad"),
        "rolling_radius": (radius, "m"),
        "normal_force": (normal, "N"),
        "half_axes": (np.full((len(wheel), 2), 5e-3), "m"),
        "friction": (np.full(len(wheel), 0.35), "1"),
        "creepage": (creepage, "1, 1, 1/m"),
        "creep_force": (creep, "N"),
        "force": (np.column_stack([creep[:, 0], lateral, -normal * np.cos(angle)]), "N"),
        "utilisation": (np.hypot(*creep.T) / (0.35 * normal), "1"),
    }
    heaviest = [0, 2, 3, 4]
    with h5py.File(path, "w") as file:
        root = file.create_group("curving")
        numbers = {"curvature": 1 / 300, "speed": 10.0, "wheelbase": 2.5, "circles": 1.5}
        for name, value in (numbers | {"axle_load": 120e3, "residual": 1e-9}).items():
            dataset(root, name, value)
        dataset(root, "frame", np.array([-0.25e-3, -3.15e-3]), "m, rad")
        for name, values in (("shift", [-6.24e-3, 0.53e-3]), ("yaw", [-6.61e-3, -0.37e-3]), ("roll", [0.0, 0.0])):
            dataset(root, f"axles/{name}", np.array(values))
            if name != "roll":
                over = np.outer(300 / np.array(RADII), values)
                over[-1] = np.nan
                dataset(root, f"radii/{name}", over)
        dataset(root, "axles/angular_speed", np.array([21.7, 21.7]), "rad/s")
        dataset(root, "axles/suspension", np.zeros((2, 2)), "N, N m")
        dataset(root, "contacts/wheel", wheel, "-")
        dataset(root, "radii/radius", np.array(RADII), "m")
        dataset(root, "radii/message", [""] * 3 + ["no equilibrium <R = 100 m>"], "-")
        dataset(root, "radii/places", np.array([[1, 1, 1, 1], [1, 2, 1, 1], [1, 2, 1, 1], [0, 0, 0, 0]]))
        for name, (values, units) in tables.items():
            dataset(root, f"contacts/{name}", values, units)
            grown = 300 / np.array(RADII) if name == "creepage" else np.ones(len(RADII))
            over = np.multiply.outer(grown, values[heaviest])
            over[-1] = np.nan
            dataset(root, f"radii/{name}", over, units)
    return path
