"""Comparison of two values, numbers and texts or nested mappings and lists of them: equal to the bit, within rounding, or different."""

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

EQUAL, WITHIN, DIFFERS = "equal to the bit", "within", "differs"
"""Verdicts on two values."""

Place = tuple[str | int, ...]
"""Keys of mappings and indices of lists that lead to a value."""

Rounding = Callable[[Place, Any, Any], bool]
"""Whether rounding may make the difference between two values in a place."""

PATH_OR_NUMBER = re.compile(r"\S*[/\\]\S*|\S*\.py\b\S*|[-+]?\d+(\.\d*)?(e[-+]?\d+)?")
"""Parts of a sentence that rounding or another folder may change: the path of a file, or a number."""


@dataclass(frozen=True)
class Compared:
    """Two values in the same place of two records.

    Parameters
    ----------
    place : tuple of str or int
        Keys and indices that lead to it.
    old, new : object
        The values; None where one is missing.
    verdict : str
        :data:`EQUAL`, :data:`WITHIN` or :data:`DIFFERS`.
    """

    place: Place
    old: Any
    new: Any
    verdict: str

    @property
    def is_number(self) -> bool:
        """Whether both values are numbers."""
        return is_number(self.old) and is_number(self.new)

    @property
    def difference(self) -> float:
        """The difference relative to the larger of the two numbers; 0 where they are equal, NaN where one is no finite number."""
        if self.verdict == EQUAL:
            return 0.0
        if not self.is_number or not math.isfinite(self.old) or not math.isfinite(self.new):
            return math.nan
        return float(abs(self.old - self.new) / max(abs(self.old), abs(self.new)))


def compare(old: Any, new: Any, rounding: Rounding = lambda place, old, new: False, place: Place = ()) -> Iterator[Compared]:
    """Compare two values, or all values of two nested mappings or lists.

    NaN equals NaN, and true is not 1. Values that are not equal are within where ``rounding`` says so, but never a finite number and one
    that is not, nor a value that only one side has.

    Parameters
    ----------
    old, new : object
        The values, as JSON has them.
    rounding : callable
        Whether rounding may make the difference between the two values in a place.
    place : tuple of str or int
        Keys and indices that lead to the two values.

    Yields
    ------
    Compared
        Each pair of values that are neither mappings nor lists of the same length.

    Examples
    --------
    >>> [pair.verdict for pair in compare({"h": [0.1, 0.5]}, {"h": [0.1, 0.25]})]
    ['equal to the bit', 'differs']
    """
    if isinstance(old, dict) and isinstance(new, dict):
        for key in dict.fromkeys([*new, *old]):
            if key in old and key in new:
                yield from compare(old[key], new[key], rounding, (*place, key))
            else:
                yield Compared((*place, key), old.get(key), new.get(key), DIFFERS)
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for k, pair in enumerate(zip(old, new, strict=True)):
            yield from compare(*pair, rounding, (*place, k))
    else:
        yield Compared(place, old, new, _verdict(place, old, new, rounding))


def _verdict(place: Place, old: Any, new: Any, rounding: Rounding) -> str:
    if same(old, new):
        return EQUAL
    # The difference from infinity or NaN is not finite, so that one test finds all pairs that no rounding explains.
    apart = is_number(old) and is_number(new) and not math.isfinite(old - new)
    return DIFFERS if apart or not rounding(place, old, new) else WITHIN


def is_number(value: Any) -> bool:
    """Return whether a value is a number, and no truth value."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def same(one: Any, other: Any) -> bool:
    """Return whether two values are equal to the bit; NaN equals NaN, and true is not 1."""
    if is_number(one) and is_number(other):
        return bool(one == other or (one != one and other != other))
    return type(one) is type(other) and bool(one == other)


def same_sentence(one: Any, other: Any) -> bool:
    """Return whether two texts are the same sentence apart from numbers and paths; texts of one word have to be equal."""
    if not isinstance(one, str) or not isinstance(other, str) or " " not in one:
        return same(one, other)
    return PATH_OR_NUMBER.sub("#", one) == PATH_OR_NUMBER.sub("#", other)
