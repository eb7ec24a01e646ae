"""The only loop over steps: it composes, stores, watches and stops; a step is a map and knows nothing of it."""

from typing import Any

from daebench.kernels.hole import (
    COMPENSATED,
    COMPOSED,
    INF,
    LOCAL,
    MULTISTEP,
    PROJECTED,
    Number,
    Report,
    Vector,
    chart,
    increment,
    no_work,
    norm,
    plus_work,
    scale,
    start,
    step,
    store,
    total,
    watch,
    watched,
    worst,
)
from daebench.kernels.manifold import project
from daebench.kernels.newton import NOT_FINITE, OK, both
from daebench.kernels.summation import add

WATCH_NOT_FINITE = 4

if MULTISTEP:

    def one(p: Vector, q: Vector, memory: Any, h: Number) -> Any:
        """Return the next p, q, memory, the raw multipliers and a report."""
        return step(p, q, memory, h)  # type: ignore[call-arg]

    def begin(p: Vector, q: Vector, h: Number) -> Any:
        """Return the memory that the first step needs, and a report."""
        return start(p, q, h)

elif COMPENSATED:

    def one(p: Vector, q: Vector, memory: Any, h: Number) -> Any:
        """Return the next p, q, what rounding left of their sums, the raw multipliers and a report."""
        dp, dq, raw, report = increment(p, q, h)
        p1, low_p = add(p, memory[0], dp)
        q1, low_q = add(q, memory[1], dq)
        return p1, q1, (low_p, low_q), raw, report

    def begin(p: Vector, q: Vector, h: Number) -> Any:
        """Return what rounding has left so far: nothing; and a report."""
        return (scale(0.0 * h, p), scale(0.0 * h, q)), (OK, 0.0 * h, INF, no_work())

else:

    def one(p: Vector, q: Vector, memory: Any, h: Number) -> Any:
        """Return the next p, q, memory, the raw multipliers and a report."""
        p1, q1, raw, report = step(p, q, h)
        return p1, q1, memory, raw, report


if COMPOSED:

    def advance(p: Vector, q: Vector, memory: Any, h: Number, weights: Any) -> Any:
        """Return what ``one`` returns for substeps of weights[0] h, weights[1] h, ... in a row, and how many were tried."""
        pivot, work = INF, no_work()
        for stage in range(len(weights)):
            p, q, memory, raw, report = one(p, q, memory, weights[stage] * h)
            pivot, work = min(pivot, report[2]), plus_work(work, report[3])
            if report[0] != OK:
                return p, q, memory, raw, (report[0], report[1], pivot, work), stage + 1
        return p, q, memory, raw, (report[0], report[1], pivot, work), len(weights)

else:

    def advance(p: Vector, q: Vector, memory: Any, h: Number, weights: Any) -> Any:
        """Return what ``one`` returns, and that it was one substep."""
        p1, q1, memory1, raw, report = one(p, q, memory, h)
        return p1, q1, memory1, raw, report, 1


if PROJECTED:

    def finish(p: Vector, q: Vector, report: Report) -> Any:
        """Return the projection of a state onto the manifold, and the report of everything up to there."""
        p1, q1, settled = project(p, q)
        return p1, q1, both(report, settled)

else:

    def finish(p: Vector, q: Vector, report: Report) -> Any:
        """Return p, q and the report as they are."""
        return p, q, report


if LOCAL:

    def seen(p: Vector, q: Vector) -> Any:
        """Return the state (p, q) at the local coordinates that the scheme computes in."""
        return chart(p, q)

else:

    def seen(p: Vector, q: Vector) -> Any:
        """Return p and q, which the scheme computes in."""
        return p, q


def first(p: Vector, q: Vector) -> tuple[Number, ...]:
    """Return the conserved quantities that the run watches, at the start."""
    p, q = seen(p, q)
    return watched(p, q)


def integrate(
    p: Vector,
    q: Vector,
    memory: Any,
    conserved: tuple[Number, ...],
    maxima: tuple[Number, ...],
    pivot: Number,
    h: Number,
    weights: Any,
    steps: int,
    left: int,
    every: int,
    P: Any,
    Q: Any,
    R: Any,
) -> Any:
    """Take so many steps of size h, storing a state when ``left`` steps are done and then after every ``every``.

    Returns the last good state and memory, the maxima of what is watched, the smallest pivot, the steps done, the rows stored,
    the steps left until the next output, Newton's work, the substeps tried in the last step, and the last report; the number tried is
    negative where it was not one of them that failed but what comes after.
    """
    row = 0
    work = no_work()
    report = (OK, 0.0 * pivot, pivot, work)
    tried = 0
    for k in range(steps):
        p1, q1, memory1, raw, report, tried = advance(p, q, memory, h, weights)
        stepped = report[0]
        p1, q1, report = finish(p1, q1, report)
        work = plus_work(work, report[3])
        if report[0] == OK and not norm(p1) + norm(q1) < INF:
            report = (NOT_FINITE, INF, report[2], report[3])
        p_seen, q_seen = seen(p1, q1)
        larger = worst(maxima, watch(p_seen, q_seen, conserved))
        if report[0] == OK and not total(larger) < INF:
            report = (WATCH_NOT_FINITE, INF, report[2], report[3])
        if report[0] != OK:
            return p, q, memory, maxima, pivot, k, row, left, work, tried if stepped != OK else -tried, report
        p, q, memory, maxima = p1, q1, memory1, larger
        pivot = min(pivot, report[2])
        left -= 1
        if left == 0:
            store(P, Q, R, row, p_seen, q_seen, raw)
            row += 1
            left = every
    return p, q, memory, maxima, pivot, steps, row, left, work, tried, report
