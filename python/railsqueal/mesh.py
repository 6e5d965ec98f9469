"""Fields on the mesh: the pieces of all ranks joined, the points on their borders once."""

from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np
from numpy.typing import NDArray

from .errors import ResultError
from .result import Floats, Integers

# Faces of the cells by VTK's number of their kind, outward, corners only; a triangle repeats its last corner.
FACES: dict[int, list[list[int]]] = {
    10: [[0, 2, 1, 1], [0, 1, 3, 3], [1, 2, 3, 3], [2, 0, 3, 3]],
    12: [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]],
    13: [[0, 1, 2, 2], [3, 5, 4, 4], [0, 3, 4, 1], [1, 4, 5, 2], [2, 5, 3, 0]],
    14: [[0, 3, 2, 1], [0, 1, 4, 4], [1, 2, 4, 4], [2, 3, 4, 4], [3, 0, 4, 4]],
}
# Cells that lie on the surface of a body: those of a contact grid that its mesh does not have.
FLAT = (5, 9)
# Quadratic kinds have the corners of these first.
FACES |= {24: FACES[10], 25: FACES[12], 26: FACES[13], 29: FACES[12]}


class Mesh:
    """Points [p, 3] in m, and cells of both bodies: cell i has the points `connectivity[offsets[i]:offsets[i + 1]]` and
    is of VTK's kind `types[i]`.

    `body` [p] and `cell_body` [c] are 1 for the lower and 2 for the upper body. Cells of a contact grid on the surfaces
    have points of their own.
    """

    def __init__(self, root: Any) -> None:
        points, body = (
            np.asarray(root["Points"][()], dtype=np.float64),
            np.asarray(root["PointData/body"][: len(root["Points"])]),
        )
        count = {
            name: np.asarray(root[f"NumberOf{name}"][()], dtype=np.int64)
            for name in ("Points", "Cells", "ConnectivityIds")
        }
        starts = np.concatenate([[0], np.cumsum(count["Points"])[:-1]])
        joined = np.asarray(root["Connectivity"][()], dtype=np.int64) + np.repeat(starts, count["ConnectivityIds"])
        lengths = np.concatenate(
            [np.diff(piece) for piece in np.split(root["Offsets"][()], np.cumsum(count["Cells"] + 1)[:-1])]
        )
        self.offsets: Integers = np.concatenate([[0], np.cumsum(lengths)])
        self.types: NDArray[np.uint8] = np.asarray(root["Types"][()])
        on_surface = np.zeros(len(points))
        on_surface[joined[np.repeat(np.isin(self.types, FLAT), lengths)]] = 1
        # Two bodies that touch have points at one place, which stay two; so have a body and the contact grid on it.
        place = np.column_stack([points + 0.0, body, on_surface])
        _, self.first, self._same = np.unique(place, axis=0, return_index=True, return_inverse=True)
        self._same = self._same.reshape(-1)
        self.points: Floats = points[self.first]
        self.body: NDArray[np.int8] = body[self.first]
        self.connectivity: Integers = self._same[joined]
        self.cell_body: NDArray[np.int8] = self.body[self.connectivity[self.offsets[:-1]]]

    def __len__(self) -> int:
        return len(self.types)

    def cells(self, kind: int, body: int | None = None) -> Integers:
        """Points [c, n] of the cells of a kind, of one body or of both."""
        chosen = np.flatnonzero((self.types == kind) & ((self.cell_body == body) if body else True))
        if not len(chosen):
            return np.zeros((0, 0), dtype=np.int64)
        size = int(self.offsets[chosen[0] + 1] - self.offsets[chosen[0]])
        return np.asarray(self.connectivity[self.offsets[chosen][:, None] + np.arange(size)])

    def surface(self, body: int | None = None) -> Integers:
        """Faces [f, 4] of the bodies that belong to one cell alone, outward; a triangle repeats its last corner."""
        faces: list[Integers] = []
        for kind in np.setdiff1d(self.types, FLAT):
            if int(kind) not in FACES:
                raise ResultError(
                    f"cells of VTK's kind {kind} have no surface here; there is one for {', '.join(map(str, FACES))}"
                )
            cells = self.cells(int(kind), body)
            if len(cells):
                faces.append(cells[:, FACES[int(kind)]].reshape(-1, 4))
        if not faces:
            raise ResultError(f"the mesh has no cells of body {body}")
        all_faces = np.concatenate(faces)
        _, index, times = np.unique(np.sort(all_faces, axis=1), axis=0, return_index=True, return_counts=True)
        return np.asarray(all_faces[index[times == 1]], dtype=np.int64)


class Fields:
    """Fields of a result file or of a sequence (`FILE.free_modes.vtkhdf`, `FILE.modes.vtkhdf`, `FILE.transient.vtkhdf`)
    on their mesh."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        try:
            self._file = h5py.File(self.path)
        except OSError as error:
            raise ResultError(f"cannot read {self.path}: {error}; fields are written with output.fields") from error
        if "VTKHDF" not in self._file:
            self._file.close()
            raise ResultError(f"{self.path} has no fields on a mesh (/VTKHDF): run the job with output.fields = true")
        self._root = self._file["VTKHDF"]
        self._rows = int(self._root["NumberOfPoints"][()].sum())
        self.mesh = Mesh(self._root)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    @property
    def names(self) -> list[str]:
        """Names of the fields at the points."""
        return sorted(self._root["PointData"])

    @property
    def steps(self) -> Floats:
        """Value of each step of a sequence: number of the mode, period, or time in s; of a result file one step, 0."""
        return np.asarray(self._root["Steps/Values"][()], dtype=np.float64) if "Steps" in self._root else np.zeros(1)

    def field(self, name: str, step: int = 0) -> NDArray[Any]:
        """Values [p, …] of a field at the points of `mesh`, at a step counted from 0."""
        if name not in self._root["PointData"]:
            raise ResultError(f"{self.path} has no field {name!r}; it has {', '.join(self.names)}")
        if not 0 <= step < len(self.steps):
            raise ResultError(f"{self.path} has {len(self.steps)} steps, counted from 0; there is no step {step}")
        data = self._root[f"PointData/{name}"]
        offsets = f"Steps/PointDataOffsets/{name}"
        begin = int(self._root[offsets][step]) if offsets in self._root else 0
        return np.asarray(data[begin : begin + self._rows])[self.mesh.first]

    def table(self, name: str) -> NDArray[Any]:
        """A table beside the fields, such as `modes/frequency` of a sequence of modes: one value for each step."""
        if name not in self._file:
            raise ResultError(f"{self.path} has no dataset {name}")
        return np.asarray(self._file[name][()])
