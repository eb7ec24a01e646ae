"""A trajectory: what a run gave, as arrays that belong to it alone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from daebench.errors import RunFailed
from daebench.runs.solver_steps import SolverSteps

Array = NDArray[np.float64]

CONSTRAINED = ("energy", "manifold", "integrals")
"""What a run on a constrained problem can monitor."""

POISSON = ("energy", "casimirs", "integrals")
"""What a run on a Poisson system can monitor."""

DOUBTED = "use a smaller h or tol, and see whether the motion has left the domain of H, or G has lost rank"
"""What to do where a run has come to its end with a number that is not finite."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What one method gave on one initial value problem, the states apart.

    Parameters
    ----------
    problem, case, method : str
        Names.
    parameters : mapping of str to float
        The problem's run-time parameters.
    knob : str
        "h" or "tol": what the method is steered by.
    value : float
        Step size or tolerance.
    t : ndarray, shape(n,)
        Output times, the first 0.
    steps : int
        Steps taken, as the solver counts them.
    work : mapping of str to int
        Exact counts: evaluations, linear solves, Newton sweeps. Empty if not counted.
    maxima : mapping of str to float
        Largest modulus of the monitored errors: "energy", "g", "Gv", and Casimir functions and first integrals by name.
    maxima_over : str
        "steps" or "outputs": what the maxima were taken over.
    pivot : float, optional
        Smallest relative pivot met in a linear solve.
    seconds : float
        CPU time of stepping; neither compilation nor, of tolerance-driven methods, the evaluation of H, g and the rank of G after each step
        is in it.
    compile_seconds : float
        Time until the kernel was ready.
    callback_seconds : float, optional
        Part of ``seconds`` spent in Python callbacks, for solvers that have them.
    callbacks : str, optional
        What IDA or CVODE called, see :data:`daebench.runs.request.CALLBACKS`; None of other methods.
    solver_steps : SolverSteps, optional
        What IDA or CVODE thinks of its steps, where it was asked for.
    failure : str, optional
        Why the run ended early, as a sentence; None if it is complete.
    interrupted : bool
        Whether it was the person at the keyboard who ended it.
    sensitivities : mapping of str to mapping of str to ndarray
        Derivatives of the states at the output times, where they were asked for, by the name of a parameter or initial value and by that
        of the states: dq/da is ``sensitivities["a"]["q"]``, shape(n, d), and dq_i/dq0_j is ``sensitivities["q0"]["q"][:, i, j]``.
        :func:`daebench.methods.run.prepare` says how a start is changed on the manifold.
    """

    problem: str
    case: str
    method: str
    parameters: Mapping[str, float]
    knob: str
    value: float
    t: Array
    steps: int
    work: Mapping[str, int] = field(default_factory=dict)
    maxima: Mapping[str, float] = field(default_factory=dict)
    maxima_over: str = "steps"
    pivot: float | None = None
    seconds: float
    compile_seconds: float = 0.0
    callback_seconds: float | None = None
    callbacks: str | None = None
    solver_steps: SolverSteps | None = None
    failure: str | None = None
    interrupted: bool = False
    sensitivities: Mapping[str, Mapping[str, Array]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Make a run with a number that is not finite a failure, whichever method it is of: the last of all checks."""
        if self.failure is None and (what := self._not_finite()):
            why = f"{self.method} on {self.problem}, case {self.case}: {what}, so that the run is no result; {DOUBTED}."
            object.__setattr__(self, "failure", why)

    def _not_finite(self) -> str | None:
        """Return which number is not finite, and when, as a sentence without an end; None if all are."""
        numbers = {name: (self.t, rows) for name, rows in self.states.items()}
        numbers |= {f"the stage multiplier {name}": multipliers for name, multipliers in self._stage_multipliers.items()}
        numbers |= {
            f"d{part}/d{name}": (self.t, rows.reshape(len(rows), -1))
            for name, by in self.sensitivities.items()
            for part, rows in by.items()
        }
        for name, (t, rows) in numbers.items():
            wrong = np.flatnonzero(~np.isfinite(rows).all(axis=1))
            if len(wrong):
                return f"{name} is not finite at t = {t[wrong[0]]:.9g}"
        wrong_maxima = [name for name, value in self.maxima.items() if not np.isfinite(value)]
        return f"the largest error of {wrong_maxima[0]} is not finite" if wrong_maxima else None

    @property
    def states(self) -> Mapping[str, Array]:
        """The states by name; each shape(n, ...)."""
        raise NotImplementedError

    @property
    def _stage_multipliers(self) -> Mapping[str, tuple[Array, Array]]:
        """Stage multipliers of steps by name, with their times."""
        return {}

    def complete(self) -> Self:
        """Return the trajectory itself.

        Raises
        ------
        RunFailed
            If the run ended early; the message is the failure's sentence.
        """
        if self.failure is not None:
            raise RunFailed(self.failure)
        return self


@dataclass(frozen=True, kw_only=True)
class Passage:
    """A place where G lost rank, and a run went on.

    Parameters
    ----------
    t : float
        When, as extrapolated from the pivots before.
    pivot : float
        Smallest pivot that was measured around it, see ``daebench.schemes.kernels.rank``.
    branch : str
        "through": the velocity after is the smooth continuation of that before; "reflected": it is the opposite of that; "other branch":
        it is neither; "unknown": the run ended there.
    turn : float
        Angle between the velocity before and that after, extrapolated back, in the metric of kinetic energy, degrees.
    """

    t: float
    pivot: float
    branch: str
    turn: float


@dataclass(frozen=True, kw_only=True)
class Trajectory(Outcome):
    """What one method gave on a constrained Hamiltonian system.

    Parameters
    ----------
    q, p : ndarray, shape(n, d)
        Positions and momenta at the output times.
    lam : ndarray, shape(n, m), optional
        Multipliers lam(p, q) of HLW (1.12) at the output times, where they were asked for.
    raw : mapping of str to (ndarray, shape(n,), ndarray, shape(n, m))
        Stage multipliers of a fixed-step scheme by name, where they were asked for: the times they belong to, and their values.
    passages : sequence of Passage
        Where G lost rank and the run went on.
    """

    q: Array
    p: Array
    lam: Array | None = None
    raw: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)
    passages: Sequence[Passage] = ()

    @property
    def states(self) -> Mapping[str, Array]:
        """The states by name: q, p, and lam where there are multipliers; each shape(n, ...)."""
        return {"q": self.q, "p": self.p} | ({} if self.lam is None else {"lam": self.lam})

    @property
    def _stage_multipliers(self) -> Mapping[str, tuple[Array, Array]]:
        return self.raw


@dataclass(frozen=True, kw_only=True)
class PoissonTrajectory(Outcome):
    """What one method gave on a Poisson system.

    Parameters
    ----------
    y : ndarray, shape(n, size)
        States at the output times.
    """

    y: Array

    @property
    def states(self) -> Mapping[str, Array]:
        """The states by name: y, shape(n, size)."""
        return {"y": self.y}
