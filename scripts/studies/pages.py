"""Tables of pages: what a study writes between two marks of a page, so that no figure of it is typed by hand."""

from pathlib import Path


def put(page: Path, name: str, text: str) -> None:
    """Replaces what stands between `<!-- study: NAME -->` and `<!-- end -->` of the page."""
    begin, end = f"<!-- study: {name} -->\n", "<!-- end -->"
    before, mark, rest = page.read_text(encoding="utf-8").partition(begin)
    _, closed, after = rest.partition(end)
    if not mark or not closed:
        raise SystemExit(f"{page}: there is no place for the study {name}")
    page.write_text(before + begin + text.rstrip("\n") + "\n" + end + after, encoding="utf-8")
