"""A function of a compiled library as a method: ``int step(const double *par, double *p, double *q, double h)``, or with y for p and q."""

import ctypes
import time
import types
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from daebench.compiler.cache import generated
from daebench.errors import BadInput
from daebench.methods.fixed_step.stepping import next_piece
from daebench.methods.outside.method import OutsideMethod
from daebench.methods.outside.record import Block
from daebench.methods.solvers.monitor import Stopped
from daebench.runs.grid import Grid
from daebench.runs.ivp import Ivp
from daebench.runs.request import Request

LOOP = '''
"""The loop over the steps of a compiled library: a function of C is called by its address."""

from daebench.compiler.machine_code import njit
from daebench.methods.outside.address import call{vectors} as call


@njit{cached}
def integrate(address, par, {state}, h, rows):
    data, {data} = par.ctypes.data, {pointers}
    for k in range(len(rows)):
        status = call(address, data, {data}, h)
        if status:
            return k, status
        {store}
    return len(rows), 0
'''


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
        What the method is called.
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
        library = ctypes.CDLL(str(path.resolve()))
    except OSError as error:
        raise BadInput(f"{name}: {path} cannot be loaded as a library: {error}.") from None
    try:
        address = ctypes.cast(getattr(library, function), ctypes.c_void_p).value
    except AttributeError:
        raise BadInput(f'{name}: {path} has no function {function}; one of C++ is to be declared extern "C".') from None
    return OutsideMethod(name, partial(_blocks, int(address or 0)), content)


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
        return LOOP.format(vectors=vectors, cached="(cache=True)" if cached else "()", **parts)

    return generated("library_loop", f"library loop {vectors}", build)


def _blocks(address: int, ivp: Ivp, grid: Grid, request: Request) -> Iterator[Block]:
    state = [np.array(vector, dtype=float) for vector in ivp.start]
    integrate, par = _loop(len(state)).integrate, np.array(ivp.par)
    rows = np.empty((0, ivp.size))
    integrate(address, par, *state, grid.h, rows)  # compiled before the clock runs
    done, piece = 0, 64
    while done < grid.steps:
        piece = min(piece, grid.steps - done, max(1, MOST_NUMBERS // ivp.size))
        if len(rows) < piece:
            rows = np.zeros((piece, ivp.size))
        began = time.perf_counter()
        count, status = integrate(address, par, *state, grid.h, rows[:piece])
        took = time.perf_counter() - began
        yield Block(np.arange(done + 1, done + count + 1, dtype=np.int64), rows[:count], took)
        if status:
            raise Stopped(f"the function of the library returned {status}, and not 0")
        done += piece
        piece = next_piece(piece, took)


MOST_NUMBERS = 2**18
"""Numbers of a block at most: 2 MB, which stay in the cache of the processor."""
