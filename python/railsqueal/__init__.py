"""Result files of railsqueal: open one, take its tables as arrays and its fields on the mesh, draw, report, compare and
export them.

    from railsqueal import Result, ComplexModes, Fields

    with Result("curve.h5") as result:
        modes = ComplexModes.from_result(result)
        print([modes.name(k) for k in modes.unstable])
    with Fields("curve.free_modes.vtkhdf") as fields:
        shape = fields.field("shape", step=0)      # [points, 3]

Units are SI, shapes those of docs/reference/output.md. What is wrong with a file is a `ResultError` in words.
"""

from .curving import Curving, CurvingRadii
from .errors import ResultError
from .mesh import Fields, Mesh
from .result import Result, lookup
from .tables import ComplexModes, ContactGrid, CreepCurve, Cycles, History, Modes, Provenance, Receptances, Sweep

__all__ = [
    "ComplexModes",
    "ContactGrid",
    "CreepCurve",
    "Curving",
    "CurvingRadii",
    "Cycles",
    "Fields",
    "History",
    "Mesh",
    "Modes",
    "Provenance",
    "Receptances",
    "Result",
    "ResultError",
    "Sweep",
    "lookup",
]
