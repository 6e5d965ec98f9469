"""Sections from drawings: outlines, their integrals and meshes, and what is refused."""

import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from railsqueal.__main__ import main
from railsqueal.errors import InputError, ResultError
from railsqueal.section import Options, Section, WheelProperties, make
from railsqueal.section.curves import Affine, Arc, Line
from railsqueal.section.edges import divide, with_polylines
from railsqueal.section.outline import Outline

ezdxf = pytest.importorskip("ezdxf")
pytest.importorskip("netgen")

MESHES = Path(__file__).parents[2] / "meshes"
QUARTER = math.tan(math.pi / 8)
# A ring with rounded edges of its rim, mm, as (x, y, group, bulge); counterclockwise.
INNER, OUTER, WIDTH, ROUND = 100.0, 460.0, 130.0, 12.0
RING = [
    (-WIDTH / 2, INNER, "bore", 0.0),
    (WIDTH / 2, INNER, "", 0.0),
    (WIDTH / 2, OUTER - ROUND, "", QUARTER),
    (WIDTH / 2 - ROUND, OUTER, "running", 0.0),
    (ROUND - WIDTH / 2, OUTER, "", QUARTER),
    (-WIDTH / 2, OUTER - ROUND, "", 0.0),
]
WHEEL = Options("wheel", unit="mm")


@pytest.fixture
def csv(tmp_path: Path) -> Callable[..., Path]:
    """Writes a table."""

    def write(rows: Sequence[Sequence[Any]] | str | bytes, header: str = "x,y,group,bulge") -> Path:
        path = tmp_path / "outline.csv"
        if isinstance(rows, str):
            rows = rows.encode()
        if isinstance(rows, bytes):
            path.write_bytes(rows)
        else:
            path.write_text("\n".join([header, *(",".join(map(str, row)) for row in rows)]) + "\n")
        return path

    return write


@pytest.fixture
def dxf(tmp_path: Path) -> Callable[..., Path]:
    """Writes a drawing that a function fills in."""

    def write(fill: Callable[[Any], Any], units: int = 4, binary: bool = False) -> Path:
        document = ezdxf.new("R2000")
        document.header["$INSUNITS"] = units
        fill(document.modelspace())
        path = tmp_path / "outline.dxf"
        document.saveas(path, fmt="bin" if binary else "asc")
        return path

    return write


def ring(space: Any, scale: float = 1.0, skip: Sequence[int] = (), shift: float = 0.0) -> None:
    """Draws the ring of lines and arcs."""
    for k, (x, y, group, bulge) in enumerate(RING):
        to = RING[(k + 1) % len(RING)]
        layer = {"layer": group or "0"}
        if k in skip:
            continue
        if bulge:
            corner = math.copysign(WIDTH / 2 - ROUND, x)
            angles = (0, 90) if corner > 0 else (90, 180)
            space.add_arc((scale * corner, scale * (OUTER - ROUND)), scale * ROUND, *angles, dxfattribs=layer)
        else:
            space.add_line((scale * to[0], scale * to[1]), (scale * x + shift, scale * y), dxfattribs=layer)


def moments(outline: Outline) -> list[float]:
    """All moments up to the third order."""
    return [outline.moment(p, q) for p in range(4) for q in range(4 - p)]


def refused(path: Path, options: Options = WHEEL, code: int = 3) -> str:
    """The message with which a drawing is refused."""
    with pytest.raises(ResultError) as found:
        make(path, options)
    assert found.value.code == code, found.value
    return str(found.value)


def made(path: Path, **options: Any) -> Section:
    """The section of a wheel."""
    return make(path, Options("wheel", **options))


def ring_moment(q: int) -> float:
    """The integral of y^q over the ring in m, its corners by quadrature in polar coordinates."""
    a, r, y0 = 1e-3 * WIDTH, 1e-3 * ROUND, 1e-3 * (OUTER - ROUND)
    x, w = np.polynomial.legendre.leggauss(40)
    angle, by = math.pi / 4 * (x + 1), math.pi / 4 * w
    # Strips of the corners dy by dx = r cos at y = y0 + r sin.
    corner = float((by * r * np.cos(angle) * r * np.cos(angle) * (y0 + r * np.sin(angle)) ** q).sum())
    flat = (y0 ** (q + 1) - (1e-3 * INNER) ** (q + 1)) / (q + 1) * a
    top = ((y0 + r) ** (q + 1) - y0 ** (q + 1)) / (q + 1) * (a - 2 * r)
    return flat + top + 2 * corner


def test_table_and_drawing_give_the_same_loop_with_the_moments_of_closed_forms(csv: Any, dxf: Any) -> None:
    table, drawing = made(csv(RING), unit="mm"), made(dxf(ring))
    np.testing.assert_allclose(moments(drawing.outline), moments(table.outline), rtol=1e-12, atol=1e-16)
    assert drawing.outline.group_lengths() == pytest.approx(table.outline.group_lengths())
    assert table.outline.length() == pytest.approx(
        1e-3 * (2 * WIDTH - 2 * ROUND + 2 * (OUTER - INNER - ROUND) + math.pi * ROUND)
    )
    # Bulges of a polyline, clockwise, in inches.
    rows = [(x / 25.4, y / 25.4, -RING[k - 1][3]) for k, (x, y, *_) in reversed(list(enumerate(RING)))]
    path = dxf(lambda space: space.add_lwpolyline(rows, format="xyb", close=True), units=1)
    inches = made(path, picks=[("running", 0.0, OUTER / 25.4)])
    assert "unit in by $INSUNITS = 1" in "\n".join(inches.lines)
    np.testing.assert_allclose(moments(inches.outline), moments(table.outline), rtol=1e-12, atol=1e-16)
    for q in range(4):
        assert table.outline.moment(0, q) == pytest.approx(ring_moment(q), rel=1e-12)


def test_mass_and_moments_of_inertia_of_a_torus() -> None:
    big, small, density = 0.4, 0.05, 7860.0
    centre = np.array([0.02, big])
    halves = [Arc.circular("", "half", centre, small, angles) for angles in ((0.0, math.pi), (math.pi, 2 * math.pi))]
    found = WheelProperties.of_outline(Outline.join(halves, 1e-6), density)
    mass = density * 2 * math.pi**2 * big * small**2
    assert found.area == pytest.approx(math.pi * small**2, rel=1e-12)
    assert found.mass == pytest.approx(mass, rel=1e-12)
    assert found.axial == pytest.approx(mass * (big**2 + 0.75 * small**2), rel=1e-12)
    assert found.diametral == pytest.approx(mass * (0.5 * big**2 + 0.625 * small**2), rel=1e-12)
    assert found.centre == pytest.approx(0.02, rel=1e-12)


def test_mesh_has_the_area_of_the_outline_and_nodes_on_its_arcs(csv: Any) -> None:
    found = made(csv(RING), unit="mm")
    mesh, outline = found.mesh, found.outline
    assert mesh.jacobians().min() > 0
    assert mesh.area() == pytest.approx(outline.moment(0, 0), rel=1e-6)
    sides = [tuple(sorted(side)) for t in mesh.triangles[:, :3].tolist() for side in (t[:2], t[1:], t[::2])]
    border = {side for side in sides if sides.count(side) == 1}
    assert border == {tuple(sorted(edge)) for edge in mesh.edges[:, :2].tolist()}
    centre = 1e-3 * np.array([WIDTH / 2 - ROUND, OUTER - ROUND])
    nodes = mesh.nodes[np.unique(mesh.edges)]
    round_nodes = nodes[(nodes > centre + 1e-9).all(axis=1)]
    assert len(round_nodes) >= 7
    np.testing.assert_allclose(np.linalg.norm(round_nodes - centre, axis=1), 1e-3 * ROUND, rtol=1e-9)


def test_edges_become_shorter_towards_reentrant_corners(csv: Any) -> None:
    """A ring with a step: one re-entrant corner among sharp and round ones."""
    places = ((-50, 200), (50, 200), (50, 260), (0, 260), (0, 300), (-50, 300))
    groups = ("bore", "", "", "", "running", "")
    step = [(*place, group, 0) for place, group in zip(places, groups)]
    edges = divide(make(csv(step), WHEEL).outline.curves, lambda _: 6e-3)
    lengths: dict[tuple[int, int], list[float]] = {}
    for edge in edges:
        first, last = edge.point(0.0), edge.point(1.0)
        for end in (first, last):
            place = (round(1e3 * float(end[0])), round(1e3 * float(end[1])))
            lengths.setdefault(place, []).append(1e3 * float(np.linalg.norm(last - first)))
    assert max(lengths[0, 260]) < 6 / 16 + 1e-6
    for corner in ((-50, 200), (50, 200), (50, 260), (0, 300), (-50, 300)):
        assert min(lengths[corner]) > 5, corner
    spans = [float(np.linalg.norm(edge.point(1.0) - edge.point(0.0))) for edge in edges]
    assert all(0.45 < one / other < 2.2 for one, other in zip(spans, spans[1:]))


def test_rail_has_the_published_properties_of_60e1() -> None:
    found = make(MESHES / "rail-outline.csv", Options("rail")).properties
    # EN 13674-1: 76.70 cm², 60.21 kg/m, 3038.3 and 512.3 cm⁴, recalled; the outline has 0.01 mm.
    assert 1e4 * found.area == pytest.approx(76.70, rel=2e-3)
    moments = [1e8 * found.vertical, 1e8 * found.lateral]  # type: ignore[union-attr]
    assert moments == pytest.approx([3038.3, 512.3], rel=3e-3)
    assert 1e3 * found.centroid[1] == pytest.approx(80.9, abs=0.1)  # type: ignore[union-attr]


def test_examples_are_those_of_their_script(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(MESHES))
    import make_outlines  # type: ignore[import-not-found]

    make_outlines.rail(tmp_path / "rail-outline.csv")
    make_outlines.wheel(tmp_path / "wheel-outline.dxf")
    make_outlines.wheelset(tmp_path / "wheelset-outline.csv")
    for name in ("rail-outline.csv", "wheelset-outline.csv"):
        assert (tmp_path / name).read_text() == (MESHES / name).read_text()
    one, other = made(tmp_path / "wheel-outline.dxf"), made(MESHES / "wheel-outline.dxf")
    assert moments(one.outline) == moments(other.outline)


def test_points_along_an_arc_become_quadratic_edges(csv: Any) -> None:
    # A bowed web of 1 mm long lines: edges of 6 mm pass several of them.
    bow = [(30 + 20 * math.sin(math.pi * k / 300), 120.0 + k) for k in range(1, 300)]
    rows = [
        (-30, 120, "bore"),
        (30, 120, ""),
        *((x, y, "") for x, y in bow),
        (30, 420, ""),
        (30, 430, "running"),
        (-30, 430, ""),
    ]
    path = csv(rows, "x,y,group")
    found = made(path, unit="mm")
    assert len(found.outline.curves) == len(rows)
    # The web with the lines at its ends, which it meets with a small turn, is one curve of four.
    assert len(with_polylines(found.outline.curves)) == 4
    assert len(found.mesh.edges) < 200
    assert found.mesh.area() == pytest.approx(found.outline.moment(0, 0), rel=2e-5)


def test_splines_ellipses_blocks_and_mirrored_arcs_are_exact(dxf: Any) -> None:
    def fill(space: Any) -> None:
        ring(space, skip=(2, 4))
        top, at = OUTER - ROUND, WIDTH / 2 - ROUND
        # A quarter of a circle as a rational spline.
        points = [(WIDTH / 2, top), (WIDTH / 2, OUTER), (at, OUTER)]
        spline = space.add_rational_spline(points, weights=[1, math.sqrt(0.5), 1], degree=2, knots=[0, 0, 0, 1, 1, 1])
        assert spline.dxf.degree == 2
        # The other one within a block, drawn from below: its x is the other one.
        block = space.doc.blocks.new("CORNER")
        block.add_arc((at, top), ROUND, 0, 90, dxfattribs={"extrusion": (0, 0, -1)})
        space.add_blockref("CORNER", (0, 0))
        space.add_text("a remark")

    found = made(dxf(fill))
    for q in range(4):
        assert found.outline.moment(0, q) == pytest.approx(ring_moment(q), rel=1e-9)
    assert "left out: 1 TEXT" in found.remarks

    def oval(space: Any) -> None:
        space.add_ellipse((0, 300), (150, 0), 0.5, 0, math.pi, dxfattribs={"layer": "RUNNING"})
        space.add_polyline2d([(-150, 300), (150, 300)], dxfattribs={"layer": "bore"})

    assert made(dxf(oval)).outline.moment(0, 0) == pytest.approx(1e-6 * math.pi * 150 * 75 / 2, rel=1e-12)
    half = made(
        dxf(lambda space: (ring(space, skip=(0,)), space.add_ellipse((0, INNER), (WIDTH / 2, 0), 0.5, math.pi, 0)))
    )
    assert half.outline.moment(0, 0) == pytest.approx(ring_moment(0) + 1e-6 * math.pi * WIDTH**2 / 16, rel=1e-12)


def test_axes_origin_and_mirror(csv: Any) -> None:
    flange = [
        *RING[:1],
        (WIDTH / 2, INNER, "", 0.0),
        (WIDTH / 2, OUTER + 28, "", 0.0),
        (WIDTH / 2 - 30, OUTER + 28, "", 0.0),
    ]
    flange += [(WIDTH / 2 - 30, OUTER, "running", 0.0), (-WIDTH / 2, OUTER, "", 0.0)]
    plain = made(csv(flange), unit="mm")
    turned = made(
        csv([(y + 7, -x - 5, g, b) for x, y, g, b in flange]), unit="mm", axis="y", mirror=True, origin=(7, -5)
    )
    np.testing.assert_allclose(moments(turned.outline), moments(plain.outline), rtol=1e-12, atol=1e-18)
    below = made(csv([(x, -y, g, b) for x, y, g, b in flange]), unit="mm")
    np.testing.assert_allclose(moments(below.outline), moments(plain.outline), rtol=1e-12, atol=1e-18)
    assert any("below the axle" in remark for remark in below.remarks)
    assert not any("flange" in remark for remark in plain.remarks)
    other_side = made(csv([(-x, y, "", b) for x, y, _, b in flange]), unit="mm", picks=[("running", 0, OUTER)])
    assert any("the flange is to be at +x; --mirror" in remark for remark in other_side.remarks)


@pytest.mark.parametrize(
    ("separator", "decimal", "end", "mark"),
    [
        (";", ",", "\n", b""),
        ("\t", ",", "\r\n", b"\xef\xbb\xbf"),
        (" ", ".", "\n", b""),
        (",", ".", "\r\n", b""),
        (" ", ",", "\n", b""),
    ],
)
def test_tables_of_any_separator_decimal_sign_and_line_end_are_one(
    csv: Any, separator: str, decimal: str, end: str, mark: bytes
) -> None:
    rows = [separator.join(f"{v:.3f}".replace(".", decimal) for v in row[:2]) for row in RING]
    found = made(csv(mark + (end.join(rows) + end).encode()), unit="mm", picks=[("running", 0, OUTER)])
    sign = {".": "decimal point", ",": "decimal comma"}[decimal]
    assert sign in found.lines[0] and "6 rows, 2 columns, no header" in found.lines[0]
    box = 1e-3 * np.array([[-WIDTH / 2, INNER], [WIDTH / 2, OUTER]])
    np.testing.assert_allclose(found.outline.box(), box)


def test_columns_are_named_by_the_header(csv: Any) -> None:
    rows = [(g, y, b, x) for x, y, g, b in RING]
    found = made(csv(rows, "Group,r [mm],Bulge,y [mm]"))
    assert found.outline.moment(0, 1) == pytest.approx(ring_moment(1), rel=1e-12)
    assert "unit mm by the header" in found.lines[0]
    assert "--unit m" in refused(csv(rows, "Group,r [mm],Bulge,y [mm]"), Options("wheel", unit="m"), 2)


POINTS = "-65;100\n65;100\n65;460\n-65;460\n"


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("", ["is empty"]),
        ("# only a remark\n", ["is empty"]),
        ("x;y\n", ["line 1", "'x;y' is no row of numbers"]),
        ("Wheel of the year\nsome words\n", ["line 2", "no row of numbers"]),
        ("0;-65;100\n1;65;100\n2;65;460\n3;-65;460\n", ["line 1", "3 columns without a header", "number of the point"]),
        ("index;x;y\n0;-65;100\n1;65;100\n3;65;460\n", ["'index'", "has no meaning here"]),
        ("0;100\n1;65\n2;460\n", ["2 columns without a header", "number of the point"]),
        ("-65,0,100,0\n65,0,100,0\n65,0,460,0\n", ["line 1", "decimal commas or separators", "semicolons"]),
        ("x;y;z\n1;2;3\n4;5;6\n7;8;10\n", ["coordinates x, y, z"]),
        ("x (mm);y (m)\n" + POINTS, ["several units"]),
        (POINTS + "-65;1O0\n", ["line 5", "'1O0' is no finite number"]),
        (POINTS + "-65\n", ["line 5", "1 fields", "expected 2"]),
        (POINTS + "-65;nan\n", ["line 5", "'nan'"]),
        (POINTS + "65;100\n-65;300\n", ["line 5", "that of line 2"]),
        ("-65;100\n65;100\n", ["2 different points"]),
        ("-65;100\n65;460\n65;100\n-65;460\n", ["crosses itself", "line 1", "line 3"]),
        ("-65;-460\n65;-460\n65;460\n-65;460\n", ["reaches the axle", "y = -460"]),
    ],
)
def test_tables_that_are_none_are_refused(csv: Any, text: str, parts: list[str]) -> None:
    said = refused(csv(text))
    for part in parts:
        assert part in said, said


def test_units_that_do_not_fit_are_named(csv: Any, dxf: Any) -> None:
    said = refused(csv(RING), Options("wheel", unit="m"))
    assert "radius 460 m" in said and "the unit that fits is mm" in said, said
    metres = [(1e-3 * x, 1e-3 * y, g, b) for x, y, g, b in RING]
    said = refused(csv(metres), Options("wheel", unit="mm"))
    assert "radius 0.00046 m" in said and "the unit that fits is m" in said, said
    said = refused(csv(RING), Options("wheel"), 2)
    assert "does not say its unit" in said and "mm" in said
    said = refused(dxf(ring), Options("wheel", unit="in"), 2)
    assert "--unit in" in said and "says mm ($INSUNITS = 4)" in said
    assert "give --unit" in refused(dxf(ring, units=0), Options("wheel"), 2)
    flat = csv([(0, 0, "foot", 0), (1, 0, "", 0), (1, 0.5, "running", 0), (0, 0.5, "", 0)])
    assert "no unit makes that height" in refused(flat, Options("rail", unit="mm"))


def test_open_branched_and_double_outlines_are_refused_with_places(dxf: Any) -> None:
    said = refused(dxf(lambda space: ring(space, skip=(3,))))
    assert "the outline is open" in said and "(x = 53.0000, y = 460.0000) mm" in said and "106 mm away" in said, said
    said = refused(dxf(lambda space: ring(space, shift=0.5)))
    assert "0.5 mm away" in said, said
    assert made(dxf(lambda space: ring(space, shift=0.005))).outline.moment(0, 0) == pytest.approx(
        ring_moment(0), rel=1e-4
    )
    two = refused(dxf(lambda space: (ring(space), space.add_circle((0, 300), 20, dxfattribs={"layer": "hole"}))))
    assert "2 closed outlines" in two and "hole" in two and "--ignore" in two, two
    found = made(
        dxf(lambda space: (ring(space), space.add_circle((0, 300), 20, dxfattribs={"layer": "hole"}))), ignored=["HOLE"]
    )
    assert (
        found.outline.moment(0, 0) == pytest.approx(ring_moment(0), rel=1e-12)
        and "layers left out: hole (1)" in found.remarks
    )
    said = refused(dxf(lambda space: (ring(space), space.add_line((0, 100), (0, 460)))))
    assert "ends that meet no other" in said, said
    said = refused(
        dxf(lambda space: (ring(space), space.add_line((-65, 100), (0, 300)), space.add_line((-65, 100), (0, 300))))
    )
    assert "are the same curve" in said, said
    said = refused(dxf(lambda space: (ring(space), space.add_line((0, 200), (0, 200)))))
    assert "has no length" in said and "(x = 0.0000, y = 200.0000) mm" in said, said
    said = refused(dxf(lambda space: (ring(space), space.add_circle((-65, 100), 20))))
    assert "crosses" in said or "closed outlines" in said, said


def test_groups_come_from_layers_options_and_points(dxf: Any) -> None:
    def upper(space: Any) -> None:
        ring(space)
        for entity in space:
            entity.dxf.layer = {"running": "TREAD", "bore": "BORE"}.get(entity.dxf.layer, "0")

    path = dxf(upper)
    said = refused(path)
    assert "no edge is in the group 'running' (the drawing has TREAD, bore)" in said, said
    assert set(made(path, groups={"tread": "running"}).outline.group_lengths()) == {"running", "bore"}
    assert set(made(path, picks=[("running", 10, 460.5)]).outline.group_lengths()) == {"running", "bore"}
    assert "the nearest curve" in refused(path, Options("wheel", picks=[("running", 10, 470)]), 2)
    assert "'hub'" in refused(path, Options("wheel", ignored=["hub"]), 2)
    whole = dxf(
        lambda space: space.add_lwpolyline([row[:2] for row in RING], close=True, dxfattribs={"layer": "running"})
    )
    assert "whole outline" in refused(whole)


def test_files_that_are_no_drawings_are_refused(tmp_path: Path, dxf: Any) -> None:
    path = tmp_path / "a.dxf"
    assert "no such file" in refused(path)
    garbage = np.random.default_rng(1).integers(0, 256, 5000, dtype=np.uint8).tobytes()
    for data, part in (
        (b"", "is empty"),
        (b"AC1027" + garbage, "is a DWG file"),
        (b"AutoCAD Binary DXF\r\n\x1a\x00" + garbage, "no DXF drawing that can be read"),
        (garbage, "no DXF drawing that can be read"),
        (b"x;y\n1;2\n", "no DXF drawing that can be read"),
        (b"0\nSECTION\n2\nENTITIES\n0\nLINE\n10\nnan\n", "no lines, arcs"),
    ):
        path.write_bytes(data)
        said = refused(path)
        assert part in said and "a.dxf" in said, said
    assert "no lines, arcs" in refused(dxf(lambda space: space.add_text("nothing")))
    assert made(dxf(ring, binary=True)).outline.moment(0, 0) == pytest.approx(ring_moment(0), rel=1e-12)
    said = refused(dxf(lambda space: (ring(space, skip=(0,)), space.add_line((-65, 100, 0), (65, 100, 3)))))
    assert "expected a plane drawing" in said, said
    table = tmp_path / "a.csv"
    table.write_bytes(garbage)
    assert "no text" in refused(table)
    assert "no regular file" in refused(tmp_path)


def test_command_writes_mesh_picture_and_the_body_of_a_job(tmp_path: Path, capsys: Any, dxf: Any) -> None:
    path = dxf(ring)
    arguments = ["section", str(path), "--kind", "wheel", "--size", "0.02"]
    picture = tmp_path / "picture.png"
    assert main([*arguments, "--picture", str(picture)]) == 0
    said = capsys.readouterr().out
    body = json.loads(said[said.index("{") :])["upper"]
    assert body["mesh"]["revolved"]["section"]["file"] == {"path": str(tmp_path / "outline.msh"), "radius": 0.46}
    assert body["fixed"] == ["bore"] and "volume" in said and "mass" in said
    assert picture.read_bytes()[:4] == b"\x89PNG" and 5000 < picture.stat().st_size < 100_000
    assert main(arguments) == 2 and "is there already" in capsys.readouterr().err
    assert main([*arguments, "--force"]) == 0
    for extra, part, code in (
        (["--output", str(path), "--force"], "the drawing itself", 2),
        (["--output", str(tmp_path / "no/a.msh")], "no folder", 6),
        (["--size", "6", "--force"], "is it given in mm", 2),
        (["--size", "nan", "--force"], "--size", 2),
        (["--group", "running", "--force"], "NAME=LAYER", 2),
        (["--pick", "running=3", "--force"], "NAME=X,Y", 2),
        (["--picture", str(tmp_path / "a.gif"), "--force"], ".png, .pdf, .svg", 2),
    ):
        assert main([*arguments, *extra]) == code
        assert part in capsys.readouterr().err


def test_a_loop_is_the_same_from_shuffled_and_turned_curves() -> None:
    points = np.array([[0.0, 0.1], [0.1, 0.1], [0.1, 0.2], [0.05, 0.3], [0.0, 0.2]])
    lines = [Line("", f"line {k}", points[k], points[(k + 1) % 5]) for k in range(5)]
    expected = Outline.join(lines, 1e-6)
    shuffled = Outline.join([lines[k].reversed() if k % 2 else lines[k] for k in (3, 0, 4, 2, 1)], 1e-6)
    assert moments(shuffled) == pytest.approx(moments(expected))
    moved = [line.transformed(Affine(2 * np.eye(2), np.array([1.0, 0.0]))) for line in lines]
    assert Outline.join(moved, 1e-6).moment(0, 0) == pytest.approx(4 * expected.moment(0, 0))
    with pytest.raises(InputError, match="ends of curves meet"):
        Outline.join(
            [*lines, *(Line("", "other", a, b) for a, b in ((points[0], points[2] * 2), (points[2] * 2, points[3])))],
            1e-6,
        )


def test_half_of_a_wheelset_has_the_mass_of_both_halves_and_says_its_middle(tmp_path: Path, capsys: Any) -> None:
    half = [
        (0.0, 0.0, "", 0.0),
        (750.0, 0.0, "", 0.0),
        (750.0, 80.0, "", 0.0),
        (65.0, 80.0, "", 0.0),
        (65.0, 460.0, "running", 0.0),
        (-65.0, 460.0, "", 0.0),
        (-65.0, 80.0, "", 0.0),
        (-100.0, 80.0, "journal", 0.0),
        (-300.0, 80.0, "", 0.0),
        (-300.0, 0.0, "", 0.0),
    ]
    path = tmp_path / "half.csv"
    path.write_text("\n".join(["x (mm),y (mm),group,bulge", *(",".join(map(str, row)) for row in half)]) + "\n")
    made = make(path, Options("wheelset", size=0.05))
    volume = 2 * math.pi * (0.08**2 * 1.05 + (0.46**2 - 0.08**2) * 0.13)
    assert isinstance(made.properties, WheelProperties)
    assert made.properties.mass == pytest.approx(7860 * volume, rel=1e-12)
    assert made.properties.centre == pytest.approx(0.75)
    assert made.mesh.nodes[:, 1].min() == 0.0 and len(made.remarks) == 1
    mesh = tmp_path / "half.msh"
    assert main(["section", str(path), "--kind", "wheelset", "--size", "0.05", "--output", str(mesh)]) == 0
    body = json.loads(capsys.readouterr().out.split("folder:\n\n")[1])["upper"]
    assert body["mesh"]["revolved"]["section"]["file"]["middle"] == 0.75
    assert body["suspension"]["journals"] == [-0.95, 0.95] and "fixed" not in body
    with pytest.raises(InputError, match=r"in a corner; expected one half of a wheelset"):
        pointed = [(750.0, 40.0, "", 0.0) if row[:2] == (750.0, 80.0) else row for row in half]
        pointed[1] = (700.0, 0.0, "", 0.0)
        path.write_text("\n".join(["x (mm),y (mm),group,bulge", *(",".join(map(str, row)) for row in pointed)]) + "\n")
        make(path, Options("wheelset", size=0.05))
    with pytest.raises(InputError, match="crosses the axle"):
        path.write_text(
            "\n".join(["x (mm),y (mm),group,bulge", *(f"{x},{y - 5},{g},{b}" for x, y, g, b in half)]) + "\n"
        )
        make(path, Options("wheelset", size=0.05))
