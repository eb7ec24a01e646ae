"""Constraints that depend on each other: what they forbid at second order, and whether a motion obeys a start."""

from dataclasses import dataclass

import numpy as np

from daebench.diagnostics.inverse_mass import DEPENDENT, root_of
from daebench.errors import BadInput
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.systems.lazily import scipy

ZERO = 1e-8
"""Second derivative of a combination of constraints, relative to its terms, below which it is zero."""

DEFINITE = 1e-6
"""Eigenvalue, relative to the largest, above which it is positive, and below minus which it is negative."""

ROUNDS = 500
"""Number of iterations of the search for a semidefinite combination."""

LARGEST = 200
"""Largest number of constraints that are examined."""


@dataclass(frozen=True)
class Dependence:
    """The combinations w of constraints without gradient, w^T G = 0, and the directions that G leaves free.

    Parameters
    ----------
    w : ndarray, shape(m, c)
        Combinations, one a column.
    Z : ndarray, shape(d, f)
        Free directions of unit kinetic energy, one a column.
    curvatures : ndarray, shape(m, d, d)
        Second derivatives of each constraint.
    """

    w: Array
    Z: Array
    curvatures: Array

    @property
    def forms(self) -> Array:
        """The forms Z^T (w^T g_qq) Z of all combinations, shape(c, f, f), relative to the size of their terms; zero if rounding."""
        parts = np.einsum("if,kij,jg->kfg", self.Z, self.curvatures, self.Z)
        # Not of Z^T g_qq Z, which is nothing but rounding where Z leaves the positions in g alone.
        sizes = np.abs(self.w).T @ np.linalg.norm(self.curvatures, axis=(1, 2)) * np.linalg.norm(self.Z, 2) ** 2
        forms = np.einsum("kc,kfg->cfg", self.w, parts) / np.where(sizes > 0, sizes, 1.0)[:, None, None]
        return np.where(np.linalg.norm(forms, axis=(1, 2))[:, None, None] > ZERO, forms, 0.0)

    @property
    def forbidden(self) -> int:
        """The number of free directions that a semidefinite form forbids: rank of one with the largest rank, 0 where there is none."""
        form = semidefinite(self.forms)
        if form is None:
            return 0
        eigenvalues = np.linalg.eigvalsh(form)
        return int(np.sum(eigenvalues > DEFINITE * eigenvalues[-1]))

    def bends(self, v: Array) -> tuple[float, Array] | None:
        """Return w^T g_qq (v, v) and w of the combination for which it is largest relative to its terms; None if all are zero."""
        parts = np.einsum("i,kij,j->k", v, self.curvatures, v)
        sizes = np.abs(self.w).T @ np.linalg.norm(self.curvatures, axis=(1, 2)) * (v @ v)
        shares = self.w.T @ parts / np.where(sizes > 0, sizes, 1.0)
        k = int(np.argmax(np.abs(shares)))
        return (float(self.w[:, k] @ parts), self.w[:, k]) if abs(shares[k]) > ZERO else None


def dependence_at(ivp: ConstrainedIvp) -> Dependence | None:
    """Return the dependence of constraints on each other at the start; None if there is none, or if it is not examined.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers, without the time among its positions.
    """
    if ivp.arrays or ivp.m > LARGEST or ivp.facts.EXTENDED:
        return None
    G = np.asarray(ivp.value("G", tuple(ivp.q0)), dtype=float)
    lengths = np.linalg.norm(G, axis=1)
    lengths = np.where(lengths > 0, lengths, 1.0)
    # Before the masses are asked for: independent constraints, the usual case, need no root of M^-1.
    if not np.all(np.isfinite(G)) or _rank(G / lengths[:, None]) == ivp.m:
        return None
    root = root_of(ivp, ivp.p0, ivp.q0)
    rows = G @ root
    sizes = np.linalg.norm(rows, axis=1)
    sizes = np.where(sizes > 0, sizes, 1.0)
    U, _, Vt = np.linalg.svd(rows / sizes[:, None])
    rank = _rank(rows / sizes[:, None])
    curvatures = np.array([ivp.value("curvature", tuple(ivp.q0), tuple(row)) for row in np.eye(ivp.m)], dtype=float)
    # Divided by the lengths, so that w combines the constraints themselves and not their normalised gradients.
    return Dependence(U[:, rank:] / sizes[:, None], root @ Vt[rank:].T, curvatures)


def _rank(rows: Array) -> int:
    sizes = np.linalg.svd(rows, compute_uv=False)
    return int(np.sum(sizes > DEPENDENT * max(float(np.max(sizes, initial=0.0)), DEPENDENT)))


def semidefinite(forms: Array) -> Array | None:
    """Return a positive semidefinite form that is not zero in the span of symmetric ones, of a large rank; None where none is found.

    By projections in turn onto the cone and onto the span, from that of the identity: where that has no part in the span, all traces are
    zero, and there is none. Where they are too slow, by the form of unit trace whose least eigenvalue is the largest, see :func:`_highest`.

    Parameters
    ----------
    forms : ndarray, shape(c, f, f)
        Symmetric matrices.
    """
    c, f, _ = forms.shape
    Q, sizes, _ = np.linalg.svd(forms.reshape(c, f * f).T, full_matrices=False)
    basis = Q[:, sizes > ZERO * max(float(np.max(sizes, initial=0.0)), ZERO)]
    # From the identity, which lies deep in the cone: projections in turn then end at a form of large rank.
    A = (basis @ (basis.T @ np.eye(f).ravel())).reshape(f, f)
    for _ in range(ROUNDS):
        size = float(np.linalg.norm(A))
        if size <= DEFINITE:
            return None
        eigenvalues, vectors = np.linalg.eigh(A / size)
        if eigenvalues[0] >= -DEFINITE:
            return A / size
        above = (vectors * np.maximum(eigenvalues, 0.0)) @ vectors.T
        A = (basis @ (basis.T @ above.ravel())).reshape(f, f)
    return _highest(basis.T.reshape(-1, f, f))


def _highest(basis: Array) -> Array | None:
    """Return the semidefinite form whose least eigenvalue is the largest of all forms of unit trace; None where that is negative.

    By linear programs: maximise s with v^T A v >= s for the eigenvectors v of all forms so far. Each s is a bound from above.
    """
    traces = np.trace(basis, axis1=1, axis2=2)
    cuts = np.array([np.einsum("kij,i,j->k", basis, v, v) for v in np.eye(basis.shape[1])])
    bounds = [(-1.0, 1.0)] * len(basis) + [(None, None)]  # a semidefinite form of unit trace has a norm of at most 1
    for _ in range(ROUNDS):
        rows = np.column_stack([-cuts, np.ones(len(cuts))])
        program = scipy.optimize.linprog(
            np.append(np.zeros(len(basis)), -1.0), rows, np.zeros(len(cuts)), np.append(traces, 0.0)[None], [1.0], bounds
        )
        if program.x is None or program.x[-1] < -DEFINITE:
            return None
        A = np.einsum("k,kij->ij", program.x[:-1], basis)
        eigenvalues, vectors = np.linalg.eigh(A)
        if eigenvalues[0] >= -DEFINITE and program.x[-1] - eigenvalues[0] <= DEFINITE:
            return np.asarray(A / np.linalg.norm(A))
        # Each eigenvector that a form violates becomes a condition on all later forms.
        cuts = np.vstack([cuts, np.einsum("kij,ia,ja->ak", basis, vectors, vectors)])
    return None


def require_motion(ivp: ConstrainedIvp) -> None:
    """Accept a start whose velocity some motion on the manifold can have.

    Where w^T G = 0, a motion has w^T g_qq (q', q') = 0 too, whatever its acceleration: the second derivative of w^T g = 0.

    Raises
    ------
    BadInput
        If it is not zero.
    """
    try:
        dependent = dependence_at(ivp)
    except np.linalg.LinAlgError:
        return
    bent = dependent.bends(np.asarray(ivp.value("H_p", tuple(ivp.p0), tuple(ivp.q0)), dtype=float)) if dependent else None
    if bent is None:
        return
    value, w = bent
    names = ivp.listed(map(int, np.flatnonzero(np.abs(w) > DEFINITE * np.max(np.abs(w)))))
    raise BadInput(
        f"no motion obeys the start of {ivp.problem}, case {ivp.case}: G v = 0, but G loses rank there, and {names} together change at "
        f"second order whatever the acceleration, w^T g_qq(v, v) = {value:.3g} with w^T G = 0; leave out the part that bends them."
    )
