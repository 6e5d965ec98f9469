"""Tables of a result as CSV, in full precision and SI units."""

import csv
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from .. import figures
from ..curving import WHEELS, Curving, CurvingRadii
from ..mode_names import ModeNames
from ..result import Result
from ..stability import Balance, Budget, Sensitivities
from ..tables import (
    BODIES,
    ComplexModes,
    ContactGrid,
    CreepCurve,
    Cycles,
    History,
    Modes,
    Provenance,
    Receptances,
    Sweep,
    contact_name,
    contact_number,
)
from ..track_decay import TrackDecay
from . import uncertainty
from .markup import Row

# Columns of the tables of steady curving as CSV.
CURVING_HEADS = (
    *("wheel", "wheel_y_m", "rail_y_m", "contact_angle_rad", "rolling_radius_m", "normal_force_N"),
    *("creepage_longitudinal", "creepage_lateral", "spin_1/m", "creep_force_forwards_N", "creep_force_tangent_N"),
    *("force_forwards_N", "force_right_N", "force_down_N", "friction", "utilisation"),
)
EIGENVALUE_HEADS = (
    *("place", "frequency_Hz", "growth_rate_1/s", "damping_ratio", "unstable", "oscillates"),
    *("source", "name", "made_of"),
)
RADII_HEADS = (
    *("radius_m", "wheel", "places", "axle_shift_m", "axle_yaw_rad"),
    *("contact_angle_rad", "rolling_radius_m", "normal_force_N"),
    *("creepage_longitudinal", "creepage_lateral", "spin_1/m"),
    *("force_forwards_N", "force_right_N", "force_down_N", "utilisation", "message"),
)


def save(path: Path, head: Row, rows: Iterable[Row]) -> Path:
    """A CSV file; numbers in full precision."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(head)
        writer.writerows([[repr(float(c)) if isinstance(c, (float, np.floating)) else c for c in row] for row in rows])
    return path


def csv_tables(result: Result) -> list[tuple[str, Row, list[Row]]]:
    """Name, head and rows of each table that the result has."""
    made: list[tuple[str, Row, list[Row]]] = [("figures", ("group", "name", "value", "unit"), figure_rows(result))]
    if Modes.bodies(result):
        head = ("body", "mode", "frequency_Hz", "residual", "nodal_diameters", "family", "name")
        made.append(("modes", head, mode_rows(result)))
    if ComplexModes.present(result):
        table = ComplexModes.from_result(result)
        made.append(("eigenvalues", EIGENVALUE_HEADS, complex_rows(result, table, unstable=False)))
        made.append(("unstable", EIGENVALUE_HEADS, complex_rows(result, table, unstable=True)))
        made += stability_tables(result, table)
    forces = force_rows(result)
    if forces:
        made.append(("forces", ("analysis", "point", "force_x_N", "force_y_N", "force_z_N"), forces))
    made += curve_tables(result) + sweep_tables(result) + transient_tables(result)
    made += uncertainty.csv_tables(result)
    stages = Provenance.from_result(result).stages
    if stages:
        made.append(("times", ("stage", "time_s"), [*stages.items(), ("all stages", sum(stages.values()))]))
    return made


def stability_tables(result: Result, table: ComplexModes) -> list[tuple[str, Row, list[Row]]]:
    """Growth-rate budget, energy balance and sensitivities of eigenvalues."""
    made: list[tuple[str, Row, list[Row]]] = []
    budget = Budget.from_result(result)
    if budget is not None:
        columns = (budget.damping, budget.friction, budget.creep, budget.tilting, budget.growth_rate)
        rows: list[Row] = [(k, table.frequency[k], *(c[k] for c in columns)) for k in range(len(budget.growth_rate))]
        parts = ("structural_damping", "friction", "creep_damping", "contact_tilt", "sum")
        head = ("place", "frequency_Hz", *(f"{part}_1/s" for part in parts))
        made.append(("budget", head, rows))
    balance = Balance.from_result(result)
    if balance is not None:
        rows = [
            (int(k), table.frequency[k], *parts, sum(parts)) for k, parts in zip(balance.place, balance.parts.tolist())
        ]
        heads = ("place", "frequency_Hz", "damping_lower_1/s", "damping_upper_1/s", "contact_work_1/s", "sum_1/s")
        made.append(("balance", heads, rows))
    sensitivities = Sensitivities.from_result(result)
    if sensitivities is not None:
        rows = []
        for parameter, slopes in sensitivities.by.items():
            unit = result.units(f"stability/sensitivity/{parameter}")
            rows += [
                (k, table.frequency[k], parameter, unit, s.real, s.imag / (2 * np.pi), -table.growth_rate[k] / s.real)
                for k, s in enumerate(slopes)
                if np.isfinite(s) and s.real != 0
            ]
        head = (
            "place",
            "frequency_Hz",
            "parameter",
            "unit",
            "growth_rate_derivative",
            "frequency_derivative_over_2pi",
            "change_to_zero_growth",
        )
        made.append(("sensitivities", head, rows))
    return made


def curve_tables(result: Result) -> list[tuple[str, Row, list[Row]]]:
    """Steady curving, creep curve and receptances."""
    made: list[tuple[str, Row, list[Row]]] = []
    if CreepCurve.present(result):
        curve = CreepCurve.from_result(result)
        growth = np.full(len(curve.creepage), np.nan) if curve.eigenvalue is None else curve.eigenvalue.real
        rows: list[Row] = list(zip(curve.creepage, *curve.force.T, curve.stick_share, growth, curve.status))
        head = (
            f"creepage_{curve.key}",
            "force_x_N",
            "force_y_N",
            "force_z_N",
            "stick_share",
            "growth_rate_1/s",
            "status",
        )
        made.append(("creep-curve", head, rows))
    if Curving.present(result):
        made.append(("curving", CURVING_HEADS, curving_rows(Curving.from_result(result))))
    if CurvingRadii.present(result):
        made.append(("curving-radii", RADII_HEADS, radii_rows(CurvingRadii.from_result(result))))
    for group in Receptances.groups(result):
        receptances = Receptances.from_result(result, group)
        entries = [f"{body}_{a}{b}" for body in receptances.bodies for a in "xyn" for b in "xyn"]
        heads = ["frequency_Hz", *(f"{entry}_{part}_m/N" for entry in entries for part in ("re", "im"))]
        made.append((group.replace("_", "-"), heads, receptance_rows(receptances)))
    if TrackDecay.present(result):
        decay = TrackDecay.from_result(result)
        columns = ("band_Hz", *(f"{name}_dB/m" for name in decay.rate))
        made.append(("track-decay", columns, list(zip(decay.frequency, *decay.rate.values()))))
    return made


def sweep_tables(result: Result) -> list[tuple[str, Row, list[Row]]]:
    """Points of a sweep, their eigenvalues, and their limit cycles."""
    made: list[tuple[str, Row, list[Row]]] = []
    if not Sweep.present(result):
        return made
    sweep = Sweep.from_result(result)
    count = len(sweep.status)
    keys = [
        f"{key}_{unit}" if (unit := result.units(f"sweep/values/{key}")) not in ("1", "-") else key
        for key in sweep.keys
    ]
    given = [tuple(sweep.values[key][k] for key in sweep.keys) for k in range(count)]
    message = sweep.message or [""] * count
    columns = list(zip(sweep.unstable, sweep.growth_rate, sweep.frequency, sweep.sticking, sweep.status, message))
    head = (*keys, "unstable", "growth_rate_1/s", "frequency_Hz", "sticking_nodes", "status", "message")
    made.append(("sweep", head, [(*given[k], *columns[k]) for k in range(count)]))
    spectra: list[Row] = [(k, *given[k], e.imag / (2 * np.pi), e.real) for k in range(count) for e in sweep.spectrum(k)]
    if spectra:
        made.append(("sweep-eigenvalues", ("point", *keys, "frequency_Hz", "growth_rate_1/s"), spectra))
    if Cycles.present(result):
        cycles = Cycles.from_result(result)
        loudest = cycles.loudest()
        level = np.full(cycles.fate.shape, np.nan) if loudest is None else loudest
        rows: list[Row] = [
            (
                branch,
                *given[k],
                cycles.fate[b, k],
                cycles.frequency[b, k],
                cycles.kinetic[b, k],
                level[b, k],
                cycles.time[b, k],
            )
            for b, branch in enumerate(cycles.branch)
            for k in range(count)
        ]
        head = ("branch", *keys, "fate", "frequency_Hz", "kinetic_energy_J", "sound_power_level_dB(A)", "time_s")
        made.append(("limit-cycles", head, rows))
    return made


def transient_tables(result: Result) -> list[tuple[str, Row, list[Row]]]:
    """Forces and motions step by step, and the sound power in third octaves."""
    made: list[tuple[str, Row, list[Row]]] = []
    if History.present(result):
        history = History.from_result(result)
        columns = [history.time, *history.force.T, history.closed, history.stick]
        head = ["time_s", "force_x_N", "force_y_N", "force_z_N", "closed_nodes", "sticking_nodes"]
        if history.velocity is not None:
            for k, point in enumerate(history.points):
                columns += list(history.velocity[:, k].T)
                head += [f"velocity_{axis}_of_{point}_m/s" for axis in "xyz"]
        made.append(("transient", head, [tuple(row) for row in zip(*columns)]))
    path = "transient/sound_power"
    bodies = [body for body in BODIES.values() if f"{path}/{body}/level" in result]
    if bodies:
        names = result.array(f"{path}/band_name")
        parts = [result.array(f"{path}/{body}/{kind}") for body in bodies for kind in ("power", "level", "level_a")]
        head = [f"{body}_{kind}" for body in bodies for kind in ("power_W", "level_dB", "level_dB(A)")]
        made.append(("sound-power", ("third_octave_Hz", *head), [tuple(row) for row in zip(names, *parts)]))
    return made


def figure_rows(result: Result) -> list[Row]:
    """Key figures."""
    return [(f.group, f.name, f.word or f.value, f.unit) for f in figures.figures_of_result(result)]


def mode_rows(result: Result) -> list[Row]:
    """Free modes of the bodies."""
    rows: list[Row] = []
    names = ModeNames.from_result(result)
    for body in Modes.bodies(result):
        table = Modes.from_result(result, body)
        diameters = table.diameters if table.diameters is not None else [""] * len(table.frequency)
        columns = zip(table.frequency, table.residual, diameters, table.family, names.free[body])
        rows += [(body, k + 1, *row) for k, row in enumerate(columns)]
    return rows


def complex_rows(result: Result, table: ComplexModes, unstable: bool) -> list[Row]:
    """Eigenvalues: the unstable ones, or all."""
    names = ModeNames.from_result(result)
    places = table.unstable if unstable else range(len(table.eigenvalue))
    columns = (table.frequency, table.growth_rate, table.damping_ratio, table.grows, table.oscillates)
    return [
        (int(k), *(c[k].item() for c in columns), table.source[k], names.made_of(table, int(k)), table.made_of(int(k)))
        for k in places
    ]


def force_rows(result: Result) -> list[Row]:
    """Contact forces on body 1 of each analysis; of a transient the mean over the last quarter."""
    rows: list[Row] = []
    groups = ContactGrid.groups(result)
    for group in groups:
        point = contact_name(result, contact_number(group)) if len(groups) > 1 else ""
        rows.append(("steady", point, *result.array(f"{group}/force")))
    if "stability/force" in result:
        forces = np.atleast_2d(result.array("stability/force"))
        for number, force in enumerate(forces, 1):
            rows.append(("stability", contact_name(result, number) if len(forces) > 1 else "", *force))
    if CreepCurve.present(result):
        curve = CreepCurve.from_result(result)
        rows += [("creep_curve", f"{curve.key} {c!r}", *f) for c, f in zip(curve.creepage.tolist(), curve.force)]
        for number, group in enumerate(CreepCurve.further(result), 2):
            own = zip(result.array(f"{group}/{curve.key}").tolist(), result.array(f"{group}/force"))
            rows += [("creep_curve", f"contact {number}, {curve.key} {c!r}", *f) for c, f in own]
    if Sweep.present(result) and "sweep/force" in result:
        sweep = Sweep.from_result(result)
        names = [", ".join(f"{key} {sweep.values[key][k]}" for key in sweep.keys) for k in range(len(sweep.status))]
        rows += [("sweep", name, *f) for name, f in zip(names, result.array("sweep/force"))]
    if "transient/force" in result:
        force = result.array("transient/force")
        rows.append(("transient", "mean of the last quarter", *force[3 * len(force) // 4 :].mean(axis=0)))
    return rows


def curving_rows(table: Curving) -> list[Row]:
    """Places of contact of a bogie in a curve, wheel by wheel, the one that carries most first."""
    order = [int(place) for wheel in range(len(WHEELS)) for place in table.places(wheel)]
    geometry = (table.wheel_y, table.rail_y, table.contact_angle, table.rolling_radius)
    forces = (*table.creep_force.T, *table.force.T)
    columns = (*geometry, table.normal_force, *table.creepage.T, *forces, table.friction, table.utilisation)
    return [(WHEELS[table.wheel[k]], *(float(column[k]) for column in columns)) for k in order]


def radii_rows(table: CurvingRadii) -> list[Row]:
    """Equilibria over the radius: a row for each wheel of each curve."""
    rows: list[Row] = []
    for k, radius in enumerate(table.radius):
        for wheel, name in enumerate(WHEELS):
            geometry = (table.contact_angle, table.rolling_radius, table.normal_force)
            used = table.utilisation[k, wheel]
            at = (*(n[k, wheel] for n in geometry), *table.creepage[k, wheel], *table.force[k, wheel], used)
            axle = (table.shift[k, wheel // 2], table.yaw[k, wheel // 2])
            rows.append((float(radius), name, int(table.places[k, wheel]), *map(float, (*axle, *at)), table.message[k]))
    return rows


def receptance_rows(table: Receptances) -> list[Row]:
    """Receptances, real and imaginary parts."""
    parts = [np.stack([h.real, h.imag], axis=-1).reshape(len(h), -1) for h in table.bodies.values()]
    return [list(map(float, row)) for row in np.column_stack([table.frequency, *parts])]
