"""The tables of `/uncertainty`: probabilities of squeal by mode, growth rates and Sobol' indices."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from .labels import Quantity, body_words, quantity
from .result import Floats, Integers, Result
from .tables import Table


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
