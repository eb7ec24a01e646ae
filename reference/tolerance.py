"""What every tolerance-driven method shares: the request it can meet, the output grid, the run from output to output."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput
from daebench.method import Request
from daebench.pose import Dae
from daebench.reference.meter import Meter, Stopped
from daebench.scene import Scene
from daebench.trajectory import Trajectory

Array = NDArray[np.float64]

TOLERANCES = (1e-15, 1e-2)
POINTS = 201
MOST_POINTS = 10_000_000
SECONDS_LIMIT = 600.0
MOST_STEPS = 10_000_000
"""Limit of steps: of a whole run with SciPy, from output to output with SUNDIALS."""


def check(name: str, request: Request, least: float = TOLERANCES[0]) -> None:
    """Refuse a request that a tolerance-driven method cannot meet.

    Raises
    ------
    BadInput
        If tol is outside of [least, 1e-2], t_end is missing or not a positive number, steps or every > 0 are given, points are
        fewer than 2 or more than 1e7, raw multipliers are asked for, or the precision is not float64.
    """
    if not least <= request.value <= TOLERANCES[1]:
        raise BadInput(f"tol = {request.value:g} of {name} must be between {least:.3g} and {TOLERANCES[1]:g}.")
    if request.steps is not None:
        raise BadInput(f"{name} chooses its own steps; give an end time instead of a number of steps.")
    if request.t_end is None or not (math.isfinite(request.t_end) and request.t_end > 0):
        raise BadInput(f"{name} needs an end time, a finite number greater than 0; it was given {request.t_end}.")
    if request.every:
        raise BadInput(f"{name} has no fixed steps to keep every {request.every} of; give points, or every = 0 to keep the end alone.")
    if request.points is not None and not 2 <= request.points <= MOST_POINTS:
        raise BadInput(f"points = {request.points} must be between 2 (start and end) and {MOST_POINTS}.")
    if request.raw:
        raise BadInput(f"{name} has no raw multipliers of steps; ask for lam(p, q) instead.")
    if request.precision != "float64":
        raise BadInput(f"{name} computes in float64 only, not in {request.precision}.")


Advance = Callable[[float], Array]
"""Returns the unknowns at the next output time, or raises :class:`Stopped`."""


def run(name: str, dae: Dae, request: Request, begin: Callable[[Meter], Advance], *, began: float, advice: str) -> Trajectory:
    """Return the trajectory of a solver that is driven from output to output.

    Where it stops early, the trajectory has the outputs so far, the end of the last step, and why.

    Parameters
    ----------
    name : str
        Name of the method.
    dae : Dae
        What is solved.
    request : Request
        What is asked for, already checked.
    begin : callable
        ``begin(meter)`` compiles what will be called and returns how to advance.
    began : float
        When the work on this request began, on ``time.perf_counter``.
    advice : str
        What to do if the run stops early.
    """
    assert request.t_end is not None
    meter, scene, failure = Meter(request.t_end, request.seconds_limit or SECONDS_LIMIT, request.patience), dae.scene, None
    interrupted = False
    times = np.linspace(0.0, request.t_end, max(3, request.points or POINTS))
    Y, seconds, ready = [dae.y0], 0.0, began

    def sentence(why: str, t: float, advice: str) -> str:
        where = f"{name} on {scene.problem}, case {scene.case}, stopped at t = {t:.9g} of {request.t_end:g} (tol = {request.value:g})"
        return f"{where}: {why}; {advice}."

    try:
        advance = begin(meter)
        ready = time.perf_counter()
        meter.start()
        for t in times[1:]:
            cpu = time.thread_time()
            try:
                Y.append(advance(float(t)))
            finally:
                seconds += time.thread_time() - cpu
            if request.progress:
                request.progress(float(t) / request.t_end)
    except Stopped as stop:
        failure = sentence(str(stop), meter.t if stop.t is None else stop.t, stop.advice or advice)
    except KeyboardInterrupt:
        failure, interrupted = sentence("interrupted", meter.t, "run it again"), True
    if failure and meter.t > times[len(Y) - 1]:
        times = np.append(times[: len(Y)], meter.t)
        Y.append(meter.y)
    found = _trajectory(name, dae, request, times, np.array(Y), meter, failure, seconds=seconds, compile_seconds=ready - began)
    return replace(found, interrupted=interrupted)


def _trajectory(
    name: str,
    dae: Dae,
    request: Request,
    times: Array,
    Y: Array,
    meter: Meter,
    failure: str | None,
    *,
    seconds: float,
    compile_seconds: float,
) -> Trajectory:
    scene = dae.scene
    q, v = dae.unpack(Y)
    p = dae.momenta(q, v)
    p[0] = scene.p0  # as given, without the round-off of p = M v
    kept = slice(None) if request.every is None and request.points != 2 else [0, -1] if len(Y) > 1 else [0]
    return Trajectory(
        problem=scene.problem,
        case=scene.case,
        method=name,
        parameters=dict(scene.parameters),
        knob="tol",
        value=request.value,
        t=times[: len(Y)][kept],
        q=q[kept],
        p=p[kept],
        lam=scene.along("lam", p[kept], q[kept]) if request.multipliers else None,
        steps=meter.steps,
        work=dict(meter.calls) | {"steps": meter.steps} if request.count else {},
        maxima=_maxima(scene, request.watch, p, q),
        maxima_over="outputs",
        pivot=_smallest_pivot(scene, p, q) if "manifold" in request.watch else None,
        callback_seconds=min(meter.seconds, seconds),
        failure=failure,
        seconds=seconds,
        compile_seconds=compile_seconds,
    )


def _maxima(scene: Scene, watch: tuple[str, ...], p: Array, q: Array) -> Mapping[str, float]:
    """Return the largest moduli over all outputs, those at the ends of ``every = 0`` and between them alike."""
    maxima: dict[str, Any] = {}
    if "energy" in watch:
        H = scene.along("H", p, q)
        maxima["energy"] = np.max(np.abs(H - H[0]))
    if "manifold" in watch:
        maxima |= {"g": np.max(np.abs(scene.along("g", q))), "Gv": np.max(np.abs(scene.along("Gv", p, q)))}
    if "integrals" in watch and scene.integrals:
        errors = scene.along("integrals", p, q)
        maxima |= dict(zip(scene.integrals, np.max(np.abs(errors - errors[0]), axis=0), strict=True))
    return {name: float(value) for name, value in maxima.items()}


def _smallest_pivot(scene: Scene, p: Array, q: Array) -> float:
    """Return the smallest relative pivot of G H_pp G^T over all outputs: no solver's flag tells of rank loss, this does."""
    call = scene.functions("lam_and_pivot").lam_and_pivot
    with np.errstate(all="ignore"):
        return float(min(call(tuple(a), tuple(b), scene.par)[1] for a, b in zip(p, q, strict=True)))
