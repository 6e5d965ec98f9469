"""The pictures of docs/tutorials: runs the commands of each page in a folder of their own."""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from program import ROOT

sys.path.insert(0, str(ROOT / "tests" / "python"))
from documents import commands  # noqa: E402

PAGES = ROOT / "docs" / "tutorials"
PICTURES = ROOT / "docs" / "pictures"
# Pictures of each page: the name that `plot` gives them, and the name under which they are kept.
SHOWN = {
    "mesh-to-sound.md": {
        name: name
        for name in ("own-mesh-contact-map.svg", "squeal-growth.png", "squeal-cycle.png", "squeal-sound-power.svg")
    },
    "drawing-to-quiet-wheel.md": {"verdict-growth-budget.png": "tutorial-growth-budget.png"},
}


def follow(page, shown):
    """Runs a page and keeps its pictures."""
    environment = {**os.environ, "PATH": f"{ROOT / 'target/release'}{os.pathsep}{os.environ['PATH']}"}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for entry in ("scripts", "meshes", "python"):
            (folder / entry).symlink_to(ROOT / entry)
        for words in commands(page):
            subprocess.run(words, cwd=folder, env=environment, check="compare" not in words, stdout=subprocess.DEVNULL)
            if words[1] == "run":
                result = next(
                    (w for k, w in enumerate(words) if words[k - 1] == "--output"), Path(words[2]).stem + ".h5"
                )
                plot = ["railsqueal", "plot", result, "--format", "png,svg"]
                subprocess.run(plot, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)
        PICTURES.mkdir(exist_ok=True)
        for picture, kept in shown.items():
            shutil.copy(folder / picture, PICTURES / kept)


def performed():
    """Runs the pages and keeps their pictures."""
    for page, shown in SHOWN.items():
        follow(PAGES / page, shown)
    return {}
