"""Build backend: setuptools on a copy of the sources. In place it would leave `build` and `railsqueal.egg-info` behind.

An editable installation stays one of this folder.
"""

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from setuptools import build_meta
from setuptools.build_meta import (  # noqa: F401
    build_editable,
    get_requires_for_build_editable,
    prepare_metadata_for_build_editable,
)

HERE = Path(__file__).resolve().parent
# Files and folders that a distribution is made of.
SOURCES = ("pyproject.toml", "README.md", "build_backend.py", "railsqueal")


@contextlib.contextmanager
def copied() -> Iterator[None]:
    """Makes a copy of the sources the working folder."""
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as folder:
        for name in SOURCES:
            if (HERE / name).is_dir():
                shutil.copytree(HERE / name, Path(folder, name), ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy2(HERE / name, folder)
        Path(folder, "MANIFEST.in").write_text("include build_backend.py\n", encoding="utf-8")
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(before)


def get_requires_for_build_wheel(config_settings: Any = None) -> list[str]:
    """Further packages that a wheel needs."""
    with copied():
        return list(build_meta.get_requires_for_build_wheel(config_settings))


def get_requires_for_build_sdist(config_settings: Any = None) -> list[str]:
    """Further packages that an archive of the sources needs."""
    with copied():
        return list(build_meta.get_requires_for_build_sdist(config_settings))


def prepare_metadata_for_build_wheel(metadata_directory: str, config_settings: Any = None) -> str:
    """Metadata of the wheel."""
    target = os.path.abspath(metadata_directory)
    with copied():
        return str(build_meta.prepare_metadata_for_build_wheel(target, config_settings))


def build_wheel(wheel_directory: str, config_settings: Any = None, metadata_directory: str | None = None) -> str:
    """The wheel."""
    target, metadata = os.path.abspath(wheel_directory), metadata_directory and os.path.abspath(metadata_directory)
    with copied():
        return str(build_meta.build_wheel(target, config_settings, metadata))


def build_sdist(sdist_directory: str, config_settings: Any = None) -> str:
    """An archive of the sources."""
    target = os.path.abspath(sdist_directory)
    with copied():
        return str(build_meta.build_sdist(target, config_settings))


# The bytecode of this file is of no use either.
with contextlib.suppress(OSError, TypeError):
    os.unlink(__cached__)
    os.rmdir(os.path.dirname(__cached__))
