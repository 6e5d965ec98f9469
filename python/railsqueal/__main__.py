"""The command line: `python -m railsqueal COMMAND FILE.h5`. Exit codes are those of the solver: 0 done, 2 usage, 3
input, 6 writing."""

import argparse
import sys
import unicodedata
from pathlib import Path

from . import compare, export, sound
from .errors import INPUT, USAGE, ResultError
from .measured import Measurements
from .measured import command as fit
from .measured.overlay import Overlay
from .result import Result
from .section import command as section
from .track_decay import MeasuredDecay


def main(arguments: list[str] | None = None) -> int:
    """Runs a command; its exit code."""
    given = parser().parse_args(arguments)
    try:
        return int(given.run(given))
    except ResultError as error:
        print(f"railsqueal: error: {printable(str(error))}", file=sys.stderr)
        return error.code
    except BrokenPipeError:
        # A reader that has seen enough (`| head`) is no error.
        sys.stderr.close()
        return 0


def printable(text: str) -> str:
    """The text with characters that steer a terminal as escapes; lines and tabs stay."""

    def steers(c: str) -> bool:
        return c not in "\n\t" and unicodedata.category(c) in ("Cc", "Cf", "Zl", "Zp")

    return "".join(f"\\u{{{ord(c):x}}}" if steers(c) else c for c in text)


def parser() -> argparse.ArgumentParser:
    """All commands with their options."""
    top = argparse.ArgumentParser(prog="railsqueal", description="Result files and sections of railsqueal.")
    commands = top.add_subparsers(required=True, metavar="COMMAND")

    def command(name: str, run: object, help: str) -> argparse.ArgumentParser:
        made = commands.add_parser(name, help=help, description=help)
        made.set_defaults(run=run)
        return made

    one = command("summary", summarised, "The verdict and the summary with which the run ended.")
    one.add_argument("file", type=Path, metavar="FILE.h5")

    one = command("plot", plot, "Pictures of a result, of a stopped run as far as it came.")
    one.add_argument(
        "file",
        type=Path,
        metavar="FILE.h5",
        help="result, or the surfaces that `railsqueal check JOB --mesh FILE.vtkhdf` wrote",
    )
    one.add_argument("--out", type=Path, metavar="DIR", help="folder of the pictures (default: beside the file)")
    one.add_argument("--modes", type=int, default=12, metavar="N", help="modes drawn for each body (default 12)")
    one.add_argument("--format", default="png", metavar="LIST", help="png, pdf, svg, or several: png,pdf (default png)")
    add_measured(one)

    one = command(
        "report",
        reported,
        "One HTML file with figures, tables, pictures, warnings and provenance, and tables as CSV beside it.",
    )
    one.add_argument("file", type=Path, metavar="FILE.h5")
    one.add_argument("--out", type=Path, metavar="DIR", help="folder of the report (default: beside the file)")
    add_measured(one)

    fit.add_arguments(command("fit", fit.run, "Natural frequencies and damping of measured frequency responses."))

    codes = "Exit code 0 if they agree, 1 if not, 2 if they cannot be compared."
    one = command("compare", compared, f"What differs between two results: keys of the job, figures, tables. {codes}")
    one.add_argument("one", type=Path, metavar="A.h5")
    one.add_argument("other", type=Path, metavar="B.h5")
    one.add_argument(
        "--tolerance",
        type=float,
        default=1e-6,
        metavar="T",
        help="relative difference that counts as none (default 1e-6)",
    )

    words = "The section of a wheel or a rail from a DXF drawing or a table of coordinates, as a mesh for the job."
    section.add_arguments(command("section", section.run, words))

    one = command("sound", write_sound, "The motion of a point, or the sound of a body's modes, as a sound file.")
    one.add_argument("file", type=Path, metavar="FILE.h5")
    one.add_argument(
        "--point",
        metavar="NAME",
        help="name of the point (default: the first), or lower or upper: a body with sound power (default: the louder "
        "one, without points)",
    )
    one.add_argument("--out", type=Path, metavar="FILE.wav", help="sound file (default: beside the result)")

    one = command("export", exported, "Fields or a sequence on the joined mesh, for programs that do not read VTKHDF.")
    one.add_argument("file", type=Path, metavar="FILE", help="FILE.h5 or one of its .vtkhdf sequences")
    one.add_argument(
        "--format",
        choices=("vtu", "xdmf", "csv"),
        default="vtu",
        help="vtu: a file a step and a .pvd; xdmf: one and its .h5; csv: a table of the branches of limit cycles "
        "(default vtu)",
    )
    one.add_argument("--out", type=Path, metavar="DIR", help="folder (default: beside the file)")
    return top


def add_measured(parser: argparse.ArgumentParser) -> None:
    """Options of measured receptances beside computed ones."""
    parser.add_argument("--measured", type=Path, metavar="FILE.uff", help="universal file with measured receptances")
    parser.add_argument(
        "--point",
        action="append",
        default=[],
        metavar="BODY=NODE",
        help="node of the file at the contact point of a body: upper=12, or upper=12,13 for a response at 12 and a "
        "force at 13; repeatable",
    )
    parser.add_argument(
        "--decay",
        type=Path,
        metavar="FILE.csv",
        help="measured track decay rates: columns frequency (Hz), vertical, lateral (dB/m)",
    )
    parser.add_argument("--axes", metavar="X,Y,Z", help="axes of the file along x, y and z of the job, as in Y,-X,Z")


def measurements(given: argparse.Namespace) -> Measurements:
    """The measured values that are asked for."""
    if given.measured is None and (given.point or given.axes):
        raise ResultError("--point, --axes: found without --measured FILE.uff, which they belong to", USAGE)
    overlay = None if given.measured is None else Overlay.read(given.measured, given.point, given.axes)
    return Measurements(overlay, None if given.decay is None else MeasuredDecay.read(given.decay))


def said(paths: list[Path]) -> int:
    """Prints what was written."""
    for path in paths:
        print(path)
    return 0


def summarised(given: argparse.Namespace) -> int:
    """The summary; of results of earlier programs, which have none, the verdict and the warnings."""
    from .verdict import verdict

    with Result(given.file) as result:
        said = verdict(result)
        name = "provenance/summary" if "provenance/summary" in result else "provenance/warnings"
        lines = result.texts(name) if name in result else []
    prefix = "" if name.endswith("summary") else "warning: "
    print("\n".join([said.sentence, *said.notes, *(prefix + line for line in lines)]))
    return 0


def plot(given: argparse.Namespace) -> int:
    """Pictures."""
    from .pictures import Canvas, draw, surfaces  # matplotlib takes a second, which the other commands need not wait

    if surfaces.Surfaces.present(given.file):
        if given.measured is not None or given.decay is not None:
            raise ResultError(f"--measured, --decay: {given.file} holds surfaces of meshes, which have neither", USAGE)
        stem = given.file.name.removesuffix(".vtkhdf").removesuffix(".mesh")
        return said(surfaces.draw(given.file, Canvas(given.out or given.file.parent, stem, given.format.split(","))))
    with Result(given.file) as result:
        canvas = Canvas(given.out or given.file.parent, result.stem, given.format.split(","))
        made = draw(result, canvas, given.modes, measurements(given))
    if not made:
        words = "no contact, no modes, no receptances, no sweep, no curving, no creep curve and no transient"
        raise ResultError(f"{given.file} holds {words}: nothing to draw", INPUT)
    return said(made)


def reported(given: argparse.Namespace) -> int:
    """The report."""
    from . import report  # with matplotlib, which takes a second

    with Result(given.file) as result:
        return said(report.write(result, given.out or given.file.parent, measurements(given)))


def compared(given: argparse.Namespace) -> int:
    """The comparison."""
    if not given.tolerance >= 0:
        raise ResultError(f"--tolerance: expected a number of at least 0, found {given.tolerance}", USAGE)
    try:
        with Result(given.one) as one, Result(given.other) as other:
            text, same = compare.text(one, other, given.tolerance)
    except ResultError as error:
        # As diff has it: 1 is a difference, 2 that there is nothing to compare.
        raise ResultError(str(error), USAGE) from error
    print(text)
    return 0 if same else 1


def write_sound(given: argparse.Namespace) -> int:
    """The sound."""
    with Result(given.file) as result:
        print(sound.write(result, given.point, given.out))
    return 0


def exported(given: argparse.Namespace) -> int:
    """The export."""
    return said(export.write(given.file, given.out or given.file.parent, given.format))


if __name__ == "__main__":
    sys.exit(main())
