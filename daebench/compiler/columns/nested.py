"""Functions called by code that is rewritten for several runs and not compiled: numbers are arrays with an entry for each run."""

import operator
from collections.abc import Callable
from functools import reduce
from typing import Any

import numpy as np

__all__ = ["anyof", "held", "max", "min", "negated", "note", "recall", "select"]


def select(first: Any, x: Any, y: Any) -> Any:
    """Return x where ``first`` is true, else y, for each number in nested tuples of the same form."""
    if isinstance(x, tuple):
        return tuple(select(first, a, b) for a, b in zip(x, y, strict=True))
    return np.where(first, x, y)


def anyof(truths: Any) -> bool:
    """Return whether a truth value is true in any run."""
    return bool(np.any(truths))


def negated(truths: Any) -> Any:
    """Return whether a truth value is false, for each run."""
    return np.logical_not(truths)


def held(like: Any, width: Any) -> list[Any]:
    """Return a slot for nested tuples of the form of ``like``."""
    return [like]


def note(slot: list[Any], first: Any, x: Any) -> None:
    """Write nested tuples into a slot, in the runs where ``first`` is true."""
    slot[0] = select(first, x, slot[0])


def recall(slot: list[Any]) -> Any:
    """Return the nested tuples in a slot."""
    return slot[0]


def max(*numbers: Any) -> Any:
    """Return the largest of several numbers, as Python's own function does: each replaces the one before if it is larger."""
    return _extreme(operator.gt, numbers)


def min(*numbers: Any) -> Any:
    """Return the smallest of several numbers."""
    return _extreme(operator.lt, numbers)


def _extreme(beyond: Callable[[Any, Any], Any], numbers: Any) -> Any:
    return reduce(lambda x, y: np.where(beyond(y, x), y, x), numbers)
