"""Pictures of a railsqueal result file."""

import argparse
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # no screen is needed

import campbell  # noqa: E402
import contact  # noqa: E402
import creep_curve  # noqa: E402
import modes  # noqa: E402
import placement  # noqa: E402
import receptance  # noqa: E402
import style  # noqa: E402
import sweep  # noqa: E402
import transient  # noqa: E402
from results import Results, ResultsError  # noqa: E402


def main():
    parser = argparse.ArgumentParser(prog="scripts/plot", description=__doc__)
    parser.add_argument("file", type=Path, help="result file (.h5)")
    parser.add_argument("--out", type=Path, help="directory of the pictures (default: beside the file)")
    parser.add_argument("--modes", type=int, default=12, metavar="N", help="modes drawn for each body (default 12)")
    arguments = parser.parse_args()
    style.apply()
    out = arguments.out or arguments.file.parent
    try:
        with Results(arguments.file) as results:
            out.mkdir(parents=True, exist_ok=True)
            made = contact.pictures(results, out) + modes.pictures(results, out, arguments.modes)
            made += campbell.pictures(results, out) + receptance.pictures(results, out) + sweep.pictures(results, out)
            made += placement.pictures(results, out) + creep_curve.pictures(results, out) + transient.pictures(results, out)
    except ResultsError as error:
        sys.exit(fail(error, 3))
    except OSError as error:
        sys.exit(fail(f"cannot write to {out}: {error}", 6))
    if not made:
        sys.exit(fail(f"{arguments.file} holds no contact, no modes, no receptances, no sweep, no creep curve and no transient: nothing to draw", 3))
    for path in made:
        print(path)


def fail(message, code):
    print(message, file=sys.stderr)
    return code


main()
