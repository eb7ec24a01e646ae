"""Python callables as methods: one step, a whole run, or an object with a memory."""

import copy
import inspect
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, fields
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput, RunFailed, unknown
from daebench.methods.fixed_step.stepping import next_piece
from daebench.methods.outside.method import OutsideMethod, Stated, Step
from daebench.methods.outside.record import Block
from daebench.methods.solvers.monitor import Stopped
from daebench.runs.external_state import external_state
from daebench.runs.grid import Grid
from daebench.runs.ivp import ConstrainedIvp, Ivp
from daebench.runs.request import Request
from daebench.runs.trajectory import Array

Steps = NDArray[np.int64]

Guard = Callable[[], AbstractContextManager[None]]
"""Turns what goes wrong in a file of the user's own into a :class:`RunFailed` that names its line."""


@dataclass(frozen=True)
class Kind:
    """How callables are called for problems of one kind.

    Parameters
    ----------
    step, solve : str
        How one step, and a whole run, are called.
    result : str
        What they return.
    vectors : int
        Number of vectors in a state.
    """

    step: str
    solve: str
    result: str
    vectors: int


CONSTRAINED = Kind("step(p, q, h)", "solve(p, q, h, t)", "p and q", 2)
POISSON = Kind("step(y, h)", "solve(y, h, t)", "y", 1)


def method_of_callable(code: Any, name: str = "", content: str = "", guard: Guard = nullcontext) -> OutsideMethod:
    """Return a Python callable as a method.

    Parameters
    ----------
    code : callable, or object or class with a method ``step``
        On a constrained problem ``step(p, q, h)`` returns p and q after a step, or ``solve(p, q, h, t)`` returns them at the times t,
        shape(k, d) each; on a Poisson system ``step(y, h)`` and ``solve(y, h, t)`` return y. The arguments are copies, and not to be
        changed. An object with a memory is copied, and a class called without arguments, at the start of each run. What it claims it
        may say in an attribute ``claims``, with any of the fields of :class:`daebench.methods.outside.method.Stated`.
    name : str
        What the method is called; by default the name of the callable.
    content : str
        Digest of the code.
    guard : callable
        Returns a context that turns what goes wrong in a file of the user's own into a RunFailed that names its line.

    Raises
    ------
    BadInput
        If it cannot be called, or takes another number of arguments.
    """
    name = name or getattr(code, "__qualname__", type(code).__qualname__)
    remembers = not inspect.isroutine(code) and callable(getattr(code, "step", None))
    if not (remembers or callable(code)):
        raise BadInput(f"{name} is no method: it is a {type(code).__name__}; {ADVICE}.")
    taken = _arguments(code.step if remembers else code) - (remembers and isinstance(code, type))
    if not 2 <= taken <= 4:
        raise BadInput(f"{name} takes {taken} argument{'' if taken == 1 else 's'}; {ADVICE}.")
    claims = _stated(name, getattr(code, "claims", {}))
    fresh = partial(_fresh, code, remembers)
    blocks = partial(_blocks, fresh, name, taken, guard)
    return OutsideMethod(name, blocks, content, every_step=taken < 4, step=fresh if taken < 4 else None, claims=claims)


def _stated(name: str, claims: Any) -> Stated:
    """Return what a callable says of itself in its attribute ``claims``."""
    known = [field.name for field in fields(Stated)]
    if not isinstance(claims, Mapping):
        raise BadInput(f"{name}: claims is to be a mapping, as {{'order': 2, 'symplectic': True}}, and is a {type(claims).__name__}.")
    for claim, value in claims.items():
        if claim not in known:
            raise unknown(f"claim of {name}", str(claim), known)
        if not isinstance(value, int if claim == "order" else bool):
            raise BadInput(f"{name}: claims[{claim!r}] = {value!r} is to be {'a whole number' if claim == 'order' else 'True or False'}.")
    return Stated(**claims)


def _fresh(code: Any, remembers: bool) -> Step:
    """Return the callable, of an object with a memory that of a copy that remembers nothing yet."""
    step: Step = (code() if isinstance(code, type) else copy.deepcopy(code)).step if remembers else code
    return step


ADVICE = (
    f"give {CONSTRAINED.step} that returns {CONSTRAINED.result}, {CONSTRAINED.solve} that returns them at the times t, "
    f"{POISSON.step} or {POISSON.solve} on a Poisson system, or an object with a method step"
)
"""What may be given."""


def _arguments(code: Callable[..., Any]) -> int:
    """Return how many positional arguments a callable takes that have no default; 3 where it does not say, as built-in functions do."""
    try:
        parameters = inspect.signature(code).parameters.values()
    except (TypeError, ValueError):
        return 3
    positional = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    if any(parameter.kind is inspect.Parameter.VAR_POSITIONAL for parameter in parameters):
        return 3
    return sum(parameter.kind in positional and parameter.default is inspect.Parameter.empty for parameter in parameters)


def _blocks(fresh: Callable[[], Step], name: str, taken: int, guard: Guard, ivp: Ivp, grid: Grid, request: Request) -> Iterator[Block]:
    kind = CONSTRAINED if isinstance(ivp, ConstrainedIvp) else POISSON
    with _named(guard):
        code = fresh()
    if taken == kind.vectors + 1:
        yield from _steps(partial(_after_step, code, name, kind, guard), ivp, grid)
    elif taken == kind.vectors + 2:
        yield _whole(code, name, kind, guard, ivp, grid)
    else:
        raise BadInput(f"{name} takes {taken} arguments; on {ivp.problem} give {kind.step} that returns {kind.result}, or {kind.solve}.")


@contextmanager
def _named(guard: Guard) -> Iterator[None]:
    """Say what goes wrong in code from outside as the reason for which a run stopped."""
    try:
        with guard():
            yield
    except RunFailed as error:
        raise Stopped(str(error)) from error
    except Exception as error:
        text = " ".join(str(error).split())
        raise Stopped(f"the code raises {type(error).__name__}{': ' * bool(text)}{text}") from error


def _after_step(code: Callable[..., Any], name: str, kind: Kind, guard: Guard, state: Sequence[Array], h: float) -> list[Array]:
    """Return the state after a step; the callable is given copies, and must leave them as they are."""
    given = [vector.copy() for vector in state]
    with _named(guard):
        result = code(*given, h)
    changed = any(a.tobytes() != b.tobytes() for a, b in zip(given, state, strict=True))
    if changed:
        raise BadInput(f"{name}: {kind.step} changes its arguments; return new arrays, and leave those that it is given as they are.")
    after: list[Array] = external_state(result, [vector.shape for vector in state], f"{name}: {kind.step} must return {kind.result}")
    return after


def _steps(after: Callable[[Sequence[Array], float], list[Array]], ivp: Ivp, grid: Grid) -> Iterator[Block]:
    """Take all steps, in blocks of about a fifth of a second."""
    state: Sequence[Array] = ivp.start
    done, piece = 0, 64
    while done < grid.steps:
        piece = min(piece, grid.steps - done)
        rows = np.empty((piece, ivp.size))
        stopped, count, began = None, piece, time.perf_counter()
        for k in range(piece):
            try:
                state = after(state, grid.h)
            except Stopped as stop:
                stopped, count = stop, k
                break
            np.concatenate(state, out=rows[k])
            if not np.isfinite(rows[k]).all():
                count = k + 1
                break
        took = time.perf_counter() - began
        yield Block(np.arange(done + 1, done + count + 1, dtype=np.int64), rows[:count], took)
        if stopped is not None:
            raise stopped
        done += piece
        piece = next_piece(piece, took)


def _whole(code: Callable[..., Any], name: str, kind: Kind, guard: Guard, ivp: Ivp, grid: Grid) -> Block:
    """Return what a whole run gives at the outputs."""
    steps = outputs(grid)
    shapes = [(len(steps), len(vector)) for vector in ivp.start]
    began = time.perf_counter()
    with _named(guard):
        result = code(*(vector.copy() for vector in ivp.start), grid.h, steps * grid.h)
    took = time.perf_counter() - began
    parts = external_state(result, shapes, f"{name}: {kind.solve} must return {kind.result} at the {len(steps)} times t")
    return Block(steps, np.concatenate(parts, axis=1), took)


def outputs(grid: Grid) -> Steps:
    """Return the numbers of the steps after which a state is kept, the last step among them."""
    steps = np.arange(grid.every, grid.steps + 1, grid.every, dtype=np.int64) if grid.every else np.empty(0, dtype=np.int64)
    return steps if len(steps) and steps[-1] == grid.steps else np.append(steps, np.int64(grid.steps))
