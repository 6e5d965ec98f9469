"""Opening of results: complete files, and what a stopped run has left. Every fault names the file and the dataset."""

import json
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from .errors import ResultError

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Complexes = NDArray[np.complex128]


class Result:
    """A result open for reading: `FILE.h5`, or, where a run was stopped before that file was there, the segments in
    `FILE.transient/`.

    Datasets are read by their path as docs/reference/output.md has it: `result["contact/force"]`. The tables of an
    analysis are in `railsqueal.tables`, fields on the mesh in `railsqueal.mesh`.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._derived: dict[str, Any] = {}
        self.stopped = not self.path.exists() and bool(segments(self.path))
        self._paths = segments(self.path) if self.stopped else [self.path]
        self._files: list[Any] = []
        try:
            # A run may leave more segments than files can be open: the first one has the job and the model, all others
            # the same tables.
            for file in dict.fromkeys([self._paths[0], self._paths[-1]]):
                self._files.append(h5py.File(file))
        except OSError as error:
            self.close()
            if not Path(file).exists():
                message = f"{file}: no such file; expected a result file that `railsqueal run JOB` wrote"
                raise ResultError(message) from error
            raise ResultError(f"cannot read {file}: {error}") from error
        if self.stopped:
            self._derived = derived(self)

    def close(self) -> None:
        """Closes the file."""
        for file in self._files:
            file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __contains__(self, name: str) -> bool:
        return name in self._derived or any(name in file for file in self._files)

    def __getitem__(self, name: str) -> Any:
        """A dataset as h5py reads it; what grows with time is joined over the segments of a stopped run."""
        if name in self._derived:
            return self._derived[name]
        dataset = self._dataset(name)
        try:
            if self.stopped and name.startswith(("transient/", "transient_")):
                return np.concatenate(list(self._pieces(name)))
            return dataset[()]
        except OSError as error:
            raise ResultError(
                f"{self.path}: cannot read {name}: {error}; bring the file back from a copy, or run the job again"
            ) from error

    def _pieces(self, name: str) -> Iterator[NDArray[Any]]:
        for path in self._paths:
            with h5py.File(path) as file:
                if name in file:
                    yield file[name][()]

    def _dataset(self, name: str) -> Any:
        holders = [file for file in self._files if name in file]
        if not holders:
            groups = sorted({group for file in self._files for group in file})
            near = name.split("/")[0]
            there = (
                f"/{near} has {', '.join(self._files[-1][near])}"
                if near in self._files[-1] and near != name
                else f"it has {', '.join(groups)}"
            )
            raise ResultError(f"{self.path} has no dataset {name}; {there}")
        if not isinstance(holders[0][name], h5py.Dataset):
            raise ResultError(
                f"{self.path}: {name} is a group, not a dataset; it has {', '.join(sorted(holders[0][name]))}"
            )
        return holders[0][name]

    def names(self, group: str = "/") -> list[str]:
        """Paths of all datasets of a group and of the groups in it, sorted."""
        found: set[str] = set()
        for file in self._files:
            file.visititems(lambda name, item: found.add(name) if isinstance(item, h5py.Dataset) else None)
        prefix = group.strip("/") + "/" if group.strip("/") else ""
        return sorted(name for name in found | set(self._derived) if name.startswith(prefix))

    def units(self, name: str) -> str:
        """Units of a dataset; `1` of numbers without one, `-` of text."""
        return str(self._dataset(name).attrs.get("units", "-"))

    def description(self, name: str) -> str:
        """Description of a dataset."""
        return str(self._dataset(name).attrs.get("description", ""))

    def dimensions(self, name: str) -> list[str]:
        """Labels of the dimensions of a dataset; empty where the file has none."""
        found = self._dataset(name)
        labels = found.attrs.get("DIMENSION_LABELS")
        given = [] if labels is None else [t.decode() if isinstance(t, bytes) else str(t or "") for t in labels]
        return (given + [""] * found.ndim)[: found.ndim]

    def array(self, name: str) -> Floats:
        """A dataset of numbers in double precision."""
        return np.asarray(self[name], dtype=np.float64)

    def optional(self, name: str) -> Floats | None:
        """The same, or None where the file does not have it."""
        return self.array(name) if name in self else None

    def integers(self, name: str) -> Integers:
        """A dataset of whole numbers."""
        return np.asarray(self[name], dtype=np.int64)

    def complexes(self, name: str) -> Complexes:
        """A dataset of complex numbers."""
        return np.asarray(self[name], dtype=np.complex128)

    def number(self, name: str) -> float:
        """A scalar."""
        value = np.asarray(self[name])
        if value.size != 1:
            raise ResultError(f"{self.path}: {name} has the shape {value.shape}, expected one number")
        return float(value.reshape(()))

    def texts(self, name: str) -> list[str]:
        """A dataset of texts; one text is a list of one."""
        return [t.decode() if isinstance(t, bytes) else str(t) for t in np.atleast_1d(self[name])]

    @property
    def stem(self) -> str:
        """Name of the file without its ending."""
        return self.path.stem

    @property
    def job(self) -> dict[str, Any]:
        """The resolved job; empty where the file has none."""
        name = "checkpoint/job" if self.stopped else "provenance/job"
        if name not in self:
            return {}
        try:
            job = json.loads(self.texts(name)[0])
        except ValueError as error:
            raise ResultError(f"{self.path}: {name} is no JSON: {error}") from error
        return job if isinstance(job, dict) else {}

    def companion(self, suffix: str) -> Path:
        """Path of a file that goes with this one."""
        return self.path.with_name(f"{self.path.stem}.{suffix}")


def segments(path: Path) -> list[Path]:
    """The segments that the transient of a run to this file writes, in the order of time."""
    return sorted(path.with_name(f"{path.stem}.transient").glob("[0-9]*.h5"), key=lambda p: (len(p.stem), p.stem))


def derived(result: Result) -> dict[str, Any]:
    """Tables that segments of a stopped run hold in another form than a complete file: names of the points, and the
    contact grid."""
    made: dict[str, Any] = {}
    points = lookup(result.job, "analyses.transient.points") or []
    if points:
        made["transient/points/name"] = np.array([str(p.get("name", "")) for p in points], dtype=object)
    suffix, number = "", 1
    while f"reduced/x{suffix}" in result and f"reduced/y{suffix}" in result:
        x, y = result.array(f"reduced/x{suffix}"), result.array(f"reduced/y{suffix}")
        grid = f"transient{suffix}/grid"
        made[f"{grid}/x"], made[f"{grid}/y"] = np.tile(x, len(y)), np.repeat(y, len(x))
        made[f"{grid}/weight"] = np.outer(widths(y), widths(x)).reshape(-1)
        number += 1
        suffix = f"_{number}"
    return made


def widths(lines: Floats) -> Floats:
    """Width that belongs to each line of a grid: half the way to its neighbours."""
    half = 0.5 * np.diff(lines)
    return np.asarray(np.concatenate([half[:1], half[:-1] + half[1:], half[-1:]]))


def lookup(job: Any, path: str, default: Any = None) -> Any:
    """Value of a dotted path in a job."""
    for key in path.split("."):
        if not isinstance(job, dict) or key not in job:
            return default
        job = job[key]
    return job
