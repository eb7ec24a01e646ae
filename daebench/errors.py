"""Errors as a small tree, and the validation of names and numeric input: every message says what, where, and what to do."""

import math
from collections.abc import Collection, Iterable
from difflib import get_close_matches
from typing import Any

LONGEST = 2000
"""Most characters of a message: names and values that it quotes may be of any length."""


def bounded(text: str) -> str:
    """Return a text of at most :data:`LONGEST` characters; of a longer one the beginning and the end, which says what to do."""
    if len(text) <= LONGEST:
        return text
    part = LONGEST // 2 - 40
    return f"{text[:part]} ... ({len(text)} characters) ... {text[-part:]}"


class DaebenchError(Exception):
    """Anything daebench refuses or cannot finish; its text is one sentence for the person at the keyboard."""

    def __str__(self) -> str:
        return bounded(super().__str__())


class BadInput(DaebenchError):
    """The request itself cannot be met: unknown names, values out of range, files that are not what they should be."""


class InconsistentStart(BadInput):
    """Initial values that are off the constraint manifold."""


class InvalidProblem(BadInput):
    """A problem definition that contradicts itself."""


class RunFailed(DaebenchError):
    """A run that stopped before its end, raised where a whole trajectory is required."""


class LostMotion(UserWarning):
    """A run that came to its end and is no good all the same: its energy or its constraints are lost."""


class Interrupted(DaebenchError):
    """The person at the keyboard, or the system, ended what was being done; what is kept of it is in the message."""


LONGEST_NAME = 200
"""Most characters of a name that is held against others: that takes time by their product."""


def unknown(kind: str, name: str, known: Iterable[str]) -> BadInput:
    """Return the error for a name that is not among the known ones, with the nearest of them.

    Parameters
    ----------
    kind : str
        What the name stands for, as "case of spherical_pendulum".
    name : str
        The name.
    known : iterable of str
        The names that there are.
    """
    names = sorted(known)
    near = get_close_matches(name, names, n=3, cutoff=0.5) if len(name) <= LONGEST_NAME else []
    hint = f"did you mean {' or '.join(near)}?" if near else f"known: {', '.join(names) or 'none'}."
    return BadInput(f"unknown {kind} {name!r}; {hint}")


def require_known(required: tuple[str, str, Collection[str]], *optional: tuple[str, str, Collection[str]]) -> None:
    """Refuse a name that is not known.

    Parameters
    ----------
    required : tuple of str, str and collection of str
        What the name stands for, the name, and the known ones.
    *optional : tuple of str, str and collection of str
        The same of names that may be empty.

    Raises
    ------
    BadInput
        With the nearest names, see :func:`unknown`.
    """
    for kind, name, known in (required, *(entry for entry in optional if entry[1])):
        if name not in known:
            raise unknown(kind, name, known)


def real(name: str, value: Any) -> float:
    """Return a value as a finite float.

    Raises
    ------
    BadInput
        If it is none.
    """
    try:
        number = float(value) if not isinstance(value, bool | str | bytes) else math.nan
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise BadInput(f"{name} = {value!r} must be a finite number.")
    return float(number)


def positive(name: str, value: Any) -> float:
    """Return a value as a finite float greater than 0.

    Raises
    ------
    BadInput
        If it is none.
    """
    number = real(name, value)
    if number <= 0:
        raise BadInput(f"{name} = {number:g} must be greater than 0.")
    return number


def whole(name: str, value: Any) -> int:
    """Return a value as a whole number.

    Raises
    ------
    BadInput
        If it is none.
    """
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise BadInput(f"{name} = {value!r} must be a whole number.")
    return int(value)
