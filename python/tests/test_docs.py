"""The pages of the project: their links lead somewhere, and they name the pictures and subcommands that there are."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), ROOT / "python/README.md", ROOT / "meshes/README.md"]


def anchors(page: Path) -> set[str]:
    """Anchors of the headings of a page, as they are made from their words."""
    heads = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", re.sub(r"[`*]", "", head).lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        # The list of what is in the book leads from the root, where the book is made.
        base = ROOT if page.name == "SUMMARY.md" else page.parent
        to = (base / path).resolve() if path else page
        assert to.exists(), f"{page.name}: {target} leads nowhere"
        assert not anchor or anchor in anchors(to), f"{page.name}: {target}: {to.name} has no such heading"


def test_rust_of_pages_is_that_of_an_example_that_is_compiled() -> None:
    sources = "\n".join(path.read_text(encoding="utf-8") for path in ROOT.glob("src/**/*.rs"))
    examples = {line[3:].strip() for line in map(str.strip, sources.split("\n")) if line.startswith("///")}
    found = 0
    for page in PAGES:
        for block in re.findall(r"```rust\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
            for line in filter(None, (line.partition("//")[0].strip() for line in block.split("\n"))):
                assert line in examples, f"{page.name}: no example in the sources has the line {line!r}"
                found += 1
    assert found > 10


def targets(page: Path, base: Path) -> list[Path]:
    """Pages to which a page leads, in order."""
    found = re.findall(r"\]\(([^)#\s]+\.md)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    return [(base / path).resolve() for path in found if not re.match(r"[a-z]+:", path)]


def test_every_page_is_in_the_book_once() -> None:
    in_book = targets(ROOT / "docs/SUMMARY.md", ROOT)
    assert len(in_book) == len(set(in_book)), "docs/SUMMARY.md names a page twice"
    pages = {page.resolve() for page in PAGES} - {ROOT / "docs/SUMMARY.md"}
    assert len(pages) > 40 and set(in_book) == pages


def test_no_page_is_orphaned() -> None:
    reached, waiting = set(), [ROOT / "docs/README.md"]
    while waiting:
        page = waiting.pop()
        if page.is_file() and page not in reached:
            reached.add(page)
            waiting += targets(page, page.parent)
    entries = {ROOT / "README.md", ROOT / "docs/SUMMARY.md"}
    lost = sorted(str(page.relative_to(ROOT)) for page in {page.resolve() for page in PAGES} - reached - entries)
    assert not lost, f"no page that the map docs/README.md leads to has a link to {lost}"


def test_every_picture_is_on_the_page_of_results() -> None:
    sources = [path.read_text(encoding="utf-8") for path in (ROOT / "python/railsqueal/pictures").glob("*.py")]
    names = {
        name for text in sources for name in re.findall(r'canvas\.save\(figure, (?:of_contact\()?f?"([^"]+)"[,)]', text)
    }
    made = {name.replace("{name}", body) for name in names for body in ("lower", "upper")}
    page = (ROOT / "docs/reference/output.md").read_text(encoding="utf-8")
    section = page[page.index("## Pictures") : page.index("## Report")]
    named = {
        name for row in re.findall(r"^\| (`[^|]*`) \|", section, re.MULTILINE) for name in re.findall(r"`([^`]+)`", row)
    }
    assert len(made) > 10 and named - {"frequencies.md"} == made
