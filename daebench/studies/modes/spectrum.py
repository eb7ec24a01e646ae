"""The linearisation at rest of each formulation, as a matrix on the states that its own constraints leave, and its eigenvalues.

With p = dp, q = q* + dq and lam = lam* + dlam the motion near rest is::

    dq' = H_pp dp + H_pq dq,    dp' = -H_qp dp - C dq' - K dq - G^T dlam,    K = H_qq + sum lam_i g_i'',    C = -dF/dv

Index 3 asks for G dq = 0, of which the hidden constraint G dq' = 0 follows, index 2 for G dq' = 0 alone, index 1 for G dq'' = 0 alone. What
is not asked for is a direction in which a run drifts: an eigenvalue 0.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.studies.modes.equilibrium import Equilibrium, largest, stiffness

DEPENDENT = 1e-10
"""Part of the largest singular value below which one is zero."""

ZERO = 1e-5
"""Eigenvalues of at most this part of the largest are zeros of the drift: two in one place come out as the square root of round-off."""

SLOW = 1e-4
"""Eigenvalues below this part of the largest are sought again: the round-off of the largest hides what tells them apart."""

ROUNDED = 16.0
"""A square of a frequency within so many roundings of the terms that it is made of is zero, times the number of positions."""

Spectra = Mapping[str, NDArray[np.complex128]]


@dataclass(frozen=True)
class Linear:
    """The system at rest."""

    H_pp: Array
    H_pq: Array
    K: Array
    """Second derivatives of H, and of H + lam^T g by q; shape (d, d)."""
    G: Array
    """Derivative of the constraints; shape (m, d)."""
    sizes: Array
    """Sizes of the terms of K, whose sum may be far smaller; shape (d, d)."""
    C: Array
    """Damping; shape (d, d)."""

    @classmethod
    def at(cls, ivp: ConstrainedIvp, rest: Equilibrium, damping: Array) -> "Linear":
        """Return it at an equilibrium."""
        state = np.zeros(ivp.d), rest.q
        H_pp, H_pq = (np.array(ivp.value(name, *state), dtype=float) for name in ("H_pp", "H_pq"))
        _require_mass_alone(ivp, H_pp, H_pq)
        K, sizes = stiffness(ivp, rest.q, rest.lam)
        return cls(H_pp, H_pq, K, np.array(ivp.value("G", rest.q), dtype=float), sizes, damping)

    @property
    def velocity(self) -> Array:
        """The matrix of dq' by (dp, dq)."""
        return np.hstack([self.H_pp, self.H_pq])

    def field(self, *, alpha: float = 0.0, beta: float = 0.0, stiff: float = 0.0) -> Array:
        """Return the matrix of (dp', dq') by (dp, dq) where dlam is such that G dq'' + 2 alpha G dq' + beta^2 G dq = 0.

        With ``stiff`` there is no multiplier, and the potential energy has stiff |g|^2 / 2 more.
        """
        d, G = len(self.K), self.G
        force = np.hstack([-self.H_pq.T, -self.K]) - self.C @ self.velocity
        if stiff:
            force[:, d:] -= stiff * G.T @ G
            return np.vstack([force, self.velocity])
        if not len(G):
            return np.vstack([force, self.velocity])
        accelerated = G @ (self.H_pp @ force + self.H_pq @ self.velocity)
        accelerated += 2 * alpha * G @ self.velocity + beta**2 * np.hstack([np.zeros_like(G), G])
        S = G @ self.H_pp @ G.T
        dlam = np.linalg.lstsq(S, accelerated, rcond=DEPENDENT)[0]
        return np.vstack([force - G.T @ dlam, self.velocity])

    def left_by(self, *rows: Array) -> Array:
        """Return an orthonormal basis of the states (dp, dq) that some rows leave, its vectors as columns."""
        matrix = np.vstack(rows)
        _, singular, directions = np.linalg.svd(matrix)
        return np.asarray(directions[int(np.sum(singular > DEPENDENT * np.max(singular, initial=0.0))) :].T)


def _require_mass_alone(ivp: ConstrainedIvp, H_pp: Array, H_pq: Array) -> None:
    """Refuse an equilibrium whose small oscillations are not those of K dq = w^2 M dq."""
    size = np.sqrt(np.maximum(np.diag(H_pp), np.finfo(float).tiny))
    if not np.min(np.linalg.eigvalsh(H_pp / np.outer(size, size))) > DEPENDENT:
        raise BadInput(f"modes need a mass matrix, and H_pp of {ivp.problem} is not positive definite at rest.", "modes-mass-not-definite")
    if np.any(H_pq):
        raise BadInput(
            f"modes need an H whose momenta and positions are not coupled at rest, and H_pq of {ivp.problem} is not zero there.",
            "modes-coupled-momenta",
        )


def spectra(system: Linear, *, alpha: float, beta: float, stiff: float) -> Spectra:
    """Return the eigenvalues of each formulation, 1/s, those with the largest modulus first; without constraints of the ODE alone."""
    if not len(system.G):
        return {"ode": _eigenvalues(system.field(), np.eye(2 * len(system.K)))}
    G0 = np.hstack([np.zeros_like(system.G), system.G])
    hidden = system.G @ system.velocity
    free, index2 = system.left_by(G0, hidden), system.left_by(hidden)
    everything = np.eye(2 * len(system.K))
    ode, stabilised = system.field(), system.field(alpha=alpha, beta=beta)
    matrices = {
        "index3": (ode, free),
        "index2": (ode, index2),
        "index1": (ode, everything),
        "ggl": (ode, free),
        "ode": (ode, everything),
        "baumgarte": (stabilised, everything),
        "penalty": (system.field(stiff=stiff), everything),
    }
    return {name: _eigenvalues(matrix, basis) for name, (matrix, basis) in matrices.items()}


def _eigenvalues(matrix: Array, basis: Array) -> NDArray[np.complex128]:
    eigenvalues = np.linalg.eigvals(basis.T @ matrix @ basis).astype(complex)
    return np.asarray(eigenvalues[np.argsort(-np.abs(eigenvalues), kind="stable")])


def largest_real(eigenvalues: NDArray[np.complex128]) -> float:
    """Return the largest real part, 0 where it is the root of round-off of what is 0 twice, or of a pair of the stiffest."""
    growth = float(np.max(eigenvalues.real, initial=0.0))
    return growth if growth > ZERO * largest(eigenvalues) else 0.0


def zeros(eigenvalues: NDArray[np.complex128]) -> int:
    """Return how many eigenvalues are zero."""
    return int(np.sum(np.abs(eigenvalues) <= ZERO * max(largest(eigenvalues), np.finfo(float).tiny)))


def natural(system: Linear) -> tuple[Array, Array, Array]:
    """Return the squares of natural frequencies, 1/s^2, in ascending order, and the shapes dq of the modes and M dq, as rows.

    They are the stationary values of dq^T K dq / dq^T M dq over the directions dq with G dq = 0, by a symmetric eigenvalue problem in
    positions of unit mass, so that equal and nearly equal ones are as accurate as others. Each value is taken anew along its direction, so
    that it has its own round-off and not that of the stiffest; one within that is zero. The largest entry of a shape is 1.
    """
    root = np.linalg.cholesky(system.H_pp)  # dq = root x has unit mass in x
    _, singular, directions = np.linalg.svd(system.G @ root)
    free = directions[int(np.sum(singular > DEPENDENT * np.max(singular, initial=0.0))) :].T
    vectors = free @ _directions(free.T @ root.T @ system.K @ root @ free)
    along = root @ vectors
    squares = np.sum(along * (system.K @ along), axis=0)
    rounding = ROUNDED * float(np.finfo(float).eps) * len(root) * np.sum(np.abs(along) * (system.sizes @ np.abs(along)), axis=0)
    squares = np.where(np.abs(squares) <= rounding, 0.0, squares)
    order = np.argsort(squares, kind="stable")
    shapes, momenta = along.T[order], np.linalg.solve(root.T, vectors).T[order]
    largest = shapes[np.arange(len(shapes)), np.argmax(np.abs(shapes), axis=1)][:, None]
    return squares[order], shapes / largest, momenta / largest


def _directions(A: Array) -> Array:
    """Return the eigenvectors of a symmetric matrix as columns; the slow ones are sought again among themselves, without the stiffest."""
    values, vectors = np.linalg.eigh(A)
    slow = np.abs(values) < SLOW * largest(values)
    if slow.any():
        vectors[:, slow] = vectors[:, slow] @ _directions(vectors[:, slow].T @ A @ vectors[:, slow])
    return np.asarray(vectors)
