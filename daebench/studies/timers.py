"""Time per step, best of several runs, the rivals taking turns so that noise meets them alike."""

import ctypes
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from daebench.errors import BadInput, DaebenchError
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.names import method_of
from daebench.methods.outside.read import is_outside
from daebench.runs.ivp import ConstrainedIvp, Ivp
from daebench.runs.request import Request
from daebench.runs.trajectory import Array

PENDULUM, WATER = "spherical_pendulum", "rigid_water"
BY_HAND = {"rattle": PENDULUM, "rk4": PENDULUM, "strang": PENDULUM, "rattle_settle": WATER}
"""Methods that there is a C program of, beside this file, and the problem that it is written for."""

VARIANTS: dict[str, dict[str, Any]] = {
    "ns_per_step": {"watch": (), "count": False},
    "ns_watched": {"watch": None, "count": False},
    "ns_counted": {"watch": None, "count": True},
}
"""What is timed: bare steps; with energy and manifold, or Casimir functions, monitored; and with work counted too."""


def measure(ivp: Ivp, name: str, *, h: float, steps: int, repeat: int, anyway: bool = False) -> dict[str, Any]:
    """Return a method's best time of a step in several runs: bare, monitored, and monitored and counted.

    The row has "method", "ns_per_step", "ns_watched" and "ns_counted", in nanoseconds, and "note", which says why there is no number.
    BadInput is raised if it is not a fixed-step method of daebench.
    """
    if steps < 1 or repeat < 1:
        raise BadInput(f"steps = {steps} and repeat = {repeat} must be at least 1.", "steps-or-repeat-not-positive")
    if is_outside(name):
        raise BadInput(
            f"{name} is from outside; bench times methods of daebench, and daebench run reports the time of {name}.", "bench-from-outside"
        )
    method = method_of(ivp, name, anyway=anyway)
    if method.knob != "h":
        raise BadInput(f"{name} is not a fixed-step method; bench times schemes.", "bench-not-fixed-step")
    row: dict[str, Any] = {"method": name, "note": method.refusal(ivp)}
    if row["note"]:
        return row
    times: dict[str, list[float]] = {variant: [] for variant in VARIANTS}
    for _ in range(repeat):
        for variant, choice in VARIANTS.items():
            run = method.solve(ivp, Request(value=h, steps=steps, every=0, **choice))
            if run.failure:
                return row | {"note": run.failure}
            times[variant].append(run.seconds / run.steps * 1e9)
    return row | {variant: min(values) for variant, values in times.items()}


def hand_written(ivp: Ivp, rows: Sequence[dict[str, Any]], *, h: float, steps: int, repeat: int) -> list[dict[str, Any]]:
    """Return a row for each method of ``rows`` that there is in C, timed at -O3 in turns with the linked kernel.

    Each is written for one problem; there are none elsewhere. The linked kernel's row gets the ratio as its note.
    """
    measured = {row["method"]: row for row in rows if BY_HAND.get(row["method"]) == ivp.problem and not row.get("note")}
    if not ivp.on_manifold or not measured:
        return []
    if compiler() is None:
        return [{"method": "C", "note": "no C compiler found"}]
    with tempfile.TemporaryDirectory() as folder:
        return [_in_turns(Path(folder), ivp, row, h=h, steps=steps, repeat=repeat) for row in measured.values()]


def compiler() -> str | None:
    """Return the path of a C compiler, the one that CC names if it does; None where there is none."""
    return next((executable for name in (os.environ.get("CC", ""), "cc", "gcc", "clang") if (executable := shutil.which(name))), None)


def built(name: str, folder: Path) -> ctypes.CDLL | None:
    """Return a C program that is kept beside this file as a library, compiled at -O3; None where there is no compiler."""
    command, library = compiler(), folder / f"{name}.so"
    if command is None:
        return None
    if why := failure(command, Path(__file__).with_name(f"{name}.c"), library):
        raise DaebenchError(f"the C program does not compile: {why}.", "c-program-not-compilable")
    return ctypes.CDLL(str(library))


def failure(command: str, source: Path, library: Path, level: str = "-O3") -> str:
    """Compile a C program as a library; return the first line of what the compiler says where it fails, else ""."""
    options = [level, "-ffp-contract=off", "-shared", "-fPIC", str(source), "-o", str(library), "-lm"]
    done = subprocess.run([command, *options], capture_output=True, text=True, check=False)
    return (done.stderr.strip().splitlines() or [command])[0] if done.returncode else ""


def _in_turns(folder: Path, ivp: ConstrainedIvp, row: dict[str, Any], *, h: float, steps: int, repeat: int) -> dict[str, Any]:
    """Return the row of the program in C, and note in the kernel's how the two compare."""
    name = row["method"]
    call = _compiled(folder, name, ivp, h, steps)
    method, linked, by_hand = FixedStep(name), [], []
    for _ in range(repeat):
        run = method.solve(ivp, Request(value=h, steps=steps, every=0, **VARIANTS["ns_per_step"])).complete()
        linked.append(run.seconds / steps * 1e9)
        by_hand.append(call())
    row["ns_per_step"] = min([row["ns_per_step"], *linked])
    row["note"] = f"{min(linked) / min(by_hand):.3f} times C"
    return {"method": f"{name} in C", "ns_per_step": min(by_hand), "note": f"{Path(str(compiler())).name} -O3"}


def by_hand(folder: Path, name: str, ivp: ConstrainedIvp, h: float, steps: int) -> Callable[[], float] | None:
    """Return a call that runs a C program and returns nanoseconds per step; None where there is no program, or no compiler."""
    if BY_HAND.get(name) != ivp.problem or compiler() is None:
        return None
    return _compiled(folder, name, ivp, h, steps)


def _compiled(folder: Path, name: str, ivp: ConstrainedIvp, h: float, steps: int) -> Callable[[], float]:
    """Return a call that runs a C program and returns nanoseconds per step."""
    run = program(folder, name, ivp)
    return lambda: run(h, steps)[1] / steps * 1e9


def program(folder: Path, name: str, ivp: ConstrainedIvp) -> Callable[[float, int], tuple[Array, float]]:
    """Return a function of the step size and the number of steps that runs a C program; it returns the state (p, q) and the CPU time, s.

    There must be a compiler. The function raises :class:`DaebenchError` if the program stops early.
    """
    function = getattr(built(name, folder), name)
    function.restype = ctypes.c_long
    function.argtypes = [ctypes.c_void_p, *[ctypes.c_double] * (len(ivp.par) + 1), ctypes.c_long, ctypes.POINTER(ctypes.c_long)]

    def run(h: float, steps: int) -> tuple[Array, float]:
        state = np.concatenate([ivp.p0, ivp.q0])
        began = time.thread_time()
        taken = function(state.ctypes.data, *ivp.par, h, steps, ctypes.byref(ctypes.c_long()))
        spent = time.thread_time() - began
        if taken != steps:
            raise DaebenchError(f"the C program stopped after {taken} of {steps} steps.", "c-program-stopped")
        return state, spent

    return run
