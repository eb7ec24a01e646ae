"""Mechanics of a constrained problem at many positions at once: linear algebra, manifold, metric, and the momenta of an energy.

The last axis of every array is that of the states. NumPy's own routines take a stack of matrices one by one, which for two or three
equations is ten times as slow.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.freedom import freedom
from daebench.errors import BadInput
from daebench.runs.ivp import Array, ConstrainedIvp, Ivp
from daebench.runs.make_ivp import constrained as require_constrained
from daebench.runs.members import Members

Rows = NDArray[np.intp]
"""Numbers of members, or of chains."""


def times(A: Array, x: Array) -> Array:
    """Return A x, shape(c, n), of A, shape(c, l, n)."""
    return np.asarray(np.sum(A * x, axis=1), dtype=float)


def transposed_times(A: Array, y: Array) -> Array:
    """Return A^T y, shape(l, n), of A, shape(c, l, n)."""
    return np.asarray(np.sum(A * y[:, None], axis=0), dtype=float)


def product(A: Array, B: Array) -> Array:
    """Return A B of matrices in the first two axes."""
    return np.stack([np.sum(row[:, None] * B, axis=0) for row in A])


def gram(A: Array, B: Array) -> Array:
    """Return A B^T, shape(c, c, n), of matrices of shape(c, l, n)."""
    return np.stack([np.sum(row * B, axis=1) for row in A])


def solved(A: Array, b: Array) -> Array:
    """Return A^-1 b, shape(c, n), by elimination without pivoting.

    That is stable for A = C C^T. Of products C(y) C(x)^T, which are nearly of this kind, it may fail: what comes out is then not finite, or
    no solution, and Newton's iteration goes on from there or does not converge.
    """
    A, x = A.copy(), b.copy()
    c = len(A)
    for k in range(c - 1):
        factors = A[k + 1 :, k] / A[k, k]
        A[k + 1 :, k + 1 :] -= factors[:, None] * A[k, k + 1 :]
        x[k + 1 :] -= factors * x[k]
    for k in reversed(range(c)):
        x[k] = (x[k] - np.sum(A[k, k + 1 :] * x[k + 1 :], axis=0)) / A[k, k]
    return x


def log_det(A: Array) -> Array:
    """Return log det A of symmetric A, shape(c, c, n); NaN or -inf where it is not positive definite."""
    A, total = A.copy(), np.zeros(A.shape[2])
    for k in range(len(A)):
        total += np.log(A[k, k])
        A[k + 1 :, k + 1 :] -= (A[k + 1 :, k] / A[k, k])[:, None] * A[k, k + 1 :]
    return total


class Mechanics:
    """A problem with H = (p - a)^T M^-1 (p - a) / 2 + U at positions of all members; a(q) is 0 but for magnetic forces.

    Positions are arrays of shape(d, n), and the last axis of every result is that of the members. Functions that do not depend on
    positions, such as a mass matrix that is constant, are not told apart.
    """

    def __init__(self, members: Members) -> None:
        self.members = members
        self.ivp: Any = members.ivp
        self.d, self.k = int(self.ivp.facts.D), int(self.ivp.facts.D) - int(self.ivp.facts.M)
        self.explicit = bool(self.ivp.facts.EXPLICIT)

    def some(self, rows: Rows) -> "Mechanics":
        """Return that of some of the members, by their numbers."""
        return Mechanics(self.members.some(rows))

    def value(self, name: str, *arguments: Array, rows: Rows | None = None) -> Array:
        """Return one of the problem's functions at states of all members, or of some by their numbers, shape(..., n)."""
        some = self.members if rows is None else self.members.some(rows)
        return np.moveaxis(some.along(name, *(x.T for x in arguments)), 0, -1)

    def shift(self, q: Array, rows: Rows | None = None) -> Array:
        """Return the momentum a(q) at which the velocity is zero."""
        zero = np.zeros_like(q)
        if not self.explicit:  # a system of M and U has no magnetic forces
            return zero
        return -times(self.value("mass", zero, q, rows=rows), self.value("H_p", zero, q, rows=rows))

    def inverse(self, q: Array, rows: Rows | None = None) -> Array:
        """Return M(q)^-1."""
        return self.value("H_pp", np.zeros_like(q), q, rows=rows)

    def U(self, q: Array, rows: Rows | None = None) -> Array:
        """Return the potential energy H(a, q)."""
        return self.value("H", self.shift(q, rows), q, rows=rows) if self.explicit else self.value("U", q, rows=rows)

    def U_q(self, q: Array, rows: Rows | None = None) -> Array:
        """Return the gradient of the potential energy."""
        return self.value("H_q", self.shift(q, rows), q, rows=rows) if self.explicit else self.value("U_q", q, rows=rows)

    def volume(self, q: Array, G: Array, rows: Rows | None = None) -> Array:
        """Return log( det M det(G M^-1 G^T) ) / 2.

        Less log( det(G G^T) ) / 2 it is the logarithm of the density of the surface measure of {g = 0} in the metric M with respect to the
        Euclidean one.
        """
        inverse = self.inverse(q, rows)
        return np.asarray((log_det(gram(product(G, inverse), G)) - log_det(inverse)) / 2, dtype=float)

    def with_energy(self, q: Array, kinetic: Array, noise: Array) -> Array:
        """Return momenta of these kinetic energies on the manifold, uniform on the sphere in the metric M^-1, from normal noise."""
        G, inverse, M = self.value("G", q), self.inverse(q), self.value("mass", np.zeros_like(q), q)
        root = np.asarray(np.linalg.cholesky(np.moveaxis(M, -1, 0)), dtype=float)
        z = times(np.moveaxis(root, 0, -1), noise)
        rows = product(G, inverse)
        for _ in range(2):  # once more for what rounding has left
            z = z - transposed_times(G, solved(gram(rows, G), times(rows, z)))
        length = np.sqrt(np.sum(z * times(inverse, z), axis=0))
        return np.asarray(self.shift(q) + z * (np.sqrt(2 * np.maximum(kinetic, 0.0)) / length), dtype=float)


@dataclass(frozen=True)
class Positions:
    """The manifolds {q: g(q) = 0} of all members."""

    mechanics: Mechanics
    """The problem."""

    def conditions(self, x: Array, rows: Rows) -> tuple[Array, Array]:
        """Return g and G at positions of some members."""
        return self.mechanics.value("g", x, rows=rows), self.mechanics.value("G", x, rows=rows)


def mechanics_of(members: Members, measure: str) -> Mechanics:
    """Return the mechanics of the members of an ensemble at many positions."""
    ivp = constrained(members.ivp, measure)
    if ivp.arrays:
        raise BadInput(
            f"starts of {ivp.problem} with {ivp.facts.NODES} nodes cannot be drawn by {measure}; take fewer nodes.",
            "too-many-nodes-to-draw",
        )
    if ivp.facts.EXTENDED:
        why = f"{ivp.problem} depends on time, or has forces without a potential; draw a neighbourhood or a grid"
        raise BadInput(f"{measure} is for motions of constant energy, and {why}.", "energy-not-constant")
    if ivp.nonholonomic:
        why = f"and {ivp.problem} has constraints on velocities, whose motion need not keep it; draw a neighbourhood or a grid"
        raise BadInput(f"{measure} is a measure that Hamiltonian motion keeps, {why}.", "measure-not-invariant")
    if not ivp.facts.QUADRATIC:
        raise BadInput(
            f"{measure} takes H that is quadratic in p, and that of {ivp.problem} is not; draw a neighbourhood or a grid.",
            "measure-needs-quadratic-h",
        )
    counted = freedom(ivp)
    if counted is not None and counted.others:
        why = f"G has rank {counted.rank} of {ivp.m}: {counted.named}, {counted.where}"
        raise BadInput(f"{measure} has no density on {ivp.problem}, case {ivp.case}: {why}; {counted.cure}.", "measure-without-density")
    return Mechanics(members)


def constrained(ivp: Ivp, measure: str) -> ConstrainedIvp:
    """Return an initial value problem as that of a constrained problem; raise :class:`BadInput` where it is a Poisson system's."""
    why = "which has none; draw liouville, uniform in a box of y, or a neighbourhood"
    return require_constrained(ivp, why, f"{measure} is a distribution on a constraint manifold, and ")
