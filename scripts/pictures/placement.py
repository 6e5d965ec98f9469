"""A wheel on a rail: both lines with the point of contact, and the gap of the undeformed bodies with the contact in it."""

import matplotlib.pyplot as plt
import numpy as np
from style import BLUE, GREY, ORANGE, RED, save

MM, MICRO = 1e3, 1e6
# Half of the width shown around the contact, mm.
REACH = 45


def pictures(results, out):
    if "placement/rail_line" not in results:
        return []
    figure, (section, detail) = plt.subplots(1, 2, figsize=(9.6, 4.2), constrained_layout=True, width_ratios=[1.3, 1])
    rail, wheel = MM * results["placement/rail_line"], MM * results["placement/wheel_line"]
    _, y, z = MM * results["placement/origin"]
    section.plot(*rail.T, color=GREY, label="rail")
    section.plot(*wheel.T, color=BLUE, label="wheel")
    tilt = float(results["placement/tilt"])
    normal = 12 * np.array([np.sin(tilt), -np.cos(tilt)])
    section.annotate("", xy=(y + normal[0], z + normal[1]), xytext=(y, z), arrowprops={"arrowstyle": "->", "color": RED})
    section.plot(y, z, "o", color=RED, markersize=4)
    section.set_xlim(y - REACH, y + REACH)
    near = np.concatenate([rail[abs(rail[:, 0] - y) < REACH, 1], wheel[abs(wheel[:, 0] - y) < REACH, 1]])
    # z points down.
    section.set_ylim(near.max() + 3, near.min() - 15)
    section.set_aspect("equal")
    section.set_xlabel("y in the track / mm")
    section.set_ylabel("z in the track (down) / mm")
    section.set_title(f"contact angle {MM * float(results['placement/contact_angle']):.1f} mrad, rolling radius {MM * float(results['placement/rolling_radius']):.2f} mm")
    section.legend(loc="lower right")

    nx, ny = (int(n) for n in results["contact/shape"])
    x, across = (MM * results[f"contact/{name}"].reshape(ny, nx) for name in ("x", "y"))
    gap = MICRO * results["contact/gap0"].reshape(ny, nx)
    approach = MICRO * float(results["contact/approach"])
    levels = approach * np.array([0.25, 0.5, 1, 2, 4])
    lines = detail.contour(x, across, gap, levels=levels, colors=GREY, linewidths=0.8)
    detail.clabel(lines, fmt="%.0f µm", fontsize=7)
    detail.contourf(x, across, results["contact/pressure"].reshape(ny, nx) > 0, levels=[0.5, 1.5], colors=[ORANGE], alpha=0.6)
    detail.set_aspect("equal")
    detail.set_xlabel("x / mm (rolls to the left)")
    detail.set_ylabel("y / mm")
    detail.set_title(f"gap, and the contact under {approach:.1f} µm of approach")
    return [save(figure, out / f"{results.stem}-placement.png")]
