"""Code that is named by its place as a method: its loop over steps runs in a process of its own."""

import time
import weakref
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from daebench.methods.fixed_step import stepping
from daebench.methods.outside import callables
from daebench.methods.outside.callables import block_after, outputs, require_step_size, takes_one_step
from daebench.methods.outside.limit import Limit
from daebench.methods.outside.method import OutsideMethod
from daebench.methods.outside.process import MOST_NUMBERS, Exited, Place, Process, borrowed, give_back, lent
from daebench.methods.outside.record import Block
from daebench.methods.outside.stated import Stated
from daebench.methods.solvers.stopped import Stopped
from daebench.runs.grid import Grid
from daebench.runs.ivp import Ivp
from daebench.runs.request import Request


def method_at(place: Place) -> OutsideMethod:
    """Return the code at a place as a method.

    It is a callable of a Python file, see :func:`daebench.methods.outside.callables.method_of_callable`, or a function of a compiled
    library, ``int step(const double *par, double *p, double *q, double h)``, or with y for p and q, that updates p and q in place and
    returns 0; another status stops the run. A file that ends its process when it is loaded is a method all of whose runs fail.

    Raises
    ------
    BadInput
        If the file cannot be loaded, or has nothing of this name that can be called.
    """
    try:
        with lent(place) as process:
            about = process.about
    except Stopped as stopped:
        why = f"{stopped} while the file was loaded" if isinstance(stopped, Exited) else str(stopped)
        return OutsideMethod(place.name, partial(_never, why), place.content)
    if not about.get("taken"):
        return OutsideMethod(place.name, partial(_of_library, place), place.content)
    taken, remembers, claims = about["taken"], about["remembers"], Stated(**about["claims"])
    step = partial(RemoteStep, place) if taken < 4 else None
    blocks = partial(_of_file, place, taken)
    knob = about["knob"]
    return OutsideMethod(place.name, blocks, place.content, every_step=taken < 4, remembers=remembers, step=step, claims=claims, knob=knob)


def _never(why: str, ivp: Ivp, grid: Grid, request: Request) -> Iterator[Block]:
    """Take no step, because the code ends its process when it is loaded."""
    raise Stopped(why)


def _of_file(place: Place, taken: int, ivp: Ivp, grid: Grid, request: Request) -> Iterator[Block]:
    steps_alone = takes_one_step(place.name, taken, ivp)
    with lent(place) as process:
        limit = Limit(request.seconds_limit)
        process.ask({"do": "fresh"}, np.empty(0), limit)
        if steps_alone:
            require_step_size(place.name, grid)
            yield from _steps(process, ivp, grid, limit)
            return
        steps = outputs(grid)
        given = np.concatenate([*ivp.start, grid.times(steps)])
        about = {"do": "whole", "vectors": len(ivp.start), "h": request.value, "size": ivp.size}
        answer, numbers = process.ask(about, given, limit)
        yield Block(steps, numbers.reshape(len(steps), ivp.size), answer["seconds"])


def _steps(process: Process, ivp: Ivp, grid: Grid, limit: Limit) -> Iterator[Block]:
    """Take all steps, in blocks of about a fifth of a second."""
    state, done, room = np.concatenate(ivp.start), 0, max(1, MOST_NUMBERS // ivp.size)
    while done < grid.steps:
        question = {"vectors": len(ivp.start), "h": grid.h, "most": min(grid.steps - done, room), "chunk": callables.CHUNK_SECONDS}
        rows, seconds, stopped = process.rows(question, state, ivp.size, limit)
        yield block_after(done, rows, seconds)
        done += len(rows)
        if stopped is not None:  # after the states before it, which are not to be lost
            raise _with_steps(stopped, done)
        state = rows[-1]


def _of_library(place: Place, ivp: Ivp, grid: Grid, request: Request) -> Iterator[Block]:
    with lent(place) as process:
        about = {"do": "begin", "vectors": len(ivp.start), "size": ivp.size}
        process.ask(about, np.concatenate([*ivp.start, ivp.par]), Limit(None))
        done, piece, limit = 0, 1, Limit(request.seconds_limit)
        while done < grid.steps:
            piece = min(piece, grid.steps - done, max(1, MOST_NUMBERS // ivp.size))
            began = time.perf_counter()
            rows, seconds, stopped = process.rows({"h": grid.h, "most": piece}, np.empty(0), ivp.size, limit)
            yield block_after(done, rows, seconds)
            done += len(rows)
            if stopped is not None:  # after the states before it, which are not to be lost
                raise _with_steps(stopped, done)
            piece = stepping.next_piece(piece, time.perf_counter() - began)


def _with_steps(stopped: BaseException, done: int) -> BaseException:
    """Return why a run ended, with the number of its steps where its process has ended."""
    return Stopped(f"{stopped} after {done} step{'' if done == 1 else 's'}") if isinstance(stopped, Exited) else stopped


class RemoteStep:
    """One step as a map, of a callable without a memory yet: of real vectors checked as in a run, of complex ones as the code has it."""

    def __init__(self, place: Place) -> None:
        self._process = borrowed(place)
        weakref.finalize(self, give_back, self._process)
        self._process.ask({"do": "fresh"}, np.empty(0), Limit(None))

    def __call__(self, *arguments: Any) -> Any:
        """Return the vectors after a step, given those before it and h."""
        *state, h = arguments
        about = {"do": "step", "vectors": len(state), "h": float(h)}
        _, numbers = self._process.ask(about, np.concatenate(state), Limit(None))
        after = np.split(numbers, len(state))
        return after if len(after) > 1 else after[0]
