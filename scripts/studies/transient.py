"""Growth rates and frequencies of the transient against the eigenvalues of full sliding, from a start in each mode; for
both signs of the lateral creepage."""

import tempfile
from pathlib import Path

import numpy as np
from program import run

STEP = 1e-5
# Steps at which the first mode is followed as well.
OTHER_STEPS = (2e-5, 5e-6, 2.5e-6, 1.25e-6)
# Start of the modes, m, and the time during which they are looked at, s: what the start is not exactly a mode of has
# left the contact, and nothing sticks.
AMPLITUDE, BEGIN, END = 5e-8, 0.03, 0.2
# Time between two samples of the modal amplitudes, s.
SAMPLE = 1e-4
# Samples that the fit joins to one, and the singular value below which it takes a direction for rounding, relative to
# the largest.
JOINED, ROUNDING = 10, 1e-6
# The rates must agree within one of these, relative and in 1/s; the frequency relative to the linear one must be low by
# (hω)²/12 within the third, a sixth of that at the first step above.
NEAR_RELATIVE, NEAR = 0.02, 0.2
NEAR_FREQUENCY = 1e-5


def exponents(samples, interval):
    """All λ of q(t) = Σ c e^{λt} + constant in the samples [times, amplitudes], 1/s: the shift of the principal
    directions in time by one sample.

    Dynamic mode decomposition with delays (J. H. Tu et al., J. Comput. Dyn. 1, 2014) in the form of ESPRIT (R. Roy, T.
    Kailath, IEEE Trans. Acoust. Speech Signal Process. 37, 1989).
    """
    changes = np.diff(samples, axis=0)
    rows = len(changes) - JOINED
    joined = np.hstack([changes[k : k + rows] for k in range(JOINED)])
    in_time, size, _ = np.linalg.svd(joined, full_matrices=False)
    in_time = in_time[:, size > ROUNDING * size[0]]
    shift = np.linalg.lstsq(in_time[:-1], in_time[1:], rcond=None)[0]
    return np.log(np.linalg.eigvals(shift).astype(complex)) / interval


def near(values, wanted):
    return values[np.argmin(abs(values - wanted))]


def followed(lateral, mode, step, model):
    """The row of a start in this mode, from 1, and the number of unstable modes; `model` is the result file whose
    reduced model is taken."""
    sets = {
        "contact.creepage.lateral": lateral,
        "analyses.stability.direction": "actual",
        "analyses.transient.duration": END,
        "analyses.transient.step": step,
        "analyses.transient.start.mode": mode,
        "analyses.transient.start.amplitude": AMPLITUDE,
        "analyses.transient.points": "[]",
        "analyses.transient.sound_power": "null",
        "analyses.transient.contact_stride": 0,
        "analyses.transient.modal_stride": round(SAMPLE / step),
        "output.reduced": "false",
    }
    tables, _ = run("squeal.json", sets, ranks=1, reuse=model, groups=("stability", "transient"))
    linear = tables["stability/eigenvalue"]
    time, samples = tables["transient/modal_time"], tables["transient/modal_displacement"]
    taken = (time > BEGIN - step) & (time < END + step)
    samples, wanted = samples[taken], linear[mode - 1]
    fitted = near(exponents(samples, SAMPLE), wanted)
    halves = [
        near(exponents(part, SAMPLE), wanted) for part in (samples[: len(samples) // 2], samples[len(samples) // 2 :])
    ]
    row = {
        "lateral": lateral,
        "mode": mode,
        "step": step,
        "linear": [wanted.real, wanted.imag / (2 * np.pi)],
        "transient": [fitted.real, fitted.imag / (2 * np.pi)],
        "scheme": -((step * wanted.imag) ** 2) / 12,
        "halves": [half.real for half in halves],
        "closed": int(tables["transient/closed"].min()),
        "stick": int(tables["transient/stick"].max()),
    }
    return row, int((linear.real > 0).sum())


def misses(row):
    """Bounds that a row breaks, in words."""
    (rate, frequency), (fitted, at) = row["linear"], row["transient"]
    bound = max(NEAR_RELATIVE * abs(rate), NEAR)
    name = f"lateral creepage {row['lateral']:+g}, mode {row['mode']}, step {row['step']:g} s"
    found = []
    if row["stick"]:
        found.append(f"{name}: {row['stick']} nodes stick, which is not the motion that was linearised")
    if abs(fitted - rate) > bound:
        found.append(
            f"{name}: growth rate {fitted:.4f} 1/s, eigenvalue {rate:.4f} 1/s, further apart than {bound:.3f} 1/s"
        )
    if abs(row["halves"][0] - row["halves"][1]) > 0.1 * bound:
        found.append(
            f"{name}: the halves of the time give {row['halves'][0]:.4f} and {row['halves'][1]:.4f} 1/s: no "
            "exponential growth, or the fit fails"
        )
    shift, scheme = at / frequency - 1, row["scheme"]
    if abs(shift - scheme) > NEAR_FREQUENCY:
        found.append(
            f"{name}: the frequency is off by {shift:.3e}, by the scheme it should be {scheme:.3e} within "
            f"{NEAR_FREQUENCY:.0e}"
        )
    return found


def rest(row):
    """How far the eigenvalue of the transient is from that of the linear motion under the scheme, 1/s."""
    (rate, frequency), (fitted, at) = row["linear"], row["transient"]
    return abs(complex(fitted - rate, 2 * np.pi * (at - frequency * (1 + row["scheme"]))))


def against_linear():
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / "model.h5"
        run("squeal.json", {}, ranks=1, only="stability", output=model)
        first, count = followed(0.01, 1, STEP, model)
        if count == 0:
            raise SystemExit("jobs/squeal.json has no unstable mode")
        steps = sorted(
            [first, *(followed(0.01, 1, step, model)[0] for step in OTHER_STEPS)], key=lambda row: -row["step"]
        )
        rows = [*steps, *(followed(0.01, mode, STEP, model)[0] for mode in range(2, count + 1))]
        rows += [followed(-0.01, mode, STEP, model)[0] for mode in range(1, count + 1)]
    for row in rows:
        print(
            f"   {100 * row['lateral']:+g} %, mode {row['mode']}, {1e6 * row['step']:g} µs: linear "
            f"{row['linear'][0]:.4f} 1/s {row['linear'][1]:.4f} Hz, "
            f"transient {row['transient'][0]:.4f} 1/s {row['transient'][1]:.4f} Hz (halves {row['halves'][0]:.4f}, "
            f"{row['halves'][1]:.4f} 1/s)",
            flush=True,
        )
    broken = [words for row in rows for words in misses(row)]
    for coarse, fine in zip(steps, steps[1:]):
        if rest(fine) >= rest(coarse):
            broken.append(
                f"what is left of the difference does not fall with the step: {rest(coarse):.4f} 1/s at "
                f"{coarse['step']:g} s, {rest(fine):.4f} at {fine['step']:g} s"
            )
    if broken:
        raise SystemExit("\n".join(["the transient does not follow the linear analysis:", *broken]))
    return rows
