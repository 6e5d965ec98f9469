"""Tutorials followed literally: their commands in order in a fresh folder, and the results that the pages promise.

usage: tutorials.py PROGRAM [--keep FOLDER] [PAGE…]

A page promises the output that it shows (blocks without a command), the files that it names, and figures in its
sentences, which PROMISES relates to the output. Numbers agree within half a per cent or a unit of the last place that
the page shows. With `--keep` outputs and files of each page stay in FOLDER.
"""

import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np
from documents import ROOT, commands, environment, place, runnable, tell

PAGES = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
NUMBER = re.compile(r"[+\u2212-]?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
# Files that a page names in its text.
NAMED = re.compile(r"`([\w-]+\.(?:png|svg|html|wav|json|h5|msh))`")
WORDS = {"no": 0, "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6}
# Share by which a number may differ from that of the page, beside a unit of its last place.
DIFFERENCE = 0.005

# Sentences with figures: a pattern of the page, one of the command, and one of its output that has the same figures, in
# the same order.
PROMISES = {
    "drawing-to-quiet-wheel.md": [
        (
            r"leading inner wheel slides sideways by ([\d.]+) % of the speed",
            r"railsqueal curving",
            r"leading inner +(?:\S+ +){5}-([\d.]+)",
        ),
        (r"this wheel squeals at (\d+) Hz", r"verdict\.h5$", r"^Squeals at (\d+) Hz"),
        (r"mode has (\w+) nodal diameters and moves along the axle", r"verdict\.h5$", r"wheel mode n = (\d+) axial"),
        (
            r"A damping ratio of ([\d.]+) for one mode",
            r"verdict\.h5$",
            r"damping ratio of upper mode [^+]*\+([\d.e-]+)",
        ),
        (r"for all modes of the wheel the verdict says (\d+\.\d+)", r"verdict\.h5$", r"higher by ([\d.]+)"),
        (
            r"wheel radiates (\d+) dB\(A\), (\d+) dB\(A\) at 7\.5 m",
            r"--output squeal\.h5",
            r"sound power of upper +([\d.]+) dB\(A\).*at 7\.5 m ([\d.]+) dB\(A\)",
        ),
    ],
    "mesh-to-sound.md": [
        (r"Here (\d+) nodes touch", r"run own-mesh", r"contact nodes closed / in stick +(\d+)"),
        (
            r"friction of [\d.]+ (\w+) modes are left, and the first one grows by ([\d.]+) 1/s",
            r"run .*softer\.h5",
            r"stability of [a-z ]+: (\d+) unstable[^\n]*\n[^\n]*growth rate \+([\d.]+)",
        ),
        (
            r"velocity grows by ([\d.]+) 1/s, fitted",
            r"transient\.duration",
            r"growth rate +\+([\d.]+) 1/s fitted",
        ),
        (
            r"linear analysis says ([\d.]+) 1/s for the mode at [\d.]+ Hz",
            r"transient\.duration",
            r"stability of [^\n]*\n[^\n]*growth rate \+([\d.]+)",
        ),
        (
            r"1/s for the mode at ([\d.]+) Hz",
            r"transient\.duration",
            r"stability of [^\n]*\n +([\d.]+) Hz",
        ),
        (
            r"([\d.]+) dB\(A\) of the upper body, most of it in the third octave of (\d+) Hz",
            r"transient\.duration",
            r"sound power of upper +([\d.]+) dB\(A\).*?third octave of (\d+) Hz",
        ),
    ],
}

# Times at which nodes begin to stick: a pattern of the page, and the result that has it.
STICK = {"mesh-to-sound.md": (r"From ([\d.]+) s on nodes stick", "squeal.h5")}


def value(text):
    """Value of a number or a word for one, and a unit of its last place."""
    if text in WORDS:
        return WORDS[text], 0.0
    text = text.replace("\u2212", "-")
    mantissa, _, exponent = text.partition("e")
    places = len(mantissa.partition(".")[2])
    return float(text), 10.0 ** (int(exponent or 0) - places)


def agree(shown, printed):
    """True if a printed number is that of the page."""
    (page, unit), (output, _) = value(shown), value(printed)
    return abs(page - output) <= max(unit, DIFFERENCE * abs(page))


def same(shown, printed):
    """True if a printed line begins with that of the page: the same words, and numbers that agree."""
    if not NUMBER.sub("#", printed).startswith(NUMBER.sub("#", shown)):
        return False
    return all(map(agree, NUMBER.findall(shown), NUMBER.findall(printed)))


def normal(line):
    """The line with single blanks."""
    return " ".join(line.split())


def blocks_of_output(page, text):
    """Blocks of a page that show output: `(first line, lines)`. Blocks with a command or a variable are left out."""
    begun = re.compile(r"(railsqueal|mpirun|scripts/|python3|\w+=\")")
    lines, found, block, fence = text.splitlines(), [], [], None
    for number, line in enumerate([*lines, ""], 1):
        if line.startswith("```"):
            fence = None if fence is not None else line[3:].strip()
            if fence is None:
                found.append(block)
            block = []
        elif fence == "":
            block.append((number, line))
        elif fence is None and line.startswith("    "):
            block.append((number, line))
        elif fence is None:
            found.append(block)
            block = []
    shown = [b for b in found if b and not any(begun.match(line.strip()) for _, line in b)]
    if not shown:
        raise SystemExit(f"{page}: shows no output")
    return shown


def lines_missing(name, text, outputs):
    """Lines of output that the page shows and no command printed."""
    printed = [normal(line) for _, output in outputs for line in output.splitlines()]
    for block in blocks_of_output(name, text):
        for number, line in block:
            shown = normal(line)
            if not shown or shown == "...":
                continue
            if not any(same(shown, line) for line in printed):
                words = NUMBER.split(shown)[0][:40]
                near = [line for line in printed if words and line.startswith(words[:12])][:3]
                yield f"{name}:{number}: no command prints {shown!r}; near it: {near}"


def files_missing(name, text, folder):
    """Files that the page names and no command made."""
    for file in sorted(set(NAMED.findall(text))):
        if not (folder / file).is_file() or (folder / file).stat().st_size == 0:
            yield f"{name}: {file} was not made"


def figures_wrong(name, text, outputs):
    """Figures of sentences that are not those of the output."""
    text = normal(text)
    for of_page, command, of_output in PROMISES.get(name, ()):
        said = re.search(of_page, text)
        if not said:
            yield f"{name}: no sentence matches {of_page!r}: mend PROMISES of tests/python/tutorials.py"
            continue
        printed = [
            found
            for line, output in outputs
            if re.search(command, line) and (found := re.search(of_output, output, re.MULTILINE))
        ]
        if not printed:
            yield f"{name}: no command like {command!r} prints a match of {of_output!r}"
        elif not all(map(agree, said.groups(), printed[-1].groups())):
            yield f"{name}: {said[0]!r}, but the program prints {printed[-1][0]!r}"


def stick_wrong(name, text, folder):
    """A time of the first stick that is not that of the result."""
    if name not in STICK:
        return
    pattern, file = STICK[name]
    said = re.search(pattern, normal(text))
    with h5py.File(folder / file) as result:
        sticking = np.flatnonzero(result["transient/stick"][:] > 0)
        first = result["transient/time"][sticking[0]] if sticking.size else np.nan
    if not said:
        yield f"{name}: no sentence matches {pattern!r}: mend STICK of tests/python/tutorials.py"
    elif not agree(said[1], f"{first:.6f}"):
        yield f"{name}: {said[0]!r}, but the first node sticks at {first:.3f} s"


def followed(page, program, kept):
    """Faults of a page that is followed from its first command to its last."""
    text, name = page.read_text(encoding="utf-8"), page.name
    outputs, faults = [], []
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(kept or temporary) / page.stem
        folder.mkdir(parents=True)
        place(folder, program)
        for words in commands(page):
            words, missing = runnable(words, folder, program)
            if missing:
                return [f"{name}: {shlex.join(words)}: {missing}"]
            begun = time.monotonic()
            ran = subprocess.run(
                words, cwd=folder, env=environment(program), capture_output=True, text=True, check=False
            )
            print(f"{name}: {shlex.join(words)} ({time.monotonic() - begun:.0f} s)", flush=True)
            if ran.returncode not in ((0, 1) if "compare" in words else (0,)):
                return [*faults, f"{name}: {tell(words, ran)}"]
            outputs.append((shlex.join(words), ran.stdout + ran.stderr))
        if kept:
            log = "".join(f"$ {line}\n{out}\n" for line, out in outputs)
            (folder / "outputs.txt").write_text(log, encoding="utf-8")
        faults += [*lines_missing(name, text, outputs), *files_missing(name, text, folder)]
        faults += [*figures_wrong(name, text, outputs), *stick_wrong(name, text, folder)]
    return faults


def main():
    arguments = sys.argv[1:]
    kept = None
    if "--keep" in arguments:
        k = arguments.index("--keep")
        kept = arguments[k + 1]
        del arguments[k : k + 2]
    if not arguments or not os.access(arguments[0], os.X_OK):
        sys.exit(__doc__)
    pages = [ROOT / "docs" / "tutorials" / name for name in arguments[1:]] or PAGES
    faults = [fault for page in pages for fault in followed(page, str(Path(arguments[0]).resolve()), kept)]
    print("\n".join(faults))
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
