"""Python callables as methods: one step, a whole run, or an object with a memory."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput, Stopped
from daebench.methods.fixed_step.stepping import CHUNK_SECONDS as CHUNK_SECONDS
from daebench.methods.outside.call import Code, Guard, described, fresh, stepped
from daebench.methods.outside.ending import Limit
from daebench.methods.outside.method import OutsideMethod, Stated, Step
from daebench.methods.outside.process import Exited
from daebench.methods.outside.record import Block
from daebench.runs.grid import Grid
from daebench.runs.ivp import Ivp
from daebench.runs.request import Request

Steps = NDArray[np.int64]


def method_of_callable(code: Any, name: str = "", content: str = "", guard: Guard = nullcontext) -> OutsideMethod:
    """Return a Python callable as a method.

    It is called in this process. An exception, and ``SystemExit``, end its run with a sentence; ``os._exit``, and signals as that of a
    segmentation fault, cannot be caught here and end Python itself. Code that is named by its place, as ``./mine.py:step``, runs in a
    process of its own, where they end its run alone.

    Parameters
    ----------
    code : callable, or object or class with a method ``step``
        On a constrained problem ``step(p, q, h)`` returns p and q after a step, or ``solve(p, q, h, t)`` returns them at the times t,
        shape(k, d) each; on a Poisson system ``step(y, h)`` and ``solve(y, h, t)`` return y. The arguments are copies, and must not be
        changed. An object with a memory is copied, and a class is called without arguments, at the start of each run. An attribute
        ``claims`` may state its claims, with any of the fields of :class:`daebench.methods.outside.method.Stated`. An attribute ``knob`` of
        "tol" says that ``solve(p, q, tol, t)`` chooses its own steps: it is given the tolerance in place of h.
    name : str
        Name of the method; by default the name of the callable.
    content : str
        Digest of the code.
    guard : callable
        Returns a context that turns errors in a user file into a RunFailed that names the line.

    Raises
    ------
    BadInput
        If it cannot be called, or has another number of arguments.

    Examples
    --------
    >>> import daebench
    >>> from daebench.methods.outside.callables import method_of_callable
    >>> def explicit_euler(p, q, h):
    ...     return p - h * q, q + h * p
    >>> method_of_callable(explicit_euler).name
    'explicit_euler'
    """
    name = name or getattr(code, "__qualname__", type(code).__qualname__)
    about = described(code, name)
    anew = fresh(code, about.remembers)
    blocks = partial(_blocks, anew, name, about.taken, guard)
    step = partial(_mapping, anew, name, guard) if about.taken < 4 else None
    return OutsideMethod(
        name,
        blocks,
        content,
        every_step=about.taken < 4,
        remembers=about.remembers,
        step=step,
        claims=Stated(**about.claims),
        knob=about.knob,
    )


def takes_one_step(name: str, taken: int, ivp: Ivp) -> bool:
    """Return whether a callable of so many arguments takes one step on a problem, or a whole run; refuse one for another kind of state."""
    state, n = ivp.state, len(ivp.start)
    if taken not in (n + 1, n + 2):
        calls = f"step({state.arguments}, h) that returns {state.listed}, or solve({state.arguments}, h, t)"
        raise BadInput(f"{name} takes {taken} arguments; on {ivp.problem} give {calls}.", "step-argument-count")
    return taken == n + 1


def _blocks(anew: Callable[[], Step], name: str, taken: int, guard: Guard, ivp: Ivp, grid: Grid, request: Request) -> Iterator[Block]:
    steps = takes_one_step(name, taken, ivp)
    code = Code(name, anew, guard, Limit(request.seconds_limit))
    if steps:
        require_step_size(name, grid)
        yield from _steps(code, ivp, grid)
    else:
        yield _whole(code, ivp, grid, request.value)


def _steps(code: Code, ivp: Ivp, grid: Grid) -> Iterator[Block]:
    """Take all steps, in blocks of about a fifth of a second."""
    state: Sequence[NDArray[np.float64]] = ivp.start

    def take(left: int) -> Taken:
        nonlocal state
        rows = list[NDArray[np.float64]]()
        state, seconds, stopped = stepped(code, state, grid.h, left, CHUNK_SECONDS, rows.append)
        return np.array(rows).reshape(len(rows), ivp.size), seconds, stopped

    return in_blocks(take, grid)


Taken = tuple[NDArray[np.float64], float, BaseException | None]
"""States of steps, the time that the code took for them, s, and what ended them early."""


def in_blocks(take: Callable[[int], Taken], grid: Grid) -> Iterator[Block]:
    """Yield the states of all steps, some after the other; ``take`` is told how many are left."""
    done = 0
    while done < grid.steps:
        rows, seconds, stopped = take(grid.steps - done)
        yield Block(np.arange(done + 1, done + len(rows) + 1, dtype=np.int64), rows, seconds)
        done += len(rows)
        if isinstance(stopped, Exited):
            raise Stopped(f"{stopped} after {done} step{'' if done == 1 else 's'}")
        if stopped is not None:  # after the states before it, which are not to be lost
            raise stopped


def _mapping(anew: Callable[[], Step], name: str, guard: Guard) -> Step:
    """Return one step as a map: of real vectors checked as in a run, of complex ones as the code has it."""
    code = Code(name, anew, guard, Limit(None))

    def step(*arguments: Any) -> Any:
        *state, h = arguments
        with code.limited():
            if any(map(np.iscomplexobj, state)):
                return code.of_complex(state, h)
            after, _ = code.step(state, h)
        return after if len(after) > 1 else after[0]

    return step


def require_step_size(name: str, grid: Grid) -> None:
    """Refuse a tolerance for code that takes one step at a time."""
    if grid.end is not None:
        raise BadInput(
            f"{name}: knob = 'tol' is for solve(p, q, tol, t), or solve(y, tol, t) on a Poisson system; one step takes h.",
            "knob-tol-of-one-step",
        )


def _whole(code: Code, ivp: Ivp, grid: Grid, value: float) -> Block:
    """Return the states of a whole run at the outputs."""
    steps = outputs(grid)
    with code.limited():
        states, seconds = code.solve(ivp.start, value, grid.times(steps))
    return Block(steps, np.concatenate(states, axis=1), seconds)


def outputs(grid: Grid) -> Steps:
    """Return the numbers of the steps after which a state is kept, the last step among them."""
    steps = np.arange(grid.every, grid.steps + 1, grid.every, dtype=np.int64) if grid.every else np.empty(0, dtype=np.int64)
    return steps if len(steps) and steps[-1] == grid.steps else np.append(steps, np.int64(grid.steps))
