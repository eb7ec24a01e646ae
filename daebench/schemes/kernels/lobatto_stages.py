"""The stages of Lobatto IIIA-IIIB, HLW VII.1.5, by an iteration in increments that omits the derivatives of the forces.

Its matrix is exact in the multipliers. The omitted terms make the convergence linear with a factor O(h^2), and O(h) if H_p depends on q.
For somewhat larger steps Newton's full matrix still converges, but to other solutions than those that continue from smaller steps: for
lobatto3 on the spherical pendulum, case fig1.2, from h = 0.35 on, with energy errors of 0.1 to 0.3 instead of 0.037 at h = 0.34. ``DATA``
is what :func:`daebench.schemes.lobatto.numbers` returns: A, A^, the matrix N with c_i N = A A^, b and c.
"""

from typing import Any

from daebench.schemes.kernels.branch import doubt, floor, goes_on, settled_on, walked
from daebench.schemes.kernels.constrain import tangential
from daebench.schemes.kernels.language import (
    ON_VELOCITIES,
    SEPARABLE,
    STAGES,
    A,
    G,
    H_p,
    H_pp,
    H_q,
    g,
    norm,
    rows,
    solve_stages_but_one,
    zero,
)
from daebench.schemes.kernels.newton import newton
from daebench.schemes.kernels.spaces import DATA, LENGTH, Data, Jacobian, Multiplier, Number, Report, Rows, Update, Vector
from daebench.schemes.kernels.stages import places, weighted, weighted_but_last

Points = tuple[Vector, ...]
Multipliers = tuple[Multiplier, ...]
Start = tuple[Vector, Vector, Jacobian, Number]

PART = 0.046875
"""Fraction by which a step grows in its walk: it is whole after 22 of 32 updates, and the others let it converge."""


def positions(q0: Vector, dQ: tuple[Vector, ...]) -> tuple[Vector, ...]:
    """Return Q_1 = q0, Q_2, ..., Q_s."""
    return (q0, *tuple(q0 + dQ[i] for i in range(STAGES - 1)))


def jacobians(G0: Jacobian, Q: tuple[Vector, ...]) -> tuple[Jacobian, ...]:
    """Return G at every stage."""
    return (G0, *tuple(G(Q[i]) for i in range(1, STAGES)))


def forces(P: Points, Q: Points, J: tuple[Jacobian, ...], Lam: Multipliers) -> Points:
    """Return H_q + G^T Lam at every stage but the last."""
    return tuple(H_q(P[k], Q[k]) + J[k].T @ Lam[k] for k in range(STAGES - 1))


def total(weights: Data, values: Multipliers) -> Multiplier:
    """Return sum_j weights_j values_j over all stages."""
    x = weights[0] * values[0]
    for j in range(1, STAGES):
        x = x + weights[j] * values[j]
    return x


if ON_VELOCITIES:

    def values(h: Number, dQ: Points, free: Points, V: Points, Q: Points, J: tuple[Jacobian, ...]) -> Multipliers:
        """Return g(Q_i) + G(Q_i) (free_i - dQ_i), and for constraints on velocities h sum_j a_ij A(Q_j) V_j, i = 2 ... s."""
        rates = tuple(A(Q[i]) @ V[i] for i in range(STAGES))
        on_positions = tuple((J[i + 1] - A(Q[i + 1])) @ (free[i] - dQ[i]) + g(Q[i + 1]) for i in range(STAGES - 1))
        return tuple(on_positions[i] + h * total(DATA[0][i + 1], rates) for i in range(STAGES - 1))

else:

    def values(h: Number, dQ: Points, free: Points, V: Points, Q: Points, J: tuple[Jacobian, ...]) -> Multipliers:
        """Return g(Q_i) + G(Q_i) (free_i - dQ_i), i = 2 ... s."""
        return tuple(J[i + 1] @ (free[i] - dQ[i]) + g(Q[i + 1]) for i in range(STAGES - 1))


def correct(
    h: Number, dQ: Points, free: Points, V: Points, Q: Points, J: tuple[Jacobian, ...], R: tuple[Rows, ...]
) -> tuple[Multipliers, Points, Number, Number]:
    """Return the changes of the multipliers for which g(Q_i) = 0 to first order, the Q_i - q0 that follow, |g| and a pivot.

    ::

        g(Q_i) + G(Q_i) (free_i - dQ_i - h^2 sum_k (A A^)_ik M^-1 G(Q_k)^T change_k) = 0,      i = 2 ... s,  k = 1 ... s-1

    with G(Q_k) M^-1 in R_k, and V_j the velocities that lead to free_i.
    """
    w = tuple(h * h * DATA[4][i] for i in range(STAGES))
    value = values(h, dQ, free, V, Q, J)
    B = tuple(tuple(w[i] * DATA[2][i][k] * J[i] @ R[k].T for k in range(STAGES - 1)) for i in range(1, STAGES))
    change, pivot = solve_stages_but_one(B, value)
    back = tuple(R[k].T @ change[k] for k in range(STAGES - 1))
    moved = tuple(weighted_but_last(free[i - 1], -w[i], DATA[2][i], back) for i in range(1, STAGES))
    return change, moved, sum(norm(value[i]) for i in range(STAGES - 1)), pivot


def first_guess(p0: Vector, q0: Vector, h: Number) -> tuple[Points, Multipliers]:
    """Return the start of the iteration: Q_i - q0 on the tangent, i = 2 ... s, and zero multipliers."""
    v0 = H_p(p0, q0)
    return tuple(h * DATA[4][i] * v0 for i in range(1, STAGES)), tuple(zero(q0) for k in range(STAGES - 1))


def off(guess: Points, moved: Points) -> Number:
    """Return the distance of the end of a step from its extrapolation."""
    return norm(moved[STAGES - 2] - guess[STAGES - 2])


if SEPARABLE and not ON_VELOCITIES:

    def update(x: tuple[Points, Multipliers], data: Start) -> Update:
        """One update of Q_i - q0 and Lam_k; the P_i are eliminated, H_p being affine in p."""
        dQ, Lam = x
        p0, q0, G0, h = data
        Q = positions(q0, dQ)
        J = jacobians(G0, Q)
        # Any momentum will do in forces and inverse mass: H is separable, and M constant.
        kick = forces(tuple(p0 for k in range(STAGES)), Q, J, Lam)
        R = tuple(rows(J[k], p0, q0) for k in range(STAGES - 1))
        free = tuple(h * DATA[4][i] * H_p(weighted_but_last(p0, -h, DATA[2][i], kick), q0) for i in range(1, STAGES))
        change, moved, residual, pivot = correct(h, dQ, free, free, Q, J, R)
        size = sum(norm(moved[i] - dQ[i]) for i in range(STAGES - 1))
        Lam = tuple(Lam[k] + change[k] for k in range(STAGES - 1))
        return (moved, Lam), size, max(LENGTH, norm(Q[STAGES - 1])), residual, pivot

    def begin(p0: Vector, q0: Vector, h: Number) -> tuple[Points, Multipliers]:
        """Return the start of the iteration."""
        return first_guess(p0, q0, h)

    def momenta(p0: Vector, rest: Multipliers) -> tuple[Points, Multipliers]:
        """Return the P_i as far as the forces need them, and the multipliers."""
        return tuple(p0 for i in range(STAGES)), rest

else:

    def update(x: tuple[Points, tuple[Points, Multipliers]], data: Start) -> Update:  # type: ignore[misc]
        """One update of Q_i - q0, P_i - p0 and Lam_k: first P, then the velocities with it, then Q and the multipliers together."""
        dQ, (dP, Lam) = x
        p0, q0, G0, h = data
        Q = positions(q0, dQ)
        J = jacobians(G0, Q)
        kick = forces(places(p0, dP), Q, J, Lam)
        still = 0 * p0
        free_P = tuple(weighted_but_last(still, -h, DATA[1][i], kick) for i in range(STAGES))
        P = places(p0, free_P)
        S = tuple(H_pp(P[i], Q[i]) for i in range(STAGES))
        V = tuple(H_p(P[i], Q[i]) for i in range(STAGES))
        R = tuple(J[k] @ S[k] for k in range(STAGES - 1))
        free_Q = tuple(weighted(h, DATA[0][i], V) for i in range(1, STAGES))
        # Momenta come first: their update needs no matrix, and with them velocities are already one iteration ahead.
        change, moved, residual, pivot = correct(h, dQ, free_Q, V, Q, J, R)
        pull = tuple(J[k].T @ change[k] for k in range(STAGES - 1))
        moved_P = tuple(weighted_but_last(free_P[i], -h, DATA[1][i], pull) for i in range(STAGES))
        size_Q = sum(norm(moved[i] - dQ[i]) for i in range(STAGES - 1))
        size_P = sum(norm(S[i] @ (moved_P[i] - dP[i])) for i in range(STAGES))
        Lam = tuple(Lam[k] + change[k] for k in range(STAGES - 1))
        return (moved, (moved_P, Lam)), size_Q + abs(h) * size_P, max(LENGTH, norm(Q[STAGES - 1])), residual, pivot

    def begin(p0: Vector, q0: Vector, h: Number) -> tuple[Points, tuple[Points, Multipliers]]:  # type: ignore[misc]
        """Return the start of the iteration, with momenta as they are."""
        dQ, Lam = first_guess(p0, q0, h)
        return dQ, (tuple(0 * p0 for i in range(STAGES)), Lam)

    def momenta(p0: Vector, rest: tuple[Points, Multipliers]) -> tuple[Points, Multipliers]:  # type: ignore[misc]
        """Return the P_i and the multipliers."""
        dP, Lam = rest
        return places(p0, dP), Lam


def ahead(dQ: Points, previous: Points, w: Number) -> Points:
    """Return the stages of a growing step, extrapolated from the previous ones; w is the next part over the last one."""
    return tuple(dQ[i] + w * (dQ[i] - previous[i]) for i in range(STAGES - 1))


def update_part(x: tuple[Number, Points, tuple[Points, Any]], data: tuple[Start, Vector, Vector]) -> Update:
    """One update of the stages of a step that grows by a part; the pivot is negative where its branch has an end."""
    share, previous, (dQ, rest) = x
    (p0, q0, G0, h), dq, tangent = data
    grown = min(1.0, share + PART)
    guess = ahead(dQ, previous, (grown - share) / PART)
    (moved, rest), size, scale, residual, pivot = update((guess, rest), (p0, q0, G0, grown * h))
    return (
        (grown, dQ, (moved, rest)),
        size,
        scale,
        residual,
        min(pivot, goes_on(off(guess, moved), PART * (norm(dq) + norm(tangent)), scale)),
    )


def stages(p0: Vector, q0: Vector, h: Number) -> tuple[Points, Points, Multipliers, Report]:
    """Return P_1, ..., P_s, Q_2 - q0, ..., Q_s - q0, Lam_1, ..., Lam_s-1, and a report: that of a step on the motion's own branch."""
    x, data = begin(p0, q0, h), (p0, q0, G(q0), h)
    (dQ, rest), report = newton(update, x, data)
    dq, near = dQ[STAGES - 2], floor(q0)
    tangent, d, _ = tangential(dq, data[2], rows(data[2], p0, q0))
    unsure = doubt(q0, data[2], tangent, dq, d, near)
    still = begin(p0, q0, 0 * h)
    (_, _, (end, _)), walk = walked(update_part, (0 * h, still[0], still), (data, dq, tangent), unsure)
    P, Lam = momenta(p0, rest)
    return P, dQ, Lam, settled_on(tangent, dq, end[STAGES - 2], unsure, walk, report, near)
