"""Python callables as methods: one step, a whole run, or an object with a memory."""

import copy
import inspect
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import fields
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput, unknown
from daebench.methods.fixed_step.stepping import CHUNK_SECONDS
from daebench.methods.outside.call import CONSTRAINED, POISSON, Code, Guard, Kind
from daebench.methods.outside.limit import Limit
from daebench.methods.outside.method import OutsideMethod, Stated, Step
from daebench.methods.outside.record import Block
from daebench.methods.solvers.monitor import Stopped
from daebench.runs.grid import Grid
from daebench.runs.ivp import ConstrainedIvp, Ivp
from daebench.runs.request import Request
from daebench.runs.trajectory import Array

Steps = NDArray[np.int64]


def method_of_callable(code: Any, name: str = "", content: str = "", guard: Guard = nullcontext) -> OutsideMethod:
    """Return a Python callable as a method.

    Parameters
    ----------
    code : callable, or object or class with a method ``step``
        On a constrained problem ``step(p, q, h)`` returns p and q after a step, or ``solve(p, q, h, t)`` returns them at the times t,
        shape(k, d) each; on a Poisson system ``step(y, h)`` and ``solve(y, h, t)`` return y. The arguments are copies, and must not be
        changed. An object with a memory is copied, and a class is called without arguments, at the start of each run. An attribute
        ``claims`` may state its claims, with any of the fields of :class:`daebench.methods.outside.method.Stated`.
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
    """
    name = name or getattr(code, "__qualname__", type(code).__qualname__)
    remembers = not inspect.isroutine(code) and callable(getattr(code, "step", None))
    if not (remembers or callable(code)):
        raise BadInput(f"{name} is not a method: it is a {type(code).__name__}; {ADVICE}.")
    unbound = remembers and isinstance(code, type) and inspect.isfunction(inspect.getattr_static(code, "step"))
    taken = _arguments(code.step if remembers else code) - unbound
    if not 2 <= taken <= 4:
        raise BadInput(f"{name} takes {taken} argument{'' if taken == 1 else 's'}; {ADVICE}.")
    claims = _stated(name, getattr(code, "claims", {}))
    fresh = partial(_fresh, code, remembers)
    blocks = partial(_blocks, fresh, name, taken, guard)
    step = partial(_mapping, fresh, name, guard) if taken < 4 else None
    return OutsideMethod(name, blocks, content, every_step=taken < 4, remembers=remembers, step=step, claims=claims)


def _stated(name: str, claims: Any) -> Stated:
    """Return the claims in the attribute ``claims`` of a callable."""
    known = [field.name for field in fields(Stated)]
    if not isinstance(claims, Mapping):
        raise BadInput(
            f"{name}: claims must be a mapping, for example {{'order': 2, 'symplectic': True}}, and is a {type(claims).__name__}."
        )
    for claim, value in claims.items():
        if claim not in known:
            raise unknown(f"claim of {name}", str(claim), known)
        if claim == "order" and not (type(value) is int and value > 0):
            raise BadInput(f"{name}: claims['order'] = {value!r} must be a whole number greater than 0.")
        if claim != "order" and not isinstance(value, bool):
            raise BadInput(f"{name}: claims[{claim!r}] = {value!r} must be True or False.")
    return Stated(**claims)


def _fresh(code: Any, remembers: bool) -> Step:
    """Return the callable, of an object with a memory that of a copy that remembers nothing yet."""
    step: Step = (code() if isinstance(code, type) else copy.deepcopy(code)).step if remembers else code
    return step


ADVICE = (
    f"give {CONSTRAINED.step} that returns {CONSTRAINED.result}, {CONSTRAINED.solve} that returns them at the times t, "
    f"{POISSON.step} or {POISSON.solve} on a Poisson system, or an object with a method step"
)
"""Kinds of code that may be given."""


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
    if taken not in (kind.vectors + 1, kind.vectors + 2):
        raise BadInput(f"{name} takes {taken} arguments; on {ivp.problem} give {kind.step} that returns {kind.result}, or {kind.solve}.")
    code = Code(name, fresh, guard, Limit(request.seconds_limit))
    if taken == kind.vectors + 1:
        yield from _steps(code, kind, ivp, grid)
    else:
        yield _whole(code, kind, ivp, grid)


def _steps(code: Code, kind: Kind, ivp: Ivp, grid: Grid) -> Iterator[Block]:
    """Take all steps, in blocks of about a fifth of a second."""
    state: Sequence[Array] = ivp.start
    done, ended = 0, False
    while done < grid.steps:
        rows, seconds = list[Array](), 0.0
        stopped: BaseException | None = None
        until = time.perf_counter() + CHUNK_SECONDS
        with code.limited():
            try:
                while not ended:
                    state, took = code.step(kind, state, grid.h)
                    rows.append(np.concatenate(state))
                    seconds += took
                    ended = done + len(rows) == grid.steps or time.perf_counter() > until or not np.isfinite(rows[-1]).all()
            except (Stopped, BadInput, KeyboardInterrupt) as error:
                stopped = error
        yield Block(np.arange(done + 1, done + len(rows) + 1, dtype=np.int64), np.array(rows).reshape(len(rows), ivp.size), seconds)
        if stopped is not None:  # after the states before it, which are not to be lost
            raise stopped
        done, ended = done + len(rows), False


def _mapping(fresh: Callable[[], Step], name: str, guard: Guard) -> Step:
    """Return one step as a map: of real vectors checked as in a run, of complex ones as the code has it."""
    code = Code(name, fresh, guard, Limit(None))

    def step(*arguments: Any) -> Any:
        *state, h = arguments
        with code.limited():
            if any(map(np.iscomplexobj, state)):
                return code.of_complex(state, h)
            after, _ = code.step(CONSTRAINED if len(state) == CONSTRAINED.vectors else POISSON, state, h)
        return after if len(after) > 1 else after[0]

    return step


def _whole(code: Code, kind: Kind, ivp: Ivp, grid: Grid) -> Block:
    """Return what a whole run gives at the outputs."""
    steps = outputs(grid)
    with code.limited():
        states, seconds = code.solve(kind, ivp.start, grid.h, np.asarray(steps * grid.h))
    return Block(steps, np.concatenate(states, axis=1), seconds)


def outputs(grid: Grid) -> Steps:
    """Return the numbers of the steps after which a state is kept, the last step among them."""
    steps = np.arange(grid.every, grid.steps + 1, grid.every, dtype=np.int64) if grid.every else np.empty(0, dtype=np.int64)
    return steps if len(steps) and steps[-1] == grid.steps else np.append(steps, np.int64(grid.steps))
