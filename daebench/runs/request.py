"""Methods and requests: a method solves an initial value problem with a step size or tolerance, and a request says what to compute."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeVar

from daebench.errors import BadInput, positive, real, require_known, whole
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.state import State

Progress = Callable[[float], None]
"""Called from time to time with the completed fraction of the run."""

Told = Callable[[float, str], None]
"""Called with the fraction of the work that is done, and what is done now."""


def silent(fraction: float, label: str) -> None:
    """Say nothing of the work that is done."""


ON_SINGULAR = {
    "stop": "the run ends there",
    "continue": "it continues, and reports the branch of the motion",
    "least-squares": "it continues, and systems of constraints are solved by least squares, so they may be redundant",
}
"""Actions of a run if G loses rank."""


CALLBACKS = {
    "native": "machine code, if the libraries of SUNDIALS allow it",
    "python": "Python functions, through scikit-sundae",
}
"""Implementation of the equations and of the loop over steps for IDA and CVODE: machine code, or Python."""


PRECISIONS = {
    "float64": "double precision",
    "mixed": "forces in single precision, and everything else in double precision",
    "float32": "single precision",
}
"""Number types of a run of a fixed-step method."""


CHECKED: Mapping[str, Callable[[str, Any], Any]] = {
    **dict.fromkeys(("steps", "every", "points"), whole),
    "t_end": real,
    "seconds_limit": positive,
}
"""Checks of the numbers of a request."""


@dataclass(frozen=True)
class WorkLimit:
    """Limit of a tolerance-driven run by its work, not by the clock, so that the outcome does not depend on the machine.

    Parameters
    ----------
    calls : int
        Largest number of calls of the residual, or of the right side.
    slow_calls, slow_part : int
        The run ends earlier if ``slow_calls`` consecutive calls cover less than one part in ``slow_part`` of it.
    """

    calls: int
    slow_calls: int
    slow_part: int


@dataclass(frozen=True, kw_only=True)
class Request:
    """A request to a method for the solution of an initial value problem.

    Parameters
    ----------
    value : float
        Step size or tolerance of the method.
    t_end : float, optional
        End of the run; a fixed-step method takes floor(t_end / h + 1e-9) steps of exactly h.
    steps : int, optional
        Number of steps of a fixed-step method, in place of t_end.
    every : int, optional
        Number of steps between stored states of a fixed-step method; 0 stores only the end. The default is 1.
    points : int, optional
        Number of equidistant output times of a tolerance-driven method, including the start. The default is 201.
    watch : tuple of str, optional
        Any of "energy", "manifold" (of a constrained problem), "casimirs" (of a Poisson system), "integrals". The default is all that the
        problem has, except "integrals".
    count : bool
        Whether work is counted.
    precision : str
        Number type: one of :data:`PRECISIONS`.
    multipliers : bool
        Whether lam(p, q) is computed at the output times.
    raw : bool
        Whether the stage multipliers of every step of a fixed-step scheme are stored.
    progress : callable, optional
        Called with the fraction done.
    seconds_limit : float, optional
        Wall-clock limit, s.
    work_limit : WorkLimit, optional
        Limit of work of a tolerance-driven method.
    on_singular : str, optional
        What to do if G loses rank: one of :data:`ON_SINGULAR`. The default is declared by the case.
    callbacks : str
        Implementation of the callbacks of IDA and CVODE: one of :data:`CALLBACKS`.
    solver_steps : bool
        Whether the steps of IDA or CVODE are recorded, see :class:`daebench.runs.solver_steps.SolverSteps`.
    sensitivities : tuple of str
        Parameters and initial values with respect to which the states are differentiated.
    looks : int
        Number of states along the run of a fixed-step method that are looked at to judge it, whatever is stored; 0 for none.
    keep_interrupted : bool
        Whether a run that is ended by Ctrl-C is returned as far as it came, with this failure; otherwise the interruption is raised.
    """

    value: float
    t_end: float | None = None
    steps: int | None = None
    every: int | None = None
    points: int | None = None
    watch: Sequence[str] | None = None
    count: bool = True
    precision: str = "float64"
    multipliers: bool = False
    raw: bool = False
    progress: Progress | None = field(default=None, compare=False)
    seconds_limit: float | None = None
    work_limit: WorkLimit | None = None
    on_singular: str | None = None
    callbacks: str = "native"
    solver_steps: bool = False
    sensitivities: Sequence[str] = ()
    looks: int = 0
    keep_interrupted: bool = False

    def __post_init__(self) -> None:
        require_known(("precision", self.precision, PRECISIONS))
        require_known(("kind of callbacks", self.callbacks, CALLBACKS))
        for name, checked in CHECKED.items():
            if (value := getattr(self, name)) is not None:
                object.__setattr__(self, name, checked(name, value))
        for name in ("watch", "sensitivities"):
            # A text alone is one name: its letters would be taken for names otherwise.
            if (names := getattr(self, name)) is not None:
                object.__setattr__(self, name, (names,) if isinstance(names, str) else tuple(names))

    def at_rank_loss(self, ivp: ConstrainedIvp) -> str:
        """Return the choice where G loses rank, from the request or else from the initial value problem; one of :data:`ON_SINGULAR`.

        Raises
        ------
        BadInput
            If it is none of :data:`ON_SINGULAR`.
        """
        mode = self.on_singular or ivp.on_singular
        require_known(("on_singular", mode, ON_SINGULAR))
        return mode

    def watched(self, state: State) -> tuple[str, ...]:
        """Return the monitored quantities of a state, in their order."""
        return tuple(name for name in state.monitors if (name != "integrals" if self.watch is None else name in self.watch))


Ivp = TypeVar("Ivp", contravariant=True)
Result = TypeVar("Result", covariant=True)


class Method(Protocol[Ivp, Result]):
    """A solver of initial value problems that is controlled by one number.

    A method for constrained problems is a ``Method[ConstrainedIvp, Trajectory]``, one for Poisson systems a ``Method[PoissonIvp,
    PoissonTrajectory]``.
    """

    @property
    def name(self) -> str:
        """Name in the grammar of methods."""

    @property
    def knob(self) -> str:
        """Its control parameter: "h" or "tol"."""

    def refusal(self, ivp: Ivp) -> str | None:
        """Return why the method cannot be used on this problem, as a sentence, or None."""

    def check(self, ivp: Ivp, request: Request) -> None:
        """Check that a request can be met.

        Parameters
        ----------
        ivp : Ivp
            The problem with the numbers of a case.
        request : Request
            The request.

        Raises
        ------
        BadInput
            If it cannot be met; the message says why and what to do.
        """

    def solve(self, ivp: Ivp, request: Request) -> Result:
        """Return the trajectory. If the run stops early, it contains the result so far and the reason.

        Parameters
        ----------
        ivp : Ivp
            The problem with the numbers of a case.
        request : Request
            The request.
        """


def resolution_value(method: Method[Any, Any], *, h: float | None, tol: float | None) -> float:
    """Return a method's step size or tolerance.

    Raises
    ------
    BadInput
        If it is missing, or the other one is given.
    """
    resolution, other = (h, tol) if method.knob == "h" else (tol, h)
    if resolution is None or other is not None:
        wanted, unwanted = ("a step size h", "a tolerance") if method.knob == "h" else ("a tolerance tol", "a step size")
        raise BadInput(
            f"{method.name} is controlled by {wanted}; {'give one' if resolution is None else f'leave out {unwanted}'}.",
            "resolution-missing-or-other",
        )
    return resolution
