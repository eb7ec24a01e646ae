"""H = 1/2 p^T M(q)^-1 p + U(q) with a mass matrix that is never inverted symbolically: linear systems are solved with it."""

from daebench.schemes.kernels.language import (
    EXTENDED,
    FORCED,
    G,
    M,
    N,
    T_q,
    T_qq,
    T_qv,
    U,
    U_q,
    U_qq,
    c_v,
    dot,
    g_qv,
    identity_d,
    rate_of_time,
    solve_mass,
)
from daebench.schemes.kernels.spaces import Matrix, Multiplier, Number, Rows, Vector

if EXTENDED:

    def H(p: Vector, q: Vector) -> Number:
        """Energy K = 1/2 p^T M^-1 p + U + p_t; the inverse mass of the time is 0."""
        return 0.5 * dot(p, solve_mass(M(q), p)[0]) + U(q) + dot(p, rate_of_time(q))

    def H_p(p: Vector, q: Vector) -> Vector:
        """Velocity (M^-1 p, 1)."""
        return solve_mass(M(q), p)[0] + rate_of_time(q)

else:

    def H(p: Vector, q: Vector) -> Number:
        """Hamiltonian 1/2 p^T M^-1 p + U."""
        return 0.5 * dot(p, H_p(p, q)) + U(q)

    def H_p(p: Vector, q: Vector) -> Vector:
        """Velocity v = M^-1 p."""
        return solve_mass(M(q), p)[0]


def H_q(p: Vector, q: Vector) -> Vector:
    """Minus the force at fixed p: U_q - T_q(q, v)."""
    return U_q(q) - T_q(q, H_p(p, q))


def H_pp(p: Vector, q: Vector) -> Matrix:
    """Inverse mass matrix, by solving."""
    return solve_mass(M(q), p, identity_d(q))[1]


def H_qp(p: Vector, q: Vector) -> Matrix:
    """Derivative of H_q with respect to p: -N(q, v)^T M^-1, or -T_qv M^-1 with forces."""
    return -columns_solved(p, q)


if FORCED:

    def columns_solved(p: Vector, q: Vector) -> Matrix:
        """Rows M^-1 t_k for the rows t_k of T_qv: T_qv M^-1."""
        return solve_mass(M(q), p, T_qv(q, H_p(p, q)))[1]

    def H_pq(p: Vector, q: Vector) -> Matrix:
        """Derivative of H_p with respect to q: -M^-1 N(q, v)."""
        return -solve_mass(M(q), p, N(q, H_p(p, q)).T)[1].T

elif EXTENDED:

    def columns_solved(p: Vector, q: Vector) -> Matrix:
        """Rows M^-1 n_k for the columns n_k of N(q, v): N^T M^-1."""
        return solve_mass(M(q), p, N(q, H_p(p, q)).T)[1]

else:

    def columns_solved(p: Vector, q: Vector) -> Matrix:
        """Rows M^-1 n_k for the columns n_k of N(q, v): N^T M^-1."""
        # M is evaluated once for both solutions; in time, H_p has the rate of the time, which N takes, too.
        mass = M(q)
        return solve_mass(mass, p, N(q, solve_mass(mass, p)[0]).T)[1]


def H_qq(p: Vector, q: Vector) -> Matrix:
    """Derivative of H_q with respect to q at fixed p: U_qq - T_qq + N^T M^-1 N."""
    v = H_p(p, q)
    return U_qq(q) - T_qq(q, v) + columns_solved(p, q) @ N(q, v)


def Gv_p(p: Vector, q: Vector) -> Rows:
    """Derivative of G v with respect to p: G M^-1."""
    return solve_mass(M(q), p, G(q))[1]


def Gv_q(p: Vector, q: Vector) -> Rows:
    """Derivative of G v with respect to q at fixed p: g_qv(q, v) - G M^-1 N."""
    v = H_p(p, q)
    return g_qv(q, v) - Gv_p(p, q) @ N(q, v)


def a_p(p: Vector, q: Vector, lam: Multiplier) -> Rows:
    """Derivative of (1.12) with respect to p: (2 g_qv - G M^-1 c_v) M^-1."""
    v, mass = H_p(p, q), M(q)
    a_v = 2 * g_qv(q, v) - Gv_p(p, q) @ c_v(q, v)
    return solve_mass(mass, p, a_v)[1]


def rows(X: Rows, p: Vector, q: Vector) -> Rows:
    """M^-1 applied to each row of X."""
    return solve_mass(M(q), p, X)[1]
