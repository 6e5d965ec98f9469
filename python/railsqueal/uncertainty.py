"""The tables of `/uncertainty`: probabilities of squeal by mode, growth rates and Sobol' indices."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from .labels import Quantity, body_words, quantity
from .result import Floats, Integers, Result
from .tables import Table

# Bins that tell how much the probability depends on an input.
BINS = 6
# Random samples that a map of two inputs needs, and those in a bin of it in the mean.
LEAST = 64
IN_BIN = 16


def named(result: Result, key: str) -> Quantity:
    """The quantity of an uncertain key, which may be one number of a list."""
    found = quantity(key, result.units(f"uncertainty/values/{key}"), body_words(result.job))
    *_, parent, last = ("", *key.split("."))
    if not last.isdigit():
        return found
    if parent == "by_diameter":
        return replace(found, name=found.name.replace("loss factors for n = 0, 1, 2, …", f"loss factor for n = {last}"))
    return replace(found, name=f"{found.name}, entry {int(last) + 1}")


@dataclass(frozen=True)
class Uncertainty(Table):
    """Samples of uncertain keys and what they say; numbers of a point that failed are NaN."""

    needs: ClassVar[str] = "uncertainty/keys"
    analysis: ClassVar[str] = "uncertainty"

    keys: list[str]  # [k]
    values: dict[str, Floats]  # key: [n]
    part: Integers  # [n], 0 and 1 of random samples, 2 + i of the design for the input i
    status: Integers  # [n], 0 computed
    message: list[str]  # [n]
    unstable: Integers  # [n]
    growth_rate: Floats  # [n], 1/s
    frequency: Floats  # [n], Hz
    samples: int  # random ones
    failed: int  # of these
    confidence: float
    probability: float  # that any mode is unstable
    interval: Floats  # [2]
    method: str  # how the interval was made
    other: float  # probability of growth that is none of the modes
    levels: Floats  # [q], probabilities of the quantiles
    quantiles: Floats  # [q], of the largest growth rate, 1/s
    modes: list[str]  # [m], names
    mode_frequency: Floats  # [m], Hz, at the job's own point
    mode_probability: Floats  # [m]
    mode_interval: Floats  # [m, 2]
    mode_found: Floats  # [m], share of the random samples in which it was found
    mode_quantiles: Floats  # [m, q], 1/s
    mode_growth: Floats  # [n, m], 1/s
    first: Floats | None  # [k], first-order Sobol' indices of the largest growth rate
    first_interval: Floats | None  # [k, 2]
    total: Floats | None  # [k]
    total_interval: Floats | None  # [k, 2]

    @classmethod
    def from_result(cls, result: Result) -> Self:
        """The samples of a result."""
        cls.expect(result)
        group = "uncertainty"
        keys = result.texts(f"{group}/keys")
        status = result.integers(f"{group}/status")
        names = result.texts(f"{group}/modes/name")
        m, n = len(names), len(status)
        return cls(
            keys,
            {key: result.array(f"{group}/values/{key}") for key in keys},
            result.integers(f"{group}/part"),
            status,
            result.texts(f"{group}/message"),
            result.integers(f"{group}/unstable"),
            result.array(f"{group}/growth_rate"),
            result.array(f"{group}/frequency"),
            int(result.number(f"{group}/samples")),
            int(result.number(f"{group}/failed")),
            result.number(f"{group}/confidence"),
            result.number(f"{group}/probability"),
            result.array(f"{group}/probability_interval"),
            result.texts(f"{group}/interval_method")[0],
            result.number(f"{group}/other_probability"),
            result.array(f"{group}/levels"),
            result.array(f"{group}/quantiles"),
            names,
            result.array(f"{group}/modes/own_frequency"),
            result.array(f"{group}/modes/probability"),
            result.array(f"{group}/modes/interval").reshape(m, 2),
            result.array(f"{group}/modes/found"),
            result.array(f"{group}/modes/quantiles").reshape(m, -1),
            result.array(f"{group}/modes/growth_rate").reshape(n, m),
            result.optional(f"{group}/indices/first"),
            result.optional(f"{group}/indices/first_interval"),
            result.optional(f"{group}/indices/total"),
            result.optional(f"{group}/indices/total_interval"),
        )

    @property
    def random(self) -> Integers:
        """Places of the random samples that were computed."""
        return np.flatnonzero((self.part < 2) & (self.status == 0))

    @property
    def squealing(self) -> list[int]:
        """Modes that are unstable in any random sample, the likeliest first."""
        return [m for m in range(len(self.modes)) if self.mode_probability[m] > 0]

    def bins(self, key: str, count: int) -> tuple[Floats, Integers]:
        """Ends of `count` bins of an input with as many random samples each, and the bin of each of these samples."""
        x = self.values[key][self.random]
        ends = np.unique(np.quantile(x, np.linspace(0, 1, count + 1)))
        return ends, np.clip(np.searchsorted(ends, x, side="right") - 1, 0, max(len(ends) - 2, 0))

    def dependence(self, key: str) -> float:
        """Variance of the share of unstable samples over the bins of an input."""
        _, of = self.bins(key, BINS)
        grows = self.unstable[self.random] > 0
        return float(np.var([grows[of == b].mean() for b in np.unique(of)]))

    def map(self) -> tuple[tuple[str, str], tuple[Floats, Floats], Floats] | None:
        """Conditional probability of squeal over two inputs: their keys, the ends of the bins, `[x][y]`, and the share
        of unstable samples in each bin, NaN without any; of the inputs that it depends on most."""
        if len(self.keys) < 2 or len(self.random) < LEAST:
            return None
        x, y = sorted(self.keys, key=self.dependence, reverse=True)[:2]
        count = int(np.clip(np.sqrt(len(self.random) / IN_BIN), 2, 10))
        (x_ends, column), (y_ends, row) = self.bins(x, count), self.bins(y, count)
        shape = (len(y_ends) - 1, len(x_ends) - 1)
        if 0 in shape:
            return None
        samples, unstable = np.zeros(shape), np.zeros(shape)
        np.add.at(samples, (row, column), 1)
        np.add.at(unstable, (row, column), self.unstable[self.random] > 0)
        with np.errstate(invalid="ignore"):
            return (x, y), (x_ends, y_ends), unstable / samples

    def sentence(self, names: dict[str, str]) -> str:
        """The outcome in a sentence; `names` are those of the keys."""
        said = f"P(squeal) = {self.probability:.2f} ± {np.diff(self.interval)[0] / 2:.2f}"
        by = [f"{self.mode_frequency[m]:.0f} Hz {self.mode_probability[m]:.2f}" for m in self.squealing[:4]]
        if by:
            said += f": {', '.join(by)}"
        if self.first is not None and self.first.max() > 0:
            k = int(np.argmax(self.first))
            said += f"; {100 * min(self.first[k], 1):.0f} % of the variance of the growth rate is {names[self.keys[k]]}"
        return f"{said}."


@dataclass(frozen=True)
class Loudness(Table):
    """Limit cycles of some random samples; stable samples are silent."""

    needs: ClassVar[str] = "uncertainty/cycles/fate"
    analysis: ClassVar[str] = "uncertainty.cycles"

    sample: Integers  # [c], rows of the samples in the tables of the study
    fate: Integers  # [c], -1 not computed, 0 at rest, more: it moves
    frequency: Floats  # [c], Hz
    kinetic: Floats  # [c], J
    level: Floats | None  # [c], dB(A), A-weighted sound power of the louder body; -inf of a silent sample
    message: list[str]  # [c]

    @classmethod
    def from_result(cls, result: Result) -> Self:
        """The limit cycles of a result."""
        cls.expect(result)
        group = "uncertainty/cycles"
        return cls(
            result.integers(f"{group}/sample"),
            result.integers(f"{group}/fate"),
            result.array(f"{group}/frequency"),
            result.array(f"{group}/kinetic"),
            result.optional(f"{group}/level_a"),
            result.texts(f"{group}/message"),
        )

    @property
    def sorted_levels(self) -> Floats:
        """Levels of the samples whose level is known, ascending, dB(A)."""
        return np.sort(self.level[~np.isnan(self.level)]) if self.level is not None else np.empty(0)

    def sentence(self) -> str:
        """The outcome in a sentence."""
        moving = int(np.count_nonzero(self.fate > 0))
        said = f"{moving} of {len(self.fate)} samples followed in time squeal"
        loud = self.sorted_levels[np.isfinite(self.sorted_levels)]
        if len(loud):
            # Of an even number the lower one of the two in the middle, as the summary has it.
            middle = np.quantile(loud, 0.5, method="inverted_cdf")
            said += f"; the median of their levels is {middle:.1f} dB(A), the largest {loud[-1]:.1f} dB(A)"
        return f"{said}."
