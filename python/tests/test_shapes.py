"""Modes in motion: the data of the viewer, its picture in a browser, and the modal assurance criterion."""

import base64
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from conftest import cube, dataset
from railsqueal import Result, compare, mac, report
from railsqueal.report import shapes
from railsqueal.result import Floats
from test_verdict import at, spectrum

STEPS = 16


def sequence(path: Path, name: str, fields: list[Any], tables: dict[str, Any]) -> None:
    """A sequence on two cubes of eight points each, the lower body's and the upper one's, with a field of each step."""
    with h5py.File(path, "w") as file:
        root = file.create_group("VTKHDF")
        dataset(root, "Points", np.array(cube(0, -1) + cube(0, 0)), "m")
        dataset(root, "PointData/body", np.tile(np.repeat([1, 2], 8).astype(np.int8), len(fields)), "-")
        dataset(root, f"PointData/{name}", np.concatenate(fields).astype(np.float32))
        dataset(root, "Connectivity", np.arange(16), "-")
        dataset(root, "Offsets", np.array([0, 8, 16]), "-")
        dataset(root, "Types", np.full(2, 12, np.uint8), "-")
        for kind, count in (("Points", 16), ("Cells", 2), ("ConnectivityIds", 16)):
            dataset(root, f"NumberOf{kind}", np.array([count]))
        dataset(root, "Steps/Values", np.arange(len(fields), dtype=float))
        dataset(root, f"Steps/PointDataOffsets/{name}", 16 * np.arange(len(fields)))
        for table, values in tables.items():
            dataset(file, f"modes/{table}", np.array(values))


def moving(path: Path, seed: int = 1) -> tuple[Path, Floats, Floats, Floats]:
    """A result with two complex modes and two free ones; both parts of the first complex one, and the free ones."""
    spectrum(path, [at(965, 4.0), at(350, -1.0)])
    random = np.random.default_rng(seed)
    real, later = random.normal(size=(2, 2, 16, 3))
    angle = 2 * np.pi * np.arange(STEPS) / STEPS
    frames = [np.cos(a) * real[k] + np.sin(a) * later[k] for k in (0, 1) for a in angle]
    place = np.repeat([0, 1], STEPS)
    tables = {
        "eigenvalue": place,
        "frequency": np.repeat([965.0, 350.0], STEPS),
        "growth_rate": np.repeat([4.0, -1.0], STEPS),
    }
    sequence(
        path.with_name(f"{path.stem}.modes.vtkhdf"),
        "motion",
        frames,
        tables | {"phase": np.tile(np.arange(STEPS) / STEPS, 2)},
    )
    free = random.normal(size=(2, 16, 3))
    sequence(
        path.with_name(f"{path.stem}.free_modes.vtkhdf"),
        "shape",
        list(free),
        {"frequency": [975.0, 975.0], "body": [2, 2], "number": [1, 2]},
    )
    return path, real[0], later[0], free


def decoded(text: str) -> dict[str, Any]:
    """Data of the viewer in a page."""
    found = re.search(r'<script type="application/json" id="viewer-data">(.*?)</script>', text, re.DOTALL)
    assert found
    return dict(json.loads(found[1]))


def numbers(text: str, kind: str) -> Any:
    return np.frombuffer(base64.b64decode(text), kind)


def test_motions_of_the_page_are_those_of_the_sequence(tmp_path: Path) -> None:
    path, real, later, free = moving(tmp_path / "a.h5")
    with Result(path) as result:
        data = decoded(report.page(result, []))
    assert [m["note"].split(";")[0] for m in data["motions"]] == [
        "965 Hz: wheel mode n = 3 axial, travelling against the rotation",
        "350 Hz: wheel mode n = 3 axial, travelling against the rotation",
        "975 Hz: wheel mode 1 (n = 3 axial)",
        "975 Hz: wheel mode 2 (n = 3 axial)",
    ]
    both, upper = data["meshes"]
    points = numbers(both["points"], "<f4").reshape(-1, 3)
    triangles = numbers(both["triangles"], "<u4").reshape(-1, 3)
    # Two closed cubes: each edge belongs to two triangles, which see it in opposite directions; the volume is 2.
    assert points.shape == (16, 3) and triangles.shape == (24, 3) and len(numbers(upper["triangles"], "<u4")) == 36
    edges = {(int(a), int(b)) for t in triangles for a, b in zip(t, np.roll(t, -1))}
    assert len(edges) == 72 and all((b, a) in edges for a, b in edges)
    corners = points[triangles]
    assert np.einsum("ti,ti->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6 == pytest.approx(2, rel=1e-6)
    # Points are sorted by the reader of the mesh: find each one's own.
    order = [int(np.argmin(np.abs(np.array(cube(0, -1) + cube(0, 0)) - p).sum(axis=1))) for p in points]
    motion = data["motions"][0]
    re_, im = (numbers(motion[part], "<i2").reshape(-1, 3) / 32767 for part in ("re", "im"))
    largest = np.sqrt((real**2 + later**2).sum(axis=1).max())
    shared = {tuple(p) for p in np.array(cube(0, -1)) if p[2] == 0}
    alone = np.array([tuple(np.round(p, 6)) not in shared for p in points])
    assert alone.sum() == 8
    for part, given in ((re_, real), (im, later)):
        assert np.abs(part[alone] - (given / largest)[np.array(order)[alone]]).max() < 2e-5
    assert data["motions"][2]["im"] is None and data["motions"][2]["mesh"] == 1


def test_motions_without_room_are_counted(tmp_path: Path) -> None:
    path, *_ = moving(tmp_path / "a.h5")
    with Result(path) as result:
        every = shapes.Shapes.from_result(result)
        assert (len(every.motions), every.left_out) == (4, 0)
        few = shapes.Shapes.from_result(result, budget=shapes.cost(every.motions[0], every.surfaces[0]) + 10)
        assert (len(few.motions), few.left_out) == (1, 3)


def test_a_page_has_a_largest_size(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, *_ = moving(tmp_path / "a.h5")
    rooms: list[int] = []
    section = shapes.section
    monkeypatch.setattr(shapes, "section", lambda result, room: rooms.append(room) or section(result, room))
    with Result(path) as result:
        whole = report.page(result, [])
        # Two of four modes find room: the first one with its surface, and one more.
        every = shapes.Shapes.from_result(result)
        two = shapes.cost(every.motions[0], every.surfaces[0]) + shapes.cost(every.motions[1], None)
        monkeypatch.setattr(report, "LARGEST", report.LARGEST - rooms[0] + shapes.OVERHEAD + two)
        text = report.page(result, [])
    # The room and the other parts are the page.
    assert len(text.encode()) < report.LARGEST + 10_000
    assert len(decoded(text)["motions"]) == 2 and "2 more modes are in the sequences beside the result" in text
    assert len(whole.encode()) < 15_000_000


def test_the_library_is_in_the_page_once_and_small(tmp_path: Path) -> None:
    path, *_ = moving(tmp_path / "a.h5")
    with Result(path) as result:
        text = report.page(result, [])
    library = (shapes.WEB / "three.min.js").read_text(encoding="utf-8")
    assert text.count(library) == 1 and "</script" not in library and len(text) < 2_000_000
    assert "MIT" in (shapes.WEB / "three.LICENSE").read_text(encoding="utf-8")


@pytest.mark.skipif(shutil.which("chromium") is None, reason="no chromium to draw the page")
def test_a_browser_draws_the_motion(tmp_path: Path) -> None:
    path, *_ = moving(tmp_path / "a.h5")
    with Result(path) as result:
        page, *_ = report.write(result, tmp_path / "out")
    options = "--headless=new --no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader"
    options += " --virtual-time-budget=3000 --dump-dom"
    address = f"{page.as_uri()}#motion=2&phase=0.25"
    done = subprocess.run(
        ["chromium", *options.split(), address], capture_output=True, text=True, timeout=120, check=True
    )
    figure = re.search(r'<figure id="viewer"([^>]*)>', done.stdout)
    assert (
        figure
        and 'data-state="drawn"' in figure[1]
        and 'data-motion="2"' in figure[1]
        and 'data-points="8"' in figure[1]
    )
    assert (
        "0.25 of the period" in done.stdout
        and "975 Hz: wheel mode 1 (n = 3 axial); free of contact, undamped" in done.stdout
    )


def test_mac_of_known_shapes() -> None:
    one = np.array([[1, 0, 0], [1, 1, 0], [1, 1j, 0]], complex)
    other = np.array([[2j, 0, 0], [0, 1, 0], [1, -1j, 0]], complex)
    assert mac.criterion(one, other) == pytest.approx(np.array([[1, 0, 0.5], [0.5, 0.5, 0.5], [0.5, 0.5, 0]]))
    assert mac.with_plane(one[1], np.array([[1, 2, 0], [1, -1, 0]], complex)) == pytest.approx(1)
    assert mac.with_plane(np.array([1, 1, 2], complex), np.array([[0, 0, 1]], complex)) == pytest.approx(4 / 6)


def test_shapes_of_two_results_are_compared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, real, later, free = moving(tmp_path / "a.h5")
    other, *_ = moving(tmp_path / "b.h5")
    # The complex mode a third of a period later is the same one; the pair of free modes is turned in its plane.
    angle = 2 * np.pi * np.arange(STEPS) / STEPS + 2.1
    with h5py.File(tmp_path / "b.modes.vtkhdf", "a") as file:
        file["VTKHDF/PointData/motion"][: 16 * STEPS] = np.concatenate(
            [np.cos(a) * real + np.sin(a) * later for a in angle]
        )
    with h5py.File(tmp_path / "b.free_modes.vtkhdf", "a") as file:
        turned = np.array([free[0] + 2 * free[1], free[0] - free[1]])
        file["VTKHDF/PointData/shape"][...] = turned.reshape(-1, 3)
        # The mesh stands elsewhere and is turned about the vertical by a right angle, and the shapes with it.
        right = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        file["VTKHDF/Points"][...] = file["VTKHDF/Points"][()] @ right
        file["VTKHDF/PointData/shape"][...] = file["VTKHDF/PointData/shape"][()] @ right
    with Result(path) as one, Result(other) as two:
        a, b = (mac.complex_shapes(r) for r in (one, two))
        assert a and b
        assert mac.partners(a, b)[1] == pytest.approx([1, 1], abs=1e-6)
        text, same = compare.text(one, two, 1e-6)
        assert same and "complex modes: mode of A, mode of B that is most alike\n  2 of 2 modes have MAC" in text
        free_a, free_b = (mac.free_shapes(r, "upper") for r in (one, two))
        assert free_a and free_b
        moved = mac.aligned(free_a, free_b)
        # Each is in the plane of the two, which have one frequency; alone they are not alike.
        assert moved and mac.partners(moved, free_b)[1] == pytest.approx([1, 1], abs=1e-6)
        assert mac.criterion(moved.shape, free_b.shape).max() < 0.95
    monkeypatch.setattr(mac, "MEMORY", 16 * 3 * 16)
    with Result(path) as one:
        few = mac.complex_shapes(one)
        assert few and few.shape.shape == (1, 48) and mac.fitting(10**9) == 1
    monkeypatch.undo()
    with h5py.File(tmp_path / "b.free_modes.vtkhdf", "a") as file:
        file["VTKHDF/Points"][10, 0] += 0.1
    with Result(path) as one, Result(other) as two:
        assert "the display meshes differ: no MAC" in compare.text(one, two, 1e-6)[0]
    (tmp_path / "b.modes.vtkhdf").write_bytes(b"no HDF5")
    with Result(path) as one, Result(other) as two:
        text, same = compare.text(one, two, 1e-6)
        assert same and "modal assurance criterion (MAC): cannot read" in text and "b.modes.vtkhdf" in text
