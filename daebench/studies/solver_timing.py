"""IDA with compiled callbacks beside a program in C on the same libraries, and beside Python callbacks, taking turns."""

import ctypes
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from daebench.errors import BadInput, DaebenchError
from daebench.methods.formulations.constrained import pose
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.solvers.ida import Ida
from daebench.methods.solvers.native.libraries import Unavailable, address
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Request
from daebench.studies.timers import built

TOLERANCES = (1e-6, 1e-9, 1e-12)
T_END = 10.0
POINTS = 201

IDA_C = (
    "SUNContext_Create",
    "N_VGetArrayPointer",
    "SUNDenseMatrix_Data",
    "N_VMake_Serial",
    "IDACreate",
    "IDAInit",
    "IDASVtolerances",
    "IDASetUserData",
    "SUNDenseMatrix",
    "SUNLinSol_Dense",
    "IDASetLinearSolver",
    "IDASetJacFn",
    "IDASetStopTime",
    "IDASolve",
    "IDAGetDky",
    "IDAFree",
    "SUNLinSolFree",
    "SUNMatDestroy",
    "N_VDestroy",
    "SUNContext_Free",
)
"""Functions of SUNDIALS that ``ida.c`` is given the addresses of, in its order."""


def measure_solvers(*, repeat: int) -> list[dict[str, Any]]:
    """Return times of IDA at index 2 on the spherical pendulum, case fig1.2, to t = 10 with 201 outputs; a row for each tolerance."""
    if repeat < 1:
        raise BadInput(f"repeat = {repeat} must be at least 1.", "repeat-not-positive")
    ivp, method = constrained(initial_value_problem("spherical_pendulum", "fig1.2", None)), Ida("index2")
    with tempfile.TemporaryDirectory() as folder:
        program, note = _program(Path(folder))
        rows = []
        for tol in TOLERANCES:
            request = Request(value=tol, t_end=T_END, points=POINTS)
            python = method.solve(ivp, Request(value=tol, t_end=T_END, points=POINTS, callbacks="python")).complete()
            times: dict[str, list[float]] = {"native": [], "in_c": [], "run": [], "python": [python.seconds]}
            for _ in range(repeat):
                began = time.perf_counter()
                run = method.solve(ivp, request).complete()
                times["run"].append(time.perf_counter() - began)
                times["native"].append(run.seconds)
                if program:
                    taken, seconds = program(tol)
                    times["in_c"].append(seconds)
                    _require_same(run.steps, taken)
            rows.append(_row(tol, run.steps, times, note if run.callbacks == "native" else "SUNDIALS cannot be called natively here"))
    return rows


def _row(tol: float, steps: int, times: dict[str, list[float]], note: str) -> dict[str, Any]:
    best = {name: 1e3 * min(values) if values else None for name, values in times.items()}
    native, in_c, python = best["native"], best["in_c"], best["python"]
    over_c = native / in_c if native and in_c else None
    return {"tol": tol, "steps": steps, **best, "over_c": over_c, "python_over_native": python / native if python and native else None} | (
        {"note": note} if note else {}
    )


def _require_same(ours: int, theirs: int) -> None:
    if abs(ours - theirs) > 0.01 * ours:
        raise DaebenchError(
            f"the program in C takes {theirs} steps where IDA takes {ours}; the two do not solve the same equations.",
            "c-program-differs-from-ida",
        )


def _program(folder: Path) -> tuple[Callable[[float], tuple[int, float]] | None, str]:
    """Return a call that runs the program in C at a tolerance, and gives its steps and CPU time, s; or None, and why there is none."""
    try:
        table = (ctypes.c_void_p * len(IDA_C))(*map(address, IDA_C))
    except Unavailable as why:
        return None, str(why)
    library = built("ida", folder)
    if library is None:
        return None, "no C compiler found"
    function = library.ida
    function.restype = ctypes.c_long
    function.argtypes = [*[ctypes.c_void_p] * 5, ctypes.c_double, ctypes.c_void_p, ctypes.c_long, ctypes.c_void_p]
    ivp = constrained(initial_value_problem("spherical_pendulum", "fig1.2", None))
    dae, times = pose(ivp, "index2", multipliers="derivative"), np.linspace(0.0, T_END, POINTS)[1:].copy()

    def call(tol: float) -> tuple[int, float]:
        y, yp, atol, rows = dae.y0.copy(), dae.yp0.copy(), np.full(dae.n, tol), np.empty((len(times), dae.n))
        numbers = [array.ctypes.data for array in (dae.par, y, yp, atol)]
        began = time.thread_time()
        taken = function(table, *numbers, tol, times.ctypes.data, len(times), rows.ctypes.data)
        seconds = time.thread_time() - began
        if taken < 0:
            raise DaebenchError(f"the program in C stopped with flag {taken} of SUNDIALS.", "c-program-flag")
        return taken, seconds

    return call, ""
