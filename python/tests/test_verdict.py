"""The verdict on made results whose spectra are known, and the names and units of keys."""

import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import h5py
import numpy as np
import pytest
from conftest import dataset
from railsqueal import ComplexModes, Result, labels, report
from railsqueal.mode_names import ModeNames
from railsqueal.stability import Budget, Sensitivities
from railsqueal.verdict import verdict

ROOT = Path(__file__).parents[2]
JOB = {
    "title": "made",
    "bodies": {
        "lower": {
            "mesh": {"extruded": {"section": "60E1", "length": 14.0}},
            "track": {"pad": {"vertical": 120e6, "loss_factor": 0.2}},
        },
        "upper": {
            "mesh": {"revolved": {"section": "W920S"}},
            "profile": "S1002",
            "material": {"young": 210e9, "density": 7860.0},
        },
    },
    "contact": {
        "friction": {"exponential": {"static": 0.4, "memory_length": 2e-5}},
        "normal_load": 60e3,
        "placement": {"yaw": -0.01},
    },
    "analyses": {"stability": {"max_frequency": 6000.0}},
}
# Free modes: one of the rail, a pair of the wheel with n = 3, and a second axial one with n = 3.
WHEEL = [(975.0, 3, "axial 0"), (975.0, 3, "axial 0"), (2020.0, 3, "axial 1")]


def spectrum(path: Path, values: Sequence[complex], job: dict[str, object] = JOB) -> Path:
    """A result with these eigenvalues: of each motion 54 and 44 % are in the pair of the wheel, and 2 % in the rail."""
    value = np.array(values, dtype=complex)
    with h5py.File(path, "w") as file:
        dataset(file, "provenance/job", json.dumps(job), "-")
        dataset(file, "modes/lower/frequency", [100.0], "Hz")
        dataset(file, "modes/lower/diameters", [4.0])
        frequency, diameters, family = zip(*WHEEL)
        dataset(file, "modes/upper/frequency", frequency, "Hz")
        dataset(file, "modes/upper/diameters", np.array(diameters, float))
        dataset(file, "modes/upper/family", family, "-")
        dataset(file, "stability/eigenvalue", value, "1/s")
        dataset(file, "stability/participation", np.tile([0.02, 0.54, 0.44, 0.0], (len(value), 1)))
        dataset(file, "stability/mode_body", [1, 2, 2, 2], "-")
        dataset(file, "stability/mode_frequency", [100.0, *frequency], "Hz")
        dataset(file, "stability/diameters", np.tile([0.0, -3.0], (len(value), 1)))
    return path


def at(frequency: float, growth: float) -> complex:
    return growth + 2j * np.pi * frequency


def test_a_squealing_wheel_is_named(tmp_path: Path) -> None:
    values = [at(965, 4.05), at(985, 2.9), at(350, -1.0)]
    with Result(spectrum(tmp_path / "a.h5", values)) as result:
        said = verdict(result)
    assert said.kind == "squeal"
    assert said.sentence.startswith(
        "Squeals at 965 Hz: wheel mode n = 3 axial, travelling against the rotation, growth rate 4.0 1/s "
        "(damping ratio −0.067 %); "
        "also at 985 Hz; "
    )
    # 2 · 4.05 / (2π 965) over the 98 % of the wheel.
    assert (
        f"{2 * 4.05 / (2 * np.pi * 965) / 0.98:.4f}" == "0.0014"
        and "loss factor of the wheel that is higher by 0.0014" in said.sentence
    )


def test_growth_without_oscillation_is_no_squeal(tmp_path: Path) -> None:
    values = [1588.0, at(350, -2.0), at(3000, -1.0)]
    with Result(spectrum(tmp_path / "a.h5", values)) as result:
        said, text = verdict(result), report.page(result, [])
        table = ComplexModes.from_result(result)
        assert table.oscillates.tolist() == [False, True, True]
    assert said.kind == "relaxation" and said.sentence.startswith(
        "No squealing mode found up to 6 kHz, but one eigenvalue grows without oscillation"
    )
    assert "(stick–slip relaxation), at 1600 1/s" in said.sentence and "least damped: 3000 Hz" in said.sentence
    # Apart from the modes, which it is not listed among.
    apart = text[text.index("<h3>Growth without oscillation</h3>") : text.index("<h3>Eigenvalues that oscillate")]
    assert (
        "+1588" in apart
        and "+1588" not in text[text.index("<h3>Eigenvalues that oscillate") : text.index('id="modes"')]
    )
    with Result(spectrum(tmp_path / "b.h5", [*values, at(965, 3.0)])) as result:
        both = verdict(result)
    assert (
        both.kind == "squeal"
        and "Squeals at 965 Hz" in both.sentence
        and "apart from these, one eigenvalue grows" in both.sentence
    )


def test_a_quiet_wheel_has_its_least_damped_mode(tmp_path: Path) -> None:
    with Result(spectrum(tmp_path / "a.h5", [at(350, -1.0), at(3183, -1.7)])) as result:
        said = verdict(result)
    ratio = 100 * 1.7 / np.hypot(1.7, 2 * np.pi * 3183)
    assert said.kind == "quiet" and said.sentence == (
        "No squeal found up to 6 kHz; least damped: 3183 Hz, wheel mode n = 3 axial, travelling against the rotation, "
        f"damping ratio {ratio:.2g} %."
    )


def test_an_eigenvalue_of_both_models_counts_once(tmp_path: Path) -> None:
    path = spectrum(tmp_path / "a.h5", [at(965, 4.0), at(965.1, 4.1)])
    with h5py.File(path, "a") as file:
        dataset(file, "stability/source", ["reduced", "full"], "-")
        dataset(file, "stability/partner", [1, 0])
    with Result(path) as result:
        assert "growth rate 4.1 1/s" in verdict(result).sentence and "also at" not in verdict(result).sentence


def test_the_verdict_of_the_program_is_taken(tmp_path: Path) -> None:
    path = spectrum(tmp_path / "a.h5", [at(965, 4.05)])
    with h5py.File(path, "a") as file:
        dataset(file, "verdict/kind", "quiet", "-")
        dataset(file, "verdict/sentence", "Sweep: growth at 1 of 2 points, with contact.normal_load = 70000 N.", "-")
        dataset(file, "verdict/notes", ["And more."], "-")
        dataset(file, "sweep/keys", ["contact.normal_load"], "-")
        dataset(file, "sweep/shape", [2])
        dataset(file, "sweep/values/contact.normal_load", [60e3, 70e3], "N")
        for name, values in (("status", [0, 0]), ("growth_rate", [-1.0, 8.4]), ("unstable", [0, 1])):
            dataset(file, f"sweep/{name}", np.array(values))
        for name in ("sticking", "frequency", "offset"):
            dataset(file, f"sweep/{name}", np.zeros(3 if name == "offset" else 2))
        dataset(file, "sweep/eigenvalue", np.zeros(0, complex), "1/s")
    with Result(path) as result:
        said = verdict(result)
    # Keys have their names in the report.
    assert (said.kind, said.notes) == ("quiet", ["And more."])
    assert said.sentence == "Sweep: growth at 1 of 2 points, with normal load N = 70 kN."


def test_less_friction_is_a_cure(tmp_path: Path) -> None:
    job = {**JOB, "contact": {"friction": 0.4, "placement": {}}}
    for given, words in ((job, "with friction below 0.30 (linear"), (JOB, "with friction lower by 25 % (linear")):
        path = spectrum(tmp_path / "a.h5", [at(965, 4.05), at(985, 2.9)], given)
        with h5py.File(path, "a") as file:
            dataset(file, "stability/sensitivity/friction", np.array([20.25, 11.6], complex), "1/s")
        with Result(path) as result:
            assert words in verdict(result).sentence
        path.unlink()


def test_results_that_cannot_tell_say_so(transient: Callable[..., Path], tmp_path: Path) -> None:
    path = tmp_path / "modes.h5"
    with h5py.File(path, "w") as file:
        dataset(file, "modes/lower/frequency", [100.0], "Hz")
    with Result(path) as result:
        assert verdict(result).kind == "none"
    stopped = transient(segments=2)
    with Result(stopped) as result:
        said = verdict(result)
    # It grows at 5 1/s at 425 Hz.
    assert said.kind == "squeal" and re.search(r"grows at (4.9|5.0|5.1) 1/s at 425 Hz and is at 425 Hz", said.sentence)


def test_kinds_of_modes_are_summed(tmp_path: Path) -> None:
    with Result(spectrum(tmp_path / "a.h5", [at(965, 4.0)])) as result:
        names, table = ModeNames.from_result(result), ComplexModes.from_result(result)
        assert names.free["upper"] == [
            "wheel mode 1 (n = 3 axial)",
            "wheel mode 2 (n = 3 axial)",
            "wheel mode 3 (n = 3 axial 1)",
        ]
        assert names.free["lower"] == ["rail mode 1 (4 waves on its length)"]
        assert names.shares(table, 0)[0] == ("upper", "wheel mode n = 3 axial", pytest.approx(0.98))
        assert names.made_of(table, 0) == "98 % wheel mode n = 3 axial"


def test_budget_and_cures(tmp_path: Path) -> None:
    path = spectrum(tmp_path / "a.h5", [at(965, 4.0), at(985, 2.0)])
    with h5py.File(path, "a") as file:
        for name, values in (
            ("damping", [-0.6, -0.6]),
            ("across", [-1.2, -1.1]),
            ("tilting", [-0.1, 0.0]),
            ("growth_rate", [4.0, 2.0]),
        ):
            dataset(file, f"stability/criterion/{name}", values, "1/s")
        dataset(file, "stability/criterion/mode", [1, 2])
        slopes = {
            "friction": [20.0, 1.0],
            "upper_position": [-1000.0, -100.0],
            "normal_load": [1e-4, 1e-9],
            "lateral": [-400.0, -400.0],
        }
        for name, values in slopes.items():
            dataset(file, f"stability/sensitivity/{name}", np.array(values, complex), "1/s")
        dataset(file, "placement/creepage", [0.001, -0.02, 0.0])
    with Result(path) as result:
        budget, sensitivities = Budget.from_result(result), Sensitivities.from_result(result)
        assert budget is not None and sensitivities is not None
        # What is left of the sum is friction.
        assert budget.friction == pytest.approx([5.9, 3.7])
        cures = {name: change for name, change, _ in sensitivities.cures(result, 0, 4.0)}
        assert cures == {
            "friction": pytest.approx(-0.2),
            "upper_position": pytest.approx(4e-3),
            "normal_load": pytest.approx(-4e4),
            "lateral": pytest.approx(0.01),
        }
        words = [words for *_, words in sensitivities.cures(result, 0, 4.0)]
        assert (
            words[0] == "friction −20 %"
            and "contact on the upper body along y +4 mm" in words
            and "lateral creepage +1 %" in words
        )
        # Twice the friction, a shift of 20 mm and more than the load are no cures of the other mode.
        assert [name for name, *_ in sensitivities.cures(result, 1, 2.0)] == ["lateral"]
        tables = {name: rows for name, _, rows in report.csv_tables(result)}
        assert [row[3] for row in tables["budget"]] == pytest.approx([5.9, 3.7])
        assert [row[-1] for row in tables["sensitivities"] if row[2] == "upper_position"] == pytest.approx(
            [4e-3, 20e-3]
        )
        text = report.page(result, [])
    assert "<td>+5.900</td>" in text and "friction −20 %" in text


def test_the_job_is_told_with_units(tmp_path: Path) -> None:
    with Result(spectrum(tmp_path / "a.h5", [at(965, -4.0)])) as result:
        text = report.page(result, [])
    table = re.findall(
        r"<tr><td>(.*?)</td><td>(.*?)</td><td>(.*?)</td></tr>", text[: text.index("<h3>Contact, vehicle")]
    )
    rows = {name: cells for name, *cells in table}
    assert rows["body"] == ["swept rail, section 60E1", "swept wheel, section W920S"] and rows["running profile"] == [
        "",
        "S1002",
    ]
    assert rows["vertical pad stiffness"] == ["120 MN/m", ""] and rows["Young&#x27;s modulus E"] == ["", "210 GPa"]
    assert (
        "exponential: static 0.4, memory length 20 µm" in text
        and "<td>yaw of the wheelset (angle of attack)</td><td>−10 mrad</td>" in text
    )


def test_axes_have_names_and_units() -> None:
    assert labels.quantity("contact.friction").axis == "coefficient of friction μ"
    assert labels.quantity("contact.normal_load", "N").axis == "normal load N / kN"
    assert (
        labels.quantity("contact.placement.yaw", "rad").statement(-0.01)
        == "yaw of the wheelset (angle of attack) = −10 mrad"
    )
    assert (
        labels.quantity("bodies.upper.mesh.revolved.contact_offset", "m", {"lower": "rail", "upper": "wheel"}).axis
        == "contact offset of the wheel / mm"
    )
    assert labels.quantity("bodies.others.idler.material.young", "Pa").axis.startswith("Young's modulus of idler")
    # A key that is not listed has its last words and the unit of the file.
    assert (
        labels.quantity("bodies.lower.supports.2.loss_frequency", "Hz").axis
        == "supports loss frequency of the lower body / Hz"
    )
    assert labels.words('{"table": {"points": [[0, 0.15], [0.05, 0.25]]}}') == "table: points: (0, 0.15), (0.05, 0.25)"


def test_units_are_those_of_the_job_page() -> None:
    """SI units of `labels.NAMES` against those that docs/reference/job.md has for keys of the same last name."""
    page = (ROOT / "docs/reference/job.md").read_text(encoding="utf-8")
    units: dict[str, set[str]] = {}
    for keys, unit in re.findall(r"^\| (`[^|]*`) \| ([^|]*) \|", page, re.MULTILINE):
        for place, key in enumerate(re.findall(r"`([^`]+)`", keys)):
            given = [u.strip().replace("·", " ") for u in unit.split(",")]
            units.setdefault(re.sub(r"\.N\.", ".", key).split(".")[-1], set()).add(given[min(place, len(given) - 1)])
    compared = 0
    for suffix, (_, _, si, _, _) in labels.NAMES.items():
        known = {u for u in units.get(suffix.split(".")[-1], set()) if u}
        if si != "-" and known:
            compared += 1
            assert si in known, f"{suffix}: {si} here, {known} in docs/reference/job.md"
    assert compared > 60


def test_a_quiet_job_of_a_sweep_that_squeals_is_no_quiet_one(tmp_path: Path) -> None:
    path = spectrum(tmp_path / "a.h5", [at(965, -1.0)])
    with h5py.File(path, "a") as file:
        dataset(file, "sweep/keys", ["contact.from.wheel"], "-")
        dataset(file, "sweep/shape", [2])
        dataset(file, "sweep/values/contact.from.wheel", ["leading inner", "trailing outer"], "-")
        for name, values in (
            ("status", [0, 0]),
            ("growth_rate", [-1.0, 8.39]),
            ("unstable", [0, 1]),
            ("sticking", [0, 0]),
        ):
            dataset(file, f"sweep/{name}", np.array(values))
        dataset(file, "sweep/frequency", [965.0, 4400.6], "Hz")
        dataset(file, "sweep/eigenvalue", [at(965, -1.0), at(4400.6, 8.39)], "1/s")
        dataset(file, "sweep/offset", [0, 1, 2])
    with Result(path) as result:
        said = verdict(result)
    with h5py.File(path, "a") as file:
        file["sweep/eigenvalue"][1] = 8.39
    with Result(path) as result:
        assert verdict(result).kind == "quiet" and verdict(result).notes[0].startswith("Sweep: growth at 1 of 2 points")
    assert said.kind == "squeal"
    assert said.sentence == "Sweep: growth at 1 of 2 points; fastest 8.4 1/s at 4401 Hz, with wheel: trailing outer."
    assert said.notes[0].startswith("The point of the job itself: No squeal found up to 6 kHz; least damped: 965 Hz")


def test_modes_of_meshes_are_named_by_diameters_and_frequency(tmp_path: Path) -> None:
    path = spectrum(tmp_path / "a.h5", [at(965, 4.0)])
    with h5py.File(path, "a") as file:
        del file["modes/upper/family"]
    with Result(path) as result:
        assert (
            ModeNames.from_result(result).made_of(ComplexModes.from_result(result), 0)
            == "98 % wheel mode n = 3 of 975 Hz"
        )
