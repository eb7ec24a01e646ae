"""Runge-Kutta tableaux of the Gauss, Radau and Lobatto families, computed for any number of stages s.

The nodes are the ends of [0, 1] that the family prescribes and the zeros of the polynomial that is orthogonal on [0, 1] with the
weight x^a (1 - x)^b, where a and b are 1 for a prescribed end and 0 for a free one. All but IIIB are collocation methods::

    sum_j a_ij c_j^(k-1) = c_i^k / k,     sum_j b_j c_j^(k-1) = 1/k,     k = 1 ... s                      HLW II.1.3
    IIIB:  a^_ij = b_j (1 - a_ji / b_i),  from  b_i a^_ij + b_j a_ji = b_i b_j  with a_ij of IIIA         HLW Theorem VI.4.6
"""

from dataclasses import dataclass
from functools import cache
from math import comb, factorial
from typing import Any

from daebench.errors import BadInput, whole
from daebench.systems.lazily import mpmath as mp

FLOATS = 40
"""Digits to which a tableau is computed before it is rounded, once, to floating-point numbers."""


@dataclass(frozen=True)
class Tableau:
    """The coefficients of a Runge-Kutta method, as floats or as mpmath numbers.

    Parameters
    ----------
    A : tuple of tuple
        Coefficients a_ij, shape(s, s).
    b : tuple
        Weights, shape(s,).
    c : tuple
        Nodes, shape(s,), increasing.
    """

    A: tuple[tuple[Any, ...], ...]
    b: tuple[Any, ...]
    c: tuple[Any, ...]


def gauss(s: int, digits: int | None = None) -> Tableau:
    """Return the Gauss tableau of order 2s, HLW II.1.3: symmetric, symplectic; s = 1 is the implicit midpoint rule.

    Parameters
    ----------
    s : int
        Number of stages, at least 1.
    digits : int, optional
        Return mpmath numbers of this many digits in place of floats.

    Raises
    ------
    BadInput
        If s is not a whole number or too small.
    """
    return _rounded(_collocation(_stages("gauss", s, 1), 0, 0, digits or FLOATS), digits)


def radau_iia(s: int, digits: int | None = None) -> Tableau:
    """Return the Radau IIA tableau of order 2s-1, HLW II.1.3: c_s = 1, stiffly accurate; s = 1 is the implicit Euler method.

    Parameters and errors are those of ``gauss``.
    """
    return _rounded(_collocation(_stages("radau_iia", s, 1), 0, 1, digits or FLOATS), digits)


def lobatto_iiia(s: int, digits: int | None = None) -> Tableau:
    """Return the Lobatto IIIA tableau of order 2s-2, HLW II.1.3: c_1 = 0, c_s = 1, the first row of A zero, the last row b; s >= 2.

    Parameters and errors are those of ``gauss``.
    """
    return _rounded(_collocation(_stages("lobatto_iiia", s, 2), 1, 1, digits or FLOATS), digits)


def lobatto_iiib(s: int, digits: int | None = None) -> Tableau:
    """Return the Lobatto IIIB tableau of order 2s-2, HLW II.1.4: the first column of A is b_1, the last zero; s >= 2.

    With IIIA it is a symplectic partitioned pair. Parameters and errors are those of ``gauss``.
    """
    return _rounded(_iiib(_stages("lobatto_iiib", s, 2), digits or FLOATS), digits)


def _stages(family: str, s: Any, least: int) -> int:
    stages = whole(f"the number of stages s of {family}", s)
    if stages < least:
        raise BadInput(f"{family} needs at least {least} stage{'s' if least > 1 else ''}, not s = {stages}.", "too-few-stages")
    return stages


def _guarded(s: int, digits: int) -> Any:
    """Return mpmath's context of enough digits: the monomials lose about one for each stage, and zeros of their sums two."""
    return mp.workdps(digits + 3 * s + 10)


def _nodes(s: int, a: int, b: int) -> list[Any]:
    """Return the nodes of highest quadrature order, including 0 if a = 1, and 1 if b = 1."""
    n = s - a - b
    # The shifted Jacobi polynomial by Rodrigues' formula: its coefficients are integers, so that no digit is lost before the roots.
    falling = [(-1) ** k * comb(n, k) * factorial(n + a + b + k) // factorial(a + k) for k in range(n, -1, -1)]
    interior = mp.polyroots(falling, maxsteps=50 + 20 * n, extraprec=mp.mp.prec) if n else []
    return [*[mp.mpf(0)] * a, *sorted(interior), *[mp.mpf(1)] * b]


@cache
def _collocation(s: int, a: int, b: int, digits: int) -> Tableau:
    """Return the collocation tableau with the guard digits still on."""
    with _guarded(s, digits):
        c = _nodes(s, a, b)
        # The Vandermonde matrix is badly conditioned; the guard digits of ``_guarded`` cover what its inverse loses.
        to_weights = mp.matrix([[x**k for k in range(s)] for x in c]) ** -1
        integrals = mp.matrix([[x ** (k + 1) / (k + 1) for k in range(s)] for x in [*c, mp.mpf(1)]])
        *A, weights = (tuple(row) for row in (integrals * to_weights).tolist())
        return Tableau(tuple(A), weights, tuple(c))


@cache
def _iiib(s: int, digits: int) -> Tableau:
    """Return the tableau of IIIB with the guard digits still on; the factor 1 - a_ji / b_i makes its last column exactly zero."""
    iiia = _collocation(s, 1, 1, digits)
    with _guarded(s, digits):
        A = tuple(tuple(iiia.b[j] * (1 - iiia.A[j][i] / iiia.b[i]) for j in range(s)) for i in range(s))
        return Tableau(A, iiia.b, iiia.c)


def _rounded(tableau: Tableau, digits: int | None) -> Tableau:
    """Return the tableau without its guard digits, as floats or as mpmath numbers."""
    with mp.workdps(digits or FLOATS):
        # Unary plus rounds an mpmath number to the working precision.
        number = float if digits is None else mp.mpf.__pos__
        return Tableau(tuple(tuple(map(number, row)) for row in tableau.A), tuple(map(number, tableau.b)), tuple(map(number, tableau.c)))
