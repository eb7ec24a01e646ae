"""The secular part of an error: of the monotone shapes that drifts have, the one that fits its window means best."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from daebench.diagnostics.oscillations import correlation
from daebench.diagnostics.window_means import window_means
from daebench.runs.trajectory import Array

POWERS = (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0)
RATES = (2.0, 3.0, 4.5, 7.0, 10.0, 15.0, 22.0, 33.0, 50.0, 75.0)
"""Rates of exponentials, times the whole time."""

STEPS = 63
"""Places of a step that are tried, equally far apart."""

BETTER = 0.7
"""A shape other than a power of t has to lower the sum of squares that the best power leaves by this factor."""

POINTS = 2048
"""Points over which shapes are averaged."""


@dataclass(frozen=True)
class Secular:
    """A monotone shape, fitted to window means.

    Parameters
    ----------
    law : str
        "power", "exponential", "saturated" or "step".
    number : float
        Exponent of t, rate times the whole time, or place of the step as a part of the whole time.
    change : float
        Its change from the start of the time to the end.
    seen : float
        Modulus of its change from the first window to the last.
    scatter : float
        Standard deviation of the window means about it.
    neighbours, increments : float
        Correlations of neighbouring residuals, and of neighbouring differences of residuals.
    """

    law: str
    number: float
    change: float
    seen: float
    scatter: float
    neighbours: float
    increments: float

    def along(self, u: Array) -> Array:
        """Return it at times u, scaled to 0 ... 1; it is 0 at the start."""
        return self.change * shape(self.law, self.number, u)


def shape(law: str, number: float, u: Array) -> Array:
    """Return a shape at scaled times u, 0 at u = 0 and 1 at u = 1.

    ::

        power  u^a        exponential  (e^(k u) - 1) / (e^k - 1)        saturated  (1 - e^(-k u)) / (1 - e^-k)        step  u >= a
    """
    if law == "power":
        return np.asarray(u**number)
    if law == "step":
        return np.asarray(u >= number, dtype=float)
    rate = number if law == "exponential" else -number
    return np.asarray(np.expm1(rate * u) / np.expm1(rate))


@lru_cache(maxsize=64)
def _shapes(windows: int) -> tuple[tuple[tuple[str, float], ...], Array]:
    """Return the shapes, powers first, and their means over windows, shape(windows, shapes)."""
    steps = [("step", (k + 1) / (STEPS + 1)) for k in range(STEPS)]
    names = [("power", x) for x in POWERS] + [(law, x) for law in ("exponential", "saturated") for x in RATES] + steps
    u = (np.arange(POINTS) + 0.5) / POINTS
    return tuple(names), window_means(u, np.column_stack([shape(*name, u) for name in names]), windows)


def secular(means: Array) -> Secular:
    """Return the shape that fits window means best, by least squares.

    Parameters
    ----------
    means : ndarray, shape(windows,)
        Tapered means over windows, see :func:`daebench.diagnostics.window_means.window_means`; at least four.
    """
    names, columns = _shapes(len(means))
    centred, m = columns - np.mean(columns, axis=0), means - np.mean(means)
    factors = m @ centred / np.sum(centred**2, axis=0)
    misfits = np.sum((m[:, None] - centred * factors) ** 2, axis=0)
    best, power = int(np.argmin(misfits)), int(np.argmin(misfits[: len(POWERS)]))
    best = best if misfits[best] < BETTER * misfits[power] else power
    residual = m - centred[:, best] * factors[best]
    scatter = float(np.sqrt(misfits[best] / (len(m) - 3)))
    seen = float(np.ptp(columns[:, best] * factors[best]))
    return Secular(*names[best], float(factors[best]), seen, scatter, correlation(residual), correlation(np.diff(residual)))


def factors(means: Array, best: Secular) -> Array:
    """Return the changes of several errors, fitted with one shape.

    Parameters
    ----------
    means : ndarray, shape(windows, members)
        Window means, a column each.
    best : Secular
        The shape.
    """
    names, columns = _shapes(len(means))
    fitted = columns[:, names.index((best.law, best.number))] if (best.law, best.number) in names else np.linspace(0, 1, len(means))
    centred = fitted - np.mean(fitted)
    return np.asarray(centred @ means / float(centred @ centred), dtype=float)
