"""The symmetric projection of a step onto the manifold, HLW V.4.1."""

from typing import Any

from daebench.schemes.kernels.language import INF, H_pp, mass, norm, plain_step, plus_work, zero
from daebench.schemes.kernels.manifold import Point, corrected, correction, normals, shift
from daebench.schemes.kernels.newton import OK, newton
from daebench.schemes.kernels.spaces import Number, Rows, Step, Update, Vector

Guess = tuple[Point, Point, Number, Any, Number, tuple[Any, int, Number]]


def due_at(x: Point, p_free: Vector, q_free: Vector) -> tuple[Point, Number, Number, Number, Number]:
    """Return the correction of x = (p, q, nu, mu), given the step from the shifted start; and size, scale, residual and pivot.

    With the matrix 2 C D^-1 C^T, HLW V.4.1: the step's own derivative is taken as that of the identity.
    """
    return correction(2.0, x, p_free, q_free, H_pp(x[0], x[1]), mass(x[0], x[1]))


def part_of(share: Number, x: Point) -> Point:
    """Return a share of a correction."""
    return share * x[0], share * x[1], share * x[2], share * x[3]


def share_next(due: Point, due_before: Point) -> Number:
    """Return 1/2 if a correction undoes between a half and three halves of the one before, by positions; else 1."""
    return 0.5 if 2.0 * norm(due[1] + due_before[1]) < norm(due_before[1]) else 1.0


def update_symmetric(x: Guess, data: tuple[Vector, Vector, Number, tuple[Rows, Rows, Rows]]) -> Update:
    """One update: the current correction, the step from the resulting start, and the next correction.

    No step is thus wasted: the iteration ends with the update after which no correction remains. Where nearby motions part fast, the true
    derivative of the step is larger than the identity. Corrections then overshoot and undo each other, possibly for ever; from the first
    one that does, only half of each is made.
    """
    state, due, share, work, pivot, _ = x
    p0, q0, h, down0 = data
    state = corrected(state, part_of(share, due))
    by_p, by_q = shift(down0, state[2], state[3])
    p_free, q_free, stage_lam, inner = plain_step(p0 + by_p, q0 + by_q, h)
    left, size, scale, residual, due_pivot = due_at(state, p_free, q_free)
    share = min(share, share_next(left, due))
    # The step inside has its own reports: they travel with the iterate, because an update returns nothing else.
    x = (state, left, share, plus_work(work, inner[3]), min(pivot, inner[2]), (stage_lam, inner[0], inner[1]))
    return x, size, scale, residual if inner[0] == OK else INF, due_pivot


def step(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1, q1, the stage multipliers of the step inside, and a report.

    ::

        x~ = x0 + N(x0) (nu, mu),      x1 = Phi_h(x~) + N(x1) (nu, mu),      g(q1) = 0,      G(q1) H_p(p1, q1) = 0

    where the columns of N(x) = D^-1 C^T span the normal space of the manifold at x. Its metric has a unit of time, 1 s.
    """
    p_free, q_free, stage_lam, inner = plain_step(p0, q0, h)
    first_guess = (p_free, q_free, zero(q0), zero(q0))
    due, _, _, _, due_pivot = due_at(first_guess, p_free, q_free)
    down0 = normals(p0, q0, H_pp(p0, q0), mass(p0, q0))
    # A step that failed has no pivot; its status is reported below.
    settled = inner[2] if inner[0] == OK else INF
    start = (first_guess, due, 1.0 + 0 * h, inner[3], min(due_pivot, settled), (stage_lam, inner[0], inner[1]))
    (state, _, _, work, pivot, last), report = newton(update_symmetric, start, (p0, q0, h, down0))
    status = report[0] if last[1] == OK else last[1]
    residual = report[1] if last[1] == OK else last[2]
    return state[0], state[1], last[0], (status, residual, min(pivot, report[2]), plus_work(work, report[3]))
