"""Trajectories: the results of runs, as arrays of their own."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput, RunFailed, bounded
from daebench.runs.interpolant import Interpolant
from daebench.runs.result import Result
from daebench.runs.solver_steps import SolverSteps
from daebench.runs.state import CONSTRAINED, POISSON, State
from daebench.runs.trajectory_files import WRITERS, columns, dataset, write_trajectory
from daebench.systems.lazily import pandas as pd

Array = NDArray[np.float64]

DOUBTED = "use a smaller h or tol, and check whether the motion has left the domain of H, or G has lost rank"
"""Advice for a run that reached its end with a number that is not finite."""


IN_FILES = (
    *("problem", "case", "parameters", "method", "knob", "value", "steps", "work", "maxima", "maxima_over", "pivot", "seconds"),
    *("compile_seconds", "callback_seconds", "callbacks", "failure", "interrupted"),
)
"""Fields of a run that a file contains besides its arrays, so that :func:`daebench.load` returns them."""


@dataclass(frozen=True, kw_only=True)
class Outcome(Result):
    """Result of one method on one initial value problem, without the states.

    Parameters
    ----------
    problem, case, method : str
        Names.
    parameters : mapping of str to float
        The problem's run-time parameters.
    knob : str
        "h" or "tol": the control parameter of the method.
    value : float
        Step size or tolerance.
    t : ndarray, shape(n,)
        Output times, the first 0.
    steps : int
        Steps taken, as counted by the solver.
    work : mapping of str to int
        Exact counts: evaluations, linear solves, Newton iterations. Empty if not counted.
    maxima : mapping of str to float
        Largest modulus of the monitored errors: "energy", "g", "Gv", and Casimir functions and first integrals by name.
    maxima_over : str
        "steps" or "outputs": the times over which the maxima were taken.
    pivot : float, optional
        Smallest relative pivot in a linear solve.
    seconds : float
        CPU time of stepping. It excludes compilation and, for tolerance-driven methods, the evaluation of H, g and the rank of G after each
        step.
    compile_seconds : float
        Time until the kernel was ready.
    callback_seconds : float, optional
        Part of ``seconds`` spent in Python callbacks, for solvers that have them.
    callbacks : str, optional
        Implementation of the callbacks of IDA or CVODE, see :data:`daebench.runs.request.CALLBACKS`; None for other methods.
    solver_steps : SolverSteps, optional
        Record of the steps of IDA or CVODE, if requested.
    failure : str, optional
        Why the run ended early, as a sentence; None if it is complete.
    interrupted : bool
        Whether the user interrupted it.
    looks : (ndarray, ndarray), optional
        Times and states, shape(k,) and shape(k, ...), of a fixed-step run that are looked at to judge it, whatever is stored.
    sensitivities : mapping of str to mapping of str to ndarray
        Derivatives of the states at the output times, if requested, by the name of a parameter or initial value and by that of
        the states: dq/da is ``sensitivities["a"]["q"]``, shape(n, d), and dq_i/dq0_j is ``sensitivities["q0"]["q"][:, i, j]``.
        :func:`daebench.run` says how a start is changed on the manifold.
    ivp : InitialValueProblem, optional
        The solved problem, for energies and pictures. It is not part of a copy that is sent to another process.
    """

    drawn_by: ClassVar[str] = "daebench.draw.trajectory"
    state: ClassVar[State]
    of_outputs: ClassVar[Mapping[str, Any]] = {"sensitivities": {}}
    """Fields that belong to the stored states, each with its value if there are none."""

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
    looks: tuple[Array, Array] | None = field(default=None, repr=False, compare=False)
    sensitivities: Mapping[str, Mapping[str, Array]] = field(default_factory=dict)
    ivp: Any = field(default=None, repr=False, compare=False)

    def __getstate__(self) -> dict[str, Any]:
        """Return the content for another process, without the problem, which consists of functions, and quantities computed from it."""
        return {item.name: getattr(self, item.name) for item in fields(self)} | {"ivp": None}

    def __post_init__(self) -> None:
        """Turn a run with a number that is not finite into a failure, for every method; this is the last of all checks.

        A sentence of any length, which has words of code from outside, is shortened.
        """
        if self.failure is None and (what := self._not_finite()):
            why = f"{self.method} on {self.problem}, case {self.case}: {what}, so the run is invalid; {DOUBTED}."
            object.__setattr__(self, "failure", why)
        if self.failure is not None:
            object.__setattr__(self, "failure", bounded(self.failure))

    def _not_finite(self) -> str | None:
        """Return which number is not finite, and when, as a sentence without a full stop; None if all are finite."""
        numbers = {name: (self.t, rows) for name, rows in self.states.items()}
        numbers |= {f"the stage multiplier {name}": multipliers for name, multipliers in self.stage_multipliers.items()}
        numbers |= {
            f"d{part}/d{name}": (self.t, rows.reshape(len(rows), -1))
            for name, by in self.sensitivities.items()
            for part, rows in by.items()
        }
        for name, (t, rows) in numbers.items():
            # The first time, at which the cause is: what follows a NaN is NaN as well.
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
    def vectors(self) -> tuple[Array, ...]:
        """The vectors of the states, (p, q) or (y,), as the functions of a problem take them; each shape(n, ...)."""
        return tuple(getattr(self, name) for name in self.state.vectors)

    @property
    def position(self) -> Array:
        """Positions, or coordinates of a Poisson system, shape(n, ...)."""
        return self.vectors[-1]

    @classmethod
    def parts(cls, rows: Array) -> dict[str, Any]:
        """Return states as they are stored, shape(n, N), as contiguous vectors by name."""
        names = cls.state.vectors
        return dict(zip(names, map(np.ascontiguousarray, np.split(rows, len(names), axis=1)), strict=True))

    def looked_at(self) -> Self:
        """Return the run with the states that were looked at in place of those that are stored, if there are such."""
        if self.looks is None:
            return self
        t, rows = self.looks
        return replace(self, t=t, looks=None, **self.parts(rows), **self.of_outputs)

    @property
    def stage_multipliers(self) -> Mapping[str, tuple[Array, Array]]:
        """Stage multipliers of steps by name, with their times."""
        return {}

    @property
    def solved(self) -> Any:
        """The initial value problem that was solved.

        Raises
        ------
        BadInput
            If the trajectory comes from a file or another process without it.
        """
        if self.ivp is None:
            raise BadInput(
                f"this trajectory was stored without the functions of {self.problem}; give daebench.load its problem, or run again.",
                "stored-without-functions",
            )
        return self.ivp

    @cached_property
    def sol(self) -> Interpolant:
        """States between the outputs: ``sol(t)["q"]``, shape(d,), or shape(k, d) for k times.

        ``sol.error`` estimates the error that interpolation adds to that of the run.

        Raises
        ------
        BadInput
            If there is only one output.
        """
        return Interpolant(self.t, self.states)

    def summary(self) -> dict[str, Any]:
        """Return a summary of the run, by name: its problem and method, how far it came, and its largest errors."""
        return {
            "problem": self.problem,
            "case": self.case,
            "parameters": dict(self.parameters),
            "method": self.method,
            self.knob: self.value,
            "steps": self.steps,
            "t": float(self.t[-1]),
            "failure": self.failure,
            **{f"largest error of {name}": value for name, value in self.maxima.items()},
            "maxima over": self.maxima_over,
            "seconds": self.seconds,
            "compile seconds": self.compile_seconds,
            "callbacks": self.callbacks,
            "work": dict(self.work),
        }

    def about(self) -> dict[str, Any]:
        """Return the description of the run that a file contains besides its arrays."""
        passages = [asdict(passage) for passage in getattr(self, "passages", ())]
        definition = {} if self.ivp is None else {"definition": self.ivp.facts.FINGERPRINT}
        return {name: getattr(self, name) for name in IN_FILES} | definition | {"passages": passages}

    def reactions(self) -> Any:
        """Return the forces (N) and torques (N m) of all joints of a mechanism on its bodies, at the outputs.

        They follow from the Newton-Euler equations of the bodies, with gravity, springs, dampers and drivers, also for joints that are
        shared points. What redundant joints leave open is NaN. Of a problem that is no mechanism, it is the force -G_i^T lam_i of each
        constraint g_i in the coordinates q.

        Returns
        -------
        daebench.diagnostics.reactions.Reactions
            ``loads`` has a record of each joint and body; ``table`` has all numbers, a row a time.

        Raises
        ------
        BadInput
            If the problem has no constraints, or the trajectory was stored without its functions.

        Examples
        --------
        >>> import daebench
        >>> run = daebench.run("planar_pendulum", case="rotating", method="rattle", h=0.01, t_end=1)
        >>> [(load.joint, load.force.shape) for load in run.reactions().loads]
        [('g1', (101, 2))]
        """
        return import_module("daebench.diagnostics.reactions").reactions(self)

    def to_frame(self) -> "pd.DataFrame":
        """Return the outputs as a table, one row per time: t, then q1, ..., p1, ..., or y1, ..., and other requested quantities."""
        return pd.DataFrame(columns(self))

    def to_xarray(self) -> Any:
        """Return the outputs as an xarray Dataset over time and component; its attributes describe the run.

        Raises
        ------
        BadInput
            If xarray is not installed.
        """
        return dataset(self)

    def save(self, path: "str | Path") -> list[Path]:
        """Write FILE.npz, which :func:`daebench.load` reads, or FILE.csv for other programs; return the files that were written.

        An existing file is replaced.

        Raises
        ------
        BadInput
            If the file ends in neither .npz nor .csv, or its folder is missing.
        """
        path = Path(path)
        if path.suffix.lower() not in WRITERS:
            raise BadInput(f"{path}: the file must end in {' or '.join(WRITERS)}.", "save-file-ending")
        if not path.parent.is_dir():
            raise BadInput(f"{path}: there is no folder {path.parent}; make it first.", "save-no-such-folder")
        return write_trajectory(path, self)

    def complete(self) -> Self:
        """Return the trajectory itself.

        Raises
        ------
        RunFailed
            If the run ended early; the message is the failure's sentence.
        """
        if self.failure is not None:
            raise RunFailed(self.failure, "run-stopped-early")
        return self


@dataclass(frozen=True, kw_only=True)
class Passage:
    """A point at which G lost rank and the run went on.

    Parameters
    ----------
    t : float
        Time, extrapolated from the pivots before.
    pivot : float
        Smallest pivot measured near it, see ``daebench.schemes.kernels.rank``.
    branch : str
        "through": the velocity after it continues the velocity before it smoothly; "reflected": it is the opposite of that velocity;
        "other branch": it is neither; "unknown": the run ended there.
    turn : float
        Angle between the velocity before and the velocity after, extrapolated back, in the metric of kinetic energy, degrees.
    """

    t: float
    pivot: float
    branch: str
    turn: float


@dataclass(frozen=True, kw_only=True)
class Trajectory(Outcome):
    """Result of one method on a constrained Hamiltonian system.

    Parameters
    ----------
    q, p : ndarray, shape(n, d)
        Positions and momenta at the output times.
    lam : ndarray, shape(n, m), optional
        Multipliers lam(p, q) of HLW (1.12) at the output times, if requested.
    raw : mapping of str to (ndarray, shape(n,), ndarray, shape(n, m))
        Stage multipliers of a fixed-step scheme by name, if requested: the times to which they belong, and their values.
    passages : sequence of Passage
        Points at which G lost rank and the run went on.
    """

    state = CONSTRAINED
    of_outputs: ClassVar[Mapping[str, Any]] = {"sensitivities": {}, "lam": None, "raw": {}}
    q: Array
    p: Array
    lam: Array | None = None
    raw: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)
    passages: Sequence[Passage] = ()

    @property
    def states(self) -> Mapping[str, Array]:
        """The states by name: q, p, and lam if multipliers were requested; each shape(n, ...)."""
        return {"q": self.q, "p": self.p} | ({} if self.lam is None else {"lam": self.lam})

    @property
    def stage_multipliers(self) -> Mapping[str, tuple[Array, Array]]:
        """Stage multipliers of steps by name, with their times."""
        return self.raw


@dataclass(frozen=True, kw_only=True)
class PoissonTrajectory(Outcome):
    """Result of one method on a Poisson system.

    Parameters
    ----------
    y : ndarray, shape(n, size)
        States at the output times.
    """

    state = POISSON
    y: Array

    @property
    def states(self) -> Mapping[str, Array]:
        """The states by name: y, shape(n, size)."""
        return {"y": self.y}
