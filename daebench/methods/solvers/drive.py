"""Common parts of tolerance-driven methods: valid requests, the output grid, the run from output to output."""

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from daebench.compiler.under_way import uncollected
from daebench.errors import BadInput, Stopped
from daebench.methods.formulations.constrained import Posed
from daebench.methods.solvers.monitor import Monitor
from daebench.methods.solvers.monitored import Monitored
from daebench.methods.solvers.native import libraries
from daebench.methods.solvers.native.libraries import DISTRIBUTION, Unavailable
from daebench.runs.provenance import EXTRAS
from daebench.runs.request import Progress, Request

Array = NDArray[np.float64]

TOLERANCES = (1e-15, 1e-2)
POINTS = 201
MOST_POINTS = 10_000_000
SECONDS_LIMIT = 600.0
MOST_STEPS = 10_000_000
"""Limit of steps: of a whole run with SciPy, from output to output with SUNDIALS."""


class ToleranceMethod(ABC):
    """A method with a tolerance: it poses a problem, and a solver is driven from output to output.

    ``differentiable`` says whether it solves variational equations too.
    """

    knob = "tol"
    differentiable: ClassVar[bool] = False

    @property
    @abstractmethod
    def name(self) -> str:
        """Name in the grammar of methods."""

    @property
    def least(self) -> float:
        """Smallest tolerance that it takes."""
        return TOLERANCES[0]

    @property
    def tells_steps(self) -> bool:
        """Whether the solver reports size, order and error estimate of its steps."""
        return False

    @abstractmethod
    def refusal(self, ivp: Any) -> str | None:
        """Return why the method cannot be used on this problem, as a sentence, or None."""

    @abstractmethod
    def _posed(self, ivp: Any) -> Any:
        """Pose an initial value problem, which says what to do where G loses rank."""

    @property
    @abstractmethod
    def _advice(self) -> str:
        """Advice on a run that stops early."""

    @abstractmethod
    def _begin(self, dae: Any, tol: float, monitor: Monitor) -> "Advance":
        """Compile the functions of a run, and return how the solver is advanced from output to output."""


def check(name: str, request: Request, least: float = TOLERANCES[0]) -> None:
    """Refuse a request that a tolerance-driven method cannot meet."""
    if not least <= request.value <= TOLERANCES[1]:
        raise BadInput(f"tol = {request.value:g} of {name} must be between {least:.3g} and {TOLERANCES[1]:g}.", "solver-tol-out-of-range")
    if request.steps is not None:
        raise BadInput(f"{name} chooses its own steps; give an end time instead of a number of steps.", "solver-given-steps")
    if request.t_end is None or not (math.isfinite(request.t_end) and request.t_end > 0):
        raise BadInput(
            f"{name} needs an end time, a finite number greater than 0; it was given {request.t_end}.", "solver-end-time-invalid"
        )
    if request.every:
        raise BadInput(
            f"{name} has no fixed steps, so every = {request.every} does not apply; give points, or every = 0 for the end only.",
            "solver-given-every",
        )
    if request.points is not None and not 2 <= request.points <= MOST_POINTS:
        raise BadInput(f"points = {request.points} must be between 2 (start and end) and {MOST_POINTS}.", "solver-points-out-of-range")
    if request.raw:
        raise BadInput(f"{name} has no stage multipliers of steps; ask for lam(p, q) instead.", "solver-stage-multipliers")
    if request.precision != "float64":
        raise BadInput(f"{name} computes in float64 only, not in {request.precision}.", "solver-precision")


def check_record(method: ToleranceMethod, request: Request) -> None:
    """Refuse a record of steps by a solver that does not tell of them, or does not tell daebench; raise :class:`BadInput`."""
    if not request.solver_steps:
        return
    if not method.tells_steps:
        raise BadInput(
            f"{method.name} does not report its steps and error estimates, as IDA and CVODE do; leave out the record of steps.",
            "solver-without-record",
        )
    if request.sensitivities:
        raise BadInput("a record of steps has only the states; ask for sensitivities in another run.", "record-beside-sensitivities")
    require_native("a record of steps", "does not hand on the estimates of their errors", request)


def require_native(what: str, lacking: str, request: Request) -> None:
    """Refuse, of a request, something of SUNDIALS that scikit-sundae does not pass on."""
    if request.callbacks != "native":
        raise BadInput(
            f"{what} needs compiled callbacks, because {DISTRIBUTION} {lacking}; leave out --callbacks {request.callbacks}.",
            "callbacks-not-compiled",
        )
    try:
        libraries.functions()
    except Unavailable as error:
        raise BadInput(
            f"{what} calls the libraries of SUNDIALS, and {error}; install {DISTRIBUTION} as a wheel.", "sundials-not-loadable"
        ) from error


Advance = Callable[[Array], Iterator[Array]]
"""Goes through output times, and yields the unknowns there as they come, shape(k, n), some rows at once; or raises :class:`Stopped`."""


def called(posed: Posed, monitor: Monitor, name: str) -> Callable[..., Array]:
    """Return a function of a formulation as solvers in Python call it: compiled, counted and timed.

    It is ``rhs(t, y)``, ``rhs_jacobian(t, y)``, ``residual(t, y, yp)`` or ``jacobian(t, y, yp, res, cj)``. All calls have
    the same arrays in memory, also that which is returned: their addresses are asked for once.
    """
    n, function, jacobian = posed.n, getattr(posed, name), name.endswith("jacobian")
    vectors = [posed.y0.copy(), posed.yp0.copy()][: 1 if name.startswith("rhs") else 2]
    rest, out = (np.empty(n), 1.0) if name == "jacobian" else (), np.empty((n, n) if jacobian else n)
    kind = "jacobian" if jacobian else name

    def call(t: float, *arguments: Any) -> Array:
        began = time.perf_counter()
        for vector, argument in zip(vectors, arguments, strict=False):
            vector[:] = argument
        monitor.called(kind, t, function(t, *vectors, *arguments[len(vectors) :], out, posed.par), began)
        return out

    function(0.0, *vectors, *rest, out, posed.par)  # compiled before the clock runs
    return call


def one_by_one(advance: Callable[[float], Array], monitor: Monitor) -> Advance:
    """Return how a solver goes through output times that is asked for one after the other."""
    return lambda times: (monitor.output(advance(float(t))) for t in times)


@dataclass(frozen=True)
class Driven:
    """Output of a solver, before it is read as states of a problem."""

    t: Array
    """The output times that were reached, and the end of the last step where it stopped early; shape (n,)."""
    Y: Array
    """Unknowns at those times; shape (n, ...)."""
    kept: slice | list[int]
    """The rows that were asked for; monitored quantities are evaluated in all of them."""
    outcome: Mapping[str, Any]
    """Fields of :class:`daebench.runs.trajectory.Outcome`, the maxima and the times apart."""


@dataclass
class _Outputs:
    """The unknowns at the output times so far, and the CPU time, s, that the solver took for them."""

    Y: list[Array]
    seconds: float = 0.0

    def extend(self, advance: Advance, times: Array, progress: Progress | None) -> None:
        """Go on to each time but the first; the outputs so far stay where the solver stops."""
        blocks = advance(times[1:])
        while True:
            cpu = time.thread_time()
            try:
                rows = next(blocks, None)
            finally:
                self.seconds += time.thread_time() - cpu
            if rows is None:
                return
            self.Y.extend(rows)
            if progress:
                progress(float(times[len(self.Y) - 1]) / float(times[-1]))


def drive(
    method: ToleranceMethod, posed: Posed, request: Request, *, began: float, make_monitor: Callable[..., Monitor] = Monitor
) -> Driven:
    """Return the output of a solver that is driven from output to output.

    Where it stops early, that is the outputs so far, the end of the last step, and why.
    """
    assert request.t_end is not None
    limits = request.t_end, request.seconds_limit or SECONDS_LIMIT, request.work_limit
    with uncollected():
        monitor = make_monitor(*limits, posed.outside, Monitored(posed, request.value))
    failure, interrupted, ready = None, False, began
    times = np.linspace(0.0, request.t_end, max(3, request.points or POINTS))
    outputs = _Outputs([posed.y0])
    try:
        monitor.native, monitor.recording = request.callbacks == "native", request.solver_steps
        with uncollected():
            monitor.begin(posed.y0)
            advance = method._begin(posed, request.value, monitor)
        ready = time.perf_counter()
        monitor.start()
        outputs.extend(advance, times, request.progress)
    except Stopped as stop:
        t = max(monitor.t, times[len(outputs.Y) - 1]) if stop.t is None else stop.t
        failure = _sentence(method.name, posed, request, t, f"{stop}; {stop.advice or method._advice}")
    except KeyboardInterrupt:
        if not request.keep_interrupted:
            raise
        failure, interrupted = _sentence(method.name, posed, request, monitor.t, "interrupted; run it again"), True
    Y, times = outputs.Y, times[: len(outputs.Y)]
    if failure and monitor.t > times[-1]:
        times = np.append(times, monitor.t)
        Y.append(monitor.y)
    selection: slice | list[int] = slice(None) if request.every is None and request.points != 2 else [0, -1] if len(Y) > 1 else [0]
    ending = {"method": method.name, "failure": failure, "interrupted": interrupted, "compile_seconds": ready - began}
    return Driven(times, np.array(Y), selection, ending | _outcome(posed, request, monitor, outputs.seconds - monitor.aside))


def _sentence(name: str, posed: Posed, request: Request, t: float, why: str) -> str:
    """Return where and why a run stopped, and what to do."""
    where = f"{name} on {posed.ivp.problem}, case {posed.ivp.case}"
    return f"{where}, stopped at t = {t:.9g} of {request.t_end:g} (tol = {request.value:g}): {why}."


def _outcome(posed: Posed, request: Request, monitor: Monitor, seconds: float) -> dict[str, Any]:
    """Return the run with its costs; ``seconds`` is the CPU time of the solver."""
    return {
        "problem": posed.ivp.problem,
        "case": posed.ivp.case,
        "parameters": dict(posed.ivp.parameters),
        "knob": "tol",
        "value": request.value,
        "steps": monitor.steps,
        "work": dict(monitor.calls) | {"steps": monitor.steps} if request.count else {},
        "maxima_over": "outputs",
        "callback_seconds": min(monitor.seconds, seconds) if monitor.seconds else None,
        "callbacks": monitor.callbacks,
        "solver_steps": monitor.recorder.steps() if monitor.recorder else None,
        "seconds": seconds,
    }


def not_installed(name: str) -> str | None:
    """Return that the package of a method is not installed, and how to install it, as a sentence; None if nothing is missing."""
    package = name.partition(":")[0]
    try:
        if package not in EXTRAS or find_spec(package) is not None:
            return None
    except ValueError:  # it was looked for before, and found missing
        pass
    return f"{name} needs {package}, which is not installed; install it by pip install 'daebench[peers]'."
