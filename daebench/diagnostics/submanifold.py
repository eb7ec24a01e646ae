"""Hamiltonian systems on symplectic submanifolds, HLW VII.2.3: a constrained system as a Poisson system, and the symplectic projection."""

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from daebench.compiler.constrained.derivation import Derivation
from daebench.compiler.constrained.local import LocalDerivation
from daebench.compiler.expressions import shortened
from daebench.diagnostics.symplecticity import tangent_basis
from daebench.errors import BadInput
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.make_ivp import initial_values
from daebench.systems.constrained import ConstrainedHamiltonian
from daebench.systems.lazily import sympy as sp
from daebench.systems.poisson import PoissonCase, PoissonSystem

SHORT = 800
"""Largest number of operations of an expression that is shortened."""


def as_poisson(problem: ConstrainedHamiltonian) -> PoissonSystem:
    """Return a constrained system in its local coordinates y = (eta, xi): the Poisson system of HLW (2.22).

    ::

        y' = B(y) grad K(y)      x = chi(y)      X = chi'(y)      B = (X^T J X)^-1      K = H(chi(y))

    It has no constraints and no multipliers. That the system is Poisson, and that the integrals stay integrals, is verified when
    it is constructed, as for every :class:`daebench.systems.poisson.PoissonSystem`. B is inverted by symbols, which takes about ten
    seconds for three coupled degrees of freedom and minutes from five on: there the form ``local``, which solves with numbers, is better.

    Parameters
    ----------
    problem : ConstrainedHamiltonian
        A problem that declares a chart. Its parameters are kept; cases are carried over by the inverse of the chart, and those left out
        that start where the chart is singular.

    Raises
    ------
    BadInput
        If the problem declares no invertible chart.
    InvalidProblem
        If the chart does not give a Poisson system, or a declared integral is not an integral.

    Examples
    --------
    >>> import daebench
    >>> from daebench.methods.catalogue import find_problem
    >>> system = daebench.as_poisson(find_problem("planar_pendulum").define())
    >>> system.y
    (omega, theta)
    >>> system.B
    Matrix([
    [                 0, -1/(length**2*mass)],
    [1/(length**2*mass),                   0]])
    """
    if not isinstance(problem, ConstrainedHamiltonian):
        raise BadInput(
            f"as_poisson takes a ConstrainedHamiltonian, such as a problem file's problem() returns, not {problem!r}.",
            "as-poisson-of-other-type",
        )
    if problem.chart is None:
        raise BadInput("the problem declares no chart of its manifold; add one to its definition.", "as-poisson-without-chart")
    local = LocalDerivation(Derivation(problem))
    chi = dict(zip([*problem.p, *problem.q], [*problem.chart.p, *problem.chart.q], strict=True))
    return PoissonSystem(
        y=tuple(local.y),
        B=_structure(local),
        H=_carried(local.H, chi),
        integrals={name: _carried(F, chi) for name, F in problem.integrals.items()},
        parameters=problem.parameters,
        cases=_cases(problem),
    )


def _structure(local: LocalDerivation) -> "sp.Matrix":
    """Return B = (X^T J X)^-1 by blocks, for positions depend on xi as a rule, and so the block of eta and eta vanishes.

    ::

        [[0, A], [-A^T, C]]^-1 = [[R^T C R, -R^T], [R, 0]]      R = A^-1
    """
    form, n = local.two_form, local.d
    if not form[:n, :n].is_zero_matrix:
        return _skew(_inverse(form))
    R, C = _inverse(form[:n, n:]), form[n:, n:]
    return _skew(sp.Matrix(sp.BlockMatrix([[R.T * C * R, -R.T], [R, sp.zeros(n, n)]])))


def _inverse(A: "sp.Matrix") -> "sp.Matrix":
    try:
        # By cofactors, which need no pivots: elimination would have to decide whether expressions are zero.
        return A.inv(method="ADJ")
    except sp.matrices.exceptions.NonInvertibleMatrixError as error:
        raise BadInput(
            "X^T J X of the problem's chart is singular everywhere; its coordinates are not independent.", "chart-singular-everywhere"
        ) from error


def _skew(B: "sp.Matrix") -> "sp.Matrix":
    """Return B made of its upper triangle, so that it is skew-symmetric letter by letter."""
    upper = sp.Matrix(*B.shape, lambda i, j: _short(B[i, j]) if i < j else 0)
    return upper - upper.T


def _carried(F: "sp.Expr", chi: Mapping["sp.Symbol", "sp.Expr"]) -> "sp.Expr":
    """Return F(chi(y))."""
    return _short(sp.sympify(F).subs(chi, simultaneous=True))


def _short(F: "sp.Expr") -> "sp.Expr":
    """Return an expression shortened, unless it is so long that this takes longer than anything it is used for."""
    return shortened(F) if F.count_ops() <= SHORT else F


def _cases(problem: ConstrainedHamiltonian) -> dict[str, PoissonCase]:
    """Return the cases in the chart."""
    assert problem.chart is not None
    cases = {}
    for name, case in problem.cases.items():
        start = dict(zip([*problem.p, *problem.q], [*case.p, *case.q], strict=True))
        y = _at([*problem.chart.inverse_eta, *problem.chart.inverse_xi], start)
        # A start where the chart is singular has no coordinates.
        if not any(coordinate.has(sp.nan, sp.zoo, sp.oo, -sp.oo) for coordinate in y):
            cases[name] = PoissonCase(y=y, parameters=case.parameters, about=case.about)
    return cases


def _at(expressions: Iterable["sp.Expr"], start: Mapping["sp.Symbol", "sp.Expr"]) -> tuple["sp.Expr", ...]:
    return tuple(sp.sympify(expression).subs(start, simultaneous=True) for expression in expressions)


def symplectic_projection(ivp: ConstrainedIvp, p: ArrayLike, q: ArrayLike) -> Array:
    """Return the symplectic projection P_x onto the tangent space of the manifold at x = (p, q), HLW (2.19).

    ::

        (J P_x v, xi) = (J v, xi)  for all tangent xi:      P_x = X (X^T J X)^-1 X^T J      x' = P_x J^-1 grad H(x)      (2.20)

    It does not depend on the basis X of the tangent space, of which :func:`daebench.diagnostics.symplecticity.tangent_basis` gives an
    orthonormal one. The removed part is J-orthogonal to the manifold.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.
    p, q : array_like, shape(d,)
        A point of the manifold.

    Returns
    -------
    ndarray, shape(2d, 2d)
        Momenta first.

    Raises
    ------
    BadInput
        If p or q is not valid, or the two-form degenerates on the tangent space there, as where G loses rank and the system
        does not rest.

    Examples
    --------
    >>> import daebench
    >>> ivp = daebench.initial_value_problem("planar_pendulum", case="horizontal")
    >>> P = daebench.symplectic_projection(ivp, ivp.p0, ivp.q0)
    >>> bool(abs(P @ P - P).max() < 1e-15), round(float(P.trace()), 12)
    (True, 2.0)
    """
    p, q = (initial_values(name, values, ivp.facts) for name, values in (("p", p), ("q", q)))
    X = tangent_basis(ivp, p, q)
    d = ivp.d
    XJ = np.hstack([-X[d:].T, X[:d].T])
    form = XJ @ X
    if np.linalg.cond(form) * np.finfo(float).eps > 1e-3:
        raise BadInput(
            f"the manifold of {ivp.problem} is not symplectic at q = {np.asarray(q).tolist()}: its two-form degenerates there.",
            "manifold-not-symplectic",
        )
    return np.asarray(X @ np.linalg.solve(form, XJ), dtype=float)
