"""Synthetic errors of conserved quantities that carry the true change of their mean: a secular part plus what has no trend.

The true change is max |s(t) - s(0)| of the secular part s alone. What is added - oscillations, beats, noise, peaks - has the same mean over
every long time by construction, so the change is known without any window, fit or filter.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SECULARS = ("none", "power", "exponential", "saturating", "step")
OTHERS = ("periodic", "beats", "coloured noise", "round-off", "peaks", "aliased")


@dataclass(frozen=True)
class Series:
    """An error, and the truth about it.

    ``change`` is that of its mean; ``oscillations`` and ``beats`` are the numbers of its periods (infinity of noise, and where there are no
    beats); ``deviation`` is the standard deviation of its means over tenths of the time without the secular part, and ``shift`` the
    change of the secular part between the means over the first and the last tenth.
    """

    name: str
    t: Array
    error: Array
    change: float
    oscillations: float
    beats: float
    deviation: float
    shift: float


def secular_part(random: np.random.Generator, kind: str, u: Array, size: float) -> Array:
    """Return s(u) on scaled times, of modulus ``size`` at most."""
    if kind == "power":
        return size * u ** random.uniform(1, 8)
    if kind == "exponential":
        rate = random.uniform(1, 20)
        return size * np.expm1(rate * u) / np.expm1(rate)
    if kind == "saturating":
        return size * -np.expm1(-random.uniform(1, 40) * u)
    return size * (u >= random.uniform(0.05, 0.95)) if kind == "step" else 0 * u


def other_part(random: np.random.Generator, kind: str, u: Array, periods: float) -> tuple[Array, float]:
    """Return a part of amplitude about 1 without a trend, and the number of periods of its slowest beat."""
    turns = 2 * np.pi * (periods * u + random.random())
    if kind in ("periodic", "aliased"):
        second, third = random.uniform(0, 0.5, 2)
        return np.sin(turns) + second * np.sin(2 * turns + 1) + third * np.sin(3 * turns + 2), np.inf
    if kind == "beats":
        slow = random.uniform(1, max(1.0, min(10, periods / 4)))
        wave = 2 * np.pi * (slow * u + random.random())
        return np.sin(turns) * (1 + random.uniform(0, 0.5) * np.sin(wave)) + random.uniform(0, 0.7) * np.sin(wave + 1), slow
    if kind == "coloured noise":
        return coloured(random, len(u), random.uniform(0, 0.95)), np.inf
    if kind == "round-off":
        step = random.uniform(0.05, 1.0)
        return step * np.round((np.sin(turns) + random.normal(size=len(u)) * random.uniform(0.02, 1)) / step), np.inf
    width = random.uniform(0.03, 0.3)
    return random.choice([-1, 1]) / (1 + (np.sin(turns / 2) / width) ** 2), np.inf


def coloured(random: np.random.Generator, n: int, memory: float) -> Array:
    """Return noise whose neighbours correlate by ``memory``."""
    from scipy.signal import lfilter

    return np.asarray(lfilter([np.sqrt(1 - memory**2)], [1, -memory], random.normal(size=n + 200))[200:])


def draw(random: np.random.Generator, secular: str, other: str, *, most: float = 50.0) -> Series:
    """Return one series: 1 to ``most`` periods, 500 to 5000 samples, and a secular part of 0.001 to 30 times the rest."""
    n = int(10 ** random.uniform(2.7, 3.7))
    periods = random.uniform(1, most)
    if other == "aliased":
        periods = n * random.uniform(0.3, 3)
    u = np.linspace(0, 1, n)
    s = secular_part(random, secular, u, float(random.choice([-1, 1])) * 10 ** random.uniform(-3, 1.5))
    rest, beats = other_part(random, other, u, periods)
    tenths = np.array_split(np.arange(n), 10)
    deviation = float(np.std([np.mean(rest[part]) for part in tenths], ddof=1))
    shift = abs(float(np.mean(s[tenths[-1]]) - np.mean(s[tenths[0]])))
    unit, time = 10 ** random.uniform(-9, 3), 10 ** random.uniform(-1, 4)
    count = np.inf if other == "coloured noise" else periods
    change, error = float(np.max(np.abs(s - s[0]))), s + rest - s[0] - rest[0]
    return Series(f"{secular} + {other}", time * u, unit * error, unit * change, count, beats, unit * deviation, unit * shift)


def walk(random: np.random.Generator) -> Series:
    """Return a single random walk, under an oscillation in half of all cases: it has no secular part, and its mean wanders."""
    n = int(10 ** random.uniform(2.7, 3.7))
    u = np.linspace(0, 1, n)
    steps = np.cumsum(random.normal(size=n)) / np.sqrt(n)
    error = steps + random.choice([0.0, 1.0]) * 10 ** random.uniform(-2, 1) * np.sin(2 * np.pi * random.uniform(20, 50) * u)
    return Series("walk", u, error - error[0], float(np.max(np.abs(steps - steps[0]))), np.inf, np.inf, 0.0, 0.0)
