"""Records of the steps of IDA or CVODE: their sizes, orders and work, and the estimated error and the weight of each unknown."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Counts = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class SolverSteps:
    """The steps of a run as seen by the solver, one per row.

    A step is accepted if the squares of estimate times weight, summed over all tested unknowns, are at most n. A weight is
    1 / (rtol |y| + atol), with y at the beginning of the step. Estimates are those of IDAGetEstLocalErrors and CVodeGetEstLocalErrors.
    If CVODE projects its steps, these estimates are not projected; the tested values are smaller.

    Parameters
    ----------
    t : ndarray, shape(k,)
        Ends of the steps, s.
    h : ndarray, shape(k,)
        Their sizes, s.
    order : ndarray of int, shape(k,)
        Orders of the formula.
    iterations : ndarray of int, shape(k,)
        Newton iterations, of all attempts at the step.
    error_failures, newton_failures : ndarray of int, shape(k,)
        Attempts at the step that failed in the error test, and in Newton's iteration.
    accepted : ndarray of bool, shape(k,)
        Whether the step was taken. If IDA gives up, failures of the error test are included: all attempts at the first
        step, or the last attempt at another.
    y, estimate, weight : ndarray, shape(k, n)
        Unknowns at the end of the step, or at its beginning if it was not taken; their estimated errors, and weights.
    blocks : mapping of str to slice
        Places of the unknowns, by name: "q", "v" or "p", "lam", "mu", "Lam" and "Mu" with Lam' = lam and Mu' = mu, or "y".
    untested : collection of str
        Names of blocks that the test leaves out.
    tol : float
        The tolerance.
    """

    t: Array
    h: Array
    order: Counts
    iterations: Counts
    error_failures: Counts
    newton_failures: Counts
    accepted: NDArray[np.bool_]
    y: Array
    estimate: Array
    weight: Array
    blocks: Mapping[str, slice]
    untested: Collection[str] = ()
    tol: float

    @property
    def shares(self) -> dict[str, Array]:
        """Share of each block in the error test, shape(k,). The squares of tested shares sum to the square of the value compared with 1.

        The share of a block that is left out is computed with the weight 1 / (tol |y| + tol).
        """
        scaled = self.estimate * self.weight
        for name in self.untested:
            place = self.blocks[name]
            scaled[:, place] = self.estimate[:, place] / (self.tol * (1.0 + np.abs(self.y[:, place])))
        return {name: np.sqrt(np.sum(scaled[:, place] ** 2, axis=1) / self.y.shape[1]) for name, place in self.blocks.items()}

    @property
    def tested(self) -> Array:
        """Quantity that the error test compares with 1, shape(k,); for projected steps, without the projection."""
        shares = [share for name, share in self.shares.items() if name not in self.untested]
        return np.asarray(np.sqrt(np.sum(np.square(shares), axis=0)))

    @property
    def columns(self) -> dict[str, Array | Counts]:
        """All data as columns of a table: by name of unknowns "q1", "estimate_q1" and "weight_q1", and "share_q" of each block."""
        rows: dict[str, Array | Counts] = {"t": self.t, "h": self.h, "order": self.order, "iterations": self.iterations}
        rows |= {"error_failures": self.error_failures, "newton_failures": self.newton_failures, "accepted": self.accepted.astype(np.int64)}
        rows |= {f"share_{name}": share for name, share in self.shares.items()}
        for prefix, values in (("", self.y), ("estimate_", self.estimate), ("weight_", self.weight)):
            for name, place in self.blocks.items():
                rows |= {f"{prefix}{name}{i + 1}": column for i, column in enumerate(values[:, place].T)}
        return rows
