"""The step sizes of an order study: all meet the common times t = T k/8, h = T/(8 n)."""

import math

from daebench.errors import BadInput, positive, whole

COMMON = 8
"""Number of common times."""

SEQUENCES = {1: (64, 11), 2: (4, 10), 3: (1, 12), 4: (1, 12)}
"""For each order claimed, the steps between common times with which to begin, and how often to halve."""

STEEP = (1, 10)
"""The same for all higher orders, with three steps between the halvings."""

MOST_STEPS = 2**32
"""Steps of a run at most: more take too long, and round-off rules long before."""


def step_sizes(t_end: float, claimed: int | None, h: float | None = None, halvings: int | None = None) -> list[int]:
    """Return the numbers of steps n from one common time to the next, coarsest first: h = t_end/(8 n)."""
    n, times = SEQUENCES.get(claimed or 2, STEEP)
    if h is not None:
        n = _steps_between(t_end, positive("h", h))
    if halvings is not None:
        times = whole("halvings", halvings)
    if times < 2:
        raise BadInput(f"halvings = {times} must be at least 2: an order needs three step sizes.")
    if times > math.log2(MOST_STEPS) or COMMON * n * 2**times > MOST_STEPS:
        raise BadInput(f"h = {t_end / (COMMON * n):g}, halved {times} times, makes more than 2^32 steps; halve it less often.")
    counts = [n * 2**k for k in range(times + 1)]
    if halvings is None and claimed not in SEQUENCES:
        counts = sorted({count * k // 4 for count in counts[:-1] for k in range(4, 8) if count * k % 4 == 0} | {counts[-1]})
    return counts


def _steps_between(t_end: float, h: float) -> int:
    ratio = t_end / (COMMON * h)
    if ratio < 1 - 1e-9:
        raise BadInput(
            f"h = {h:g} is larger than t_end/8 = {t_end / COMMON:g}, and errors are taken at every eighth of t_end = {t_end:g}; "
            "give a smaller h or a larger end time."
        )
    return math.ceil(min(ratio, MOST_STEPS) - 1e-9)
