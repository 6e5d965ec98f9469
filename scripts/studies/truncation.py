"""Effect of truncation of the modes on growth, limit cycle, and sound: `full-squeal.json` on its modes, more and more
of them, beside the same on all degrees of freedom."""

import json

import numpy as np
from pages import put
from program import ROOT, run
from report import table
from tables import frequency

# Modes of each body that are kept, and those in whose amplitudes the motion of all degrees of freedom is written.
COUNTS, WATCHED = (4, 8, 16, 40), 40
# Start near the limit cycle, m; the time that is simulated, the last part of it that is looked at, and the time between
# two samples of the amplitudes, s. From rest the cycle takes a second, which is most of an hour on all degrees of
# freedom.
AMPLITUDE, DURATION, LATE, SAMPLE = 5.3e-5, 0.35, 0.05, 1e-4
# The most by which the energy may differ between the last part and the one before it: it is the cycle then.
SETTLED = 0.005
# The largest distance of the growth rate that is fitted to the run of all degrees of freedom from its eigenvalue,
# relative.
NEAR = 0.01
# Start of that fit, m, its duration and its first part that is left to what is no motion of the mode, s.
SMALL, FITTED, LEFT = 1e-7, 5e-3, 1e-3


def fitted(samples, interval):
    """Growth rate, 1/s, of one dominant oscillation: x₂ = a x₁ − b x₀ of its changes, b = e^{2σ Δt}."""
    x = np.diff(samples, axis=0)
    past = np.column_stack([x[1:-1].ravel(), -x[:-2].ravel()])
    _, b = np.linalg.lstsq(past, x[2:].ravel(), rcond=None)[0]
    return np.log(b) / (2 * interval)


def followed(sets):
    """A run to the limit cycle: eigenvalue of the first mode of the reduced model and of the full one, and what the
    motion is at its end."""
    step = json.loads((ROOT / "jobs/full-squeal.json").read_text())["analyses"]["transient"]["step"]
    given = {
        "analyses.transient.duration": DURATION,
        "analyses.transient.start.amplitude": AMPLITUDE,
        "analyses.transient.modal_stride": round(SAMPLE / step),
        "analyses.transient.sound_power": json.dumps({"from": round(DURATION - LATE, 9), "min_frequency": 800}),
        "analyses.transient.segment": 1000,
        "output.reduced": "false",
    }
    tables, seconds = run("full-squeal.json", given | sets, ranks=1, groups=("stability", "transient", "modes"))
    time = tables["transient/time"]
    late, before = time > DURATION - LATE, (time > DURATION - 2 * LATE) & (time <= DURATION - LATE)
    drift = float(tables["transient/kinetic"][late].mean() / tables["transient/kinetic"][before].mean() - 1)
    if abs(drift) > SETTLED:
        raise SystemExit(f"{sets}: the energy still changes by {drift:.2e} in {LATE} s: that is no limit cycle")
    force, energy = tables["transient/force"][late], tables["transient/kinetic"][late]
    amplitudes = tables["transient/modal_displacement"][tables["transient/modal_time"] > DURATION - LATE]
    largest = int(amplitudes.std(axis=0).argmax())
    power = sum(tables[f"transient/sound_power/{body}/power"] for body in ("lower", "upper"))
    names = [float(name) for name in tables["transient/sound_power/band_name"]]
    level = lambda w: float(10 * np.log10(w / 1e-12))  # noqa: E731
    values, partner = tables["stability/eigenvalue"], tables["stability/partner"]
    pair = lambda value: [float(value.real), float(value.imag / (2 * np.pi))]  # noqa: E731
    return {
        "reduced": pair(values[0]),
        "full": pair(values[partner[0]]) if partner[0] >= 0 else None,
        "reach": float(min(tables[f"modes/{body}/frequency"].max() for body in ("lower", "upper"))),
        "cycle": float(frequency(amplitudes[:, largest], SAMPLE)),
        "energy": float(energy.mean()),
        "drift": drift,
        "normal": [float(-force[:, 2].max()), float(-force[:, 2].min())],
        "lateral": float(force[:, 1].std()),
        "stick": int(tables["transient/stick"][late].max()),
        "sound": {str(round(name)): level(w) for name, w in zip(names, power)},
        "seconds": seconds,
    }


def growth():
    """Growth rate that is fitted to a small motion of all degrees of freedom, 1/s."""
    sets = {
        "analyses.modes.count": WATCHED,
        "analyses.transient.duration": FITTED,
        "analyses.transient.step": 1e-5,
        "analyses.transient.modal_stride": 5,
        "analyses.transient.start.amplitude": SMALL,
        "output.reduced": "false",
    }
    tables, _ = run("full-squeal.json", sets, ranks=1, groups=("stability", "transient"))
    time, samples = tables["transient/modal_time"], tables["transient/modal_displacement"]
    wanted = tables["stability/eigenvalue"][tables["stability/partner"][0]].real
    found = float(fitted(samples[time > LEFT], time[1] - time[0]))
    if abs(found / wanted - 1) > NEAR:
        raise SystemExit(f"all degrees of freedom grow with {found:.4f} 1/s, their eigenvalue says {wanted:.4f} 1/s")
    return found


def beside_all():
    reduced = {"analyses.transient.model": '"reduced"', "analyses.stability.full": "null"}
    small = growth()
    rows = [followed(reduced | {"analyses.modes.count": count}) | {"modes": count} for count in COUNTS]
    whole = followed({"analyses.modes.count": WATCHED}) | {"modes": None, "fitted": small}
    rows.append(whole)
    cells = []
    for row in rows:
        rate, at = row["reduced"] if row["modes"] else whole["full"]
        apart = lambda key: f" ({100 * (row[key] / whole[key] - 1):+.1f} %)" if row["modes"] else ""  # noqa: E731, B023
        of_rate = f" ({100 * (rate / whole['full'][0] - 1):+.1f} %)" if row["modes"] else f" ({small:.2f} in the run)"
        sound = row["sound"]
        cells.append(
            [
                f"{row['modes']}, to {row['reach']:.0f} Hz" if row["modes"] else "all",
                f"{rate:.2f}{of_rate}",
                f"{at:.2f}",
                f"{row['cycle']:.2f}",
                f"{row['energy']:.4f}{apart('energy')}",
                f"{100 * row['drift']:+.2f} %",
                f"{row['normal'][0] / 1e3:.2f} to {row['normal'][1] / 1e3:.2f}",
                f"{row['lateral']:.0f}{apart('lateral')}",
                row["stick"],
                f"{sound['800']:.2f}",
            ]
        )
    head = [
        "modes of each body",
        "growth, 1/s",
        "Hz",
        "limit cycle, Hz",
        "kinetic energy, J",
        "change of it in 0.05 s",
        "normal force, kN",
        "lateral force, N rms",
        "stick at most",
        "sound power, 800 Hz, dB",
    ]
    put(ROOT / "docs/explanation/transient.md", "truncation", table(head, cells))
    return rows
