"""Arguments, memory and claims of a Python callable from outside, as it states them before it is run."""

import copy
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import partial
from typing import Any

from daebench.errors import BadInput, foreign, unknown
from daebench.methods.outside.stated import Stated

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
    """Its claims, with fields of :class:`daebench.methods.outside.stated.Stated`."""
    knob: str
    """"h", or "tol" where it chooses its own steps and takes a tolerance in place of a step size."""


def described(code: Any, name: str) -> Description:
    """Return the description of a callable; BadInput is raised if it cannot be called, or has another number of arguments."""
    remembers = not inspect.isroutine(code) and callable(getattr(code, "step", None))
    if not (remembers or callable(code)):
        raise BadInput(f"{name} is not a method: it is a {foreign(type(code).__name__)}; {ADVICE}.")
    unbound = remembers and isinstance(code, type) and inspect.isfunction(inspect.getattr_static(code, "step"))
    taken = _arguments(code.step if remembers else code) - unbound
    if not 2 <= taken <= 4:
        raise BadInput(f"{name} takes {taken} argument{'' if taken == 1 else 's'}; {ADVICE}.")
    return Description(remembers, taken, _stated(name, getattr(code, "claims", {})), _knob(code, name))


def _knob(code: Any, name: str) -> str:
    """Return the control parameter of a callable, by its attribute ``knob``."""
    knob = getattr(code, "knob", "h")
    if knob not in ("h", "tol"):
        raise BadInput(f"{name}: knob = {foreign(repr(knob))} must be 'h', a step size, or 'tol', a tolerance.")
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
            f"{name}: claims must be a mapping, for example {{'order': 2, 'symplectic': True}}, and is a {foreign(type(claims).__name__)}."
        )
    for claim, value in claims.items():
        if claim not in known:
            raise unknown(f"claim of {name}", foreign(str(claim)), known)
        if claim == "order" and not (type(value) is int and value > 0):
            raise BadInput(f"{name}: claims['order'] = {foreign(repr(value))} must be a whole number greater than 0.")
        if claim != "order" and not isinstance(value, bool):
            raise BadInput(f"{name}: claims[{claim!r}] = {foreign(repr(value))} must be True or False.")
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
