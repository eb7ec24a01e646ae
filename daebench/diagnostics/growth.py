"""The law of a secular part with its interval: the exponent of a power of t, or the limit of what saturates, from means over windows."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from daebench.diagnostics.oscillations import centred, correlation, products
from daebench.diagnostics.secular import POINTS, shape
from daebench.diagnostics.window_means import MOST, window_means
from daebench.runs.trajectory import Array
from daebench.systems.lazily import scipy

NAN, INFINITE = float("nan"), float("inf")

FEWEST = 5
"""Fewest windows of two oscillations each from which a law is read; if there are fewer, it is read from the largest number of windows, and
the oscillation counts as their error."""

RANGES = {"power": (0.1, 10.0), "exponential": (0.5, 100.0), "saturated": (0.5, 400.0), "step": (1 / 64, 63 / 64)}
"""Ranges of the search: exponents, rates times the whole time, and places as fractions of the whole time."""

TRIED, FINER, ROUGHLY = 60, 4, 1
"""Numbers tried in a range; refinements between the neighbours of the best one; and refinements if only the sum of squares is needed."""

CONFIDENCE = 0.95
"""Level of the intervals."""

REJECTED = 0.99
"""Level at which a power of t has to be rejected beside another shape."""

SLOWER = 3.0
"""Rates of a fast saturation are sought from the rate at which half of the change is reached, divided by this."""

OVERLAP = 1 / 6
"""Correlation of neighbouring windows of noise, which have half of their samples in common."""

SLOWEST = 0.95
"""Largest correlation of neighbouring windows that is assumed."""

NUMBERS = 3
"""Numbers of a law: a shift, a factor, and an exponent, rate or place."""

CLEARER = 0.1
"""If the fit to the later half of the windows leaves less than this part of its share of the sum of squares, the interval includes its
exponent: the beginning then does not follow the law."""

RESOLVED = 1e-6
"""Relative accuracy of an exponent, and so the least half width of its interval."""

LEAST_FREEDOM = 2.0
"""Fewest degrees of freedom of the scatter of window means."""


@dataclass(frozen=True)
class Law:
    """The law of a secular part.

    Parameters
    ----------
    name : str
        "power", "exponential", "saturated" or "step".
    exponent, exponent_low, exponent_high : float
        Exponent of the power of t that fits best, and the ends of its interval of 95 %; an end at 0.1 or 10 is open. NaN where no power of
        t fits.
    limit, limit_low, limit_high : float
        Limit of what saturates and the ends of its interval of 95 %, one of them infinite where it may have no limit; otherwise NaN.
    """

    name: str
    exponent: float = NAN
    exponent_low: float = NAN
    exponent_high: float = NAN
    limit: float = NAN
    limit_low: float = NAN
    limit_high: float = NAN


def law(t: Array, error: Array, *, windows: int = MOST, resolution: float = 0.0, leak: float = 0.0, fast: bool = False) -> Law:
    """Return the law of the secular part of an error, by its tapered means over windows of equal length.

    Each of the shapes t^a, exp(k t), 1 - exp(-k t) and a step is fitted by least squares. A power of t is rejected where another one leaves
    a sum of squares that is smaller by more than the F distribution allows at 99 %. The interval of its exponent are all those that the
    distribution allows at 95 %, and likewise that of a limit::

        S(a) <= S_min (1 + F / n) + w l^2 / 2        n = (w - 3) (1 - r) / (1 + r),        nu = w (1 - r^2) / (1 + r^2) - 3

    with w windows, whose deviations from the law correlate by r with their neighbours, 3 numbers of a law, and the quantile F of one and nu
    degrees of freedom: correlated means are worth fewer of a mean, and of a variance. What the windows leave of an oscillation, l at most,
    may follow a slow beat that a law takes for its own.

    Parameters
    ----------
    t, error : ndarray, shape(n,)
        Times, increasing and about equally spaced, and errors, finite; n is at least 32.
    windows : int
        How many windows hold two oscillations each.
    resolution : float
        Round-off of one value of the error.
    leak : float
        Largest part of the oscillation that a window mean leaves.
    fast : bool
        Whether it saturates and begins with its fastest change, which windows are too long for.
    """
    u = (t - t[0]) / (t[-1] - t[0])
    means = window_means(u, error, windows)
    # Rounding of the means: below it one shape fits no better than another, and no interval may be narrower.
    floor = len(means) * max(resolution, 8 * float(np.finfo(float).eps) * float(np.max(np.abs(error)))) ** 2
    beat = len(means) * leak**2 / 2
    if fast:
        return _saturated(means, floor, beat, least=_slowest_rate(u, error))
    fits = {name: _Fit.of(name, means, floor) for name in RANGES}
    name = min(fits, key=lambda shape: fits[shape].left)
    best = fits[name]
    if fits["power"].left <= best.left * (1 + best.allowed(REJECTED)) + beat:
        return Law("power", fits["power"].number, *_exponents(means, floor, beat, fits["power"]))
    return _saturated(means, floor, beat) if name == "saturated" else Law(name)


@dataclass(frozen=True)
class _Fit:
    """The best shape of a kind: its number, the sum of squares that it leaves, and how many windows there are and correlate."""

    number: float
    left: float
    windows: int
    alike: float

    @classmethod
    def of(cls, kind: str, means: Array, floor: float) -> "_Fit":
        tried = _grid(*RANGES[kind])
        for finer in range((FINER if kind == "power" else ROUGHLY) + 1):
            columns = _columns(kind, tuple(tried.tolist()), len(means)) if finer == 0 else _averaged(kind, tried, len(means))
            residuals = _residuals(means, columns)
            squares = products(residuals, residuals)
            best = int(np.argmin(squares))
            number, residual = float(tried[best]), residuals[best]
            tried = np.linspace(tried[max(best - 1, 0)], tried[min(best + 1, len(tried) - 1)], TRIED)
        return cls(number, floor + float(squares[best]), len(means), _alike(residual, floor))

    def allowed(self, level: float) -> float:
        """Return the allowed relative excess of the sum of squares for another number."""
        w, r = self.windows, self.alike
        freedom = max(LEAST_FREEDOM, w * (1 - r**2) / (1 + r**2) - NUMBERS)
        return float(scipy.special.fdtri(1.0, freedom, level)) / ((w - NUMBERS) * (1 - r) / (1 + r))


def _alike(residual: Array, floor: float) -> float:
    """Return the correlation of neighbouring window means about a law, corrected for the fit."""
    alike = float(correlation(residual)) if float(products(residual, residual)) > floor else 0.0
    # Fitted numbers make residuals look less correlated, by about 2/w; windows that overlap by half correlate by 1/6 at least.
    return min(max(alike + 2 / len(residual), OVERLAP), SLOWEST)


def _grid(low: float, high: float) -> Array:
    return np.geomspace(low, high, TRIED)


@lru_cache(maxsize=256)
def _columns(kind: str, numbers: tuple[float, ...], windows: int) -> Array:
    return _averaged(kind, np.array(numbers), windows)


def _averaged(kind: str, numbers: Array, windows: int) -> Array:
    """Return the means of shapes over windows, shape(numbers, windows)."""
    u = (np.arange(POINTS) + 0.5) / POINTS
    return window_means(u, np.array([shape(kind, float(x), u) for x in numbers]), windows)


def _residuals(means: Array, columns: Array) -> Array:
    """Return the residuals of window means by each shape, with the best shift and factor."""
    m, shifted = centred(means), centred(columns)
    squares = products(shifted, shifted)
    return np.asarray(m - (shifted @ m / np.where(squares > 0, squares, 1.0))[:, None] * shifted)


def _exponents(means: Array, floor: float, beat: float, best: _Fit) -> tuple[float, float]:
    """Return the ends of the interval of an exponent."""
    most = best.left * (1 + best.allowed(CONFIDENCE)) + beat

    def excess(exponent: float) -> float:
        residual = _residuals(means, _averaged("power", np.array([exponent]), len(means)))[0]
        return floor + float(residual @ residual) - most

    # The interval is never narrower than the search resolves.
    inside = [best.number * (1 - RESOLVED), best.number * (1 + RESOLVED)]
    later, left = _later(means)
    # The later half has half of the windows, so that twice its sum of squares is compared.
    if 2 * left < CLEARER * best.left:
        inside.append(later)
    ends = [_end(excess, best.number, last) for last in RANGES["power"]]
    return min(*ends, *inside), max(*ends, *inside)


def _later(means: Array) -> tuple[float, float]:
    """Return the exponent that fits the later half of the windows best, and the sum of squares that it leaves."""
    half, tried = len(means) // 2, _grid(*RANGES["power"])
    for _ in range(FINER):
        left = _residuals(means[half:], _averaged("power", tried, len(means))[:, half:])
        best = int(np.argmin(products(left, left)))
        number, squares = float(tried[best]), float(products(left, left)[best])
        tried = np.linspace(tried[max(best - 1, 0)], tried[min(best + 1, len(tried) - 1)], TRIED)
    return number, squares


def _end(excess: Callable[[float], float], inside: float, last: float) -> float:
    """Return the number at which an excess becomes positive, between one inside of an interval and the last; the last if it does not."""
    if excess(inside) >= 0:
        return inside
    # In steps first: the excess need not grow all the way, and the first crossing is the end of the interval.
    tried = np.geomspace(inside, last, TRIED // 3)
    previous = inside
    for number in map(float, tried[1:]):
        if excess(number) > 0:
            return float(scipy.optimize.brentq(excess, previous, number, rtol=1e-6))
        previous = number
    return last


def _saturated(means: Array, floor: float, beat: float, least: float = RANGES["saturated"][0]) -> Law:
    """Return the limit L of a + c s(t) with the saturating shape s, and all limits that some rate allows."""
    tried = _grid(least, RANGES["saturated"][1])
    fits: list[Array] = []
    for _ in range(FINER + 1):
        fits.append(_limits(means, tried))
        best = int(np.argmin(fits[-1][1]))
        tried = np.linspace(tried[max(best - 1, 0)], tried[min(best + 1, len(tried) - 1)], TRIED)
    limit, squares, spread, outwards, rates = np.concatenate(fits, axis=1)
    first = int(np.argmin(squares))
    residual = _residuals(means, _averaged("saturated", rates[[first]], len(means)))[0]
    fit = _Fit(rates[first], floor + squares[first], len(means), _alike(residual, floor))
    room = fit.left * (1 + fit.allowed(CONFIDENCE)) + beat - floor - squares
    within = room >= 0
    reach = spread[within] * np.sqrt(room[within])
    low, high = float(np.min(limit[within] - reach)), float(np.max(limit[within] + reach))
    # A rate as small as that is no saturation within the run: the limit is open on the side of the change.
    if np.min(rates[within]) <= RANGES["saturated"][0]:
        low, high = (low, INFINITE) if outwards[first] > 0 else (-INFINITE, high)
    return Law("saturated", limit=float(limit[first]), limit_low=low, limit_high=high)


def _slowest_rate(u: Array, error: Array) -> float:
    """Return the smallest rate of a fast change, by the time at which half of it is reached."""
    from_start = np.abs(error - error[0])
    half = int(np.argmax(from_start > np.mean(from_start[len(u) // 2 :]) / 2))
    slowest = np.log(2) / (SLOWER * max(float(u[half]), float(u[1])))
    low, high = RANGES["saturated"]
    return min(max(float(slowest), low), high / 2)


def _limits(means: Array, rates: Array) -> Array:
    """Return limits, the sums of squares left, the standard deviations of the limits for means of unit variance, the changes, and rates."""
    limits = []
    for rate, column in zip(rates, _averaged("saturated", rates, len(means)), strict=True):
        left = 1 + column * np.expm1(-rate)  # exp(-k u), averaged over windows: 1 at the start, 0 in the limit
        A = np.column_stack([np.ones_like(left), -left])
        # For a slow rate the columns are nearly parallel, so that the limit is not determined; for a fast one the second is zero.
        inverse = np.linalg.pinv(A, rcond=1e-12)
        limit, change = inverse @ means
        residual = means - A @ (limit, change)
        limits.append((limit, residual @ residual, np.linalg.norm(inverse[0]), change, rate))
    return np.array(limits).T
