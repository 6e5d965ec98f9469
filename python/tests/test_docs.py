"""The pages of the project: their links lead somewhere, and they name the pictures and subcommands that there are."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
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


def test_every_picture_is_on_the_page_of_results() -> None:
    sources = [path.read_text(encoding="utf-8") for path in (ROOT / "python/railsqueal/pictures").glob("*.py")]
    names = {name for text in sources for name in re.findall(r'canvas\.save\(figure, f?"([^"]+)"\)', text)}
    made = {name.replace("{name}", body) for name in names for body in ("lower", "upper")}
    page = (ROOT / "docs/reference/output.md").read_text(encoding="utf-8")
    section = page[page.index("## Pictures") : page.index("## Report")]
    named = {
        name for row in re.findall(r"^\| (`[^|]*`) \|", section, re.MULTILINE) for name in re.findall(r"`([^`]+)`", row)
    }
    assert len(made) > 10 and named - {"frequencies.md"} == made
