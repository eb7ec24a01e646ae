"""H_pp, the inverse mass: whether it determines multipliers, which are those of G H_pp G^T, and the mass where it is singular."""

from dataclasses import dataclass

import numpy as np

from daebench.runs.ivp import Array, ConstrainedIvp

SINGULAR = 1e-12
"""Eigenvalue of a matrix with ones on its diagonal, below which it is zero."""

DEPENDENT = 1e-9
"""Singular value of G with rows of length one, relative to the largest, below which it is zero."""

SHARE = 1e-6
"""Smallest share of a constraint in a direction with which it is named."""


@dataclass(frozen=True)
class InverseMass:
    """Ranks of H_pp and of G H_pp G^T at a state, in coordinates in which the diagonal of H_pp is one, so that units do not matter.

    Parameters
    ----------
    d, rank : int
        Number of positions without the time, and rank of H_pp.
    definite : bool
        Whether H_pp has no negative eigenvalue.
    independent, determined : int
        Rank of G, and of G H_pp G^T: multipliers of independent constraints are determined where the two are equal.
    along : str
        Names of the constraints whose gradients have a part in momenta that no velocity depends on.
    """

    d: int
    rank: int
    definite: bool
    independent: int
    determined: int
    along: str

    @property
    def ranks(self) -> str:
        """The ranks in words."""
        return f"H_pp has rank {self.rank} of {self.d}, and G H_pp G^T rank {self.determined} of {self.independent}"

    @property
    def fault(self) -> str:
        """Why multipliers are not determined, and what to do, as part of a sentence; "" where they are."""
        if self.determined == self.independent:
            return ""
        where = f"{self.ranks}, so that multipliers are not determined: momenta along the gradient of {self.along} change no velocity"
        advice = "add a gauge term to H that makes them do so, such as (q.p)^2/8 for a unit quaternion q, or (v.p)^2 with that gradient v"
        return f"{where}; {advice}: where v.p = 0 it leaves the motion as it is"

    @property
    def note(self) -> str:
        """The sentence on an unusual H_pp that determines the multipliers; "" of a positive definite one."""
        if self.rank == self.d and self.definite:
            return ""
        what = "" if self.definite else ", and negative eigenvalues"
        return f"H_pp has rank {self.rank} of {self.d}{what}; G H_pp G^T is regular, so that multipliers are determined"


def inverse_mass(ivp: ConstrainedIvp, p: Array, q: Array) -> InverseMass:
    """Return the ranks of H_pp and of G H_pp G^T at a state.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.
    p, q : ndarray, shape(d,)
        The state.

    Raises
    ------
    LinAlgError
        If a value is not finite.
    """
    root, S = scaled(ivp, p, q)
    eigenvalues = np.linalg.eigvalsh(S)
    zero = SINGULAR * max(1.0, float(np.max(np.abs(eigenvalues))))
    rows = np.asarray(ivp.value("G", q), dtype=float)[:, : len(root)] * root
    lengths = np.linalg.norm(rows, axis=1)
    rows = rows / np.where(lengths > 0, lengths, 1.0)[:, None]
    U, sizes, Vt = np.linalg.svd(rows, full_matrices=False)
    independent = int(np.sum(sizes > DEPENDENT * max(float(np.max(sizes, initial=0.0)), DEPENDENT)))
    values, vectors = np.linalg.eigh(Vt[:independent] @ S @ Vt[:independent].T)
    # On the row space of G alone, where only H_pp decides: redundant constraints must not count as undetermined.
    lost = np.abs(values) <= zero
    shares = U[:, :independent] @ (vectors[:, lost] / sizes[:independent, None])
    along = np.flatnonzero(np.max(np.abs(shares), axis=1, initial=0.0) > SHARE * np.max(np.abs(shares), initial=0.0))
    return InverseMass(
        d=len(root),
        rank=int(np.sum(np.abs(eigenvalues) > zero)),
        definite=bool(eigenvalues[0] >= -zero),
        independent=independent,
        determined=int(np.sum(~lost)),
        along=ivp.listed(map(int, along)),
    )


def scaled(ivp: ConstrainedIvp, p: Array, q: Array) -> tuple[Array, Array]:
    """Return the roots r of the diagonal of H_pp without the time, 1 where it is zero, and H_pp with rows and columns divided by r."""
    n = ivp.moving
    H_pp = np.asarray(ivp.value("H_pp", p, q), dtype=float)[:n, :n]
    # Scaled by its diagonal, so that rank and sign do not depend on the units of the positions.
    root = np.sqrt(np.abs(np.diag(H_pp)))
    root = np.where(root > 0, root, 1.0)
    if not np.all(np.isfinite(H_pp)):
        raise np.linalg.LinAlgError(f"H_pp of {ivp.problem} is not finite")
    return root, H_pp / root[:, None] / root


def root_of(ivp: ConstrainedIvp, p: Array, q: Array) -> Array:
    """Return R with H_pp = R R^T without the time; raise LinAlgError where H_pp has negative eigenvalues.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.
    p, q : ndarray, shape(d,)
        The state.
    """
    root, S = scaled(ivp, p, q)
    eigenvalues, vectors = np.linalg.eigh(S)
    # A matrix that is regular, or indefinite, takes Cholesky: exact to rounding, and the error that callers expect.
    if eigenvalues[0] > SINGULAR or eigenvalues[0] < -SINGULAR:
        n = len(root)
        return np.linalg.cholesky(np.asarray(ivp.value("H_pp", p, q), dtype=float)[:n, :n])
    return np.asarray(root[:, None] * vectors * np.sqrt(np.where(eigenvalues > SINGULAR, eigenvalues, 0.0)))


def pseudo_mass(root: Array, S: Array) -> Array:
    """Return the pseudo-inverse of H_pp as :func:`scaled` gives it, shape(n, n)."""
    return np.asarray(np.linalg.pinv(S, rcond=SINGULAR, hermitian=True) / root[:, None] / root)


def mass(ivp: ConstrainedIvp, p: Array, q: Array) -> Array:
    """Return M, the inverse of H_pp; where that is singular, its pseudo-inverse, which moves no momentum that no velocity depends on.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.
    p, q : ndarray, shape(d,)
        The state.
    """
    if ivp.facts.EXPLICIT and not ivp.facts.EXTENDED:
        root, S = scaled(ivp, p, q)
        if np.min(np.abs(np.linalg.eigvalsh(S))) <= SINGULAR:
            return pseudo_mass(root, S)
    return np.asarray(ivp.value("mass", tuple(p), tuple(q)), dtype=float)
