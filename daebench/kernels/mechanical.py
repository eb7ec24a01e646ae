"""H = 1/2 p^T M(q)^-1 p + U(q) with a mass matrix that is solved with and never inverted symbolically."""

from daebench.kernels.hole import (
    G,
    M,
    Matrix,
    Multiplier,
    N,
    Number,
    T_q,
    T_qq,
    U,
    U_q,
    U_qq,
    Vector,
    apply_md,
    axpy,
    axpy_dd,
    c_v,
    dot,
    g_qv,
    identity_d,
    minus_md,
    product,
    scale_dd,
    scale_md,
    solve_mass,
    solve_mass_d,
    solve_mass_m,
    transpose,
)


def H(p: Vector, q: Vector) -> Number:
    """Hamiltonian 1/2 p^T M^-1 p + U."""
    return 0.5 * dot(p, H_p(p, q)) + U(q)


def H_p(p: Vector, q: Vector) -> Vector:
    """Velocity v = M^-1 p."""
    return solve_mass(M(q), p)[0]


def H_q(p: Vector, q: Vector) -> Vector:
    """Minus the force at fixed p: U_q - T_q(q, v)."""
    return axpy(-1.0, T_q(q, H_p(p, q)), U_q(q))


def H_pp(p: Vector, q: Vector) -> Matrix:
    """Inverse mass matrix, by solving."""
    return solve_mass_d(M(q), p, identity_d(q))[1]


def H_qp(p: Vector, q: Vector) -> Matrix:
    """Derivative of H_q with respect to p: -N(q, v)^T M^-1."""
    return scale_dd(-1.0, columns_solved(p, q))


def columns_solved(p: Vector, q: Vector) -> Matrix:
    """Rows M^-1 n_k for the columns n_k of N(q, v): N^T M^-1."""
    mass = M(q)
    return solve_mass_d(mass, p, transpose(N(q, solve_mass(mass, p)[0])))[1]


def H_qq(p: Vector, q: Vector) -> Matrix:
    """Derivative of H_q with respect to q at fixed p: U_qq - T_qq + N^T M^-1 N."""
    v = H_p(p, q)
    return axpy_dd(1.0, product(columns_solved(p, q), N(q, v)), axpy_dd(-1.0, T_qq(q, v), U_qq(q)))


def Gv_p(p: Vector, q: Vector) -> Matrix:
    """Derivative of G v with respect to p: G M^-1."""
    return solve_mass_m(M(q), p, G(q))[1]


def Gv_q(p: Vector, q: Vector) -> Matrix:
    """Derivative of G v with respect to q at fixed p: g_qv(q, v) - G M^-1 N."""
    v = H_p(p, q)
    return minus_md(g_qv(q, v), apply_md(transpose(N(q, v)), Gv_p(p, q)))


def a_p(p: Vector, q: Vector, lam: Multiplier) -> Matrix:
    """Derivative of (1.12) with respect to p: (2 g_qv - G M^-1 c_v) M^-1."""
    v, mass = H_p(p, q), M(q)
    a_v = minus_md(scale_md(2.0, g_qv(q, v)), apply_md(transpose(c_v(q, v)), Gv_p(p, q)))
    return solve_mass_m(mass, p, a_v)[1]


def rows(X: Matrix, p: Vector, q: Vector) -> Matrix:
    """M^-1 applied to each row of X."""
    return solve_mass_m(M(q), p, X)[1]
