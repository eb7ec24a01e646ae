"""Gauss collocation, HLW II.1.3, on the index-reduced ODE (1.18) or another form of the system."""

from functools import partial
from typing import Any

from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.language import STAGES, STIFF, G, H_pp, H_qp, H_qq, curvature, f, g, norm, solve_2s
from daebench.schemes.kernels.mixed import by_position
from daebench.schemes.kernels.newton import newton
from daebench.schemes.kernels.spaces import DATA, FORM_DATA, LENGTH, RATE, I, Matrix, Number, Step, Update, Vector
from daebench.schemes.kernels.stages import weighted

Points = tuple[Vector, ...]
Guess = tuple[Points, Points, Number]


def claims(s: int) -> Claims:
    """Return the claims of Gauss collocation with s stages."""
    return Claims(
        order=2 * s,
        symmetric=True,
        symplectic=False,
        keeps_g=False,
        keeps_Gv=False,
        system="ode",
        source="HLW II.1.3",
        any_form=True,
        canonical=True,
    )


def numbers(s: int) -> tuple[Any, ...]:
    """Return the tableau A, b, c of s stages."""
    # Not at the top of the file: what is imported there belongs to the step, and is read by the compiler.
    from daebench.schemes.kernels.tableaux import gauss

    tableau = gauss(s)
    return tableau.A, tableau.b, tableau.c


MEMBERS = {f"gauss{s}": Member(claims=claims(s), stages=s, numbers=partial(numbers, s), simplified=True) for s in (2, 3, 4)}


def states(x0: Vector, K: Points, h: Number) -> Points:
    """Return x0 + h sum_j a_ij K[j] at each stage i."""
    return tuple(x0 + weighted(h, DATA[0][i], K) for i in range(STAGES))


if STIFF:
    # The fixed-point iteration below contracts only while h is smaller than the shortest period, which is of the order of eps here.

    def block(w: Number, X: Matrix, i: int, j: int) -> Matrix:
        """Return h a_ij X, with the identity added where i = j; w is h or -h."""
        return I + w * DATA[0][i][j] * X if i == j else w * DATA[0][i][j] * X

    def stiffness(p: Vector, q: Vector) -> Matrix:
        """Return minus the derivative of p' with respect to q, H_qq + (G^T G + (G^T g)_q at fixed G) / eps^2."""
        (eps,) = FORM_DATA
        G0 = G(q)
        return H_qq(p, q) + (curvature(q, g(q)) + G0.T @ G0) / eps**2

    def update(x: Guess, data: tuple[Vector, Vector, Number]) -> Update:
        """One Newton update, with exact second derivatives, for p' = F and q' = V at the stages."""
        F, V, previous_change = x
        p0, q0, h = data
        P, Q = states(p0, F, h), states(q0, V, h)
        slopes = tuple(f(P[i], Q[i]) for i in range(STAGES))
        mixed, by_mass = tuple(H_qp(P[i], Q[i]) for i in range(STAGES)), tuple(H_pp(P[i], Q[i]) for i in range(STAGES))
        turned = tuple(by_position(P[i], Q[i], mixed[i]) for i in range(STAGES))
        K = tuple(stiffness(P[i], Q[i]) for i in range(STAGES))
        upper = tuple(
            tuple(block(h, mixed[i], i, j) for j in range(STAGES)) + tuple(h * DATA[0][i][j] * K[i] for j in range(STAGES))
            for i in range(STAGES)
        )
        lower = tuple(
            tuple(-h * DATA[0][i][j] * by_mass[i] for j in range(STAGES)) + tuple(block(-h, turned[i], i, j) for j in range(STAGES))
            for i in range(STAGES)
        )
        r_F = tuple(slopes[i][0] - F[i] for i in range(STAGES))
        r_V = tuple(slopes[i][1] - V[i] for i in range(STAGES))
        change, pivot = solve_2s(upper + lower, r_F + r_V)
        F1 = tuple(F[i] + change[i] for i in range(STAGES))
        V1 = tuple(V[i] + change[STAGES + i] for i in range(STAGES))
        size = abs(h) * sum(norm(change[STAGES + i]) for i in range(STAGES))
        residual = sum(norm(r_F[i]) + norm(r_V[i]) for i in range(STAGES))
        return (F1, V1, previous_change), size, max(LENGTH, norm(q0)), residual, pivot

else:

    def update(x: Guess, data: tuple[Vector, Vector, Number]) -> Update:
        """One fixed-point update, HLW VIII.6.2, for p' = F and q' = V at the stages.

        Only the change of V is measured, against |V| and a speed from the length and the rate of the problem, over two iterations in a row,
        because a change of F appears in V one iteration later. By then both have been contracted again.
        """
        F, V, previous_change = x
        p0, q0, h = data
        P, Q = states(p0, F, h), states(q0, V, h)
        slopes = tuple(f(P[i], Q[i]) for i in range(STAGES))
        F1, V1 = tuple(slopes[i][0] for i in range(STAGES)), tuple(slopes[i][1] for i in range(STAGES))
        change = sum(norm(V1[i] - V[i]) for i in range(STAGES))
        pivot = min(slopes[i][2] for i in range(STAGES))
        return (F1, V1, change), change + previous_change, RATE * max(LENGTH, norm(q0)) + norm(V1[0]), change, pivot


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, no stage multipliers, and a report, for x = (p, q).

    ::

        X_i = x0 + h sum_j a_ij f(X_j)        x1 = x0 + h sum_i b_i f(X_i)
    """
    F0, v0, _ = f(p0, q0)
    # The third entry, the change before, is as large as the scale: a first change that is small by chance then ends nothing.
    start = (tuple(F0 for i in range(STAGES)), tuple(v0 for i in range(STAGES)), RATE * max(LENGTH, norm(q0)) + norm(v0))
    (F, V, _), report = newton(update, start, (p0, q0, h))
    return weighted(h, DATA[1], F), weighted(h, DATA[1], V), (), report
