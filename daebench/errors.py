"""The tree of errors, and the validation of names and numeric input: every message says what is wrong, where, and what to do."""

import math
from collections.abc import Collection, Iterable
from difflib import get_close_matches
from sys import float_info
from typing import Any

LONGEST = 1000
"""Largest number of characters of a message, because quoted names and values may have any length."""


def bounded(text: str) -> str:
    """Return a text of at most :data:`LONGEST` characters; a longer text keeps its beginning and its end, which says what to do."""
    if len(text) <= LONGEST:
        return text
    part = LONGEST // 2 - 40
    return f"{text[:part]} ... ({len(text)} characters) ... {text[-part:]}"


MOST_OF_OTHERS = 400
"""Largest number of characters of a text that is not daebench's own within a sentence."""


def foreign(text: str, most: int = MOST_OF_OTHERS) -> str:
    """Return what code from outside says as a part of a sentence: one line, without control characters, and not too long."""
    line = " ".join("".join(c if c.isprintable() else " " for c in text[: 10 * most]).split())
    return line if len(line) <= most else f"{line[:most]}..."


def in_words(error: BaseException) -> str:
    """Return the name of an exception that code from outside raised, and what it says."""
    try:
        text = foreign(str(error)).rstrip(".")
    except Exception:  # noqa: BLE001 - the text of an exception is code from outside, too
        text = ""
    return foreign(type(error).__name__) + (f": {text}" if text else "")


class DaebenchError(Exception):
    """Base of all errors: a request that daebench refuses or cannot finish. Its message is one sentence for the user.

    Parameters
    ----------
    sentence : str
        What is wrong, where, and what to do.
    code : str
        What is wrong in two to four words, as ``unknown-name``: programs that handle an error read this and not the sentence.
    **fields
        The names and values that it is about.

    Attributes
    ----------
    code : str
        The code; empty in an error that code from outside raises without one.
    fields : dict
        The fields by their names.
    """

    def __init__(self, sentence: str = "", code: str = "", /, **fields: Any) -> None:
        super().__init__(sentence)
        self.code, self.fields = code, fields

    def __str__(self) -> str:
        return bounded(super().__str__())


class BadInput(DaebenchError):
    """A request that cannot be met: unknown names, values out of range, invalid files."""


class InconsistentStart(BadInput):
    """Initial values that are off the constraint manifold."""


class InvalidProblem(BadInput):
    """A problem definition that contradicts itself."""


class CannotShow(UserWarning):
    """A problem cannot show a fault that an assertion is about."""


class RunFailed(DaebenchError):
    """A run that stopped before its end, raised where a whole trajectory is required."""


class Stopped(Exception):
    """A run that cannot go on; the text says why, ``t`` where, and ``advice`` what to do."""

    def __init__(self, why: str, t: float | None = None, advice: str | None = None) -> None:
        super().__init__(why)
        self.t, self.advice = t, advice


class LostMotion(UserWarning):
    """A run that reached its end but is of no use: its energy or its constraints are lost."""


class Overdue(BaseException):
    """Python code of somebody else has gone on for too long; what catches any Exception in it does not catch this."""


class Interrupted(DaebenchError):
    """An interruption by the user or the system; the message says which results are stored.

    Parameters
    ----------
    message : str
        The sentence.
    result : Result, optional
        The result of a study so far.
    """

    def __init__(self, message: str, result: Any = None) -> None:
        super().__init__(message, "interrupted")
        self.result = result


LARGEST = 2**63
"""Least whole number that arrays cannot have."""

LONGEST_NAME = 200
"""Largest length of a name that is compared with others, because the time of a comparison grows with the product of the lengths."""


def unknown(kind: str, name: str, known: Iterable[str]) -> BadInput:
    """Return the error for an unknown name, with the nearest known names.

    Parameters
    ----------
    kind : str
        Kind of the name, for example "case of spherical_pendulum".
    name : str
        The name.
    known : iterable of str
        The known names.
    """
    names = sorted(known)
    near = get_close_matches(name, names, n=3, cutoff=0.5) if len(name) <= LONGEST_NAME else []
    hint = f"did you mean {' or '.join(near)}?" if near else f"known: {', '.join(names) or 'none'}."
    return BadInput(f"unknown {kind} {name!r}; {hint}", "unknown-name", kind=kind, name=name)


def require_known(required: tuple[str, str, Collection[str]], *optional: tuple[str, str, Collection[str]]) -> None:
    """Refuse a name that is not known.

    Parameters
    ----------
    required : tuple of str, str and collection of str
        Kind of the name, the name, and the known names.
    *optional : tuple of str, str and collection of str
        The same for names that may be empty.

    Raises
    ------
    BadInput
        With the nearest names, see :func:`unknown`.
    """
    for kind, name, known in (required, *(entry for entry in optional if entry[1])):
        if name not in known:
            raise unknown(kind, name, known)


def real(name: str, value: Any) -> float:
    """Return a value as a finite float."""
    try:
        number = float(value) if not isinstance(value, bool | str | bytes) else math.nan
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise BadInput(f"{name} = {_shown(value)} must be a finite number.", "not-finite", name=name, value=value)
    return float(number)


def positive(name: str, value: Any) -> float:
    """Return a value as a finite float greater than 0."""
    number = real(name, value)
    if number <= 0:
        raise BadInput(f"{name} = {number:g} must be greater than 0.", "not-positive", name=name, value=number)
    if number < float_info.min:
        raise BadInput(
            f"{name} = {number:g} must be at least {float_info.min:.3g}; smaller numbers have fewer digits.",
            "below-normal-range",
            name=name,
            value=number,
        )
    return number


def whole(name: str, value: Any, least: int | None = None) -> int:
    """Return a value as a whole number that is not below the least."""
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise BadInput(f"{name} = {_shown(value)} must be a whole number.", "not-whole", name=name, value=value)
    if abs(int(value)) >= LARGEST:
        raise BadInput(
            f"{name} = {_shown(value)} must be a whole number between -2^63 and 2^63.", "whole-too-large", name=name, value=value
        )
    if least is not None and value < least:
        raise BadInput(f"{name} = {value} must be at least {least}.", "below-least", name=name, value=int(value), least=least)
    return int(value)


def _shown(value: Any) -> str:
    """Return a value as Python writes it; Python refuses to write very large whole numbers."""
    try:
        return repr(value)
    except ValueError:
        return "a number of thousands of digits"
