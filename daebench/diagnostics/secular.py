"""The secular parts of errors: of the monotone shapes that drifts have, the one that fits the window means of each best."""

from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any, Self

import numpy as np

from daebench.diagnostics.oscillations import centred, correlation, products
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

CANCELLED = 1e-6
"""Part of the sum of squares below which the residual of a shape counts as zero."""


@dataclass(frozen=True)
class Secular:
    """Monotone shapes, fitted to the window means of m errors; of one error each entry is a number.

    Parameters
    ----------
    law : ndarray of str, shape(m,)
        "power", "exponential", "saturated" or "step".
    number : ndarray, shape(m,)
        Exponent of t, rate times the whole time, or place of the step as a part of the whole time.
    change : ndarray, shape(m,)
        Its change from the start of the time to the end.
    seen : ndarray, shape(m,)
        Modulus of its change from the first window to the last.
    scatter : ndarray, shape(m,)
        Standard deviation of the window means about it.
    neighbours, increments : ndarray, shape(m,)
        Correlations of neighbouring residuals, and of neighbouring differences of residuals.
    """

    law: Any
    number: Any
    change: Any
    seen: Any
    scatter: Any
    neighbours: Any
    increments: Any

    def along(self, u: Array) -> Array:
        """Return the shapes at times u, scaled to 0 ... 1, shape(m, n); they are 0 at the start."""
        rows = np.empty((len(self.law), len(u)))
        for law, number in set(zip(self.law.tolist(), self.number.tolist(), strict=True)):
            members = (self.law == law) & (self.number == number)
            rows[members] = np.multiply.outer(self.change[members], shape(law, number, u))
        return rows

    def one(self, i: int) -> Self:
        """Return the shape of one error."""
        return replace(self, **{field.name: getattr(self, field.name)[i].item() for field in fields(self)})

    def put(self, members: Any, others: Self) -> None:
        """Replace the shapes of some errors by others."""
        for field in fields(self):
            getattr(self, field.name)[members] = getattr(others, field.name)


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


LAWS = np.array(["power"] * len(POWERS) + ["exponential"] * len(RATES) + ["saturated"] * len(RATES) + ["step"] * STEPS)
NUMBERS = np.array([*POWERS, *RATES, *RATES, *((k + 1) / (STEPS + 1) for k in range(STEPS))])
"""The shapes, powers first."""


@lru_cache(maxsize=64)
def _shapes(windows: int) -> tuple[Array, Array, Array]:
    """Return the means of shapes over windows, shape(windows, shapes), the same less their means, and the sums of squares of these."""
    u = (np.arange(POINTS) + 0.5) / POINTS
    columns = window_means(u, np.array([shape(str(law), float(x), u) for law, x in zip(LAWS, NUMBERS, strict=True)]), windows).T
    shifted = columns - np.mean(columns, axis=0)
    return columns, shifted, np.sum(shifted**2, axis=0)


def secular(means: Array) -> Secular:
    """Return the shapes that fit window means best, by least squares.

    Parameters
    ----------
    means : ndarray, shape(m, windows)
        Tapered means over windows, see :func:`daebench.diagnostics.window_means.window_means`, a row for each error; at least four.
    """
    columns, shifted, squares = _shapes(means.shape[1])
    m = centred(means)
    factors = np.einsum("mw,ws->ms", m, shifted) / squares
    misfits = products(m, m)[:, None] - factors**2 * squares
    # A difference of nearly equal sums of squares: where a shape fits almost exactly, residuals are formed instead.
    for k in np.flatnonzero(np.min(misfits, axis=1) < CANCELLED * products(m, m)):
        misfits[k] = np.sum((m[k, :, None] - shifted * factors[k]) ** 2, axis=0)
    rows = np.arange(len(m))
    best, power = np.argmin(misfits, axis=1), np.argmin(misfits[:, : len(POWERS)], axis=1)
    # Powers are preferred: a step or an exponential has to be clearly better, because noise alone often makes it slightly so.
    best = np.where(misfits[rows, best] < BETTER * misfits[rows, power], best, power)
    factor = factors[rows, best]
    residual = m - shifted.T[best] * factor[:, None]
    # Three numbers of a shape were fitted: shift, factor, and exponent, rate or place.
    scatter = np.sqrt(products(residual, residual) / (m.shape[1] - 3))
    seen = np.ptp(columns.T[best] * factor[:, None], axis=1)
    return Secular(LAWS[best], NUMBERS[best], factor, seen, scatter, correlation(residual), correlation(np.diff(residual)))


def factors(means: Array, best: Secular) -> Array:
    """Return the changes of several errors, fitted with one shape.

    Parameters
    ----------
    means : ndarray, shape(members, windows)
        Window means, a row each.
    best : Secular
        The shape of one error.
    """
    columns = _shapes(means.shape[1])[0]
    column = np.flatnonzero((best.law == LAWS) & (best.number == NUMBERS))
    # A shape with a number from a finer search is in no column; a straight line then has to do.
    fitted = columns[:, column[0]] if len(column) else np.linspace(0, 1, means.shape[1])
    shifted = fitted - np.mean(fitted)
    return np.asarray(means @ shifted / float(shifted @ shifted), dtype=float)
