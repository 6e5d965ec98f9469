"""Tables of measured values: spellings of the same numbers, harmed ones beside a second reader, and what is refused."""

import random
import re
from pathlib import Path

import pytest
from railsqueal.errors import InputError
from railsqueal.table_reader import Heading, Table

NAMES = ("y", "z")
UNIT = re.compile(r"[\s\[\]_(]*(m|mm|)[\s\])]*")


def values(text: str) -> list[list[float]]:
    """The columns y and z of a table, by its headings or in this order."""
    table = Table.parse(Path("t.csv"), text)
    headings = table.headings(NAMES)
    if headings is None:
        if len(table.rows[0]) != 2 or table.counts(0):
            raise InputError("t.csv: not two columns")
        at = [0, 1]
    else:
        places = {h.name: k for k, h in enumerate(headings) if not table.is_index(k, h)}
        if set(places) != set(NAMES) or not all(h.known for h in headings):
            raise InputError(f"t.csv: columns {', '.join(places)}")
        at = [places[name] for name in NAMES]
    columns = [table.numbers(k).tolist() for k in at]
    return [list(row) for row in zip(*columns)]


@pytest.mark.parametrize(
    "text",
    [
        "-39.5 1.575\n-39 1e-3\n.5 -200\n",
        "-39.5\t1.575\n-39.\t+1.0D-3\n0.5\t-2.0d+02\n",
        "-39,5;1,575\n-39,0;0,001\n,5;-200\n",
        "-39,5 1,575\n-39,0 0,001\n0,5 -200,0\n",
        "-39.5, 1.575,\n-39.0, 0.001,\n0.5, -200.0,\n",
        '"-39,5","1,575"\n"-39,0","0,001"\n"0,5","-200,0"\n',
        "\ufeff# made by hand\r\n\r\ny;z\r\n-39.5;1.575;;\r\n;;;\r\n-39.0;0.001 ! second\r\n0.5;-200 // third\r\n",
        "% matlab\r-39.5 1.575\r-39.0 0.001\r0.5 -200.0",
        "sep=;\ni;z [mm];y [mm]\n1;1,575;-39,5\n2;0,001;-39,0\n3;-200;0,5\n",
        "\N{MINUS SIGN}39.5\xa01.575\n\N{MINUS SIGN}39.0\xa00.001\n0.5\xa0\N{MINUS SIGN}200\n",
        "z,y\nmm,mm\n1.575,-39.5\n0.001,-39.0\n-200.0,0.5\n",
        ",y,z\n0,-39.5,1.575\n1,-39.0,0.001\n2,0.5,-200\n",
        "# z y\n1.575 -39.5\n0.001 -39.0\n-200.0 0.5\n",
        "y z\n-39.5;1.575\n-39.0;0.001\n0.5;-200.0\n",
    ],
)
def test_every_spelling_of_the_same_numbers_is_the_same_table(text: str) -> None:
    assert values(text) == [[-39.5, 1.575], [-39.0, 1e-3], [0.5, -200.0]]


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("-39,1\n-38,2\n-37,3\n", "decimal commas or separators"),
        ("1.5 2.5\n2.5 nan\n", "line 2: 'nan' is no finite number"),
        ("1.5 2.5\n2.5 1e999\n", "'1e999'"),
        ("1.5;2.5\n;1.5\n", "line 2: a number is missing"),
        ("1.5 2.5\n2.5 3.5 4.5\n", "line 2: 3 fields, expected 2"),
        ("1.5 2.5\n2.5,0 3.5\n", "line 2: '2.5,0'"),
        ("a title of it\n1.5 2.5\n", "expected 4 as in line 1"),
        ("y z\nsecond line\n1.5 2.5\n", "line 2: 'second'"),
    ],
)
def test_what_is_not_certain_is_refused_with_its_line(text: str, part: str) -> None:
    with pytest.raises(InputError) as caught:
        values(text)
    assert part in str(caught.value)


def test_units_are_told_by_headings() -> None:
    for title in ("y (mm)", "y [mm]", "Y/mm", "y_mm", "y in mm", "y mm"):
        assert (Heading.from_title(title).name, Heading.from_title(title).unit) == ("y", "mm"), title
    assert not Heading.from_title("y (ft)").known and Heading.from_title("y").unit is None


class Written:
    """A table as a device or a spreadsheet may write it."""

    def __init__(self, dice: random.Random) -> None:
        layouts = [(";", "."), (";", ","), ("\t", "."), ("\t", ","), (" ", "."), ("  ", ","), (",", "."), (", ", ".")]
        self.separator, self.decimal = dice.choice(layouts)
        end = dice.choice(["\n", "\r\n", "\r"])
        headed = dice.random() < 0.5
        index, swapped = headed and dice.random() < 0.3, headed and dice.random() < 0.3
        unit = "" if not self.separator.strip() else dice.choice(["", " [mm]", "_mm"])
        names = [dice.choice(["i", "no", "Index"]), f"y{unit}", f"Z{unit}"]
        trailing = self.separator.strip() if dice.random() < 0.2 else ""
        self.text = dice.choice(["", "\ufeff"])
        self.text += dice.choice("#!%") + " measured" + end if dice.random() < 0.3 else ""
        self.values = []

        def row(cells: list[str], comment: str = "") -> None:
            cells = [cells[0], cells[2], cells[1]] if swapped else cells
            self.text += self.separator.join(cells if index else cells[1:]) + trailing + comment + end

        if headed:
            row(names)
        for i in range(dice.randint(3, 9)):
            pair = [self.number(dice), self.number(dice)]
            row([str(i), pair[0][0], pair[1][0]], dice.choice([" # here", "", "", "", "", " // here"]))
            self.values.append([value for _, value in pair])
        self.plain = self.separator.strip() == "," and not headed and not re.search(r"[.eEdD]", self.text.split("#")[0])

    def number(self, dice: random.Random) -> tuple[str, float]:
        digits = dice.choice(["", *(f".{dice.randrange(10**n):0{n}d}" for n in (1, 2, 4))])
        text = f"{dice.choice(['', '-', '+'])}{dice.randrange(2000)}{digits}"
        power = dice.choice(["", "", "", f"{dice.choice(['', '-', '+'])}{dice.randrange(4)}"])
        value = float(f"{text}e{power}") if power else float(text)
        return text.replace(".", self.decimal) + (dice.choice("eEdD") + power if power else ""), value


def told(text: str, separator: str, decimal: str) -> list[list[float]] | None:
    """The rules once more, for a table whose layout is known; `None` where it should be refused."""
    mark = separator.strip()
    rows: list[list[str]] = []
    comment = ""
    for whole in text.replace("\ufeff", "").replace("\r\n", "\n").replace("\r", "\n").split("\n"):
        line = re.split(r"#|!|//", whole)[0].strip()
        if not line or line[0] == "%" or not line.strip(";, \t"):
            if not rows and whole.strip() and (not line or line[0] == "%"):
                comment = whole.strip().lstrip("#!%/")
            continue
        blank = not mark and (separator != "\t" or rows or re.match(r"[-+.,\d]", line))
        cells = line.split() if blank else [cell.strip() for cell in line.split(mark or "\t")]
        while cells and not cells[-1]:
            cells.pop()
        rows.append(cells)

    def number(cell: str) -> float | None:
        pattern = r"[+-]?(\d+\{0}?\d*|\{0}\d+)([eEdD][+-]?\d+)?".format(decimal)
        if re.fullmatch(pattern, cell) is None or cell.endswith(","):
            return None
        return float(re.sub("[dD]", "e", cell.replace(",", ".")))

    width = len(rows[-1]) if rows else 0

    def places(names: list[str]) -> list[int] | None:
        names = [name.strip().lower() for name in names]
        named = [[k for k, name in enumerate(names) if name[:1] == c and UNIT.fullmatch(name[1:])] for c in NAMES]
        found = [k[0] for k in named if k]
        numbering = ("", "i", "no", "no.", "index", "n", "id")
        others = [n for k, n in enumerate(names) if k not in found and n not in numbering]
        return found if len(found) == 2 and not others and len(names) == width <= 3 else None

    at: list[int] | None = [0, 1]
    if rows and number(rows[0][0]) is None:
        names = rows.pop(0)
        at = places(names if len(names) > 1 else names[0].split())
    elif (named := places(comment.split(mark) if mark else comment.split())) is not None:
        at = named
    elif width != 2:
        at = None
    if at is None:
        return None
    numbers = [[number(cell) for cell in row] for row in rows]
    if any(len(row) != width or None in row for row in numbers):
        return None
    return [[float(row[k] or 0.0) for k in at] for row in numbers]


def test_tables_are_read_to_the_last_bit_or_refused() -> None:
    dice = random.Random(5)
    read = refused = 0
    for _ in range(2000):
        table = Written(dice)
        assert told(table.text, table.separator, table.decimal) == table.values, table.text
        try:
            assert values(table.text) == table.values, table.text
        except InputError as error:
            unsure = "decimal commas or separators" in str(error) and table.plain
            assert unsure or "not two columns" in str(error), (error, table.text)
        harmed = list(table.text)
        for _ in range(dice.randint(1, 2)):
            at, c = dice.randrange(len(harmed)), dice.choice("07.,;- \teDx\n#")
            match dice.randrange(3):
                case 0:
                    del harmed[at]
                case 1:
                    harmed.insert(at, c)
                case _:
                    harmed[at] = c
        text = "".join(harmed)
        try:
            found = values(text)
        except InputError as error:
            refused += 1
            assert "t.csv" in str(error)
            continue
        read += 1
        assert found == told(text, table.separator, table.decimal), (text, table.text)
    assert read > 400 and refused > 400, (read, refused)
