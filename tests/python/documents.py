"""The pages of the project: the commands they show are ones that the program takes.

usage: documents.py check PROGRAM      every command line of a page is accepted, with `check` in the place of `run`
       documents.py run PROGRAM [PAGE…]    all of them, page by page, each page in a folder of its own; the tutorials
                                       have tutorials.py, which also compares their output
"""

import importlib.util
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("*/README.md")])
# What a page writes in the place of names of the reader's own.
PLACEHOLDER = re.compile(r"\b(JOB|OLD|FILE|PREFIX|SHELL|DIR|A|B|NAME|N)(\.\w+)?\b")
# Meshes that a page has made with Gmsh, and a job that takes such ones.
MADE = ("ring.msh", "wheel.msh", "wheel.inp", "wheel-on-rail-3d")
# Pages whose commands install, measure beside other programs, or develop.
NOT_RUN = ("install.md", "performance.md", "CONTRIBUTING.md")
# Commands that set up, build or test the checkout.
DEVELOP = ("scripts/test", "scripts/validate", "scripts/golden", "scripts/install", "scripts/setup")
# Programs whose lines are tried, behind a launcher or not.
TRIED = ("railsqueal", "target/release/railsqueal")


def blocks(text):
    """Indented blocks and those between fences that show a shell: lists of lines."""
    found, block, fence = [], [], None
    for line in [*text.splitlines(), ""]:
        if line.startswith("```"):
            if fence is None:
                found.append(block)
                block, fence = [], line[3:].strip()
            else:
                found.append(block if fence in ("", "sh", "bash") else [])
                block, fence = [], None
        elif fence is not None:
            block.append(line)
        elif line.startswith("    "):
            block.append(line[4:])
        elif line.strip() or not block:
            found.append(block)
            block = []
    return [b for b in found if b]


def commands(page):
    """Command lines of a page and the variables that they use, in order: `(variables, words)`. Comments, remarks behind
    many blanks, and lines with placeholders are left out."""
    variables, found = {}, []
    for block in blocks(page.read_text(encoding="utf-8")):
        text = re.sub(r"\\\n\s*", " ", "\n".join(block))
        for value in re.finditer(r'^(\w+)="([^"]*)"', text, flags=re.M):
            variables[value[1]] = " ".join(value[2].split())
        for line in text.splitlines():
            line = re.split(r"\s{4,}|\s+#\s", line.strip())[0]
            head = re.sub(r"^mpirun -n \d+ ", "", line)
            if not head.split(" ")[0].endswith(TRIED) and not head.startswith(("scripts/", "python3 meshes/")):
                continue
            if "…" in line or PLACEHOLDER.search(re.sub(r"'[^']*'", "", line)):
                continue
            for name, value in variables.items():
                line = line.replace(f"${name}", value)
            found.append(shlex.split(line, comments=True))
    return found


def of_program(words):
    """Words behind the program's name; `None` for another program."""
    names = [k for k, word in enumerate(words) if word in TRIED]
    return words[names[0] + 1 :] if names else None


def as_check(words):
    """The line with `check` in the place of `run`; `None` where it runs nothing."""
    if not words or words[0] != "run" or "--resume" in words:
        return None
    kept, skip = ["check"], False
    for word in words[1 : words.index("--") if "--" in words else None]:
        if skip or word in ("--output", "-o", "--reuse", "--wall-time", "--force"):
            skip = not skip and word != "--force"
            continue
        kept.append(word)
    return kept


def result_of(words):
    """Result file of a line that runs a job and replaces none; `None` for other lines."""
    words = of_program(words)
    if not words or words[0] != "run" or "--resume" in words or "--force" in words:
        return None
    named = [after for word, after in zip(words, words[1:]) if word in ("--output", "-o")]
    return named[-1] if named else str(Path(words[1]).with_suffix(".h5"))


def place(folder, program=None):
    """The checkout as a reader sees it, with jobs whose results go beside them into `folder`, and with the program as
    the one that is built there."""
    for entry in ROOT.iterdir():
        if entry.name not in ("jobs", ".git", "target") and not (folder / entry.name).exists():
            (folder / entry.name).symlink_to(entry)
    ignore = shutil.ignore_patterns("*.h5", "*.vtkhdf", "*.png", "*.transient")
    shutil.copytree(ROOT / "jobs", folder / "jobs", ignore=ignore)
    if program:
        (folder / "target" / "release").mkdir(parents=True)
        (folder / "target" / "release" / "railsqueal").symlink_to(program)


def tell(words, ran):
    """A failure, in a few lines."""
    return f"{shlex.join(words)}\n  exit code {ran.returncode}\n  " + "\n  ".join(ran.stderr.strip().splitlines()[-6:])


def checked(program):
    """Commands that the program refuses, with its messages. Jobs that a page makes with `init` are made."""
    faults, tried = [], 0
    for page in PAGES:
        results = set()
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            place(folder)
            for words in commands(page):
                result = result_of(words)
                if result in results:
                    faults.append(f"{page.relative_to(ROOT)}: {shlex.join(words)}\n  {result} is there already")
                results |= {result} - {None}
                words = of_program(words)
                init = words if words and words[0] in ("init", "check", "schema") else None
                line = init or as_check(words)
                if line is None or any(made in word for made in MADE for word in line):
                    continue
                tried += 1
                ran = subprocess.run([program, *line], cwd=folder, capture_output=True, text=True, check=False)
                if ran.returncode != 0:
                    faults.append(f"{page.relative_to(ROOT)}: {tell(line, ran)}")
    if tried < 20:
        faults.append(f"only {tried} commands were found: the pages have lost theirs")
    return faults


def environment(program):
    """Environment in which `railsqueal` is the program, and `scripts/run` builds no other one."""
    path = str(Path(program).resolve().parent) + os.pathsep + os.environ["PATH"]
    return {**os.environ, "PATH": path, "RAILSQUEAL_BUILT": "1"}


def runnable(words, folder, program):
    """Words of a line as they are run here, and the reason if they cannot be: Gmsh is missing for a mesh, or for a
    script that makes one."""
    words = [program if w == "target/release/railsqueal" else w for w in words]
    words = [sys.executable if w == "python3" else w for w in words]
    missing = any(made in word and not (folder / made).exists() for made in MADE for word in words)
    missing = missing and "section" not in words
    scripts = [ROOT / word for word in words if word.endswith(".py") and (ROOT / word).is_file()]
    missing = missing or any("import gmsh" in script.read_text(encoding="utf-8") for script in scripts)
    if missing and importlib.util.find_spec("gmsh") is None:
        return words, "Python has no gmsh"
    return words, None


def performed(program, chosen=()):
    """Commands that fail when each is run as the page shows it, of all pages or of those chosen by their paths.
    tutorials.py follows the tutorials."""
    faults = []
    for page in PAGES:
        if page.name in NOT_RUN or page.parent.name == "tutorials":
            continue
        if chosen and str(page.relative_to(ROOT)) not in chosen:
            continue
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            place(folder, program)
            for words in commands(page):
                if words[0] in DEVELOP:
                    continue
                words, missing = runnable(words, folder, program)
                if missing:
                    print(f"{page.relative_to(ROOT)}: {shlex.join(words)} left out: {missing}", flush=True)
                    continue
                begun = time.monotonic()
                ran = subprocess.run(
                    words, cwd=folder, env=environment(program), capture_output=True, text=True, check=False
                )
                # `compare` says by 1 that results differ.
                failed = ran.returncode not in ((0, 1) if "compare" in words else (0,))
                took = f"{time.monotonic() - begun:.0f} s{', failed' if failed else ''}"
                print(f"{page.relative_to(ROOT)}: {shlex.join(words)} ({took})", flush=True)
                if failed:
                    faults.append(f"{page.relative_to(ROOT)}: {tell(words, ran)}")
    return faults


def main():
    what, program = sys.argv[1], str(Path(sys.argv[2]).resolve())
    found = checked(program) if what == "check" else performed(program, sys.argv[3:])
    print("\n".join(found))
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
