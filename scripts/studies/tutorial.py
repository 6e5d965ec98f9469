"""The pictures of docs/tutorials/mesh-to-sound.md: runs the commands of the page in a folder of their own."""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from program import ROOT

sys.path.insert(0, str(ROOT / "tests" / "python"))
from documents import commands  # noqa: E402

PAGE = ROOT / "docs" / "tutorials" / "mesh-to-sound.md"
PICTURES = ROOT / "docs" / "pictures"
SHOWN = ["own-mesh-contact-map.svg", "squeal-growth.png", "squeal-cycle.png", "squeal-sound-power.svg"]


def performed():
    """Runs the page and keeps its pictures."""
    environment = {**os.environ, "PATH": f"{ROOT / 'target/release'}{os.pathsep}{os.environ['PATH']}"}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "scripts").symlink_to(ROOT / "scripts")
        for words in commands(PAGE):
            subprocess.run(words, cwd=folder, env=environment, check="compare" not in words, stdout=subprocess.DEVNULL)
            if words[1] == "run":
                result = next(
                    (w for k, w in enumerate(words) if words[k - 1] == "--output"), Path(words[2]).stem + ".h5"
                )
                subprocess.run(
                    ["railsqueal", "plot", result, "--format", "png,svg"],
                    cwd=folder,
                    env=environment,
                    check=True,
                    stdout=subprocess.DEVNULL,
                )
        PICTURES.mkdir(exist_ok=True)
        for picture in SHOWN:
            shutil.copy(folder / picture, PICTURES / picture)
    return {}
