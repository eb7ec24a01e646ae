"""Whether a step landed on the motion's own branch of g = 0: the root to which the multiplier leads from 0 as the step grows from 0.

Where g = 0 bends, the line q0 + dq - V^T nu of a step meets it at several points, and an iteration may end at any of them. The motion's
own root is near the point where the linearised constraint puts the step, unless the step is large. A step is therefore judged first by
quantities that are known. It is in doubt if it is far from that point, or if the normals turn far between its ends; few steps are. Such a
step is walked from q0 in small parts. It is reported as another branch if the walk ends elsewhere, or if the branch ends on the way.
"""

from collections.abc import Callable
from typing import Any, TypeVar

from daebench.schemes.kernels.language import (
    EPS,
    EXTENDED,
    FREE,
    INF,
    ON_VELOCITIES,
    G,
    dot,
    g,
    norm,
    plus_work,
    rate_of_time,
    solve,
    tally,
)
from daebench.schemes.kernels.newton import OK, judge
from daebench.schemes.kernels.spaces import LENGTH, Jacobian, Multiplier, Number, Report, Rows, Update, Vector

X = TypeVar("X")
ANOTHER_BRANCH = 9
PARTS = 32
"""Parts of a step that is walked; a power of two, so that they add up to it."""

PART = 0.03125
"""Fraction of a step that is one part, 1 / PARTS."""

ENDS = 16.0
"""Correction in a walk, relative to a part, above which the branch has ended: at most 4 on right steps, nearly always over 24 at ends."""

# 2^-20: a power of two, so that a change of units by powers of two leaves every digit of a run as it is.
START = 9.5367431640625e-07
"""Correction, relative to the length of the problem, below which no end is concluded: a start may be off its branch by this much."""


if EXTENDED:

    def still(x: Vector, q: Vector) -> Vector:
        """Return the change x of positions without that of the time, which no constraint force changes."""
        e = rate_of_time(q)
        return x - dot(e, x) * e

else:

    def still(x: Vector, q: Vector) -> Vector:
        """Return the change x of positions."""
        return x


def floor(q: Vector) -> Number:
    """Return the distance below which two positions differ by the rounding of an iteration that no longer improves."""
    # Newton's iteration may end within 1e4 roundings where it no longer improves: nearer roots are one root.
    return 10000.0 * EPS * max(LENGTH, norm(q))


def reach(q: Vector, tolerance: Number) -> Number:
    """Return the same distance for an iteration that ends by a tolerance: ten times the error that it leaves in positions."""
    return max(floor(q), 10.0 * tolerance * max(LENGTH, norm(q)))


if FREE or ON_VELOCITIES:

    def doubt(q0: Vector, G0: Jacobian, tangent: Vector, dq: Vector, d: Multiplier, near: Number) -> Number:
        """Return a negative number: without constraints there are no branches, and beside constraints on velocities none is looked for."""
        return -near

else:

    def doubt(q0: Vector, G0: Jacobian, tangent: Vector, dq: Vector, d: Multiplier, near: Number) -> Number:
        """Return a positive number if a step from q0 needs a walk; the step is ``tangent`` plus a part b due to the multiplier d.

        It needs none if |b| is at most ``near``, the distance within which two roots are the same.

        ::

            |b| <= |tangent| / 2,        |d^T G1 b - d^T G0 b| <= |d^T G0 b| / 2,        b = dq - tangent,        G1 = G(q0 + dq)

        d^T G0 b is -d^T G0 M^-1 G0^T d: in the direction of the correction, G1 M^-1 G0^T has to be between one and three halves of
        G0 M^-1 G0^T. If g is quadratic, (G1 + G1') M^-1 G0^T is singular for two roots on one line, so that both cannot be near
        G0 M^-1 G0^T. A step whose tangent is longer than q0 is in doubt, too: the branch may end on the way, another begin near its end.
        """
        b = dq - tangent
        G1 = G(q0 + dq)
        straight, turned = dot(G0.T @ d, b), dot(G1.T @ d, b)
        far, way = norm(still(b, q0)), norm(still(tangent, q0))
        excess = max(max(far - way / 2, abs(turned - straight) - abs(straight) / 2), way - max(LENGTH, norm(q0)))
        return min(far - near, excess)


def walked(update: Callable[..., tuple[X, Number, Number, Number, Number]], x: X, data: Any, unsure: Number) -> tuple[X, Report]:
    """Return x after one ``update`` for each part of a step, and a report; x as it is unless ``unsure`` is positive."""
    residual = INF
    pivot = INF
    for part in range(1, PARTS + 1):
        if not unsure > 0.0:
            return x, (OK, residual, pivot, tally(update, part - 1))
        x, size, _, residual, pivot = update(x, data)
        status = judge(residual, pivot, size)
        if status != OK:
            return x, (status, residual, pivot, tally(update, part))
    return x, (OK, residual, pivot, tally(update, PARTS))


def landed(report: Report, walk: Report, unsure: Number, apart: Number, most: Number) -> Report:
    """Return the report of a step and its walk: ANOTHER_BRANCH if they ended apart by more than ``most``, or the walk ended early."""
    if report[0] == OK and unsure > 0.0 and not (walk[0] == OK and apart <= most):
        return ANOTHER_BRANCH, apart, report[2], plus_work(report[3], walk[3])
    return report[0], report[1], report[2], plus_work(report[3], walk[3])


def settled_on(tangent: Vector, dq: Vector, end: Vector, unsure: Number, walk: Report, report: Report, near: Number) -> Report:
    """Return the report of a step by dq: ANOTHER_BRANCH if its walk ended at another increment of q."""
    return landed(report, walk, unsure, norm(end - dq), norm(dq - tangent) / 8 + near)


def goes_on(off: Number, part: Number, scale: Number) -> Number:
    """Return a number that is negative if the last part of a walk needed so large a correction that its branch has ended."""
    return 1 - off / (ENDS * part + START * scale)


def update_walk(dq: Vector, data: tuple[Vector, Rows, Vector]) -> Update:
    """Walk on by a part of the tangent: one Newton update for g = 0 at its end, linearised at q0 + dq.

    Where the branch ends, the pivot is negative, which ends the walk: beyond that point it would follow another branch.
    """
    q0, V, part = data
    q = q0 + dq
    G1 = G(q)
    value = g(q) + G1 @ part
    change, pivot = solve(G1 @ V.T, value)
    back = V.T @ change
    dq = dq + part - back
    scale = max(LENGTH, norm(q))
    return dq, norm(dq), scale, norm(value), min(pivot, goes_on(norm(back), norm(part), scale))


def on_branch(q0: Vector, G0: Jacobian, V: Rows, tangent: Vector, dq: Vector, d: Multiplier, report: Report, near: Number) -> Report:
    """Return the report of a root dq = tangent - V^T d of g(q0 + dq) = 0: ANOTHER_BRANCH if tau tangent leads to another root."""
    unsure = doubt(q0, G0, tangent, dq, d, near)
    end, walk = walked(update_walk, 0 * dq, (q0, V, tangent / 32), unsure)
    return settled_on(tangent, dq, end, unsure, walk, report, near)
