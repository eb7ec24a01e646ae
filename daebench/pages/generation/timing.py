"""Generated C beside machine code: size, time to compile, and time of a step, in turns, so that noise meets both alike."""

import ctypes
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from daebench.errors import BadInput, DaebenchError
from daebench.methods.catalogue import problems
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.pages.generation.linked import linked
from daebench.pages.generation.run import LANGUAGES, flat
from daebench.runs.request import Request
from daebench.runs.scales import constrained_scales

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
    """Return a row a constrained problem and method: kB of C, seconds of its compiler, best times of a step, ns, and their ratio.

    Parameters
    ----------
    steps : int
        Steps of one timed run on a problem of one unknown; others have as many fewer.
    repeat : int
        Runs, of which the best counts.
    """
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        raise BadInput("there is no compiler of C; install one, gcc for example.")
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for problem in problems("constrained"):
            ivp: Any = initial_value_problem(problem)
            h = PART / (constrained_scales(ivp, PART, rated=True)[1] or 1.0)
            for name in METHODS:
                try:
                    rows.append({"problem": problem, "method": name, **_measured(ivp, name, h, steps, repeat, compiler, Path(folder))})
                except DaebenchError as error:
                    rows.append({"problem": problem, "method": name, "note": str(error)})
    return rows


def _measured(ivp: Any, name: str, h: float, steps: int, repeat: int, compiler: str, folder: Path) -> dict[str, Any]:
    method = method_of(ivp, name)
    if refusal := method.refusal(ivp):
        raise BadInput(refusal)
    made, steps = linked(ivp, method, h), max(10, steps // ivp.d**2)
    text = HEAD + LANGUAGES["c"].functions(made) + LOOP.format(start="start(X, h, P, R);" if "start" in made.scheme.functions else "")
    source, library = folder / "step.c", folder / f"{ivp.problem}_{abs(hash(name))}.so"
    source.write_text(text, encoding="utf-8")
    began = time.perf_counter()
    subprocess.run([compiler, "-std=c99", "-O2", "-ffp-contract=off", "-w", "-shared", "-fPIC", "-o", library, source, "-lm"], check=True)
    seconds = time.perf_counter() - began
    call = ctypes.CDLL(str(library)).run
    request = Request(value=h, steps=steps, every=0, watch=(), count=False)
    best = {"generated": np.inf, "machine": np.inf}
    for _ in range(repeat):
        best["generated"] = min(best["generated"], _seconds(call, made, ivp, h, steps))
        run = method.solve(ivp, request).complete()
        if run.failure:
            raise BadInput(run.failure)
        best["machine"] = min(best["machine"], run.seconds)
    times = {f"{key}_ns": value / steps * 1e9 for key, value in best.items()}
    return {"kB": len(text) / 1000, "compile_s": seconds, **times, "ratio": best["generated"] / best["machine"]}


def _seconds(call: Any, made: Any, ivp: Any, h: float, steps: int) -> float:
    """Return the CPU time of a run of the generated code."""
    X, P = np.zeros(made.scheme.state + made.scheme.memory), np.array([*ivp.par, *made.scales], dtype=float)
    X[: made.scheme.state] = flat(made.state)
    L, R = np.zeros(max(1, made.scheme.multipliers)), np.zeros(3)
    x, p, stage, report = (ctypes.c_void_p(array.ctypes.data) for array in (X, P, L, R))
    began = time.thread_time()
    status = call(x, ctypes.c_double(h), p, stage, report, ctypes.c_long(steps))
    seconds = time.thread_time() - began
    if status:
        raise BadInput(f"the generated code stopped with status {status}.")
    return seconds
