"""The only loop over steps: it stores, watches and stops; a step is a map and knows nothing of it."""

from typing import Any

from daebench.kernels.hole import (
    INF,
    MULTISTEP,
    Number,
    Vector,
    no_work,
    norm,
    plus_work,
    start,
    step,
    store,
    total,
    watch,
    watched,
    worst,
)
from daebench.kernels.newton import NOT_FINITE, OK

WATCH_NOT_FINITE = 4

if MULTISTEP:

    def advance(p: Vector, q: Vector, memory: Any, h: Number) -> Any:
        """Return the next p, q, memory and a report."""
        return step(p, q, memory, h)  # type: ignore[call-arg]

    def begin(p: Vector, q: Vector, h: Number) -> Any:
        """Return the memory that the first step needs, and a report."""
        return start(p, q, h)

else:

    def advance(p: Vector, q: Vector, memory: Any, h: Number) -> Any:
        """Return the next p, q, memory and a report."""
        p1, q1, report = step(p, q, h)
        return p1, q1, memory, report


def first(p: Vector, q: Vector) -> tuple[Number, ...]:
    """Return the conserved quantities that the run watches, at the start."""
    return watched(p, q)


def integrate(
    p: Vector,
    q: Vector,
    memory: Any,
    conserved: tuple[Number, ...],
    maxima: tuple[Number, ...],
    pivot: Number,
    h: Number,
    steps: int,
    left: int,
    every: int,
    P: Any,
    Q: Any,
) -> Any:
    """Take so many steps of size h, storing a state when ``left`` steps are done and then after every ``every``.

    Returns the last good state and memory, the maxima of what is watched, the smallest pivot, the steps done, the rows stored,
    the steps left until the next output, Newton's work, and the last report.
    """
    row = 0
    work = no_work()
    report = (OK, 0.0 * pivot, pivot, work)
    for k in range(steps):
        p1, q1, memory1, report = advance(p, q, memory, h)
        work = plus_work(work, report[3])
        if report[0] == OK and not norm(p1) + norm(q1) < INF:
            report = (NOT_FINITE, INF, report[2], report[3])
        larger = worst(maxima, watch(p1, q1, conserved))
        if report[0] == OK and not total(larger) < INF:
            report = (WATCH_NOT_FINITE, INF, report[2], report[3])
        if report[0] != OK:
            return p, q, memory, maxima, pivot, k, row, left, work, report
        p, q, memory, maxima = p1, q1, memory1, larger
        pivot = min(pivot, report[2])
        left -= 1
        if left == 0:
            store(P, Q, row, p, q)
            row += 1
            left = every
    return p, q, memory, maxima, pivot, steps, row, left, work, report
