"""Installation of the package from a checkout."""

import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

pytest.importorskip("setuptools")
pytest.importorskip("wheel")
PACKAGE = Path(__file__).parents[1]


def listing(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def test_installation_leaves_nothing_in_the_checkout(tmp_path: Path) -> None:
    checkout = tmp_path / "python"
    left = shutil.ignore_patterns("__pycache__", "*.egg-info", "build", ".mypy_cache", ".pytest_cache")
    shutil.copytree(PACKAGE, checkout, ignore=left)
    before = listing(checkout)
    options = ["--quiet", "--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", str(tmp_path)]
    subprocess.run([sys.executable, "-m", "pip", "wheel", *options, str(checkout)], check=True)
    assert listing(checkout) == before
    (wheel,) = tmp_path.glob("railsqueal-*.whl")
    with zipfile.ZipFile(wheel) as file:
        names = set(file.namelist())
    sources = [f"railsqueal/{name}" for name in listing(checkout / "railsqueal")]
    files = {name for name in sources if (checkout / name).is_file()}
    assert len(files) > 30 and files <= names, files - names


def test_an_archive_of_the_sources_can_be_built(tmp_path: Path) -> None:
    code = f"import build_backend as b; b.build_sdist({str(tmp_path)!r})"
    subprocess.run([sys.executable, "-B", "-c", code], cwd=PACKAGE, check=True, capture_output=True)
    (archive,) = tmp_path.glob("railsqueal-*.tar.gz")
    with tarfile.open(archive) as file:
        names = {name.partition("/")[2] for name in file.getnames()}
    assert {"build_backend.py", "pyproject.toml", "railsqueal/report/web/viewer.js"} <= names
