"""Tables of a group as an `xarray.Dataset` with named dimensions, by the labels that the program writes."""

from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import USAGE, ResultError
from .result import Result

if TYPE_CHECKING:
    import xarray


def dataset(result: Result, group: str) -> "xarray.Dataset":
    """The datasets of a group, such as `stability` or `modes/upper`, without those of the groups in it.

    A dimension is named by its label in the file, else by the name of the dataset and the number of the dimension.
    Units and descriptions are attributes. Needs xarray.
    """
    try:
        import xarray
    except ImportError as error:
        raise ResultError("xarray is not installed: pip install xarray", USAGE) from error
    prefix = group.strip("/") + "/"
    names = [n for n in result.names(group) if "/" not in n.removeprefix(prefix)]
    if not names:
        raise ResultError(f"{result.path} has no datasets in /{group.strip('/')}; it has {', '.join(groups(result))}")
    sizes: dict[str, int] = {}
    variables: dict[str, Any] = {}
    for path in names:
        name, values = path.removeprefix(prefix), np.asarray(result[path])
        if values.dtype.kind == "O":
            values = np.array([v.decode() if isinstance(v, bytes) else str(v) for v in values.ravel()], dtype=object)
            values = values.reshape(np.shape(result[path]))
        dims = []
        for axis, size in enumerate(values.shape):
            label = result.dimensions(path)[axis]
            # A name stands for one size; a label that has another one here is no name of this dimension.
            fits = label and label not in dims and sizes.setdefault(label, size) == size
            dims.append(label if fits else f"{name}_{axis}")
        attributes = {"units": result.units(path), "description": result.description(path)}
        variables[name] = (tuple(dims), values, attributes)
    made: xarray.Dataset = xarray.Dataset(variables)
    return made


def groups(result: Result) -> list[str]:
    """Groups that have datasets."""
    return sorted({name.rpartition("/")[0] for name in result.names() if "/" in name})
