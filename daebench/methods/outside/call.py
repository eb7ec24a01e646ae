"""Python code from outside: its description of itself, and its calls, which are timed, ended if they take too long, and reported on."""

import copy
import inspect
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, fields
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput, Overdue, RunFailed, Stopped, foreign, in_words, unknown
from daebench.methods.outside.ending import Alarm, Limit
from daebench.runs.external_state import external_state
from daebench.runs.state import STATES

Step = Callable[..., Any]
"""``step(p, q, h)`` or ``step(y, h)``, of real or complex vectors."""

ADVICE = (
    "give step(p, q, h) that returns p and q, solve(p, q, h, t) that returns them at the times t, "
    "step(y, h) or solve(y, h, t) on a Poisson system, or an object with a method step"
)
"""Kinds of code that may be given."""


@dataclass(frozen=True)
class Description:
    """A callable as it is described."""

    remembers: bool
    """Whether it passes more from step to step than the state."""
    taken: int
    """Number of its arguments."""
    claims: Mapping[str, Any]
    """Its claims, with fields of :class:`daebench.methods.outside.call.Stated`."""
    knob: str
    """"h", or "tol" where it chooses its own steps and takes a tolerance in place of a step size."""


def described(code: Any, name: str) -> Description:
    """Return the description of a callable; BadInput is raised if it cannot be called, or has another number of arguments."""
    remembers = not inspect.isroutine(code) and callable(getattr(code, "step", None))
    if not (remembers or callable(code)):
        raise BadInput(f"{name} is not a method: it is a {foreign(type(code).__name__)}; {ADVICE}.", "code-not-a-method")
    unbound = remembers and isinstance(code, type) and inspect.isfunction(inspect.getattr_static(code, "step"))
    taken = _arguments(code.step if remembers else code) - unbound
    if not 2 <= taken <= 4:
        raise BadInput(f"{name} takes {taken} argument{'' if taken == 1 else 's'}; {ADVICE}.", "code-argument-count")
    return Description(remembers, taken, _stated(name, getattr(code, "claims", {})), _knob(code, name))


def _knob(code: Any, name: str) -> str:
    """Return the control parameter of a callable, by its attribute ``knob``."""
    knob = getattr(code, "knob", "h")
    if knob not in ("h", "tol"):
        raise BadInput(f"{name}: knob = {foreign(repr(knob))} must be 'h', a step size, or 'tol', a tolerance.", "knob-unknown")
    return str(knob)


def fresh(code: Any, remembers: bool) -> Callable[[], Step]:
    """Return a function that returns the callable, of an object with a memory that of a copy that remembers nothing yet."""
    return partial(_fresh, code, remembers)


def _fresh(code: Any, remembers: bool) -> Step:
    step: Step = (code() if isinstance(code, type) else copy.deepcopy(code)).step if remembers else code
    return step


def _stated(name: str, claims: Any) -> Mapping[str, Any]:
    """Return the claims in the attribute ``claims`` of a callable."""
    known = [field.name for field in fields(Stated)]
    if not isinstance(claims, Mapping):
        raise BadInput(
            f"{name}: claims must be a mapping, for example {{'order': 2, 'symplectic': True}}, and is a {foreign(type(claims).__name__)}.",
            "claims-not-a-mapping",
        )
    for claim, value in claims.items():
        if claim not in known:
            raise unknown(f"claim of {name}", foreign(str(claim)), known)
        if claim == "order" and not (type(value) is int and value > 0):
            raise BadInput(
                f"{name}: claims['order'] = {foreign(repr(value))} must be a whole number greater than 0.", "claimed-order-not-whole"
            )
        if claim != "order" and not isinstance(value, bool):
            raise BadInput(f"{name}: claims[{claim!r}] = {foreign(repr(value))} must be True or False.", "claim-not-true-or-false")
    return dict(claims)


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


@dataclass(frozen=True, kw_only=True)
class Stated:
    """Claims of code from outside, see :class:`daebench.schemes.kernels.claims.Claims`; None if it claims nothing."""

    order: int | None = None
    symmetric: bool | None = None
    symplectic: bool | None = None
    keeps_g: bool | None = None
    keeps_Gv: bool | None = None
    conserves_energy: bool | None = None

    @property
    def on_manifold(self) -> bool:
        """Whether it claims that both constraints hold to round-off after every step."""
        return bool(self.keeps_g and self.keeps_Gv)


Array = NDArray[np.float64]

Guard = Callable[[], AbstractContextManager[None]]
"""Turns what goes wrong in a file of the user's own into a :class:`RunFailed` that names its line."""


STATE_OF = {len(state.vectors): state for state in STATES.values()}
"""States by their number of vectors, by which a callable is called."""


class Code:
    """A callable as it is called in one run."""

    def __init__(self, name: str, fresh: Callable[[], Callable[..., Any]], guard: Guard, limit: Limit, *, cpu: bool = False) -> None:
        self.name, self.guard, self.limit, self.cpu = name, guard, limit, cpu
        self.alarm = Alarm(Code._armed.__code__)
        with self.limited():
            self.callable, _ = self._timed(fresh)

    def limited(self) -> AbstractContextManager[None]:
        """Return a context in which a call that takes too long is ended."""
        return self.alarm.after(self.limit.left)

    def step(self, vectors: Sequence[Array], h: float) -> tuple[list[Array], float]:
        """Return the state after a step, and the seconds that the code took for it.

        The callable is given copies, and must leave them as they are. Stopped is raised where it raises something or the time is over,
        BadInput where it returns no state.
        """
        if not self.limit.left:
            raise Stopped(self.limit.over)
        given, state = [vector.copy() for vector in vectors], STATE_OF[len(vectors)]
        result, seconds = self._timed(self.callable, *given, h)
        call = f"{self.name}: step({state.arguments}, h)"
        if any(a.tobytes() != b.tobytes() for a, b in zip(given, vectors, strict=True)):
            raise BadInput(f"{call} changes its arguments; return new arrays, and do not change the given ones.", "code-changes-arguments")
        return external_state(result, [vector.shape for vector in vectors], f"{call} must return {state.listed}"), seconds

    def solve(self, vectors: Sequence[Array], h: float, t: Array) -> tuple[list[Array], float]:
        """Return the states of a whole run at the times t, shape(k, ...) each, and the seconds that the code took for it."""
        result, seconds = self._timed(self.callable, *(vector.copy() for vector in vectors), h, t)
        state = STATE_OF[len(vectors)]
        duty = f"{self.name}: solve({state.arguments}, h, t) must return {state.listed} at the {len(t)} times t"
        return external_state(result, [(len(t), len(vector)) for vector in vectors], duty), seconds

    def of_complex(self, vectors: Sequence[Any], h: float) -> Any:
        """Return the state after one step from complex vectors; errors of the code are raised as they are, for it need not take them."""
        with self.guard():  # for what the code prints, not for what it raises
            try:
                return self._armed(self.callable, *(vector.copy() for vector in vectors), h)[0]
            except Exception as error:  # noqa: BLE001 - raised below
                raised = error
        raise raised

    def _timed(self, function: Callable[..., Any], *arguments: Any) -> tuple[Any, float]:
        with self._named():
            return self._armed(function, *arguments)

    def _armed(self, function: Callable[..., Any], *arguments: Any) -> tuple[Any, float]:
        clock = time.process_time if self.cpu else time.perf_counter
        began = clock()
        try:
            self.alarm.armed = True
            result = function(*arguments)
            return result, clock() - began
        except Overdue as overdue:
            self.alarm.armed = False
            raise RunFailed(self.limit.over, "code-over-time-limit").with_traceback(overdue.__traceback__) from None
        finally:
            self.alarm.armed = False

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Report an error in the code as the reason for which a run stopped."""
        try:
            with self.guard():
                yield
        except RunFailed as error:
            raise Stopped(str(error)) from error
        except (Exception, SystemExit) as error:
            raise Stopped(f"the code raises {in_words(error)}") from error


def stepped(
    code: Code, vectors: Sequence[Array], h: float, most: int, seconds: float, keep: Callable[[Array], None]
) -> tuple[Sequence[Array], float, BaseException | None]:
    """Take so many steps, or as many as are taken in so many seconds of wall time; the last one may have numbers that are not finite.

    ``keep`` is called with each state, p and q or y in one vector. Returned are the last state, the time that the code took, and what
    ended the steps early; it is to be raised when the states before it are kept.
    """
    took, until = 0.0, time.perf_counter() + seconds
    with code.limited():
        try:
            for _ in range(most):
                vectors, one = code.step(vectors, h)
                row = np.concatenate(vectors)
                keep(row)
                took += one
                if time.perf_counter() > until or not np.isfinite(row).all():
                    break
        except (Stopped, BadInput, KeyboardInterrupt) as error:
            return vectors, took, error
    return vectors, took, None
