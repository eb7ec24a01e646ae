"""What a method is: a name, a step size or tolerance, and a way from an initial value problem to a trajectory."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeVar

from daebench.errors import BadInput, unknown
from daebench.runs.ivp import ConstrainedIvp

Progress = Callable[[float], None]
"""Called now and then with the fraction of the run that is done."""


ON_SINGULAR = {
    "stop": "the run ends there",
    "continue": "it continues, and reports the branch of the motion",
    "least-squares": "it continues, and systems of constraints are solved by least squares, so they may be redundant",
}
"""What a run does where G loses rank."""


CALLBACKS = {
    "native": "machine code, where the libraries of SUNDIALS allow it",
    "python": "Python functions, through scikit-sundae",
}
"""What IDA and CVODE call for the equations, and where the loop over their steps is: in machine code, or in Python."""


@dataclass(frozen=True)
class WorkLimit:
    """When a tolerance-driven run is given up: by its work and not by the clock, so that what becomes of it depends on no machine.

    Parameters
    ----------
    calls : int
        Most calls of the residual, or of the right side.
    slow_calls, slow_part : int
        It is given up sooner where ``slow_calls`` calls in a row cover less than one part in ``slow_part`` of the run.
    """

    calls: int
    slow_calls: int
    slow_part: int


@dataclass(frozen=True, kw_only=True)
class Request:
    """What a method is asked to do with an initial value problem.

    Parameters
    ----------
    value : float
        Step size or tolerance of the method.
    t_end : float, optional
        End of the run; a fixed-step method takes floor(t_end / h + 1e-9) steps of exactly h.
    steps : int, optional
        Number of steps of a fixed-step method, in place of t_end.
    every : int, optional
        A fixed-step method stores a state after every so many steps; 0 stores the end alone. The default is 1.
    points : int, optional
        A tolerance-driven method gives output at so many equidistant times, the start included. The default is 201.
    watch : tuple of str, optional
        Any of "energy", "manifold" (of a constrained problem), "casimirs" (of a Poisson system), "integrals". The default is all that the
        problem has, but for "integrals".
    count : bool
        Whether work is counted.
    precision : str
        "float64" or "float32".
    multipliers : bool
        Whether lam(p, q) is wanted at the output times.
    raw : bool
        Whether the stage multipliers of every step of a fixed-step scheme are wanted.
    progress : callable, optional
        Called with the fraction done.
    seconds_limit : float, optional
        Wall-clock limit, s.
    work_limit : WorkLimit, optional
        Limit of work of a tolerance-driven method.
    on_singular : str, optional
        What to do where G loses rank: one of :data:`ON_SINGULAR`. The default is what the case declares.
    callbacks : str
        What IDA and CVODE call: one of :data:`CALLBACKS`.
    solver_steps : bool
        Whether it is wanted what IDA or CVODE thinks of each of its steps, see :class:`daebench.runs.solver_steps.SolverSteps`.
    sensitivities : tuple of str
        Parameters and initial values by which the states are differentiated.
    keep_interrupted : bool
        Whether a run that Ctrl-C ends is returned as far as it came, with what its failure says; else the interruption goes on.
    """

    value: float
    t_end: float | None = None
    steps: int | None = None
    every: int | None = None
    points: int | None = None
    watch: tuple[str, ...] | None = None
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
    sensitivities: tuple[str, ...] = ()
    keep_interrupted: bool = False

    def at_rank_loss(self, ivp: ConstrainedIvp) -> str:
        """Return what to do where G loses rank: what is asked for, or else what the initial value problem says; one of :data:`ON_SINGULAR`.

        Raises
        ------
        BadInput
            If it is none of these.
        """
        mode = self.on_singular or ivp.on_singular
        if mode not in ON_SINGULAR:
            raise unknown("on_singular", mode, ON_SINGULAR)
        return mode

    def watched(self, kinds: Sequence[str]) -> tuple[str, ...]:
        """Return the monitored quantities of the kinds that there are, in their order."""
        return tuple(name for name in kinds if (name != "integrals" if self.watch is None else name in self.watch))


Ivp = TypeVar("Ivp", contravariant=True)
Result = TypeVar("Result", covariant=True)


class Method(Protocol[Ivp, Result]):
    """Anything that solves an initial value problem and is steered by one number.

    One for constrained problems is a ``Method[ConstrainedIvp, Trajectory]``, one for Poisson systems a ``Method[PoissonIvp,
    PoissonTrajectory]``.
    """

    @property
    def name(self) -> str:
        """Name in the grammar of methods."""

    @property
    def knob(self) -> str:
        """What it is steered by: "h" or "tol"."""

    def refusal(self, ivp: Ivp) -> str | None:
        """Return why the method cannot be used on this problem, as a sentence, or None."""

    def check(self, ivp: Ivp, request: Request) -> None:
        """Accept a request that can be met.

        Parameters
        ----------
        ivp : Ivp
            The problem with the numbers of a case.
        request : Request
            What is asked of the method.

        Raises
        ------
        BadInput
            If it cannot; the message says why and what to do.
        """

    def solve(self, ivp: Ivp, request: Request) -> Result:
        """Return the trajectory; where the run stops early, what was computed so far and why.

        Parameters
        ----------
        ivp : Ivp
            The problem with the numbers of a case.
        request : Request
            What is asked of the method.
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
        raise BadInput(f"{method.name} is steered by {wanted}; {'give one' if resolution is None else f'leave out {unwanted}'}.")
    return resolution


knob_value = resolution_value  # the name of the release before; it goes with the next one
