"""Stage multipliers of a scheme: what its steps computed, and the times that this belongs to."""

from collections.abc import Mapping

import numpy as np

from daebench.runs.trajectory import Array

MEAN = "mean"
"""Name of the mean of the last multiplier of a step and the first of the next: (mu_{n-1} + lam_n)/2 of RATTLE."""


def stage_multipliers(nodes: Mapping[str, float], rows: Array, h: float, m: int) -> dict[str, tuple[Array, Array]]:
    """Return times and values of each stage multiplier, and of the mean where two steps meet.

    Parameters
    ----------
    nodes : mapping of str to float
        Names in the order in which a step returns them, each with its node c: it belongs to t_n + c h.
    rows : ndarray, shape(steps, k m)
        What the steps returned, one after another.
    h : float
        Step size.
    m : int
        Number of constraints.

    Returns
    -------
    dict of str to (ndarray, shape(n,), ndarray, shape(n, m))
        With ``mean`` for a scheme whose first multiplier belongs to the start of a step and whose last to its end: of first
        order each with RATTLE, the mean of the two that meet at t_n is of second.
    """
    n = np.arange(len(rows), dtype=float)
    series = {name: ((n + c) * h, rows[:, k * m : (k + 1) * m]) for k, (name, c) in enumerate(nodes.items())}
    ends = list(nodes.items())
    if len(ends) > 1 and ends[0][1] == 0.0 and ends[-1][1] == 1.0:
        series[MEAN] = (n[1:] * h, (series[ends[-1][0]][1][:-1] + series[ends[0][0]][1][1:]) / 2)
    return series
