"""The comparison of the tutorials with the output of the program, `tests/python/tutorials.py`."""

import re
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def tutorials() -> ModuleType:
    sys.path.insert(0, str(ROOT / "tests" / "python"))
    try:
        import tutorials as module
    finally:
        sys.path.pop(0)
    return module


def test_sentences_with_figures_are_on_their_pages(tutorials: ModuleType) -> None:
    assert {page.name for page in tutorials.PAGES} == set(tutorials.PROMISES)
    for name, promises in tutorials.PROMISES.items():
        text = tutorials.normal((ROOT / "docs/tutorials" / name).read_text(encoding="utf-8"))
        for of_page, _, of_output in promises:
            assert re.search(of_page, text), f"{name}: no sentence matches {of_page!r}"
            assert re.compile(of_page).groups == re.compile(of_output).groups > 0


def test_numbers_agree_within_their_last_place_or_half_a_percent(tutorials: ModuleType) -> None:
    for shown, printed in (
        ("991", "990.96"),
        ("123", "122.8"),
        ("0.0044", "4.4e-3"),
        ("three", "3"),
        ("−0.21", "-0.21"),
    ):
        assert tutorials.agree(shown, printed)
    for shown, printed in (("981", "990.96"), ("4.03", "4.06"), ("three", "4"), ("0.21", "-0.21"), ("0.70", "0.628")):
        assert not tutorials.agree(shown, printed)


def test_lines_of_output_are_compared_with_their_numbers(tutorials: ModuleType) -> None:
    text = "```\nmass 338.24 kg\n...\n```\n\n    railsqueal run mine.json\n\n    area 12 mm², no crack\n"
    outputs = [("railsqueal run mine.json", "  mass   338.20 kg with 7860 kg/m³\narea 12 mm², no crack found\n")]
    assert not list(tutorials.lines_missing("a.md", text, outputs))
    for change in (("338.24", "348.24"), ("area", "volume"), ("no crack", "one crack")):
        assert len(list(tutorials.lines_missing("a.md", text.replace(*change), outputs))) == 1


def test_files_that_a_page_names_have_to_be_made(tutorials: ModuleType, tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(b"picture")
    (tmp_path / "b.png").write_bytes(b"")
    faults = list(tutorials.files_missing("a.md", "`a.png`, `b.png`, `jobs/c.json` and `d.wav`", tmp_path))
    assert [fault.split()[1] for fault in faults] == ["b.png", "d.wav"]
