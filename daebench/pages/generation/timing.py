"""Generated C beside machine code: size, time to compile, and time of a step, in turns, so that noise meets both alike."""

import ctypes
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from daebench.errors import BadInput, DaebenchError
from daebench.methods.catalogue import problems
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.pages.generation.languages import LANGUAGES
from daebench.pages.generation.linked import linked
from daebench.runs.members import flat
from daebench.runs.request import Request
from daebench.runs.scales import constrained_scales
from daebench.studies.timers import compiler, failure

METHODS = ("rattle", "lobatto3", "rattle/kahan_li8")
PART = 0.01
"""Step size, in parts of the time in which a motion changes."""

HEAD = "#include <math.h>\n#include <stdint.h>\n#include <string.h>\n"
LOOP = """
int run(double *X, double h, const double *P, double *L, double *R, long steps);
int run(double *X, double h, const double *P, double *L, double *R, long steps)
{{
    R[0] = 0.0;
    {start}
    for (long k = 0; k < steps && R[0] == 0.0; k++) step(X, h, P, L, R);
    return (int)R[0];
}}
"""


def measure_generated(*, steps: int, repeat: int) -> list[dict[str, Any]]:
    """Return a row a constrained problem and method: kB of C, seconds of its compiler, best times of a step, ns, and their ratio."""
    command = compiler()
    if command is None:
        raise BadInput("there is no compiler of C; install one, gcc for example.", "no-c-compiler")
    rows = []
    for problem in problems("constrained"):
        ivp: Any = initial_value_problem(problem)
        h = PART / (constrained_scales(ivp, PART, rated=True)[1] or 1.0)
        for name in METHODS:
            row: dict[str, Any] = {"problem": problem, "method": name}
            try:
                rows.append(row | _measured(ivp, name, h, steps, repeat, command))
            except DaebenchError as error:
                rows.append(row | {"note": str(error)})
    return rows


def _measured(ivp: Any, name: str, h: float, steps: int, repeat: int, command: str) -> dict[str, Any]:
    method, steps = method_of(ivp, name), max(10, steps // ivp.d**2)
    request = Request(value=h, steps=steps, every=0, watch=(), count=False)
    method.check(ivp, request)
    code = linked(ivp, method, h, LANGUAGES["c"].longest)
    text = HEAD + LANGUAGES["c"].functions(code) + LOOP.format(start="start(X, h, P, R);" if "start" in code.scheme.functions else "")
    with tempfile.TemporaryDirectory() as folder:
        source, library = Path(folder) / "step.c", Path(folder) / "step.so"
        source.write_text(text, encoding="utf-8")
        began = time.perf_counter()
        if why := failure(command, source, library, "-O2"):
            raise DaebenchError(f"the generated code cannot be compiled: {why}.", "timed-code-not-compilable")
        seconds = time.perf_counter() - began
        call = ctypes.CDLL(str(library)).run
    best = {"generated": np.inf, "machine": np.inf}
    for _ in range(repeat):
        run = method.solve(ivp, request).complete()
        if run.failure:
            raise BadInput(run.failure, "timed-run-failed")
        best["machine"] = min(best["machine"], run.seconds)
        best["generated"] = min(best["generated"], _seconds(call, code, ivp, h, steps))
    times = {f"{key}_ns": value / steps * 1e9 for key, value in best.items()}
    return {"kB": len(text) / 1000, "compile_s": seconds, **times, "ratio": best["generated"] / best["machine"]}


def _seconds(call: Any, code: Any, ivp: Any, h: float, steps: int) -> float:
    """Return the CPU time of a run of the generated code."""
    X, P = np.zeros(code.scheme.state + code.scheme.memory), np.array([*ivp.par, *code.scales], dtype=float)
    X[: code.scheme.state] = flat(code.state)
    L, R = np.zeros(max(1, code.scheme.multipliers)), np.zeros(3)
    x, p, stage, report = (ctypes.c_void_p(array.ctypes.data) for array in (X, P, L, R))
    began = time.thread_time()
    status = call(x, ctypes.c_double(h), p, stage, report, ctypes.c_long(steps))
    seconds = time.thread_time() - began
    if status:
        raise BadInput(f"the generated code stopped with status {status}.", "generated-code-stopped")
    return seconds
