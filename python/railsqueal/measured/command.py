"""`railsqueal fit FILE.uff`: natural frequencies and damping of measured frequency responses, as keys for the job."""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import USAGE, WRITING, ResultError
from ..result import Complexes, Floats
from .modal_fit import BandFit, FittedMode, fit, fit_band
from .shapes import LEAST, BodyFrame, Shape, of_fit, of_mode
from .universal import FileMode, MeasuredResponse, UniversalFile

# Digits of a frequency and of damping that go into a job.
DIGITS = 6
# Most modes of a band.
MOST = 20


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add = parser.add_argument
    add("file", type=Path, metavar="FILE.uff", help="universal file with frequency responses (58) or modes (55)")
    add(
        "--band",
        action="append",
        default=[],
        metavar="FROM,TO",
        help="frequencies within which modes are fitted, Hz (default: about each peak); repeatable",
    )
    add("--modes", type=int, metavar="N", help="modes in each band (default: as many as the responses tell)")
    add("--datasets", metavar="LIST", help="numbers of the responses that are fitted together: 3,4 (default: all)")
    add(
        "--axes",
        metavar="X,Y,Z",
        help="write shapes as well: axes of the file along x, y, z of the body, -X,... for the other way",
    )
    add("--origin", metavar="X,Y,Z", help="origin of the body in the axes of the file, m (default 0,0,0)")
    add("--out", type=Path, metavar="DIR", help="folder of JSON and picture (default: beside the file)")
    add("--format", default="png", metavar="LIST", help="png, pdf, svg, or several: png,pdf (default png)")


def run(given: argparse.Namespace) -> int:
    """Fits, prints a table, and writes the keys and the picture."""
    if given.modes is not None and not 1 <= given.modes <= MOST:
        raise ResultError(f"--modes: found {given.modes}, expected 1 to {MOST}", USAGE)
    bands = [band(text) for text in given.band]
    if given.origin is not None and given.axes is None:
        raise ResultError("--origin: found without --axes, expected both", USAGE)
    frame = None if given.axes is None else BodyFrame.parse(given.axes, given.origin)
    file = UniversalFile.read(given.file)
    for words in file.others:
        print(f"left out: {words}")
    directory = given.out or given.file.parent
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ResultError(f"cannot write to {directory}: {error}", WRITING) from error
    if not file.responses:
        return listed(file, frame, directory / f"{given.file.stem}-fit.json")
    responses = chosen(file, given.datasets)
    frequency, values = together(file.path, responses)
    fits = fitted(frequency, values, bands, given.modes)
    print(f"{len(responses)} frequency responses, {len(frequency)} lines from {frequency[0]:g} to {frequency[-1]:g} Hz")
    for response in responses:
        print(f"  {response.title}")
    modes = [mode for one in fits for mode in one.modes]
    for one in fits:
        if not one.modes:
            print(f"{one.band[0]:.5g} to {one.band[1]:.5g} Hz: no mode that is certain; give --band and --modes")
    if not modes:
        raise ResultError(
            f"{file.path}: found no mode that is certain, expected peaks of {len(frequency)} lines or more; give "
            "--band FROM,TO with --modes N, or measure with finer lines"
        )
    print("\n".join(table(modes)))
    for remark in [remark for one in fits for remark in one.remarks]:
        print(f"remark: {remark}")
    entries = [entry(mode) for mode in modes]
    if frame is not None:
        residues = [column for one in fits for column in one.residues.T]
        add_shapes(entries, [of_fit(file, responses, column, frame) for column in residues])
    made = [write(directory / f"{given.file.stem}-fit.json", entries)]
    from ..pictures import Canvas  # matplotlib takes a second
    from ..pictures import fit as drawn

    canvas = Canvas(directory, given.file.stem, given.format.split(","))
    made += drawn.draw(canvas, responses, fits)
    print("\n".join(str(path) for path in made))
    return 0


def band(text: str) -> tuple[float, float]:
    """The ends of `340,375`, Hz."""
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError:
        low = high = np.nan
    if not 0 < low < high < np.inf:
        raise ResultError(f"--band: found {text!r}, expected two frequencies in Hz such as 340,375", USAGE)
    return low, high


def chosen(file: UniversalFile, datasets: str | None) -> list[MeasuredResponse]:
    """The responses with the numbers that are asked for."""
    if datasets is None:
        return file.responses
    there = {response.dataset: response for response in file.responses}
    wanted = [part.strip() for part in datasets.split(",")]
    for part in wanted:
        if not part.isdigit() or int(part) not in there:
            raise ResultError(
                f"--datasets: found {part!r}, expected numbers of frequency responses, of which there are "
                f"{', '.join(str(number) for number in there)}:\n{file.listing}",
                USAGE,
            )
    return [there[int(part)] for part in wanted]


def together(path: Path, responses: list[MeasuredResponse]) -> tuple[Floats, Complexes]:
    """Frequencies and values of responses as they were measured, `[K, f]`."""
    first = responses[0]
    for other in responses[1:]:
        if len(other.frequency) != len(first.frequency) or not np.allclose(other.frequency, first.frequency, rtol=1e-6):
            raise ResultError(
                f"{path}: datasets {first.dataset} and {other.dataset} have other frequencies; choose responses with "
                "the same ones by --datasets",
                USAGE,
            )
    return first.frequency, np.array([response.measured for response in responses])


def fitted(frequency: Floats, values: Complexes, bands: list[tuple[float, float]], modes: int | None) -> list[BandFit]:
    """Fits the bands, or all peaks where there are none."""
    if not bands:
        return fit(frequency, values, modes)
    made = []
    for low, high in bands:
        at = (frequency >= low) & (frequency <= high)
        least = 2 * ((modes or 1) + 3) + 2
        if at.sum() < least:
            raise ResultError(
                f"--band: found {at.sum()} lines from {low:g} to {high:g} Hz, expected at least {least}; the file "
                f"reaches from {frequency[0]:g} to {frequency[-1]:g} Hz",
                USAGE,
            )
        made.append(fit_band(frequency[at], values[:, at], [modes] if modes else range(1, 7)))
    return made


def table(modes: list[FittedMode]) -> list[str]:
    """Lines of a table of modes."""
    lines = [f"{'frequency, Hz':>24}{'damping ratio':>28}{'loss factor':>13}"]
    for mode in modes:
        frequency = f"{mode.frequency:.4f} ± {mode.frequency_deviation:.4f}"
        ratio = f"{mode.damping_ratio:.4e} ± {mode.damping_deviation:.1e}"
        lines.append(f"{frequency:>24}{ratio:>28}{mode.loss_factor:>13.4e}")
    return lines


def rounded(value: float) -> float:
    """The number with as many digits as a job needs."""
    return float(f"{value:.{DIGITS + 2}g}")


def entry(mode: FittedMode | FileMode) -> dict[str, Any]:
    """The item of `bodies.*.modes.measured` of a mode."""
    made: dict[str, Any] = {"near": rounded(mode.frequency), "frequency": rounded(mode.frequency)}
    if mode.damping_ratio is not None:
        made["damping_ratio"] = float(f"{mode.damping_ratio:.{DIGITS}g}")
    if isinstance(mode, FittedMode):
        deviations = {"frequency": mode.frequency_deviation, "damping_ratio": mode.damping_deviation}
        made |= {f"{key}_deviation": float(f"{value:.2g}") for key, value in deviations.items() if value > 0}
    return made


def add_shapes(entries: list[dict[str, Any]], shapes: list[Shape]) -> None:
    """Puts the shapes into the items, by which the modes are found then; prints why one is left out."""
    for item, shape in zip(entries, shapes):
        remark = shape.remark(item["frequency"])
        if remark:
            print(f"remark: {remark}")
        if len(shape.components) >= LEAST:
            del item["near"]
            item["shape"] = shape.value


def write(path: Path, entries: list[dict[str, Any]]) -> Path:
    """Writes the value of `bodies.*.modes` with these items."""
    try:
        path.write_text(json.dumps({"measured": entries}, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise ResultError(f"cannot write {path}: {error}", WRITING) from error
    return path


def listed(file: UniversalFile, frame: BodyFrame | None, path: Path) -> int:
    """Modes that the file lists itself."""
    if not file.modes:
        raise ResultError(
            f"{file.path}: found neither frequency responses (dataset 58, function type 4) nor modes (dataset 55)"
        )
    for mode in file.modes:
        ratio = "no damping" if mode.damping_ratio is None else f"damping ratio {mode.damping_ratio:.4e}"
        print(f"dataset {mode.dataset}: mode at {mode.frequency:.4f} Hz, {ratio}")
    entries = [entry(mode) for mode in file.modes]
    if frame is not None:
        add_shapes(entries, [of_mode(file, mode, frame) for mode in file.modes])
    print(write(path, entries))
    return 0
