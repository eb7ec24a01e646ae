"""``daebench.run``: one method on one problem, from Python."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from inspect import signature
from typing import TYPE_CHECKING, Any, TypeVar, overload

from daebench.compiler.under_way import uncollected
from daebench.errors import BadInput, LostMotion, positive, real, unknown, whole
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import Code, method_of
from daebench.methods.sensitivities import require_differentiable
from daebench.methods.warnings_on_runs import doubts
from daebench.runs.ivp import ConstrainedIvp, InitialValueProblem, Ivp, PoissonIvp
from daebench.runs.request import CALLBACKS, PRECISIONS, Progress, Request, resolution_value
from daebench.runs.state import STATES
from daebench.runs.trajectory import PoissonTrajectory, Trajectory

if TYPE_CHECKING:
    from daebench.systems.constrained import ConstrainedHamiltonian
    from daebench.systems.poisson import PoissonSystem

T = TypeVar("T")

LOOKS = 256
"""States along a fixed-step run that are looked at to judge it, whatever is stored."""


@overload
def run(problem: "ConstrainedHamiltonian | ConstrainedIvp", *, method: Code, **settings: Any) -> Trajectory: ...
@overload
def run(problem: "PoissonSystem | PoissonIvp", *, method: Code, **settings: Any) -> PoissonTrajectory: ...
@overload
def run(problem: str, *, method: Code, **settings: Any) -> Any: ...
def run(
    problem: "str | ConstrainedHamiltonian | PoissonSystem | InitialValueProblem", *, method: Code, **settings: Any
) -> Trajectory | PoissonTrajectory:
    """Return the trajectory of one method on one problem: with states q and p, or y on a Poisson system.

    Parameters
    ----------
    problem : str, ConstrainedHamiltonian, PoissonSystem or InitialValueProblem
        Name in the catalogue, the path of a problem file, which is executed, a definition, or an initial value problem.
    method : str or callable
        Name in the grammar of :mod:`daebench.methods.names`, for example "rattle" or "ida:index2"; or code from outside, for example
        "./mine.py:step" or a callable, see :func:`daebench.methods.outside.callables.method_of_callable`. What is named by its place runs
        in a process of its own, and what ends that ends this run alone. A callable runs in this process: ``SystemExit`` ends its run, but
        ``os._exit`` and signals, as of a segmentation fault, end Python, and cannot be caught.
    case : str, optional
        Named initial values; by default the problem's first.
    h, tol : float
        The method's resolution: step size of a fixed-step method, s; relative and absolute tolerance of other methods.
    steps : int, optional
        Number of steps of a fixed-step method.
    t_end : float, optional
        End time, s, in place of ``steps``.
    points, every : int, optional
        Output: number of equidistant times of a tolerance-driven method; number of steps between outputs of a fixed-step method, 0 for the
        end only.
    parameters, options : mapping of str to float, optional
        Values of the problem's parameters, and free numbers of the method.
    p0, q0 : sequence of float, shape(d,), optional
        Initial values of a constrained problem in place of the case's.
    y0 : sequence of float, shape(n,), optional
        Initial state of a Poisson system in place of the case's.
    watch : sequence of str, optional
        Any of "energy", "manifold" (of a constrained problem), "casimirs" (of a Poisson system), "integrals"; by default all but
        "integrals".
    project : bool
        Whether the initial values of a constrained problem are first projected onto the manifold.
    precision : str
        "float64"; "float32"; or "mixed", with forces in float32 and everything else in float64, as in OpenMM.
    multipliers : bool
        Whether lam(p, q) is computed at the output times.
    raw : bool
        Whether the stage multipliers of every step of a fixed-step scheme are kept, see :attr:`daebench.Trajectory.raw`. Those of RATTLE
        are of first order; ``mean``, of two adjacent steps, is of second order.
    compensated : bool
        Whether a fixed-step method compensates its sums over steps for rounding, HLW VIII.5: over 1e7 steps of rattle/kahan_li8 or
        lobatto5 the random walk of the energy is 7 to 40 times smaller, for 0 to 40 % more time.
    sensitivities : sequence of str
        Parameters of the problem and initial values, "q0", "p0" or "y0", by which the states are differentiated, see
        :attr:`daebench.runs.trajectory.Outcome.sensitivities`.
    on_singular : str, optional
        What to do where G loses rank: "stop", "continue" or "least-squares"; by default what the case declares.
    algebra : str
        Form of vectors: "values" or "arrays", for a chain of nodes; "" to choose by the problem's size.
    anyway : bool
        Whether a scheme may be run on a Poisson system outside of the class for which it is a Poisson integrator.
    count : bool
        Whether work is counted.
    seconds_limit : float, optional
        Wall-clock limit, s.
    callbacks : str
        Callbacks of IDA and CVODE: "native", machine code if the libraries of SUNDIALS allow it, or "python".
    solver_steps : bool
        Whether to record size, order and error estimate of each step of IDA or CVODE, see :class:`daebench.runs.solver_steps.SolverSteps`.
    progress : callable, optional
        Called with the fraction done.

    Returns
    -------
    Trajectory or PoissonTrajectory
        States, maxima and work. A run that stops early raises no error: it has its states so far, and the reason in
        :attr:`daebench.runs.trajectory.Outcome.failure`.

    Warns
    -----
    LostMotion
        If the run reached its end with an energy error above the mean kinetic energy, or with a broken constraint; or if a damping is
        negative, which is allowed.

    Raises
    ------
    BadInput
        If the request cannot be met.
    InconsistentStart
        If the initial values are off the manifold and are not to be projected.

    Notes
    -----
    ``sensitivities`` are derivatives of a fixed-step scheme's own steps, exact to rounding. IDA solves the variational equations
    F_y s + F_y' s' + F_a da = 0 with its formulation F(y, y', a) = 0: it has (1 + k) n unknowns in k directions, and derivatives are in its
    error test.

    An initial value can be changed only on the manifold. After a change of its entry q0_j or p0_j or of a parameter a, the start is
    projected as by ``project``, positions first, and the derivative is that of the projected start::

        dq -> dq - M^-1 G^T W^-1 dg,       dg = G dq + g_a da,                 W = G M^-1 G^T
        dp -> dp - G^T W^-1 dv,            dv = d(G H_p), by dp, dq and da

    This does not alter a change along the manifold, and a change along the normal, dq = M^-1 G^T nu, has no effect. A start with the
    numbers of its case varies with a parameter as the case declares; any other start does not vary before the projection.

    Examples
    --------
    >>> import daebench
    >>> run = daebench.run("planar_pendulum", case="horizontal", method="rattle", h=0.01, t_end=1)
    >>> run.q.shape, run.failure is None
    ((101, 2), True)

    With ``sensitivities`` it has derivatives of the states with respect to parameters and initial values:

    >>> swing = daebench.run(
    ...     "planar_pendulum", case="horizontal", method="rattle", h=0.01, t_end=1, sensitivities=["gravity", "q0"]
    ... )
    >>> swing.sensitivities["gravity"]["q"].shape, swing.sensitivities["q0"]["q"].shape
    ((101, 2), (101, 2, 2))
    >>> swing.sensitivities["gravity"]["q"][-1].round(4).tolist()
    [-0.2321, -0.429]
    """
    chosen, ivp, request = prepare(problem, method=method, **settings)
    trajectory: Trajectory | PoissonTrajectory = replace(chosen.solve(ivp, request), ivp=ivp)
    for doubt in doubts(ivp, trajectory):
        warnings.warn(doubt, LostMotion, stacklevel=2)
    return trajectory


@uncollected()
def prepare(
    problem: "str | ConstrainedHamiltonian | PoissonSystem | InitialValueProblem",
    *,
    case: str | None = None,
    method: Code,
    h: float | None = None,
    tol: float | None = None,
    steps: int | None = None,
    t_end: float | None = None,
    points: int | None = None,
    every: int | None = None,
    parameters: Mapping[str, float] | None = None,
    options: Mapping[str, float] | None = None,
    p0: Sequence[float] | None = None,
    q0: Sequence[float] | None = None,
    y0: Sequence[float] | None = None,
    watch: Sequence[str] | None = None,
    project: bool = False,
    precision: str = "float64",
    multipliers: bool = False,
    raw: bool = False,
    compensated: bool = False,
    sensitivities: Sequence[str] = (),
    on_singular: str | None = None,
    algebra: str = "",
    anyway: bool = False,
    count: bool = True,
    seconds_limit: float | None = None,
    callbacks: str = "native",
    solver_steps: bool = False,
    progress: Progress | None = None,
) -> tuple[Any, Ivp, Request]:
    """Return a method of the problem's kind, a consistent initial value problem and a request, all checked, as a run needs them.

    Parameters
    ----------
    problem, case, method, ...
        As for :func:`daebench.run`, which describes all parameters.

    Returns
    -------
    method : Method
        The method.
    ivp : InitialValueProblem
        The problem with the numbers of its case.
    request : Request
        The request to the method.

    Raises
    ------
    BadInput
        If the request cannot be met.
    InconsistentStart
        If the initial values are off the manifold and are not to be projected.
    """
    _require_manner(precision, callbacks)
    start: dict[str, Any] = {"p0": p0, "q0": q0, "y0": y0}
    ivp = initial_value_problem(problem, case, parameters, **start, project=project, algebra=algebra, on_singular=on_singular)
    chosen = method_of(ivp, method, options, compensated=compensated, anyway=anyway)
    value = real(chosen.knob, resolution_value(chosen, h=h, tol=tol))
    extent = _extent(t_end=t_end, steps=steps, every=every, points=points, seconds_limit=seconds_limit)
    results: dict[str, Any] = {"watch": _monitored(ivp, watch), "count": count, "multipliers": multipliers, "raw": raw}
    results |= {"sensitivities": (sensitivities,) if isinstance(sensitivities, str) else tuple(sensitivities), "solver_steps": solver_steps}
    manner: dict[str, Any] = {"precision": precision, "on_singular": on_singular, "progress": progress, "keep_interrupted": True}
    request = Request(value=value, **extent, **results, **manner, callbacks=callbacks, looks=LOOKS)
    require_differentiable(chosen, ivp, request.sensitivities, problem)
    chosen.check(ivp, request)
    return chosen, ivp, request


def _show_parameters(function: Any, of: Callable[..., Any]) -> None:
    """Make help, completion and documentation show the parameters of the function that receives ``settings``."""
    function.__signature__ = signature(of).replace(return_annotation=signature(function).return_annotation)


_show_parameters(run, prepare)


def _require_manner(precision: str, callbacks: str) -> None:
    """Refuse an unknown number type or kind of callbacks."""
    if precision not in PRECISIONS:
        raise unknown("precision", precision, PRECISIONS)
    if callbacks not in CALLBACKS:
        raise unknown("kind of callbacks", callbacks, CALLBACKS)


def _extent(*, seconds_limit: float | None, t_end: float | None, **counts: int | None) -> dict[str, Any]:
    """Return the extent of a run, in time and in numbers of steps and outputs, each number checked."""
    wholes = {name: _given(whole, name, count) for name, count in counts.items()}
    return {"t_end": _given(real, "t_end", t_end), **wholes, "seconds_limit": _given(positive, "seconds_limit", seconds_limit)}


def _given(checked: Callable[[str, Any], T], name: str, value: Any) -> T | None:
    return None if value is None else checked(name, value)


def _monitored(ivp: Ivp, watch: Sequence[str] | None) -> tuple[str, ...] | None:
    if watch is None:
        return None
    allowed = ivp.state.monitors
    wanted = [watch] if isinstance(watch, str) else list(watch)
    for name in wanted:
        if name in allowed:
            continue
        if any(name in state.monitors for state in STATES.values()):
            raise BadInput(f"{name} cannot be monitored on {ivp.problem}, which is {ivp.state.words}; monitor any of {', '.join(allowed)}.")
        raise unknown("quantity to monitor", name, allowed)
    return tuple(wanted)
