"""Members of an ensemble in lanes beside the same kernel for one run, a program in C, and heyoka's batch mode, taking turns."""

import json
import subprocess
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from daebench.errors import BadInput, DaebenchError
from daebench.methods.ensemble.lanes import WIDTHS, best_width
from daebench.methods.ensemble.run import run_members
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.runs.ivp import Ivp
from daebench.runs.machine import cores
from daebench.runs.members import Members, members
from daebench.runs.request import Request
from daebench.studies.timers import by_hand

CASES = (
    ("spherical_pendulum", "fig1.2", "rattle", 0.01),
    ("spherical_pendulum", "fig1.2", "lobatto3", 0.02),
    ("double_pendulum", "horizontal", "rattle", 0.001),
    ("slider_crank", "swing", "rattle", 0.001),
    ("free_rigid_body", None, "strang", 0.01),
)
"""What is timed: problem, case, method and step size."""

MEMBERS, SHARED, MANY, SPREAD = 64, 1024, 4096, 0.01
"""Members of a run on one core, on several, and of one whose beginning is timed; and how much their momenta or states differ."""

LASTING = 0.4
"""How long a run that is shared out takes on one core, s."""

NARROW = "from daebench.compiler import machine; machine.processor = lambda: ('haswell', '')"
"""What has vectors of AVX2 made, which hold four doubles."""

T_END, TOLERANCE = 100.0, 1e-15
"""End, s, and tolerance of the runs of heyoka."""

BARE: dict[str, Any] = {"every": 0, "watch": (), "count": False}


def measure_ensembles(*, steps: int, repeat: int) -> list[dict[str, Any]]:
    """Return times of a step and member, a row for each of :data:`CASES`."""
    if steps < 1 or repeat < 1:
        raise BadInput(f"steps = {steps} and repeat = {repeat} must be at least 1.", "steps-or-repeat-not-positive")
    with tempfile.TemporaryDirectory() as folder:
        return [_row(*case, steps=steps, repeat=repeat, folder=Path(folder)) for case in CASES]


def spread(ivp: Ivp, n: int) -> tuple[Any, ...]:
    """Return n starts whose momenta, or states, are longer than those of a problem by up to :data:`SPREAD`."""
    first, *others = ivp.start
    factors = 1 + SPREAD * np.random.default_rng(0).random((n, 1))
    return (factors * first, *(np.repeat(vector[None], n, axis=0) for vector in others))


def _row(problem: str, case: str | None, name: str, h: float, *, steps: int, repeat: int, folder: Path) -> dict[str, Any]:
    ivp = initial_value_problem(problem, case, None)
    method, some = method_of(ivp, name), members(ivp, spread(ivp, MEMBERS), h, {})
    in_c = by_hand(folder, name, ivp, h, steps) if ivp.on_manifold else None
    times: dict[str, list[float]] = {"alone": [], "in_c": [], **{f"lanes{lanes}": [] for lanes in WIDTHS}}
    for _ in range(repeat):
        run = method.solve(ivp, Request(value=h, steps=steps, **BARE)).complete()
        times["alone"].append(1e9 * run.seconds / steps)
        times["in_c"] += [in_c()] if in_c else []
        for lanes in WIDTHS:
            times[f"lanes{lanes}"].append(_per_step(method, some, max(1, steps // 4), lanes, 1))
    least = {what: min(values) if values else None for what, values in times.items()}
    chosen = least[f"lanes{best_width()}"]
    assert chosen
    return {"problem": problem, "method": name, **least, "best": best_width()} | {
        "over_alone": (least["alone"] or np.nan) / chosen,
        "over_c": least["in_c"] / chosen if least["in_c"] else None,
        "threads": _shared(method, members(ivp, spread(ivp, SHARED), h, {}), chosen, repeat),
        "begin_ms": 1e3 * min(_begun(method, members(ivp, spread(ivp, MANY), h, {})) for _ in range(repeat)),
    }


def _per_step(method: Any, some: Members, steps: int, lanes: int, threads: int, *, wall: bool = False) -> float:
    """Return nanoseconds of CPU time, or of wall time, per step and member."""
    began = time.perf_counter()
    run = run_members(method, some, Request(value=1.0, steps=steps, **BARE), lanes=lanes, threads=threads)
    seconds = time.perf_counter() - began - run.compile_seconds if wall else run.seconds
    if len(run.failed):
        raise DaebenchError(f"a member cannot be timed: {run.failure(int(run.failed[0]))}", "member-not-timed")
    return 1e9 * seconds / steps / len(some)


def _shared(method: Any, some: Members, seconds: float, repeat: int) -> float:
    """Return how many times faster all cores are than one, by wall time in turns, for runs of about :data:`LASTING` on one core.

    ``seconds`` is the time of a step and member, ns.
    """
    steps = max(1, round(1e9 * LASTING / seconds / len(some)))
    times: dict[int, list[float]] = {1: [], cores(): []}
    for _ in range(repeat):
        for threads, several in times.items():
            several.append(_per_step(method, some, steps, best_width(), threads, wall=True))
    return min(times[1]) / min(times[cores()])


def _begun(method: Any, many: Members) -> float:
    """Return the wall time of an ensemble of one step, s."""
    began = time.perf_counter()
    run_members(method, many, Request(value=1.0, steps=1, **BARE), threads=1)
    return time.perf_counter() - began


def measure_narrow(*, steps: int, repeat: int) -> list[dict[str, Any]] | None:
    """Return the rows of :func:`measure_ensembles` where machine code has vectors of AVX2; None where the processor has no wider ones."""
    import llvmlite.binding as llvm

    if not llvm.get_host_cpu_features().get("avx512f"):
        return None
    asked = f"measure_ensembles(steps={steps}, repeat={repeat})"
    script = f"{NARROW}; import json; from {__name__} import measure_ensembles; print(json.dumps({asked}))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    if done.returncode:
        raise DaebenchError(f"vectors of AVX2 cannot be timed: {done.stderr.strip().splitlines()[-1]}", "avx2-not-timed")
    rows: list[dict[str, Any]] = json.loads(done.stdout)
    return rows


def measure_heyoka(*, repeat: int) -> dict[str, Any] | None:
    """Return milliseconds a trajectory of heyoka to t = 100 s on the spherical pendulum, case fig1.2, alone and in batches.

    None where heyoka is not installed.
    """
    if find_spec("heyoka") is None:
        return None
    import heyoka as hy

    from daebench.methods.ensemble.heyoka_batches import batch_of
    from daebench.methods.solvers.heyoka_ode import equations_of

    ivp = initial_value_problem("spherical_pendulum", "fig1.2", None)
    several = batch_of(ivp, TOLERANCE)
    batch = several.batch_size
    momenta, positions = spread(ivp, batch)
    start = np.ascontiguousarray(np.concatenate([positions, momenta], axis=1).T)
    single = hy.taylor_adaptive(equations_of(ivp), start[:, 0].copy(), tol=TOLERANCE)
    times: dict[str, list[float]] = {"alone": [], "in_batches": []}
    for _ in range(repeat):
        single.time, single.state[:] = 0.0, start[:, 0]
        times["alone"].append(_spent(lambda: single.propagate_until(T_END)))
        several.set_time(0.0)
        several.state[:] = start
        times["in_batches"].append(_spent(lambda: several.propagate_until(T_END)) / batch)
    return {"batch": batch} | {what: 1e3 * min(values) for what, values in times.items()}


def _spent(call: Any) -> float:
    began = time.thread_time()
    call()
    return time.thread_time() - began
