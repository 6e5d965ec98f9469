"""The report, its tables, and the comparison of two results."""

import base64
import csv
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path

import h5py
import pytest
from railsqueal import Result, compare, figures, report, tables
from railsqueal.__main__ import main


class Reader(HTMLParser):
    """Checks that tags close in order, and collects what the page loads."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.loaded: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.loaded += [value or "" for name, value in attrs if name == "src" or (tag == "link" and name == "href")]
        if tag not in ("meta", "img", "br", "input"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_the_report_is_one_page_that_loads_nothing(cylinders: Path, tmp_path: Path) -> None:
    marked = tmp_path / "two.h5"
    shutil.copy(cylinders, marked)
    with h5py.File(marked, "a") as file:
        file["provenance/job"] = '{"title": "a < b & c", "analyses": {"steady": {}}}'
        file["provenance/warnings"] = ["the contact is <coarse>"]
    with Result(marked) as result:
        page, *tables = report.write(result, tmp_path / "out")
        text = page.read_text(encoding="utf-8")
        reader = Reader()
        reader.feed(text)
        assert (
            reader.open == []
            and len(reader.loaded) == 2
            and all(s.startswith("data:image/png;base64,") for s in reader.loaded)
        )
        assert 'src="http' not in text and 'href="http' not in text
        assert "a &lt; b &amp; c" in text and "the contact is &lt;coarse&gt;" in text
        force = next(f for f in figures.figures_of_result(result) if f.name == "force y on body 1")
        assert force.text in text and force.value == result.array("contact/force")[1]
        written = ("figures", "modes", "eigenvalues", "unstable", "forces")
        assert [t.name for t in tables] == [f"two-{name}.csv" for name in written]
        rows = {t.stem.split("-")[1]: list(csv.DictReader(t.open(encoding="utf-8"))) for t in tables}
        # The page has each table as well, byte for byte.
        embedded = dict(re.findall(r'download="([^"]+)" href="data:text/csv;base64,([^"]+)"', text))
        contents = {name: base64.b64decode(data) for name, data in embedded.items()}
        assert contents == {t.name: t.read_bytes() for t in tables}
        # To the last bit.
        assert [float(r["frequency_Hz"]) for r in rows["modes"] if r["body"] == "upper"] == result[
            "modes/upper/frequency"
        ].tolist()
        assert float(rows["forces"][0]["force_y_N"]) == result["contact/force"][1]
        assert len(rows["unstable"]) == (result["stability/growth_rate"] > 0).sum()
        assert [float(r["growth_rate_1/s"]) for r in rows["eigenvalues"]] == result["stability/growth_rate"].tolist()
        # The verdict comes first.
        assert text.index('<div class="verdict') < text.index("<h2")


def test_times_by_stage_add_up(cylinders: Path, tmp_path: Path) -> None:
    timed = tmp_path / "timed.h5"
    shutil.copy(cylinders, timed)
    with h5py.File(timed, "a") as file:
        for name in ("stage_names", "stage_times"):
            if f"provenance/{name}" in file:
                del file[f"provenance/{name}"]
        # A sweep enters the same stage for each of its bodies.
        file["provenance/stage_names"] = ["modes", "points", "modes", "points"]
        file["provenance/stage_times"] = [1.0, 2.0, 0.25, 4.5]
    with Result(timed) as result:
        assert tables.Provenance.from_result(result).stages == {"modes": 1.25, "points": 6.5}
        text = report.times(tables.Provenance.from_result(result).stages)
    assert "<td>modes</td><td>1.25</td><td>16.1</td>" in text
    assert "<td>all stages</td><td>7.75</td><td>100.0</td>" in text


def changed(path: Path, to: Path, name: str, factor: float) -> Path:
    shutil.copy(path, to)
    with h5py.File(to, "a") as file:
        file[name][...] = factor * file[name][()]
    return to


def test_results_are_compared(cylinders: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", str(cylinders), str(cylinders)]) == 0
    assert "the results agree" in capsys.readouterr().out
    # A force is a figure, the gap only in a table.
    for name in ("contact/force", "contact/gap"):
        other = changed(cylinders, tmp_path / "other.h5", name, 1 + 1e-4)
        assert main(["compare", str(cylinders), str(other)]) == 1
        said = capsys.readouterr().out
        assert re.search(rf"{name}: 1\.0e-04", said) and "the results differ" in said
        assert main(["compare", str(cylinders), str(other), "--tolerance", "1e-3"]) == 0
    capsys.readouterr()
    assert main(["compare", str(cylinders), str(tmp_path / "none.h5")]) == 2
    assert "none.h5" in capsys.readouterr().err


def test_keys_of_the_job_that_differ() -> None:
    one, other = compare.keys({"a": {"b": 1, "c": []}, "d": None}), compare.keys({"a": {"b": 2, "c": []}})
    assert one == {"a.b": "1", "a.c": "[]", "d": "null"} and one["a.b"] != other["a.b"]


def test_a_force_that_is_rounding_does_not_differ() -> None:
    small, other = (figures.Figure("g", "force x", value, "N", 7e4) for value in (1e-9, -3e-9))
    assert compare.difference(small, other) < 1e-12
    assert compare.difference(*(figures.Figure("g", "approach", v) for v in (1.0, 1.1))) == pytest.approx(0.1 / 1.1)


def test_wrong_usage_and_unreadable_files_have_their_codes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for command in (["plot"], ["report"], ["sound"]):
        assert main([*command, str(tmp_path / "none.h5")]) == 3
        assert "railsqueal: error:" in capsys.readouterr().err
    with pytest.raises(SystemExit) as ended:
        main(["plot"])
    assert ended.value.code == 2
