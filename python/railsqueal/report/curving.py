"""Section of the report on steady curving."""

from html import escape

import numpy as np

from ..curving import AXLES, Curving, CurvingRadii
from ..result import Result
from .csv_tables import CURVING_HEADS, curving_rows
from .markup import cut, table

# Columns of the table in the report: column of the CSV, head, factor, format.
CURVING_COLUMNS = (
    ("wheel_y_m", "place on the wheel, mm", 1e3, "{:+.2f}"),
    ("contact_angle_rad", "contact angle, °", 180 / np.pi, "{:+.2f}"),
    ("rolling_radius_m", "rolling radius, mm", 1e3, "{:.2f}"),
    ("normal_force_N", "normal force, kN", 1e-3, "{:.2f}"),
    ("creepage_longitudinal", "longitudinal creepage, %", 100, "{:+.4f}"),
    ("creepage_lateral", "lateral creepage, %", 100, "{:+.4f}"),
    ("spin_1/m", "spin, 1/m", 1, "{:+.4f}"),
    ("creep_force_forwards_N", "creep force forwards, kN", 1e-3, "{:+.2f}"),
    ("creep_force_tangent_N", "creep force along the tangent, kN", 1e-3, "{:+.2f}"),
    ("force_right_N", "lateral force, kN", 1e-3, "{:+.2f}"),
    ("friction", "friction", 1, "{:.3f}"),
    ("utilisation", "utilisation", 1, "{:.3f}"),
)


def section(result: Result, drawn: list[str]) -> list[str]:
    """Axles and places of contact of a bogie in a curve, radii without equilibrium, and the pictures of both."""
    if not Curving.present(result):
        return []
    curving = Curving.from_result(result)
    left = f"residual {curving.residual:.1e}, relative to the load of an axle"
    parts = ['<h2 id="curving">Curving</h2>', f"<p>{escape(curving.curve())}; {left}.</p>"]
    columns = (AXLES, curving.shift, curving.yaw, curving.angular_speed)
    axles = [(name, f"{1e3 * y:+.3f}", f"{1e3 * yaw:+.3f}", f"{speed:.4f}") for name, y, yaw, speed in zip(*columns)]
    heads = ("axle", "shift to the right, mm", "angle of attack to the right, mrad", "rotation, rad/s")
    parts.append(table(heads, axles))
    rows = []
    for wheel, *values in curving_rows(curving):
        given = dict(zip(CURVING_HEADS[1:], values))
        rows.append((wheel, *(form.format(factor * given[name]) for name, _, factor, form in CURVING_COLUMNS)))
    parts.append('<div class="wide">' + table(("wheel", *(head for _, head, *_ in CURVING_COLUMNS)), rows) + "</div>")
    if CurvingRadii.present(result):
        radii = CurvingRadii.from_result(result)
        if len(radii.failed):
            failed, more = cut([(f"{radii.radius[k]:g}", radii.message[k]) for k in radii.failed])
            parts += ["<h3>Radii without equilibrium</h3>", table(("radius, m", "reason"), failed), more]
    return parts + drawn
