"""Values that are given as texts: numbers, lists, name=value pairs, ranges, and width x height."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

from daebench.errors import BadInput

MOST_VALUES = 2**20
"""Largest number of values of one name in a grid."""

FORMS = {2: "name=lo:hi", 3: "name=lo:hi:number"}
"""Forms of a range, by the number of its entries."""


def number(what: str, text: str) -> float:
    """Return the finite number of a text; refuse other texts."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise BadInput(f"{what}: {text!r} is not a finite number.", "text-not-a-finite-number")
    return value


def numbers(what: str, text: str | None) -> list[float] | None:
    """Return a comma-separated list of numbers, or None."""
    return None if text is None else [number(what, part) for part in text.split(",")]


def words(text: str) -> list[str]:
    """Return a comma-separated list of words."""
    return [part.strip() for part in text.split(",") if part.strip()]


def pairs(what: str, given: Sequence[str]) -> dict[str, float]:
    """Return k=v texts as a mapping; refuse a text without an equals sign or without a number after it."""
    values = {}
    for text in given:
        name, equals, value = text.partition("=")
        if not equals:
            raise BadInput(f"--{what} {text!r} must be of the form name=value.", "option-pair-malformed")
        values[name.strip()] = number(f"--{what} {name.strip()}", value)
    return values


def sides(text: str, number: type[int] | type[float]) -> tuple[Any, Any] | None:
    """Return width and height of a text such as 16x9 as numbers of a type, None if it is not of this form."""
    try:
        width, height = map(number, text.lower().split("x"))
    except ValueError:
        return None
    return width, height


def ranges(option: str, given: Iterable[str], count: int) -> dict[str, list[float]]:
    """Return a number of values by name, given as name=1:2."""
    chosen: dict[str, list[float]] = {}
    for text in given:
        name, equals, numbers = (part.strip() for part in text.partition("="))
        if not name or not equals or numbers.count(":") != count - 1:
            raise BadInput(f"{option} {text!r} must be of the form {FORMS[count]}.", "option-range-malformed")
        if name in chosen:
            raise BadInput(f"{option} names {name} twice; give it once.", "option-names-twice")
        chosen[name] = [number(f"{option} {name}", part) for part in numbers.split(":")]
    return chosen


def bounds(option: str, given: list[str] | None) -> dict[str, tuple[float, float]] | None:
    """Return bounds by name, given as name=lo:hi."""
    return {name: (lo, hi) for name, (lo, hi) in ranges(option, given or [], 2).items()} or None


def values(option: str, given: list[str] | None) -> dict[str, list[float]] | None:
    """Return equidistant values by name, given as name=lo:hi:number."""
    chosen = {}
    for name, (lo, hi, count) in ranges(option, given or [], 3).items():
        if not (1 <= count <= MOST_VALUES and count == int(count)):
            raise BadInput(
                f"{option} {name}: {count:g} must be a whole number of values, from 1 to {MOST_VALUES}.", "option-count-out-of-range"
            )
        # From lo by multiples, not by repeated addition: the last value is hi up to rounding.
        chosen[name] = [lo + (hi - lo) * k / max(1, int(count) - 1) for k in range(int(count))]
    return chosen or None
