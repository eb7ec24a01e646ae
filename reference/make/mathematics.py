"""Functions of a problem of either kind that certification evaluates, and the times at which its matrix loses rank."""

from collections.abc import Callable

import mpmath as mp
import numpy as np

from daebench.reference.keep.definition import Definition
from daebench.reference.make.constrained import Constrained
from daebench.reference.make.poisson import Poisson
from daebench.runs.ivp import Array

Mathematics = Constrained | Poisson
"""One definition at mpmath's working precision, and its equations in quadruple precision."""

KINDS: dict[str, type[Mathematics]] = {"constrained": Constrained, "poisson": Poisson}


def mathematics(definition: Definition) -> Mathematics:
    """Return the mathematics of a definition."""
    return KINDS[definition.ivp.facts.KIND](definition)


DIGITS = 30
"""Decimal digits of the examined states."""

VANISHED = 1e-12
"""Fraction of the largest smallest singular value below which it counts as zero. It has a double zero, and is subject to rounding."""

NARROWINGS = 20
"""Number of golden sections of the time between three outputs. The final interval is 7e-5 of it; there the square root of the smallest
singular value consists of two straight lines that meet at zero."""

GOLDEN = (5**0.5 - 1) / 2


def rank_losses(system: Mathematics, t: Array, singular: Array) -> list[float]:
    """Return the times of rank loss, s, to nine digits.

    Each is searched for on both sides of an output at which the smallest singular value is not above that of its neighbours. Outputs must
    therefore be close enough to have one between two losses.

    Shapes: t (n,); singular (n,).
    """

    def root(x: float) -> float:
        return float(np.sqrt(system.smallest_singular_value(system.exact([mp.mpf(0), mp.mpf(x)])[1])))

    padded = np.concatenate([[np.inf], singular, [np.inf]])
    lows = np.flatnonzero((singular <= padded[:-2]) & (singular <= padded[2:]))
    with mp.workdps(DIGITS):
        when = [_lowest(root, float(t[max(k - 1, 0)]), float(t[min(k + 1, len(t) - 1)])) for k in map(int, lows)]
        lost = {float(f"{x:.9g}") for x in when if root(x) ** 2 < VANISHED * singular.max()}
    return sorted(lost)


def _lowest(f: Callable[[float], float], a: float, b: float) -> float:
    """Return the zero between a and b of a function that consists of two almost straight lines that meet there."""
    x, y = b - GOLDEN * (b - a), a + GOLDEN * (b - a)
    f_x, f_y = f(x), f(y)
    for _ in range(NARROWINGS):
        if f_x < f_y:
            b, y, f_y = y, x, f_x
            x = b - GOLDEN * (b - a)
            f_x = f(x)
        else:
            a, x, f_x = x, y, f_y
            y = a + GOLDEN * (b - a)
            f_y = f(y)
    f_a, f_b = f(a), f(b)
    return (a * f_b + b * f_a) / (f_a + f_b)
