"""What IDA or CVODE thinks of its own steps: their sizes, orders and work, and the estimated error of each unknown beside its weight."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Counts = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class SolverSteps:
    """The steps of a run as the solver saw them, one a row.

    A step is accepted if squares of estimates times weights, over all unknowns that are tested, add up to n at most. A weight is
    1 / (rtol |y| + atol), with y at the beginning of the step. Estimates are those of IDAGetEstLocalErrors and CVodeGetEstLocalErrors;
    where CVODE projects its steps, they are not projected, and what is tested is less.

    Parameters
    ----------
    t : ndarray, shape(k,)
        Ends of the steps, s.
    h : ndarray, shape(k,)
        Their sizes, s.
    order : ndarray of int, shape(k,)
        Orders of the formula.
    iterations : ndarray of int, shape(k,)
        Iterations of Newton, of all attempts at the step.
    error_failures, newton_failures : ndarray of int, shape(k,)
        Attempts at the step that failed in the error test, and in Newton's iteration.
    accepted : ndarray of bool, shape(k,)
        Whether the step was taken. Where IDA gives up, what failed in the error test last is here too: of the first step all attempts, of
        another one the last.
    y, estimate, weight : ndarray, shape(k, n)
        Unknowns at the end of the step, of one that was not taken at its beginning; their estimated errors, and weights.
    blocks : mapping of str to slice
        Where the unknowns are, by name: "q", "v" or "p", "lam", "mu", "Lam" and "Mu" with Lam' = lam and Mu' = mu, or "y".
    untested : collection of str
        Names of blocks that are left out of the test.
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
        """Part of each block in the error test, shape(k,): squares of those that are tested add up to the square of what is held against 1.

        That of a block which is left out is what it would be with a weight of 1 / (tol |y| + tol).
        """
        scaled = self.estimate * self.weight
        for name in self.untested:
            place = self.blocks[name]
            scaled[:, place] = self.estimate[:, place] / (self.tol * (1.0 + np.abs(self.y[:, place])))
        return {name: np.sqrt(np.sum(scaled[:, place] ** 2, axis=1) / self.y.shape[1]) for name, place in self.blocks.items()}

    @property
    def tested(self) -> Array:
        """What the error test compares with 1, shape(k,); of projected steps, without the projection."""
        shares = [share for name, share in self.shares.items() if name not in self.untested]
        return np.asarray(np.sqrt(np.sum(np.square(shares), axis=0)))

    @property
    def columns(self) -> dict[str, Array | Counts]:
        """All of it as columns of a table by name, of unknowns "q1", "estimate_q1" and "weight_q1", and "share_q" of each block."""
        rows: dict[str, Array | Counts] = {"t": self.t, "h": self.h, "order": self.order, "iterations": self.iterations}
        rows |= {"error_failures": self.error_failures, "newton_failures": self.newton_failures, "accepted": self.accepted.astype(np.int64)}
        rows |= {f"share_{name}": share for name, share in self.shares.items()}
        for prefix, values in (("", self.y), ("estimate_", self.estimate), ("weight_", self.weight)):
            for name, place in self.blocks.items():
                rows |= {f"{prefix}{name}{i + 1}": column for i, column in enumerate(values[:, place].T)}
        return rows
