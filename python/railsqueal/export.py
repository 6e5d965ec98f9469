"""Fields on the joined mesh as VTU (with a PVD for sequences) or XDMF, for programs that do not read VTKHDF; branches
of limit cycles as CSV."""

import base64
import csv
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from .errors import WRITING, ResultError
from .mesh import Fields, Mesh
from .result import Result
from .tables import Branches

VTK_TYPES = {"f4": "Float32", "f8": "Float64", "i1": "Int8", "u1": "UInt8", "i4": "Int32", "i8": "Int64"}
# Names of cells in XDMF by VTK's number; all cells of a mesh must be of one kind for it.
XDMF_TYPES = {
    10: "Tetrahedron",
    12: "Hexahedron",
    13: "Wedge",
    14: "Pyramid",
    24: "Tetrahedron_10",
    25: "Hexahedron_20",
    26: "Wedge_15",
}


def write(path: Path, directory: Path, form: str) -> list[Path]:
    """Writes all fields and steps of a result file or a sequence; the files, the one to open first."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        if form == "csv":
            with Result(path) as result:
                return [branches(result, directory / (path.name.removesuffix(".h5") + "-branches.csv"))]
        with Fields(path) as fields:
            stem = directory / path.name.removesuffix(".h5").removesuffix(".vtkhdf")
            return vtu(fields, stem) if form == "vtu" else xdmf(fields, stem)
    except OSError as error:
        raise ResultError(f"cannot write to {directory}: {error}", WRITING) from error


def branches(result: Result, path: Path) -> Path:
    """Branches of limit cycles as a table of values separated by commas, one row a cycle."""
    found = Branches.from_result(result)
    key = found.along.replace(".", "_")
    names = ["branch", key, "frequency_Hz", "kinetic_J", "velocity_rms_m/s", "stick_mean", "stick_largest"]
    names += ["normal_least_N", "normal_largest_N", "unstable", "multiplier_largest", "special", "second_frequency_Hz"]
    levels = list(found.level_a.items())
    names += [f"level_{body}_dB(A)" for body, _ in levels]
    velocity = found.velocity()
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(names)
        for k in range(len(found.key)):
            numbers = [
                found.key[k],
                found.frequency[k],
                found.kinetic[k],
                velocity[k],
                *found.stick[k],
                *found.normal[k],
            ]
            largest = abs(found.multiplier[k, 0])
            last = [
                int(found.unstable[k]),
                repr(float(largest)),
                found.special[k],
                repr(float(found.second_frequency[k])),
            ]
            sounds = [repr(float(level[k])) for _, level in levels]
            rows.writerow([int(found.branch[k]), *(repr(float(v)) for v in numbers), *last, *sounds])
    return path


def point_fields(fields: Fields, step: int) -> dict[str, NDArray[Any]]:
    """All fields at the points at a step; the body is that of the mesh."""
    return {name: fields.field(name, step) for name in fields.names if name != "body"} | {"body": fields.mesh.body}


def vtu(fields: Fields, stem: Path) -> list[Path]:
    """`STEM.vtu`, or of a sequence `STEM.pvd` with one file for each step."""
    steps = fields.steps
    if len(steps) == 1:
        path = stem.with_name(stem.name + ".vtu")
        path.write_bytes(piece(fields.mesh, point_fields(fields, 0)))
        return [path]
    made, lines = [], []
    for k, value in enumerate(steps):
        made.append(stem.with_name(f"{stem.name}_{k:05d}.vtu"))
        made[-1].write_bytes(piece(fields.mesh, point_fields(fields, k)))
        lines.append(f'    <DataSet timestep="{value:.17g}" file="{made[-1].name}"/>')
    head = stem.with_name(stem.name + ".pvd")
    body = "\n".join(lines)
    head.write_text(
        f'<VTKFile type="Collection" version="1.0">\n  <Collection>\n{body}\n  </Collection>\n</VTKFile>\n',
        encoding="utf-8",
    )
    return [head, *made]


def piece(mesh: Mesh, data: dict[str, NDArray[Any]]) -> bytes:
    """A VTU file of one piece."""
    cells: dict[str, NDArray[Any]] = {
        "connectivity": mesh.connectivity,
        "offsets": mesh.offsets[1:],
        "types": mesh.types,
    }
    parts = [
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
        'header_type="UInt64">\n<UnstructuredGrid>\n'
        f'<Piece NumberOfPoints="{len(mesh.points)}" NumberOfCells="{len(mesh)}">\n',
        "<Points>\n" + array("Points", mesh.points) + "</Points>\n",
        "<Cells>\n" + "".join(array(name, values) for name, values in cells.items()) + "</Cells>\n",
        "<PointData>\n" + "".join(array(name, values) for name, values in data.items()) + "</PointData>\n",
        "<CellData>\n" + array("body", mesh.cell_body) + "</CellData>\n",
        "</Piece>\n</UnstructuredGrid>\n</VTKFile>\n",
    ]
    return "".join(parts).encode()


def array(name: str, values: NDArray[Any]) -> str:
    """An array of a VTU file, binary inline."""
    values = np.ascontiguousarray(values)
    values = values.astype(values.dtype.newbyteorder("<"))
    kind, components = VTK_TYPES[values.dtype.str[1:]], 1 if values.ndim == 1 else values.shape[1]
    content = base64.b64encode(np.uint64(values.nbytes).tobytes()) + base64.b64encode(values.tobytes())
    head = f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="binary">'
    return f"{head}{content.decode()}</DataArray>\n"


def xdmf(fields: Fields, stem: Path) -> list[Path]:
    """`STEM.xdmf` with its arrays in `STEM.xdmf.h5`."""
    mesh = fields.mesh
    kinds = np.unique(mesh.types)
    if len(kinds) != 1 or int(kinds[0]) not in XDMF_TYPES:
        raise ResultError(
            f"{fields.path}: XDMF is written for cells of one kind, found VTK's kinds {kinds.tolist()}; export as vtu"
        )
    head, heavy = stem.with_name(stem.name + ".xdmf"), stem.with_name(stem.name + ".xdmf.h5")
    cells = mesh.cells(int(kinds[0]))
    with h5py.File(heavy, "w") as file:

        def item(name: str, values: NDArray[Any]) -> str:
            file.create_dataset(name, data=values, compression="gzip", shuffle=True)
            number = "Float" if values.dtype.kind == "f" else "Int"
            size = " ".join(map(str, values.shape))
            kind = f'NumberType="{number}" Precision="{values.dtype.itemsize}"'
            return f'<DataItem Dimensions="{size}" {kind} Format="HDF">{heavy.name}:/{name}</DataItem>'

        opening = f'<Topology TopologyType="{XDMF_TYPES[int(kinds[0])]}" NumberOfElements="{len(cells)}">'
        topology = f"{opening}{item('cells', cells)}</Topology>"
        geometry = f'<Geometry GeometryType="XYZ">{item("points", mesh.points)}</Geometry>'
        body = attribute("body", mesh.body, item("body", mesh.body))
        grids = []
        for k, value in enumerate(fields.steps):
            shown = {name: values for name, values in point_fields(fields, k).items() if name != "body"}
            data = [attribute(name, values, item(f"{name}_{k:05d}", values)) for name, values in shown.items()]
            inner = "\n".join([f'<Time Value="{value:.17g}"/>', topology, geometry, body, *data])
            grids.append(f'<Grid Name="step {k}" GridType="Uniform">\n{inner}\n</Grid>')
    content = "\n".join(grids)
    collection = f'<Grid Name="steps" GridType="Collection" CollectionType="Temporal">\n{content}\n</Grid>'
    head.write_text(
        f'<?xml version="1.0"?>\n<Xdmf Version="3.0"><Domain>\n{collection}\n</Domain></Xdmf>\n', encoding="utf-8"
    )
    return [head, heavy]


def attribute(name: str, values: NDArray[Any], item: str) -> str:
    """A field of an XDMF grid."""
    kind = "Scalar" if values.ndim == 1 else "Vector"
    return f'<Attribute Name="{name}" AttributeType="{kind}" Center="Node">{item}</Attribute>'
