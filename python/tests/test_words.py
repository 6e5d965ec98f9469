"""The check of lines, docstrings, names and sentences, `scripts/words`, on faults of each kind."""

from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def words() -> ModuleType:
    loader = SourceFileLoader("words", str(ROOT / "scripts/words"))
    spec = spec_from_loader("words", loader)
    assert spec is not None
    module = module_from_spec(spec)
    loader.exec_module(module)
    return module


def test_long_lines_are_told_but_for_tables_and_code(words: ModuleType) -> None:
    long = "word " * 30
    page = [long, "| " + long, "", "    " + long, "", "```", long, "```", "- " + long]
    assert [fault.split(":")[1] for fault in words.long_lines("a.md", "md", page)] == ["1", "9"]
    assert len(list(words.long_lines("a.rs", "rs", ["// " + long, "// short"]))) == 1


def test_docstrings_begin_with_nouns_or_verbs(words: ModuleType) -> None:
    rust = ["/// What it is.", "pub fn a() {}", "/// Length, m.", "/// Of a bar.", "fn b() {}", "//! Whether."]
    assert [fault.split(":")[1] for fault in words.beginnings("a.rs", "rs", rust)] == ["1", "6"]
    python = ['"""Where it is."""', 'x = 1  # """What"""', '    """Returns it."""']
    assert [fault.split(":")[1] for fault in words.beginnings("a.py", "py", python)] == ["1"]


def test_bare_names_and_types_of_one_name_are_told(words: ModuleType) -> None:
    texts = {
        "src/a.rs": ("rs", ["pub fn of() {}", "fn at() {}", "pub(crate) struct Found;", "pub struct Grid {}"]),
        "src/b.rs": ("rs", ["pub struct Grid;", "    pub fn of(x: f64) {}", "    pub fn offset() {}"]),
    }
    bare = "the public name {} says nothing: use a noun for a type, a verb for a function"
    assert list(words.names(texts)) == [
        "src/a.rs: " + bare.format("'of'"),
        "src/a.rs: " + bare.format("'Found'"),
        "src/b.rs: " + bare.format("'of'"),
        "2 public types have the name Grid: one name for one type",
    ]


def test_sentences_of_guides_are_short(words: ModuleType) -> None:
    short, long = "A short one.", "word " * 36 + "ends."
    page = [short + " " + short, "", long, "", "| " + long + " |", "", "    " + long, "", "- " + short, "- " + long]
    faults = list(words.long_sentences("docs/how-to/a.md", page))
    assert [fault.split(":")[1] for fault in faults] == ["3", "10"]
    assert not list(words.long_sentences("docs/reference/a.md", page))


def test_sentences_of_studies_are_theirs(words: ModuleType) -> None:
    page = ["<!-- study: a -->", "It " + "is long " * 20 + "indeed.", "<!-- end -->", "", "It " + "is " * 40 + "it."]
    assert [fault.split(":")[1] for fault in words.long_sentences("docs/developers/a.md", page)] == ["5"]


def test_cells_of_tables_are_short(words: ModuleType) -> None:
    link = "[a link of some words](" + "word-" * 40 + ".md)"
    page = [
        "| a | " + "word " * 31 + "|",
        f"| {'word ' * 15} | {'word ' * 16}|",
        f"| {link} |",
        "```",
        "| " + "w " * 40,
        "```",
    ]
    assert [fault.split(":")[1] for fault in words.long_cells("docs/reference/a.md", page)] == ["1"]


def test_paragraphs_are_wrapped_and_tables_and_code_are_not(words: ModuleType, tmp_path: Path) -> None:
    long = "word " * 40
    text = f"# Title\n\n{long}- end\n- {long}\n  more\n\n| {long} |\n\n    {long}\n"
    page = tmp_path / "page.md"
    page.write_text(text, encoding="utf-8")
    words.wrap(page)
    lines = page.read_text(encoding="utf-8").split("\n")
    assert max(len(line) for line in lines if not line.startswith(("|", "    "))) <= 120
    assert " ".join(lines).split() == text.split()
    assert [line for line in lines if line.startswith("- ")] == [line for line in lines if line.startswith("- word")]
