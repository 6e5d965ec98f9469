"""A wheel on a rail: both profiles with the point of contact, and the gap of the undeformed bodies."""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from ..result import Result
from ..tables import ContactGrid, numbered
from .contact import of_contact, painted
from .style import BLUE, GREY, ORANGE, RED, Canvas

MM, MICRO = 1e3, 1e6
# Half of the width shown around the contact, mm.
REACH = 45


def pictures(result: Result, canvas: Canvas) -> list[Path]:
    """A picture of each contact, which marks the others as well."""
    made: list[Path] = []
    for group in numbered(result, "placement"):
        if f"{group}/rail_line" in result:
            made += place(result, group, canvas)
    return made


def place(result: Result, group: str, canvas: Canvas) -> list[Path]:
    """The contact of the placement `group` on both profiles, and its gap."""
    contact = group.replace("placement", "contact")
    grid = ContactGrid.from_result(result, contact) if contact in ContactGrid.groups(result) else None
    figure, axes = plt.subplots(
        1, 2 if grid else 1, figsize=(9.6 if grid else 5.6, 4.2), layout="constrained", squeeze=False
    )
    section = axes[0, 0]
    rail, wheel = MM * result.array(f"{group}/rail_line"), MM * result.array(f"{group}/wheel_line")
    _, y, z = MM * result.array(f"{group}/origin")
    section.plot(*rail.T, color=GREY, label="rail")
    section.plot(*wheel.T, color=BLUE, label="wheel")
    tilt = result.number(f"{group}/tilt")
    normal = 12 * np.array([np.sin(tilt), -np.cos(tilt)])
    section.annotate(
        "", xy=(y + normal[0], z + normal[1]), xytext=(y, z), arrowprops={"arrowstyle": "->", "color": RED}
    )
    section.plot(y, z, "o", color=RED, markersize=4)
    for other in numbered(result, "placement"):
        if other != group:
            section.plot(
                *MM * result.array(f"{other}/origin")[1:], "o", color=RED, markerfacecolor="white", markersize=4
            )
    section.set_xlim(y - REACH, y + REACH)
    near = np.concatenate([rail[abs(rail[:, 0] - y) < REACH, 1], wheel[abs(wheel[:, 0] - y) < REACH, 1]])
    # z points down.
    section.set_ylim(near.max() + 3, near.min() - 15)
    section.set_aspect("equal")
    section.set_xlabel("y in the track / mm")
    section.set_ylabel("z in the track (down) / mm")
    angle, radius = MM * result.number(f"{group}/contact_angle"), MM * result.number(f"{group}/rolling_radius")
    section.set_title(f"contact angle {angle:.1f} mrad, rolling radius {radius:.2f} mm")
    section.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=2)
    if grid:
        detail = axes[0, 1]
        gap, approach = MICRO * grid.gap0, MICRO * grid.approach
        levels = approach * np.array([0.25, 0.5, 1, 2, 4])
        painted(detail, grid, np.where(grid.pressure > 0, 1.0, np.nan), colour=ORANGE)
        lines = detail.contour(MM * grid.x, MM * grid.y, gap, levels=levels, colors=GREY, linewidths=0.8)
        detail.clabel(lines, fmt="%.0f µm", fontsize=7)
        detail.set_aspect("equal")
        detail.set_xlabel("x / mm (rolls to the left)")
        detail.set_ylabel("y / mm")
        detail.set_title(f"gap, and the contact under {approach:.1f} µm of approach")
    return canvas.save(figure, of_contact("placement", group))
