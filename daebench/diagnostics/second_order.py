"""Constraints that depend on each other: what they forbid at second order, and whether a motion obeys a start."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from daebench.diagnostics.unit_rows import beyond_comparison, dependent_rows, of_length_one, root
from daebench.errors import BadInput
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.systems.lazily import scipy

ZERO = 1e-8
"""Second derivative of a combination of constraints, relative to its terms, below which it is zero."""

ROUNDING = 1e-13
"""Part of a row, or of the second derivatives of a constraint, that is rounding."""

AWAY = 1e-2
"""Distance, as a part of the largest coordinate, of a point where a gradient is compared with that at the start."""

DEFINITE = 1e-6
"""Eigenvalue, relative to the largest, above which it is positive, and below minus which it is negative."""

ROUNDS = 500
"""Number of iterations of the search for a semidefinite combination."""

LEFT = 1e-4
"""Size of a form on what another leaves free, below which it is zero: the other is known to :data:`DEFINITE` only."""


@dataclass(frozen=True)
class Dependence:
    """The combinations w of constraints without gradient, w^T G = 0, and the directions that G leaves free.

    Parameters
    ----------
    others : mapping of int to list of int
        Each constraint that depends on earlier ones, with these.
    w : ndarray, shape(m, c)
        Combinations, one a column, each of one dependent constraint with independent ones.
    free : ndarray, shape(n, f)
        Free directions x of unit mass, one a column.
    root : ndarray, shape(d, n)
        R with q = R x.
    curvatures : ndarray, shape(m, d, d)
        Second derivatives of each constraint.
    away : ndarray, shape(m, d, d)
        Those at a point away from the start, which tell a second derivative from the rounding of one that is zero.
    """

    others: Mapping[int, list[int]]
    w: Array
    free: Array
    root: Array
    curvatures: Array
    away: Array

    @property
    def independent(self) -> list[int]:
        """The constraints that depend on none before them."""
        return [k for k in range(len(self.w)) if k not in self.others]

    @cached_property
    def forms(self) -> Array:
        """The forms Z^T (w^T g_qq) Z of all combinations, Z = R x, shape(c, f, f), relative to their terms; zero if rounding."""
        Z = self.root @ self.free
        parts, away = Z.T @ self.curvatures @ Z, Z.T @ self.away @ Z
        # Where Z leaves the positions in g alone, all of Z^T g_qq Z is rounding of its terms.
        whole = ROUNDING / ZERO * np.linalg.norm(self.curvatures, axis=(1, 2)) * np.linalg.norm(Z, 2) ** 2
        sizes = np.abs(self.w).T @ np.maximum.reduce([whole, *(np.linalg.norm(form, axis=(1, 2)) for form in (parts, away))])
        forms = np.einsum("kc,kfg->cfg", self.w, parts) / np.where(sizes > 0, sizes, 1.0)[:, None, None]
        return without_rounding(forms, ZERO)

    @cached_property
    def kernel(self) -> tuple[Array, Array]:
        """Free directions that no semidefinite form forbids, shape(n, k), and the forms on them, which are then zero or indefinite."""
        left, forms = self.free, self.forms
        # Again on what is left: a form may be semidefinite there that was indefinite before.
        while (form := semidefinite(forms)) is not None:
            eigenvalues, vectors = np.linalg.eigh(form)
            rest = vectors[:, eigenvalues <= DEFINITE * eigenvalues[-1]]
            left, forms = left @ rest, without_rounding(rest.T @ forms @ rest, LEFT)
        return left, forms

    @property
    def forbidden(self) -> int:
        """The number of free directions that semidefinite forms forbid."""
        return int(self.free.shape[1] - self.kernel[0].shape[1])

    def bends(self, v: Array) -> tuple[float, Array] | None:
        """Return w^T g_qq (v, v) in parts of its terms, and w, of the combination for which it is largest; None if all are zero."""
        parts = self.curvatures @ v @ v
        moduli = np.maximum(np.abs(self.curvatures), np.abs(self.away)) @ np.abs(v) @ np.abs(v)
        sizes = np.abs(self.w).T @ np.maximum(moduli, ROUNDING / ZERO * np.linalg.norm(self.curvatures, axis=(1, 2)) * (v @ v))
        shares = self.w.T @ parts / np.where(sizes > 0, sizes, 1.0)
        k = int(np.argmax(np.abs(shares)))
        return (float(shares[k]), self.w[:, k]) if abs(shares[k]) > ZERO else None


def without_rounding(forms: Array, least: float) -> Array:
    """Return forms, those of a norm of at most ``least`` as zero."""
    return np.where(np.linalg.norm(forms, axis=(1, 2))[:, None, None] > least, forms, 0.0)


def dependence_at(ivp: ConstrainedIvp) -> Dependence | None:
    """Return the dependence of constraints on each other at the start; None if there is none, or if it is not examined.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers; the time is held, and has no direction.

    Raises
    ------
    LinAlgError
        If a value is not finite.
    """
    if beyond_comparison(ivp):
        return None
    q1 = ivp.q0 + AWAY * (float(np.max(np.abs(ivp.q0))) or 1.0) * np.cos(np.arange(ivp.d))
    G = _without_rounded_rows(ivp, q1)
    # Before the masses are asked for: independent constraints, the usual case, need no root of M^-1.
    if not dependent_rows(of_length_one(G[:, : ivp.moving])):
        return None
    R = root(ivp, ivp.q0)
    rows = of_length_one(G @ R)
    others = dependent_rows(rows)
    if not others:
        return None
    independent = [k for k in range(ivp.m) if k not in others]
    w = np.eye(ivp.m)[:, list(others)]
    shares = np.linalg.lstsq(rows[independent].T, rows[list(others)].T, rcond=None)[0]
    # A share that is rounding would bring in a curvature where the others have none.
    w[independent] = -np.where(np.abs(shares) > ROUNDING, shares, 0.0)
    sizes = np.linalg.norm(G @ R, axis=1)
    curvatures, away = (np.array([ivp.value("curvature", q, row) for row in np.eye(ivp.m)], dtype=float) for q in (ivp.q0, q1))
    free = np.linalg.svd(rows)[2][len(independent) :].T
    # Divided by the lengths, so that w combines the constraints themselves and not their normalised gradients.
    return Dependence(others, w / np.where(sizes > 0, sizes, 1.0)[:, None], free, R, curvatures, np.nan_to_num(away))


def _without_rounded_rows(ivp: ConstrainedIvp, away: Array) -> Array:
    """Return G at the start, with rows of rounding as zero, such as the gradient of a square; raise LinAlgError if it is not finite."""
    G = np.asarray(ivp.value("G", ivp.q0), dtype=float)
    if not np.all(np.isfinite(G)):
        raise np.linalg.LinAlgError(f"G of {ivp.problem} is not finite")
    lengths, others = (np.linalg.norm(rows[:, : ivp.moving], axis=1)[:, None] for rows in (G, ivp.value("G", away)))
    # Away from the start values may be NaN, which tell nothing.
    return np.where(lengths <= ZERO * AWAY * others, 0.0, G)


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

    Where w^T G = 0, a motion has w^T g_qq (q', q') = 0 too, whatever its acceleration: the second derivative of w^T g = 0, in which the
    time of a system in time is a position of velocity 1.

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
    share, w = bent
    combined = [int(k) for k in np.flatnonzero(np.abs(w) > DEFINITE * np.max(np.abs(w)))]
    change = f"{ivp.listed(combined)} {'changes' if len(combined) == 1 else 'together change'}"
    driver = ", or the driver that asks for it" if ivp.facts.EXTENDED else ""
    raise BadInput(
        f"no motion obeys the start of {ivp.problem}, case {ivp.case}: G v = 0, but G loses rank there, and {change} at second order "
        f"whatever the acceleration: where w^T G = 0, w^T g_qq(v, v) is {share:.2g} of its terms and not 0; leave out the part of v that "
        f"bends them{driver}.",
        "no-motion-at-second-order",
    )
