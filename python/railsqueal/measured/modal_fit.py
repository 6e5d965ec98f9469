"""Natural frequencies and damping of frequency responses, by least squares in the complex plane.

In a band the responses H_k(ω), k = 1 … K, as they were measured, are

    H_k(ω) = Σ_r R_kr / (iω − λ_r) + Σ_{m ≤ 2} B_km x^m,    λ_r = −ζ_r ω_r + i ω_r √(1 − ζ_r²),

with the same poles λ_r in all of them, complex residues R_kr, and a parabola over the band (x from −1 to 1) for the
modes beyond it and the conjugate poles. The poles begin as those of rational fraction polynomials (M. H. Richardson and
D. L. Formenti, Proc. 1st IMAC, 1982) in Chebyshev's polynomials, weighted anew by their denominator (C. K. Sanathanan
and J. Koerner, IEEE Trans. Autom. Control 8 (1963) 56–58). Then the sum of |H_k − model|² is made least over the poles
with the linear parameters eliminated (variable projection: G. H. Golub and V. Pereyra, SIAM J. Numer. Anal. 10 (1973)
413–432), by Levenberg and Marquardt's method. Standard deviations are those of the linearised problem, from what is
left of the responses: s² (JᵀJ)⁻¹ of the projected Jacobian J.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from ..result import Complexes, Floats

# Degree of the polynomial for what lies beyond the band.
BACKGROUND = 2
# Steps of the weighting of the rational fraction, and of the least squares.
WEIGHTINGS = 8
STEPS = 200
CONVERGED = 1e-12
# Modes of a band: at most so many more than it has peaks.
MORE = 2
# A mode is one if its half-power width is below this part of the band, its frequency is known to this part of the
# width of the band and its damping to this part of itself, and it has this part of the largest response.
WIDEST, CERTAIN, DAMPED, LOUDEST = 0.5, 0.1, 0.5, 0.02
# Part of a response that a fit may leave beside its noise.
UNFITTED = 0.02
# Difference of the information criterion from which more modes are better.
BETTER = 10.0
# Height of a peak over the valleys beside it, dB.
PROMINENT = 3.0
# Variances of the noise that are added before, so that its own peaks are lower; most peaks in one band.
FLOOR, MOST = 20.0, 8
# Half the width of the band of a peak, in half-power widths and in lines.
HALF_WIDTHS = 10.0
LINES = 16


@dataclass(frozen=True)
class FittedMode:
    """A mode and the standard deviations of its values."""

    frequency: float  # Hz, |λ|/2π
    damping_ratio: float
    frequency_deviation: float  # Hz
    damping_deviation: float

    @property
    def loss_factor(self) -> float:
        """Loss factor at resonance."""
        return 2 * self.damping_ratio

    @property
    def width(self) -> float:
        """Half-power width, Hz."""
        return 2 * self.damping_ratio * self.frequency


@dataclass(frozen=True)
class BandFit:
    """The modes of a band."""

    band: tuple[float, float]  # Hz
    frequency: Floats  # [f], Hz
    modes: list[FittedMode]  # by rising frequency; none where no fit is certain
    poles: Complexes  # [r], 1/s
    model: Complexes  # [K, f], as the responses
    residual: Floats  # [K], root mean square of what is left over that of the response
    noise: Floats  # [K], the same of the noise from line to line
    residues: Complexes  # [K, r], of the responses

    @property
    def remarks(self) -> list[str]:
        """Reasons to doubt the fit, in words."""
        made = []
        step = float(np.diff(self.frequency).max())
        for mode in self.modes:
            if mode.width < 2 * step:
                made.append(
                    f"the half-power width of {mode.frequency:.2f} Hz, {mode.width:.3g} Hz, has fewer than two lines "
                    f"({step:.3g} Hz apart): windows and leakage may pass for damping; measure with finer lines"
                )
        wrong = self.residual[self.residual > np.maximum(UNFITTED, 3 * self.noise)]
        if len(wrong):
            made.append(
                f"from {self.band[0]:.5g} to {self.band[1]:.5g} Hz the fit leaves {100 * wrong.max():.0f} % of a "
                "response, more than its noise: give a narrower --band, or more --modes"
            )
        return made


def basis(omega: Floats, poles: Complexes) -> Complexes:
    """Functions of the model at angular frequencies (rad/s), `[f, r + 3]`."""
    x = (2 * omega - omega[0] - omega[-1]) / (omega[-1] - omega[0])
    return np.column_stack([1 / (1j * omega[:, None] - poles), chebyshev.chebvander(x, BACKGROUND)])


def rational_poles(omega: Floats, responses: Complexes, count: int) -> Complexes:
    """Poles of rational fraction polynomials with `count` of them, 1/s."""
    middle, half = 0.5 * (omega[0] + omega[-1]), 0.5 * (omega[-1] - omega[0])
    x = (omega - middle) / half
    below, above = chebyshev.chebvander(x, count), chebyshev.chebvander(x, count + BACKGROUND)
    weight = np.ones(len(omega))
    roots = np.empty(0, complex)
    for _ in range(WEIGHTINGS):
        q, _ = np.linalg.qr(weight[:, None] * above)
        blocks = []
        for h in responses:
            block = (weight * h)[:, None] * below
            blocks.append(block - q @ (q.conj().T @ block))
        denominator = np.linalg.svd(np.vstack(blocks), full_matrices=False)[2][-1].conj()
        roots = chebyshev.chebroots(denominator)
        size = np.abs(below @ denominator)
        weight = 1 / np.maximum(size, 1e-6 * size.max())
    found = 1j * (middle + half * roots)
    return np.asarray(-np.abs(found.real) + 1j * found.imag)


def projected(omega: Floats, responses: Complexes, poles: Complexes) -> tuple[Complexes, Complexes, Complexes]:
    """Rest of the responses `[K, f]`, residues `[K, r]`, and derivatives of the rest by the poles `[r, K, f]`."""
    functions = basis(omega, poles)
    # Columns of like size, so that the coefficients of none are lost.
    size = np.linalg.norm(functions, axis=0)
    q, r = np.linalg.qr(functions / size)
    parts = q.conj().T @ responses.T
    rest = responses - (q @ parts).T
    count = len(poles)
    residues = (np.linalg.solve(r, parts).T / size)[:, :count]
    slope = functions[:, :count] ** 2
    slope = slope - q @ (q.conj().T @ slope)
    return rest, residues, -np.einsum("fr,kr->rkf", slope, residues)


def real(values: Complexes) -> Floats:
    """Real and imaginary parts one after the other, along the last axis."""
    return np.asarray(np.concatenate([values.real, values.imag], axis=-1))


def least_squares(omega: Floats, responses: Complexes, poles: Complexes) -> tuple[Complexes, Floats, float]:
    """Poles of the least sum of squares, their covariance `[2r, 2r]` (real and imaginary part, scaled by the width of
    the band), and the sum."""
    scale = omega[-1] - omega[0]
    count = len(poles)

    def evaluate(p: Complexes) -> tuple[Floats, Floats]:
        rest, _, slopes = projected(omega, responses, p)
        columns = [real((scale * turn * slope).reshape(-1)) for slope in slopes for turn in (1, 1j)]
        return real(rest.reshape(-1)), np.column_stack(columns)

    rest, jacobian = evaluate(poles)
    best, damping = float(rest @ rest), 1e-3
    for _ in range(STEPS):
        normal, slope = jacobian.T @ jacobian, jacobian.T @ rest
        diagonal = np.diag(np.maximum(np.diag(normal), 1e-300))
        step = -np.linalg.lstsq(normal + damping * diagonal, slope, rcond=None)[0]
        moved = poles + scale * (step[0::2] + 1j * step[1::2])
        moved = -np.maximum(np.abs(moved.real), 1e-12 * scale) + 1j * moved.imag
        trial, derivative = evaluate(moved)
        total = float(trial @ trial)
        if total < best:
            gain = best - total
            poles, rest, jacobian, best, damping = moved, trial, derivative, total, max(0.2 * damping, 1e-12)
            if gain < CONVERGED * best:
                break
        elif damping > 1e8:
            break
        else:
            damping *= 5
    freedom = len(rest) - 2 * count - 2 * len(responses) * (count + BACKGROUND + 1)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * best / max(freedom, 1)
    return poles, covariance, best


def fitted_modes(omega: Floats, poles: Complexes, covariance: Floats) -> list[FittedMode]:
    """Frequencies and damping ratios of poles, with standard deviations."""
    scale = omega[-1] - omega[0]
    modes = []
    for k, pole in enumerate(poles):
        size = abs(pole)
        own = scale**2 * covariance[2 * k : 2 * k + 2, 2 * k : 2 * k + 2]
        by_frequency = np.array([pole.real, pole.imag]) / size / (2 * np.pi)
        by_damping = np.array([-(pole.imag**2), pole.real * pole.imag]) / size**3
        deviations = [float(np.sqrt(max(g @ own @ g, 0.0))) for g in (by_frequency, by_damping)]
        modes.append(FittedMode(size / (2 * np.pi), -pole.real / size, *deviations))
    return modes


def certain(omega: Floats, responses: Complexes, poles: Complexes, modes: Sequence[FittedMode]) -> bool:
    """Returns whether all poles are modes of the band: within it, narrow, known, and no small part of the response."""
    width = (omega[-1] - omega[0]) / (2 * np.pi)
    residues = projected(omega, responses, poles)[1]
    share = np.abs(residues) / np.abs(poles.real) / np.abs(responses).max(axis=1, keepdims=True)
    return all(
        omega[0] < 2 * np.pi * mode.frequency < omega[-1]
        and mode.width < WIDEST * width
        and mode.frequency_deviation < CERTAIN * width
        and mode.damping_deviation < DAMPED * mode.damping_ratio
        and share[:, k].max() > LOUDEST
        for k, mode in enumerate(modes)
    )


def fit_band(frequency: Floats, responses: Complexes, counts: Sequence[int]) -> BandFit:
    """Fits responses `[K, f]` at frequencies (Hz) by each of the `counts` of modes, and takes the number that the
    information criterion of Schwarz prefers among those whose modes are all certain."""
    omega = 2 * np.pi * frequency
    size = np.sqrt((np.abs(responses) ** 2).mean(axis=1, keepdims=True))
    scaled = responses / np.where(size > 0, size, 1.0)
    best: tuple[float, Complexes, list[FittedMode]] | None = None
    for count in counts:
        if 2 * len(frequency) < 4 * (count + BACKGROUND + 1):
            break
        poles, covariance, total = least_squares(omega, scaled, rational_poles(omega, scaled, count))
        # Responses with more noise count less.
        rest = projected(omega, scaled, poles)[0]
        noise = np.maximum(np.sqrt((np.abs(rest) ** 2).mean(axis=1, keepdims=True)), 1e-12)
        weighted = scaled / noise
        poles, covariance, total = least_squares(omega, weighted, poles)
        order = np.argsort(poles.imag)
        modes = fitted_modes(omega, poles, covariance)
        values = 2 * weighted.size
        parameters = 2 * count + 2 * len(responses) * (count + BACKGROUND + 1)
        criterion = values * np.log(total / values) + 2 * values * np.log(noise).mean() + parameters * np.log(values)
        if not certain(omega, scaled, poles, modes):
            continue
        if best is None or criterion < best[0] - BETTER:
            best = (float(criterion), poles[order], [modes[k] for k in order])
    noise_of_lines = np.sqrt(line_noise(scaled))
    band = (float(frequency[0]), float(frequency[-1]))
    if best is None:
        nothing = np.zeros_like(responses)
        none, left = np.empty(0, complex), np.ones(len(responses))
        return BandFit(band, frequency, [], none, nothing, left, noise_of_lines, np.empty((len(responses), 0), complex))
    rest, residues, _ = projected(omega, scaled, best[1])
    left = np.sqrt((np.abs(rest) ** 2).mean(axis=1))
    return BandFit(band, frequency, best[2], best[1], responses - size * rest, left, noise_of_lines, size * residues)


def line_noise(responses: Complexes) -> Floats:
    """[K]: mean of |noise|² of responses, from their second differences from line to line."""
    # A second difference has six times the variance of a line; the median of |noise|² is ln 2 times its mean.
    return np.asarray(np.median(np.abs(np.diff(responses, 2, axis=1)) ** 2, axis=1) / (6 * np.log(2)))


def power(responses: Complexes) -> Floats:
    """[f]: sum of the squares of all responses, each over its own mean, and their noise on top, so that noise has no
    peaks."""
    square = np.abs(responses) ** 2
    noise = line_noise(responses)[:, None]
    size = np.maximum(square.mean(axis=1, keepdims=True), 1e-300)
    return np.asarray(((square + FLOOR * noise) / size).sum(axis=0))


def peaks(together: Floats) -> list[int]:
    """Lines at which a power has a peak that stands out from the valleys beside it."""
    level = 10 * np.log10(together)
    found = []
    for k in range(1, len(level) - 1):
        if not level[k - 1] < level[k] >= level[k + 1]:
            continue
        sides = []
        for side in (level[k::-1], level[k:]):
            higher = np.flatnonzero(side > level[k])
            sides.append(side[: higher[0] if len(higher) else None].min())
        if level[k] - max(sides) >= PROMINENT:
            found.append(k)
    return found


def bands_of_peaks(responses: Complexes) -> list[tuple[int, int, int]]:
    """Bands about the peaks: first line, end, and number of peaks; bands that overlap are one, up to a number."""
    together = power(responses)
    made: list[tuple[int, int, int]] = []
    for k in peaks(together):
        below = together < 0.5 * together[k]
        left = k - int(np.argmax(below[k::-1])) if below[: k + 1].any() else 0
        right = k + int(np.argmax(below[k:])) if below[k:].any() else len(together) - 1
        half = max(LINES, int(np.ceil(HALF_WIDTHS * 0.5 * (right - left))))
        first, end = max(0, k - half), min(len(together), k + half + 1)
        if made and first < made[-1][1] and made[-1][2] < MOST:
            first, _, count = made.pop()
            made.append((first, end, count + 1))
        else:
            made.append((first, end, 1))
    return made


def fit(frequency: Floats, responses: Complexes, modes: int | None = None) -> list[BandFit]:
    """Fits all bands with peaks; of `modes` modes each where that is given."""
    made = []
    for first, end, count in bands_of_peaks(responses):
        counts = [modes] if modes else range(1, count + MORE + 1)
        made.append(fit_band(frequency[first:end], responses[:, first:end], counts))
    return made
