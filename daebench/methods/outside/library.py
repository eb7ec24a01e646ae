"""A function of a compiled library as a method: ``int step(const double *par, double *p, double *q, double h)``, or with y for p and q."""

import ctypes
import os
import time
import types
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from daebench.compiler.cache import generated
from daebench.errors import BadInput
from daebench.methods.fixed_step.stepping import next_piece
from daebench.methods.outside.limit import Limit, Worker
from daebench.methods.outside.method import OutsideMethod
from daebench.methods.outside.record import Block
from daebench.methods.solvers.monitor import Stopped
from daebench.runs.grid import Grid
from daebench.runs.ivp import Ivp
from daebench.runs.request import Request
from daebench.runs.trajectory import Array

LOOP = '''
"""The loop over the steps of a compiled library: a function of C is called by its address."""

from daebench.compiler.machine_code import njit
from daebench.compiler.foreign import call{vectors} as call


@njit({options})
def integrate(address, par, {state}, h, rows, count):
    data, {data} = par.ctypes.data, {pointers}
    for k in range(len(rows)):
        status = call(address, data, {data}, h)
        if status:
            return status
        {store}
        count[0] = k + 1
    return 0
'''


OWN_NAMES_FIRST = getattr(os, "RTLD_DEEPBIND", 0)
"""A library's functions call each other by their names, and not what else has that name: glibc has a function ``step``."""

STORE = {
    1: "rows[k] = y",
    2: "rows[k, : len(p)] = p\n        rows[k, len(p) :] = q",
}
"""How a state is stored, by the number of its vectors."""


def method_of_library(name: str, path: Path, function: str, content: str) -> OutsideMethod:
    """Return a function of a compiled library as a method: it updates p and q, or y, in place and returns 0; another status stops the run.

    Parameters
    ----------
    name : str
        Name of the method.
    path : Path
        The library.
    function : str
        Name of the function.
    content : str
        Digest of the library.

    Raises
    ------
    BadInput
        If the library cannot be loaded, or has no function of this name.
    """
    try:
        library = ctypes.CDLL(str(path.resolve()), mode=OWN_NAMES_FIRST)
    except OSError as error:
        raise BadInput(f"{name}: {path} cannot be loaded as a library: {error}.") from None
    try:
        address = ctypes.cast(getattr(library, function), ctypes.c_void_p).value
    except AttributeError:
        raise BadInput(f'{name}: {path} has no function {function}; declare a function of C++ as extern "C".') from None
    assert address is not None  # a function that there is
    return OutsideMethod(name, partial(_blocks, address), content)


def _loop(vectors: int) -> types.ModuleType:
    """Return the module of the compiled loop for states of one vector, or of two."""
    names = ("y",) if vectors == 1 else ("p", "q")

    def build(cached: bool) -> str:
        parts = {
            "state": ", ".join(names),
            "data": ", ".join(f"at_{name}" for name in names),
            "pointers": ", ".join(f"{name}.ctypes.data" for name in names),
            "store": STORE[vectors],
        }
        return LOOP.format(vectors=vectors, options="cache=True, nogil=True" if cached else "nogil=True", **parts)

    return generated("library_loop", f"library loop {vectors}", build)


def _blocks(address: int, ivp: Ivp, grid: Grid, request: Request) -> Iterator[Block]:
    state, par = [np.array(vector, dtype=float) for vector in ivp.start], np.array(ivp.par)
    integrate, count = _loop(len(state)).integrate, np.zeros(1, dtype=np.int64)

    def timed(rows: Array) -> tuple[int, float]:
        began = time.perf_counter()
        status = integrate(address, par, *state, grid.h, rows, count)
        return status, time.perf_counter() - began

    rows = np.empty((0, ivp.size))
    timed(rows)  # compiled before the clock runs
    done, piece, limit = 0, 1, Limit(request.seconds_limit)
    with Worker() as worker:
        while done < grid.steps:
            piece = min(piece, grid.steps - done, max(1, MOST_NUMBERS // ivp.size))
            rows = rows if len(rows) >= piece else np.zeros((piece, ivp.size))
            count[0], took = 0, 0.0
            stopped: BaseException | None = None
            try:
                status, took = worker.result(partial(timed, rows[:piece]), limit)
                stopped = Stopped(f"the function of the library returned {status} instead of 0") if status else None
            except (Stopped, KeyboardInterrupt) as ending:  # the thread is left, which still has the rows
                stopped = ending
            yield Block(np.arange(done + 1, done + count[0] + 1, dtype=np.int64), rows[: count[0]], took)
            if stopped is not None:  # after the states before it, which are not to be lost
                raise stopped
            done += piece
            piece = next_piece(piece, took)


MOST_NUMBERS = 2**18
"""Numbers of a block at most: 2 MB, which stay in the cache of the processor."""
