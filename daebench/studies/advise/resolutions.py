"""The step sizes and tolerances that a search may take: numbered, the finer the larger the number."""

import math
from dataclasses import dataclass
from typing import Protocol

LEAST, LEAST_OF_FEW, FEW = 8, 4, 64
"""Times at which errors are taken at least, in the search, and where there are no more steps than that; of the choice there are more."""

TOLERANCES = 4
"""Tolerances a decade."""

MOST_STEPS = 2**22
"""Steps of a run at most."""

LEAST_TOLERANCE = 1e-14
"""The smallest tolerance that is tried."""

ASYMPTOTIC = 0.1
"""Error of a run, over the size of the motion, up to which it is taken as proportional to a power of the step size."""

BELOW = 0.85
"""Part of the accuracy that a prediction aims at."""

START = 2e-5
"""Approximate time that a run takes before its first step, s; a shorter time says nothing about the cost of a step."""

FARTHEST = 16
"""By how much a prediction may refine at once."""


class Resolutions(Protocol):
    """Numbered values of a method's step size or tolerance."""

    @property
    def most(self) -> int:
        """The largest number."""

    def value(self, number: int) -> float:
        """Return the step size or tolerance of a number."""

    def number(self, value: float) -> int:
        """Return the number of a value."""

    def first(self, accuracy: float) -> int:
        """Return the number to begin with."""

    def finer(self, number: int, error: float, accuracy: float) -> int:
        """Return a number that may reach an accuracy, from the error at another."""

    def between(self, low: int, high: int) -> int | None:
        """Return a number between two, or None where they are next to each other for all purposes."""

    def cost(self, number: int, seconds: float, other: int) -> float:
        """Return the least cost of another resolution, from the cost of one."""


@dataclass(frozen=True)
class StepSizes:
    """Parts of the horizon; the number is that of the steps, which come to some of the times at which the reference is known."""

    t_end: float
    """Horizon, s."""
    outputs: int
    """Number of equidistant times at which the reference is known."""
    most: int
    """Largest number of steps."""
    order: int
    """Order of the method."""
    size: float
    """Size of the motion, in the unit of its positions."""

    def value(self, number: int) -> float:
        """Return the step size."""
        return self.t_end / number

    def number(self, value: float) -> int:
        """Return the number of steps of a size."""
        return round(self.t_end / value)

    def first(self, accuracy: float) -> int:
        """Return the least number of steps."""
        return self._from(1)

    def finer(self, number: int, error: float, accuracy: float) -> int:
        """Return the number at which an error of the method's order is a little below the accuracy; twice as many where it is large."""
        parts = (error / (BELOW * accuracy)) ** (1 / self.order) if error < ASYMPTOTIC * self.size else 2.0
        return self._from(max(number + 1, math.ceil(number * min(parts, FARTHEST))))

    def between(self, low: int, high: int) -> int | None:
        """Return about the geometric mean, or None where a step is at most 15 % larger than the other."""
        middle = self._from(round(math.sqrt(low * high)))
        middle = middle if middle < high else self._from(low + 1)
        return middle if high > 1.15 * low and middle < high else None

    def cost(self, number: int, seconds: float, other: int) -> float:
        """Return a cost that grows in proportion to steps where it is more than that of a start."""
        return seconds + max(seconds - START, 0.0) * (other / number - 1)

    def _from(self, number: int) -> int:
        """Return the least number from this one on that comes to enough of the times."""
        return next(k for k in range(number, number + 2 * self.outputs) if math.gcd(k, self.outputs) >= self._least(k))

    def _least(self, number: int) -> int:
        return min(LEAST if number > FEW else LEAST_OF_FEW, self.outputs)


@dataclass(frozen=True)
class Tolerances:
    """Tolerances 10^(-k/4)."""

    most: int = round(-math.log10(LEAST_TOLERANCE)) * TOLERANCES

    def value(self, number: int) -> float:
        """Return 10^(-number / 4), to two digits."""
        return float(f"{10 ** (-number / TOLERANCES):.1e}")

    def number(self, value: float) -> int:
        """Return the number of a tolerance."""
        return round(-math.log10(value) * TOLERANCES)

    def first(self, accuracy: float) -> int:
        """Return the number of the accuracy itself."""
        return min(self.most, max(1, round(-math.log10(accuracy) * TOLERANCES)))

    def finer(self, number: int, error: float, accuracy: float) -> int:
        """Return the number at which an error in proportion to the tolerance is a little below the accuracy."""
        if not math.isfinite(error):
            return number + TOLERANCES
        return number + max(1, min(3 * TOLERANCES, math.ceil(math.log10(error / (BELOW * accuracy)) * TOLERANCES)))

    def between(self, low: int, high: int) -> int | None:
        """Return the middle, or None between neighbours."""
        return (low + high) // 2 if high > low + 1 else None

    def cost(self, number: int, seconds: float, other: int) -> float:
        """Return the same cost: how a solver's grows with the tolerance is not known beforehand."""
        return seconds
