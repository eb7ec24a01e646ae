"""An axis: its quantity, its ends, and its ticks."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from daebench.errors import BadInput
from daebench.runs.ivp import Array
from daebench.systems.lazily import matplotlib as mpl

TICKS = 5
"""Approximate maximum number of ticks on an axis."""

MINUS = "\N{MINUS SIGN}"

DIGITS = 15
"""Maximum number of decimal places of a label."""

LEAST, MOST = 1e-300, 1e300
"""Shortest and longest extent of an axis, so that neither its ticks nor its fractions overflow."""


@dataclass(frozen=True)
class Axis:
    """The quantity, the ends and the scale of an axis.

    Parameters
    ----------
    label : str
        Quantity and unit; text of an SVG if it is ``Markup``.
    low, high : float
        Ends, low < high; both positive if the scale is logarithmic.
    log : bool
        Whether the scale is logarithmic.

    Raises
    ------
    BadInput
        If the ends are not finite, not in order, too near or too far apart for floating point, or not positive on a logarithmic scale.
    """

    label: str
    low: float
    high: float
    log: bool = False

    def __post_init__(self) -> None:
        if not LEAST <= self.high - self.low <= 2 * MOST or (self.log and self.low <= 0):
            scale = "logarithmic" if self.log else "linear"
            raise BadInput(
                f"axis {self.label}: no {scale} scale goes from {self.low:g} to {self.high:g}; give finite ends in order.",
                "axis-ends-invalid",
            )

    def share(self, values: npt.ArrayLike) -> Array:
        """Return positions along the axis, 0 at its low end and 1 at its high end; NaN for values that cannot be placed on it."""
        low, high, given = (self._linear(value) for value in (self.low, self.high, values))
        return np.asarray((given - low) / (high - low), dtype=float)

    def _linear(self, values: npt.ArrayLike) -> Array:
        given = np.asarray(values, dtype=float)
        return np.log10(np.where(given > 0, given, np.nan)) if self.log else given

    def ticks(self, most: int = TICKS) -> tuple[list[tuple[float, Markup]], int]:
        """Return values of ticks, about ``most`` at most, with their labels, and the exponent of the common power of ten."""
        if self.log:
            # Ends that are powers of ten but for rounding have their ticks.
            decades = range(math.ceil(math.log10(self.low) - 1e-9), math.floor(math.log10(self.high) + 1e-9) + 1)
            # Powers of ten alone say nothing on an axis of less than two; it gets the ticks of a linear one.
            if len(decades) >= 2:
                stride = math.ceil(len(decades) / most)
                return [(10.0**k, power(k)) for k in decades if k % stride == 0], 0
        inside = [float(x) for x in mpl.ticker.MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]).tick_values(self.low, self.high)]
        slack = 1e-9 * (self.high - self.low)
        values = [x for x in inside if self.low - slack <= x <= self.high + slack and not (self.log and x <= 0)]
        texts, exponent = labels(values)
        return list(zip(values, texts, strict=True)), exponent

    def widened(self, factor: float) -> "Axis":
        """Return a linear axis with the same middle, longer by this factor."""
        middle, half = (self.low + self.high) / 2, factor * (self.high - self.low) / 2
        return replace(self, low=middle - half, high=middle + half)


def around(label: str, *values: npt.ArrayLike, log: bool = False, floor: float = 0.0, margin: float = 0.06) -> Axis:
    """Return an axis that contains all finite values, with a margin.

    Parameters
    ----------
    label : str
        Quantity and unit.
    *values : array_like
        Values to contain. Without any finite value the axis goes from 0 to 1, or from 0.1 to 1.
    log : bool
        Whether the scale is logarithmic; values that are not positive are then ignored.
    floor : float
        Lower bound of the low end of a logarithmic axis.
    margin : float
        Fraction of the extent that is added at each end.
    """
    numbers = np.concatenate([np.ravel(np.asarray(array, dtype=float)) for array in values]) if values else np.empty(0)
    numbers = numbers[np.isfinite(numbers) & ((numbers > 0) | (not log))]
    if log:
        ends = np.log10(np.clip(numbers, max(floor, 100 * LEAST), MOST / 100)) if len(numbers) else np.array([-1.0, 0.0])
        low, high = math.floor(ends.min() - 1e-9), math.ceil(ends.max() + 1e-9)
        return Axis(label, 10.0**low, 10.0 ** max(high, low + 1), log=True)
    # Values of failed runs may be near the largest double: the difference of the ends must not overflow.
    numbers = np.clip(numbers, -MOST / 2, MOST / 2)
    low, high = (float(numbers.min()), float(numbers.max())) if len(numbers) else (0.0, 1.0)
    extent = high - low if high - low > 1e3 * LEAST else abs(high) if abs(high) > 1e3 * LEAST else 1.0
    return Axis(label, low - margin * extent, high + margin * extent)


def power(k: int) -> Markup:
    """Return 10^k as text of an SVG."""
    return Markup('10<tspan dy="-.4em" font-size=".75em">{}</tspan>').format(str(k).replace("-", MINUS))


def labels(values: Sequence[float]) -> tuple[list[Markup], int]:
    """Return the labels at ticks of a linear axis, and the exponent of the common power of ten."""
    largest = max((abs(x) for x in values), default=0.0)
    step = min((abs(b - a) for a, b in itertools.pairwise(values)), default=largest) or 1.0
    exponent = math.floor(math.log10(largest)) if largest else 0
    exponent = 0 if -3 <= exponent < 5 else exponent
    unit = 10.0**exponent
    places = max(0, -math.floor(math.log10(step / unit) + 1e-9))
    # As many decimals as tell the ticks exactly: 0.25 needs two, though the step of a quarter has the size of a tenth.
    while places < DIGITS and any(abs(round(x / unit, places) - x / unit) > 1e-6 * step / unit for x in values):
        places += 1
    # + 0.0, because -0 would be printed with its sign.
    return [Markup(f"{x / unit + 0.0:.{places}f}".replace("-", MINUS)) for x in values], exponent
