"""Campbell diagram: frequencies of the waves of bodies that rotate, over the angular velocity."""

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from ..labels import body_words
from ..result import Floats, Result
from ..tables import Modes
from .style import Canvas

# Modes drawn, and angular velocities of a line.
MODES, POINTS = 16, 41
COLOURS = plt.get_cmap("tab10")


def pictures(result: Result, canvas: Canvas) -> list[Path]:
    bodies = [
        b for b in ("lower", "upper") if f"reduced/{b}/gyroscopic" in result and f"modes/{b}/wave_frequency" in result
    ]
    bodies = [b for b in bodies if result.array(f"modes/{b}/frequency").size]
    if not bodies:
        return []
    figure, axes = plt.subplots(
        2, len(bodies), figsize=(5.2 * len(bodies), 7.8), squeeze=False, sharex="col", layout="constrained"
    )
    for pair, body in zip(axes.T, bodies):
        diagram(pair, result, body)
    figure.suptitle("waves of the bodies that rotate, seen from beside them", fontsize=11)
    return canvas.save(figure, "campbell")


def diagram(axes: Any, result: Result, body: str) -> None:
    """Frequencies above, and below how far they are from those at rest."""
    omega, gyroscopic, stiffness = (
        result.array(f"reduced/{body}/{name}") for name in ("omega", "gyroscopic", "rotation_stiffness")
    )
    modes = Modes.from_result(result, body)
    assert modes.diameters is not None and modes.wave_frequency is not None
    # Of several bodies around one the fastest one is shown; the others turn in proportion.
    speed = float(np.max(np.abs(modes.speeds)))
    own = (np.abs(modes.speeds) / speed)[:, np.newaxis] if speed > 0 else np.ones((len(omega), 1))
    diameters = np.round(modes.diameters).astype(int)
    speeds = np.linspace(0.0, 2.0 * speed, POINTS)
    lines = followed([frequencies(omega, s * own * gyroscopic, (s * own) ** 2 * stiffness) for s in speeds])[:, :MODES]
    waves = np.sort(modes.wave_frequency)
    # The run is the middle one of the angular velocities.
    here = lines[POINTS // 2]
    run = np.array([waves[np.argmin(np.abs(waves - f))] for f in here])
    drawn: set[int] = set()
    for k in range(lines.shape[1]):
        n = int(diameters[k])
        label = None if n in drawn else f"n = {n}"
        drawn.add(n)
        for axis, rest in zip(axes, (0.0, lines[0, k])):
            axis.plot(speeds, lines[:, k] - rest, color=COLOURS(n % 10), linewidth=1, label=label)
            axis.plot(speed, run[k] - rest, "o", color="0.25", markersize=3)
    axes[0].set_ylabel("frequency f / Hz")
    axes[0].set_title(f"{body_words(result.job)[body]}, undamped; dots: this run")
    whose = "" if np.ptp(modes.speeds) == 0 else " of the fastest body"
    axes[1].set_xlabel(f"angular velocity Ω{whose} / (rad/s)")
    axes[1].set_ylabel("frequency less that at rest / Hz")
    handles, labels = axes[1].get_legend_handles_labels()
    order = np.argsort(labels)
    axes[1].legend(
        [handles[i] for i in order],
        [labels[i] for i in order],
        ncols=5,
        loc="upper center",
        bbox_to_anchor=(0.5, -0.16),
    )


def followed(steps: list[Floats]) -> Floats:
    """Frequencies of each step in the order of the waves, which may cross: where the last two steps point to."""
    lines = [steps[0]]
    for step in steps[1:]:
        towards = lines[-1] if len(lines) == 1 else 2 * lines[-1] - lines[-2]
        line = np.empty_like(step)
        line[np.argsort(towards, kind="stable")] = step
        lines.append(line)
    return np.array(lines)


def frequencies(omega: Floats, gyroscopic: Floats, stiffness: Floats) -> Floats:
    """Frequencies of q̈ + G q̇ + (ω² + K) q = 0, rising, Hz."""
    m = len(omega)
    companion = np.block([[np.zeros((m, m)), np.eye(m)], [-np.diag(omega**2) - stiffness, -gyroscopic]])
    values = np.linalg.eigvals(companion).imag
    return np.asarray(np.sort(values[values > 0]) / (2 * np.pi))
