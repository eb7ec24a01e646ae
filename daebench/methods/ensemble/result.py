"""The results of the runs of all members of an ensemble."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from daebench.methods.fixed_step.stepping import IN_SHORT
from daebench.runs.members import Members
from daebench.runs.trajectory import Array


@dataclass(frozen=True)
class EnsembleRun:
    """The runs of n members, each of N steps.

    Parameters
    ----------
    members : Members
        The members.
    method : str
        Name in the grammar of methods.
    index : ndarray, shape(k,)
        Numbers of steps after which states are stored, from 0 to N.
    states : ndarray, shape(k, n, c)
        States, as (p, q) or y; NaN where a member had stopped before.
    ends : ndarray, shape(n, c)
        Last good state of each member.
    steps : ndarray of int, shape(n,)
        Steps that each member took.
    status : ndarray of int, shape(n,)
        0 if a member reached its end.
    maxima : mapping of str to ndarray, shape(n,)
        Largest moduli of the errors that were monitored, by name.
    pivots : ndarray, shape(n,)
        Smallest relative pivot of each member; infinite if no linear system was solved.
    work : mapping of str to ndarray of int, shape(n,)
        Evaluations, solves and iterations by kind; empty where they were not counted.
    seconds, compile_seconds : float
        CPU time of the loops over steps, on all cores together, and wall time until they began, s.
    lanes : int
        Number of members at once on one core; 1 if they were run one by one.
    sentence : callable
        ``sentence(i)`` says why a member stopped.
    """

    members: Members
    method: str
    index: NDArray[np.int64]
    states: Array
    ends: Array
    steps: NDArray[np.int64]
    status: NDArray[np.int64]
    maxima: Mapping[str, Array]
    pivots: Array
    work: Mapping[str, NDArray[np.int64]]
    seconds: float
    compile_seconds: float
    lanes: int
    sentence: Callable[[int], str] = field(repr=False)

    @property
    def t(self) -> Array:
        """Times of the stored states, s, shape(k,), or shape(k, n) where members have their own step sizes."""
        times: Array = np.multiply.outer(self.index.astype(float), self.members.h)
        return times

    def reason(self, i: int) -> str:
        """Return the reason in two or three words; "" if a member reached its end."""
        status = int(self.status[i])
        return IN_SHORT.get(status, "not begun" if not self.steps[i] else "stopped") if status else ""

    def failure(self, i: int) -> str | None:
        """Return why a member stopped early, None if it did not."""
        return self.sentence(i) if self.status[i] else None

    @property
    def failed(self) -> NDArray[np.int64]:
        """Members that stopped early, by number."""
        return np.flatnonzero(self.status)
