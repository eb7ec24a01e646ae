"""The plan of a run: a method, an initial value problem and a request, in which everything has been checked."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from inspect import Parameter, Signature, signature
from typing import TYPE_CHECKING, Any

from daebench.compiler.under_way import uncollected
from daebench.errors import BadInput, real, unknown
from daebench.methods.catalogue import find_problem, own_problems
from daebench.methods.fixed_step.base import FixedStepMethod
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import Code, method_of
from daebench.methods.outside.method import OutsideMethod
from daebench.methods.warnings_on_runs import doubts_at_start, losses
from daebench.runs.directions import require_names
from daebench.runs.ivp import InitialValueProblem, Ivp
from daebench.runs.own_start import OwnStart, Values
from daebench.runs.request import Method, Progress, Request, resolution_value
from daebench.runs.state import STATES
from daebench.runs.trajectory import Outcome

if TYPE_CHECKING:
    from daebench.systems.constrained import ConstrainedHamiltonian
    from daebench.systems.poisson import PoissonSystem

LOOKS = 256
"""States along a fixed-step run that are looked at to judge it, whatever is stored."""

OWN = ("value", "on_singular", "looks", "keep_interrupted", "work_limit")
"""Fields of a request that a caller of :func:`plan` does not name."""


@dataclass(frozen=True)
class Plan:
    """A method, a problem with the numbers of a case, and a request that can be met."""

    method: Any
    """The method, of the problem's kind."""
    ivp: Ivp
    """The problem with its numbers, which are consistent."""
    request: Request
    """The request to the method."""

    @cached_property
    def _linked(self) -> Callable[[Progress | None], Any] | None:
        """The run linked to the problem, of a method with fixed steps."""
        return self.method.linked_run(self.ivp, self.request) if isinstance(self.method, FixedStepMethod) else None

    @cached_property
    def at_start(self) -> list[str]:
        """Sentences on what is unusual at the start."""
        return doubts_at_start(self.ivp)

    def execute(self, progress: Progress | None = None) -> Any:
        """Return the trajectory; if the method stops early, the states so far and the reason."""
        run = self._linked(progress) if self._linked else self.method.solve(self.ivp, replace(self.request, progress=progress))
        # Numbers of its own: who changes them in a result must not change them in the plan, which may be executed again.
        numbers = replace(self.ivp, parameters=dict(self.ivp.parameters))
        return replace(run, ivp=numbers.at(*(vector.copy() for vector in numbers.start)))

    def doubts(self, run: Outcome) -> list[str]:
        """Return why the motion of a run that reached its end is lost, and what is unusual at the start; nothing of a run that failed."""
        return [] if run.failure else [*losses(self.ivp, run), *self.at_start]


_plans: dict[str, Plan] = {}
"""The last plans that were made, on problems and with methods of daebench's own, by the arguments of :func:`plan`."""

MOST = 32
"""Number of plans that are kept."""


def plan(
    problem: "str | ConstrainedHamiltonian | PoissonSystem | InitialValueProblem", *, progress: Progress | None = None, **settings: Any
) -> Plan:
    """Return the plan of a run; what is asked again is not checked and linked again, if problem and method are daebench's own.

    Parameters
    ----------
    problem, case, method, ...
        As for :func:`daebench.run`, which describes all parameters.

    Raises
    ------
    BadInput
        If the request cannot be met.
    InconsistentStart
        If the initial values are off the manifold and are not to be projected.

    Examples
    --------
    >>> from daebench.methods.plan import plan
    >>> ready = plan("planar_pendulum", method="rattle", h=0.01, t_end=1)
    >>> run = ready.execute()
    >>> run.t.shape, run.failure is None
    ((101,), True)
    """
    # Arrays and code make no key: the repr of an array leaves out entries and digits, and that of a function says nothing of what it does.
    key = repr((problem, settings)) if isinstance(problem, str) and all(map(_plain, settings.values())) else ""
    if known := _plans.get(key):
        return known
    planned = _planned(problem, **settings)
    # A file of a user, or code from outside, may be another one at the next call; it is read and checked anew each time.
    if key and problem in own_problems() and not isinstance(planned.method, OutsideMethod):
        if len(_plans) >= MOST:
            _plans.pop(next(iter(_plans)), None)
        _plans[key] = planned
    return planned


def _plain(value: Any) -> bool:
    """Return whether a value is one of those that Python writes with all their digits."""
    if isinstance(value, list | tuple):
        return all(map(_plain, value))
    return value is None or type(value) in (bool, int, float, str) or (type(value) is dict and all(map(_plain, value.values())))


@uncollected()
def _planned(
    problem: "str | ConstrainedHamiltonian | PoissonSystem | InitialValueProblem",
    *,
    case: str | None = None,
    method: Code,
    h: float | None = None,
    tol: float | None = None,
    parameters: Mapping[str, float] | None = None,
    options: Mapping[str, float] | None = None,
    q0: Values | None = None,
    p0: Sequence[float] | None = None,
    v0: Values | None = None,
    y0: Sequence[float] | None = None,
    project: bool = False,
    compensated: bool = False,
    on_singular: str | None = None,
    algebra: str = "",
    anyway: bool = False,
    **asked: Any,
) -> Plan:
    """Return the plan of a run; the rest of the arguments are fields of the request."""
    start = OwnStart(q0=q0, p0=p0, v0=v0, y0=y0, project=project)
    ivp = initial_value_problem(problem, case, parameters, **start, algebra=algebra, on_singular=on_singular)
    chosen = method_of(ivp, method, options, compensated=compensated, anyway=anyway)
    value = real(chosen.knob, resolution_value(chosen, h=h, tol=tol))
    request = Request(value=value, on_singular=on_singular, looks=LOOKS, keep_interrupted=True, **asked)
    _require_monitors(ivp, request.watch or ())
    _require_differentiable(chosen, ivp, request.sensitivities, problem)
    chosen.check(ivp, request)
    return Plan(chosen, ivp, request)


def arguments() -> Signature:
    """Return the arguments of :func:`plan`: for help, completion and documentation, and to refuse others."""
    *explicit, _ = signature(_planned).parameters.values()
    request = [field for field in fields(Request) if field.name not in OWN]
    asked = [Parameter(field.name, Parameter.KEYWORD_ONLY, default=field.default, annotation=field.type) for field in request]
    return Signature([*explicit, *asked])


def _require_monitors(ivp: Ivp, names: Sequence[str]) -> None:
    """Refuse to monitor what the problem does not have."""
    allowed = ivp.state.monitors
    for name in names:
        if name in allowed:
            continue
        if any(name in state.monitors for state in STATES.values()):
            raise BadInput(
                f"{name} cannot be monitored on {ivp.problem}, which is {ivp.state.words}; monitor any of {', '.join(allowed)}.",
                "not-monitored-there",
            )
        raise unknown("quantity to monitor", name, allowed)


def _require_differentiable(method: Method[Any, Any], ivp: Ivp, names: Sequence[str], problem: Any) -> None:
    """Accept the quantities to differentiate a run by."""
    if not names:
        return
    structure = find_problem(os.fspath(problem)).structure if isinstance(problem, str | os.PathLike) else {}
    for name in names:
        if name in structure:
            raise BadInput(
                f"{name} of {ivp.problem} is a whole number, so there is no derivative with respect to it; leave it out.",
                "derivative-by-whole-number",
            )
    require_names(ivp, names)
    if not getattr(method, "differentiable", False):
        raise BadInput(
            f"{method.name} has no sensitivities; schemes of daebench such as rattle differentiate their steps, and ida:index2 solves "
            "variational equations.",
            "method-without-sensitivities",
        )
