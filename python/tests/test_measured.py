"""Measurements: universal files, receptances beside those of a result, and modes fitted to them."""

import json
import re
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from conftest import dataset
from railsqueal import Result, ResultError, report
from railsqueal.__main__ import main
from railsqueal.measured import Measurements
from railsqueal.measured.modal_fit import FittedMode, fit, fit_band
from railsqueal.measured.overlay import FileAxes, Overlay
from railsqueal.measured.universal import UniversalFile
from railsqueal.pictures import Canvas, draw

pyuff = pytest.importorskip("pyuff")
DOTS = 40
SI = {"type": 164, "units_code": 1, "length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 273.15}
MILLIMETRES = SI | {"units_code": 10, "length": 1e3}
# Frequency, Hz, and damping ratio of a close pair and of two modes apart.
MODES = ((344.0, 2e-4), (344.6, 3e-4), (358.0, 1e-3), (410.0, 1e-4))


def receptance(frequency: Any, modes: Any, shapes: Any) -> Any:
    """Σ φ_a φ_b / (ω_r² − ω² + 2iζω_r ω)."""
    w = 2 * np.pi * frequency
    parts = [s / ((2 * np.pi * f) ** 2 - w**2 + 2j * z * 2 * np.pi * f * w) for (f, z), s in zip(modes, shapes)]
    return np.sum(parts, axis=0)


def function(frequency: Any, values: Any, response: int = 2, reference: int = 2, **more: Any) -> dict[str, Any]:
    """A dataset 58 of accelerance at node 7."""
    return {
        "type": 58,
        "func_type": 4,
        "rsp_node": 7,
        "rsp_dir": response,
        "ref_node": 7,
        "ref_dir": reference,
        "x": frequency,
        "data": values,
        "abscissa_spacing": 1,
        "abscissa_spec_data_type": 18,
        "ordinate_spec_data_type": 12,
        "orddenom_spec_data_type": 13,
        "z_axis_spec_data_type": 0,
        "id1": "hammer",
    } | more


def written(path: Path, *sets: dict[str, Any]) -> Path:
    """A universal file of these datasets, after that of the units."""
    pyuff.UFF(str(path)).write_sets([dict(one) for one in sets], "overwrite")
    return path


@pytest.fixture
def computed(tmp_path: Path) -> Path:
    """A result with the receptances of both bodies, from a mode each in y, and one in y and n."""
    path = tmp_path / "run.h5"
    f = np.linspace(300, 400, 401)
    h = np.zeros((len(f), 3, 3), complex)
    h[:, 0, 0] = 1e-10
    h[:, 1, 1] = receptance(f, [(350.0, 5e-3)], [2e-3])
    h[:, 2, 2] = receptance(f, [(350.0, 5e-3)], [5e-4])
    h[:, 1, 2] = h[:, 2, 1] = receptance(f, [(350.0, 5e-3)], [1e-3])
    with h5py.File(path, "w") as file:
        dataset(file, "receptance/frequency", f, "Hz")
        dataset(file, "receptance/lower", h, "m/N")
        dataset(file, "receptance/upper", 3 * h, "m/N")
        dataset(file, "provenance/job", '{"title": "measured"}', "-")
    return path


def test_units_and_quantities_become_receptances(tmp_path: Path) -> None:
    f = np.arange(10.0, 200.0, 0.5)
    h = receptance(f, [(90.0, 0.01)], [3e-3])
    w = 2j * np.pi * f
    file = UniversalFile.read(
        written(
            tmp_path / "a.uff",
            MILLIMETRES,
            function(f, 1e3 * w**2 * h, ordinate_axis_units_lab="mm/s^2", orddenom_axis_units_lab="N"),
            SI,
            function(f, w * h, -1, 3, ordinate_spec_data_type=11, binary=1),
            function(f, h, ordinate_spec_data_type=8, abscissa_spacing=0),
            function(f, np.abs(h), func_type=6),
        )
    )
    assert [r.quantity for r in file.responses] == ["accelerance", "mobility", "receptance"]
    for response in file.responses:
        assert np.abs(response.receptance / h - 1).max() < 1e-5
    assert str(file.responses[1].response) == "7:-X" and str(file.responses[1].reference) == "7:+Z"
    assert file.others == ["dataset 6: coherence"]
    # Gravity as unit of the axis, with the units of the values.
    g = written(tmp_path / "g.uff", SI | {"units_code": 9, "length": 1 / 9.80665}, function(f, w**2 * h / 9.80665))
    assert np.abs(UniversalFile.read(g).responses[0].receptance / h - 1).max() < 1e-5


F = np.arange(10.0, 60.0)
ONES = np.ones(len(F), complex)


@pytest.mark.parametrize(
    "sets, words",
    [
        ([function(F, ONES)], "dataset 1: .* no dataset 164"),
        ([SI, function(F, ONES, ordinate_spec_data_type=0)], "dataset 2: .*data type 0 .*expected 8 displacement"),
        ([SI, function(F, ONES, ordinate_spec_data_type=1)], "data type 1"),
        ([SI, function(F, ONES, orddenom_spec_data_type=0)], "type 0 .record 10.*13 excitation force"),
        ([SI, function(F, ONES, abscissa_spec_data_type=17)], "expected 18 frequency"),
        ([SI, function(F, ONES, 4)], "response at the node 7 in the direction 4, expected a translation"),
        ([SI, function(F, ONES, 2, 0)], "reference at the node 7 in the direction 0"),
        ([SI, function(F, ONES.real)], "real numbers, expected complex"),
        ([SI, function(F, ONES, ordinate_axis_units_lab="g")], "'g' as unit .*9.80665 in SI.*dataset 164 has 1"),
        ([SI, function(F, ONES, ordinate_axis_units_lab="mm/s2")], "correct that dataset"),
        ([SI, function(F, ONES, ordinate_axis_units_lab="EU")], "'EU' .*not understood"),
        ([SI, function(F, ONES, orddenom_axis_units_lab="lbf")], "'lbf' .*record 10"),
        ([SI | {"length": 1e3}, function(F, ONES)], "dataset 1: units of the code 1"),
        ([SI, function(F[::-1], ONES, abscissa_spacing=0)], "do not rise"),
    ],
)
def test_what_is_not_certain_is_refused(tmp_path: Path, sets: list[dict[str, Any]], words: str) -> None:
    with pytest.raises(ResultError, match=words) as error:
        UniversalFile.read(written(tmp_path / "a.uff", *sets))
    assert error.value.code == 3 and "a.uff, dataset" in str(error.value)


def test_files_that_are_none_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.uff"
    with pytest.raises(ResultError, match="no such file"):
        UniversalFile.read(path)
    path.write_text("frequency,receptance\n1,2\n")
    with pytest.raises(ResultError, match="found no dataset"):
        UniversalFile.read(path)
    # Cut in the middle of the values; a value that is no number.
    whole = written(path, SI, function(F, ONES)).read_text()
    path.write_text(whole.replace(f"{1:20.11e}", f"{'NaN':>20}", 1))
    with pytest.raises(ResultError, match="dataset 2: values that are no numbers"):
        UniversalFile.read(path)
    lines = whole.splitlines()
    path.write_text("\n".join([*lines[:-8], "    -1", ""]))
    with pytest.raises(ResultError, match="dataset 2: found .* values, expected 50: the file is cut"):
        UniversalFile.read(path)


def test_axes_of_the_file_along_those_of_the_job() -> None:
    axes = FileAxes.parse("Y,-X,Z")
    direction = UniversalDirection
    assert axes.direction_in_result(direction(2), "upper") == (0, 1) and axes.direction_in_result(
        direction(1), "upper"
    ) == (1, -1)
    assert axes.direction_in_result(direction(-1), "lower") == (1, 1)
    # n points into the body: −z of the lower one.
    assert axes.direction_in_result(direction(3), "upper") == (2, 1) and axes.direction_in_result(
        direction(3), "lower"
    ) == (2, -1)
    for text in ("X,Y", "X,X,Z", "X,Y,-Z", "X,Y,W", ""):
        with pytest.raises(ResultError, match="--axes") as error:
            FileAxes.parse(text)
        assert error.value.code == 2


def UniversalDirection(code: int) -> Any:  # noqa: N802
    from railsqueal.measured.universal import Direction

    found = Direction.parse(7, code)
    assert found is not None
    return found


def test_measured_receptances_beside_computed_ones(tmp_path: Path, computed: Path, capsys: Any) -> None:
    f = np.arange(310.0, 390.0, 0.25)
    own = receptance(f, [(350.0, 5e-3)], [6e-3])
    cross = receptance(f, [(350.0, 5e-3)], [3e-3])
    w = 2j * np.pi * f
    # y of the job is −X of the file; the second function is 6 dB above the computed one.
    file = written(
        tmp_path / "wheel.uff",
        SI,
        function(f, w**2 * own, 1, 1),
        function(f, 2 * w**2 * cross, -1, 3),
        function(f, w**2 * own, 1, 1, rsp_node=9),
    )
    overlay = Overlay.read(file, ["upper=7"], "Y,-X,Z")
    assert [(c.body, c.directions) for c in overlay.curves] == [("upper", (1, 1)), ("upper", (1, 2))]
    assert overlay.left == 1
    assert np.abs(overlay.curves[0].receptance / own - 1).max() < 1e-6
    assert np.abs(overlay.curves[1].receptance / (2 * cross) - 1).max() < 1e-6
    with Result(computed) as result:
        rows = overlay.rows(result)
        assert rows[0][-1].startswith("+0.0 ± 0.0 at 320") and rows[1][-1].startswith("+6.0 ± 0.0")
        made = draw(result, Canvas(tmp_path, "run", resolution=DOTS), measured=Measurements(overlay))
        assert [p.name for p in made] == ["run-receptance.png"]
        page = report.write(result, tmp_path, Measurements(overlay))[0].read_text(encoding="utf-8")
    assert "Measured receptances" in page and "accelerance" in page and 'href="#measured"' in page
    command = ["plot", str(computed), "--out", str(tmp_path), "--measured", str(file)]
    assert main(command) == 2 and "7:+X by a force at 7:+X" in capsys.readouterr().err
    assert main([*command, "--point", "upper=7", "--axes=Y,-X,Z"]) == 0
    assert main([*command, "--point", "upper=8", "--axes=Y,-X,Z"]) == 2
    assert "found no response at the node 8" in capsys.readouterr().err
    assert main([*command, "--point", "wheel=7", "--axes=Y,-X,Z"]) == 2
    assert main(["plot", str(computed), "--point", "upper=7"]) == 2
    with h5py.File(computed, "a") as content:
        del content["receptance"]
    assert main([*command, "--point", "upper=7", "--axes=Y,-X,Z"]) == 3
    assert "analyses.receptance" in capsys.readouterr().err


def noisy(values: Any, part: float, seed: int) -> Any:
    """Values with noise of a part of their largest modulus."""
    stream = np.random.default_rng(seed)
    noise = stream.normal(size=values.shape) + 1j * stream.normal(size=values.shape)
    return values + part * np.abs(values).max(axis=-1, keepdims=True) * noise / np.sqrt(2)


def expect_modes(found: list[FittedMode], wanted: Any) -> None:
    assert len(found) == len(wanted)
    for mode, (f, z) in zip(found, wanted):
        assert abs(mode.frequency / f - 1) < 1e-4 and abs(mode.damping_ratio / z - 1) < 0.05


def test_known_modes_are_found_in_noise() -> None:
    """The close pair is 0.6 Hz apart, of which each is 0.14 and 0.2 Hz wide; 1 % of noise."""
    f = np.arange(300.0, 450.0, 0.01)
    shapes = np.array([[1.0, 0.8, 0.5, 0.7], [0.9, -0.7, 0.4, 0.6], [0.4, 0.9, -0.6, 0.2]])
    h = np.array([receptance(f, MODES, s) for s in shapes])
    modes = [mode for one in fit(f, noisy(h, 0.01, 1)) for mode in one.modes]
    expect_modes(modes, MODES)
    # One response alone has the pair too.
    at = (f > 340) & (f < 350)
    (pair,) = [fit_band(f[at], noisy(h[:1, at], 0.01, 2), range(1, 5))]
    expect_modes(pair.modes, MODES[:2])


def test_without_noise_modes_are_those_of_the_receptance() -> None:
    f = np.arange(300.0, 450.0, 0.05)
    h = receptance(f, MODES[2:], [1.0, 0.5])[None]
    for one, (frequency, ratio) in zip(fit(f, h), MODES[2:]):
        (mode,) = one.modes
        assert abs(mode.frequency / frequency - 1) < 1e-8 and abs(mode.damping_ratio / ratio - 1) < 1e-4


def test_deviations_are_those_of_repeats() -> None:
    """Over 200 draws of noise the values scatter as their standard deviations say."""
    f = np.arange(350.0, 366.0, 0.1)
    h = receptance(f, [(358.0, 1e-3)], [1.0])[None]
    fits = [fit_band(f, noisy(h, 0.05, seed), [1]).modes[0] for seed in range(200)]
    for name, deviation in (("frequency", "frequency_deviation"), ("damping_ratio", "damping_deviation")):
        scatter = np.std([getattr(one, name) for one in fits])
        said = np.mean([getattr(one, deviation) for one in fits])
        assert 0.85 < scatter / said < 1.15, (name, scatter, said)


def test_noise_alone_has_no_modes() -> None:
    f = np.arange(100.0, 200.0, 0.1)
    h = 1e-9 + noisy(np.full((2, len(f)), 1e-9 + 0j), 0.3, 5)
    assert [mode for one in fit(f, h) for mode in one.modes] == []


def test_the_command_writes_what_goes_into_the_job(tmp_path: Path, capsys: Any) -> None:
    f = np.arange(330.0, 430.0, 0.01)
    h = np.array([receptance(f, MODES, s) for s in ([1.0, 0.8, 0.5, 0.7], [0.9, -0.7, 0.4, 0.6])])
    accelerance = noisy(-((2 * np.pi * f) ** 2) * h, 0.01, 3)
    sets = [function(f, accelerance[k], rsp_node=k) for k in range(2)]
    file = written(tmp_path / "wheel.uff", SI, *sets, function(f, np.abs(h[0]), func_type=6))
    assert main(["fit", str(file), "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert "left out: dataset 4: coherence" in said and "2 frequency responses" in said
    assert re.search(r"358\.0\d+ ± 0\.0|357\.9\d+ ± 0\.0", said)
    measured = json.loads((tmp_path / "out/wheel-fit.json").read_text())["measured"]
    deviations = {"frequency_deviation", "damping_ratio_deviation"}
    assert [set(mode) for mode in measured] == [{"near", "frequency", "damping_ratio"} | deviations] * 4
    # Of the clear mode apart from the others: as the table prints them.
    assert measured[3]["frequency_deviation"] == pytest.approx(0.0001, rel=0.6)
    for mode, (frequency, ratio) in zip(measured, MODES):
        assert abs(mode["frequency"] / frequency - 1) < 1e-4 and abs(mode["damping_ratio"] / ratio - 1) < 0.05
    assert (tmp_path / "out/wheel-fit.png").stat().st_size > 0
    schema = json.loads((Path(__file__).parents[2] / "schemas/job.schema.json").read_text())
    known = schema["$defs"]["MeasuredMode"]["properties"]
    assert {key for mode in measured for key in mode} <= set(known)
    # One band, one of the responses.
    band = ["--band", "405,415", "--modes", "1", "--datasets", "2"]
    assert main(["fit", str(file), "--out", str(tmp_path / "one"), *band]) == 0
    assert len(json.loads((tmp_path / "one/wheel-fit.json").read_text())["measured"]) == 1
    for options, words in (
        (["--band", "9"], "--band: found '9'"),
        (["--band", "500,600"], "--band: found 0 lines"),
        (["--datasets", "4"], "--datasets: found '4'"),
        (["--modes", "0"], "--modes: found 0"),
    ):
        assert main(["fit", str(file), *options]) == 2 and words in capsys.readouterr().err


def test_listed_modes_and_files_without_any(tmp_path: Path, capsys: Any) -> None:
    nodes = {"node_nums": [1], "r1": np.ones(1), "r2": np.ones(1), "r3": np.ones(1), "load_case": 1, "data_ch": 2}
    real = nodes | {"type": 55, "analysis_type": 2, "spec_data_type": 8, "mode_n": 1, "freq": 358.2}
    value = 2 * np.pi * 410.0 * (-0.002 + 1j * np.sqrt(1 - 4e-6))
    complex_ = nodes | {"type": 55, "analysis_type": 3, "spec_data_type": 8, "mode_n": 2, "eig": value}
    file = written(tmp_path / "modes.uff", real | {"modal_damp_vis": 1.5e-4}, complex_)
    assert main(["fit", str(file)]) == 0
    measured = json.loads((tmp_path / "modes-fit.json").read_text())["measured"]
    assert measured[0] == {"near": 358.2, "frequency": 358.2, "damping_ratio": 1.5e-4}
    assert measured[1]["frequency"] == pytest.approx(410, rel=1e-5)
    assert measured[1]["damping_ratio"] == pytest.approx(2e-3, rel=1e-4)
    f = np.arange(100.0, 200.0)
    assert main(["fit", str(written(tmp_path / "c.uff", SI, function(f, np.ones(100), func_type=6)))]) == 3
    assert "neither frequency responses" in capsys.readouterr().err
    flat = written(tmp_path / "flat.uff", SI, function(f, np.full(100, 1e-9 + 0j)))
    assert main(["fit", str(flat)]) == 3 and "found no mode" in capsys.readouterr().err


NODES = {
    "type": 2411,
    "node_nums": [10, 11, 12, 13],
    "def_cs": [0] * 4,
    "disp_cs": [0] * 4,
    "color": [1] * 4,
    "x": [0.0, 100.0, 200.0, 300.0],
    "y": [50.0, 60.0, 70.0, 80.0],
    "z": [400.0, 300.0, 200.0, 100.0],
}


def roving(f: Any, shapes: Any, reference: int = 10) -> list[dict[str, Any]]:
    """Accelerances at X and −Y of the nodes 10 to 13 by a force at X of a node; `shapes` `[modes, 8]`."""
    modes, sets = ((350.0, 2e-4), (380.0, 3e-4)), []
    for k in range(8):
        h = receptance(f, modes, [shape[k] * shape[0] for shape in shapes])
        values = noisy(-((2 * np.pi * f) ** 2) * h, 1e-3, k)
        ends = {"rsp_node": 10 + k // 2, "rsp_dir": 1 if k % 2 == 0 else -2, "ref_node": reference, "ref_dir": 1}
        sets.append(function(f, values, **ends))
    return sets


def test_shapes_are_written_in_the_frame_of_the_body(tmp_path: Path, capsys: Any) -> None:
    f = np.arange(340.0, 390.0, 0.01)
    shapes = np.random.default_rng(5).uniform(0.3, 1.0, (2, 8)) * [
        [1, -1, 1, 1, -1, 1, 1, -1],
        [1, 1, -1, 1, 1, -1, 1, 1],
    ]
    file = written(tmp_path / "wheel.uff", MILLIMETRES, NODES, *roving(f, shapes))
    assert main(["fit", str(file), "--axes", "Y,-X,Z", "--origin", "0,0.05,0"]) == 0
    measured = json.loads((tmp_path / "wheel-fit.json").read_text())["measured"]
    assert len(measured) == 2 and all("near" not in mode for mode in measured)
    for mode, wanted in zip(measured, shapes):
        shape = mode["shape"]
        # x of the body along +Y of the file, y against its X.
        assert np.allclose(shape["points"], [[0, 0, 0.4], [0.01, -0.1, 0.3], [0.02, -0.2, 0.2], [0.03, -0.3, 0.1]])
        x, y, z = zip(*shape["motion"])
        assert z == (None,) * 4
        found = np.concatenate([-np.array(y), -np.array(x)])
        wanted = np.concatenate([wanted[0::2], wanted[1::2]])
        assert np.abs(found @ wanted) / np.linalg.norm(found) / np.linalg.norm(wanted) > 1 - 1e-5
        assert np.abs(found).max() == pytest.approx(1, abs=1e-4)
    known = json.loads((Path(__file__).parents[2] / "schemas/job.schema.json").read_text())["$defs"]
    assert set(measured[0]) <= set(known["MeasuredMode"]["properties"])
    assert set(measured[0]["shape"]) == set(known["MeasuredShape"]["properties"])
    # Without --axes there are none.
    assert main(["fit", str(file)]) == 0
    assert "near" in json.loads((tmp_path / "wheel-fit.json").read_text())["measured"][0]
    capsys.readouterr()
    lone = written(tmp_path / "lone.uff", MILLIMETRES, *roving(f, shapes))
    assert main(["fit", str(lone), "--axes", "X,Y,Z"]) == 3
    assert "no coordinates of the node 10" in capsys.readouterr().err
    others = written(tmp_path / "others.uff", MILLIMETRES, NODES, *roving(f, shapes), *roving(f, shapes, 11))
    assert main(["fit", str(others), "--axes", "X,Y,Z"]) == 2
    assert "responses to one force" in capsys.readouterr().err
    assert main(["fit", str(file), "--axes", "X,Y,Z", "--origin", "1,2"]) == 2
    assert "--origin: found '1,2'" in capsys.readouterr().err
    assert main(["fit", str(file), "--origin", "1,2,3"]) == 2
    few = written(tmp_path / "few.uff", MILLIMETRES, NODES, *roving(f, shapes)[:5])
    assert main(["fit", str(few), "--axes", "X,Y,Z"]) == 0
    assert "has 5 components, a job takes 6" in capsys.readouterr().out


def test_listed_shapes_are_made_real(tmp_path: Path, capsys: Any) -> None:
    motion = np.array([[1.0, 0.5, 0.0], [-0.7, 0.2, 0.1], [0.3, -0.9, 0.0], [0.1, 0.1, 0.4]])
    listed = {"type": 55, "analysis_type": 3, "spec_data_type": 8, "mode_n": 1, "load_case": 1, "data_ch": 2}
    listed |= {"node_nums": NODES["node_nums"], "eig": 2 * np.pi * 410.0 * (-0.002 + 1j * np.sqrt(1 - 4e-6))}
    turned = motion * np.exp(0.8j)
    even = listed | {f"r{k + 1}": turned[:, k] for k in range(3)}
    mixed = listed | {f"r{k + 1}": turned[:, k] + 1j * np.roll(turned[:, k], 1) for k in range(3)}
    file = written(tmp_path / "modes.uff", MILLIMETRES, NODES, even, mixed)
    assert main(["fit", str(file), "--axes", "X,Y,Z"]) == 0
    found = np.array(json.loads((tmp_path / "modes-fit.json").read_text())["measured"][0]["shape"]["motion"])
    assert np.allclose(found * np.sign(found[0, 0]), motion, atol=1e-4)
    assert capsys.readouterr().out.count("is complex, its real part has") == 1


def test_without_pyuff_the_message_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path / "a.uff", SI, function(F, ONES))
    monkeypatch.setitem(__import__("sys").modules, "pyuff", None)
    with pytest.raises(ResultError, match=r"pip install 'railsqueal\[measured\]'") as error:
        UniversalFile.read(path)
    assert error.value.code == 2
