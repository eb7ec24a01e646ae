"""Comparison of the numbers of a certificate with a new measurement: equal to the bit, equal within round-off, or different."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from daebench.studies.certificate.measure import Numbers
from daebench.studies.certificate.rounding import is_number

RELATIVE = 1e-6
"""Numbers may differ by this part of the larger one besides: it is less than any of them is worth."""

NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?")
"""A number in a sentence; sentences are compared without theirs."""

UNTOLD = object()
"""In the place of a value that is not there; it agrees with nothing."""


@dataclass(frozen=True)
class Difference:
    """A value of a certificate that does not agree with the new one.

    Parameters
    ----------
    place : tuple of str
        Names that lead to it.
    certified, new : object
        What the certificate has, and what was measured.
    """

    place: tuple[str, ...]
    certified: Any
    new: Any

    @property
    def sentence(self) -> str:
        """A description of the disagreement."""
        what = " of ".join(reversed(self.place))
        return f"{what} is {_short(self.certified)} in the certificate, and {_short(self.new)} when measured again"


@dataclass(frozen=True)
class Agreement:
    """How the values of a certificate agree with new ones.

    Parameters
    ----------
    equal, within : int
        Numbers that are equal to the bit, and others that agree as well as rounding allows.
    differences : tuple of Difference
        What does not agree.
    """

    equal: int
    within: int
    differences: tuple[Difference, ...]


def agreement(certified: Any, new: Numbers, allowed: Any = None, elsewhere: Any = None) -> Agreement:
    """Return how the values of a certificate agree with new ones.

    ::

        |a - b| <= 1e-6 max(|a|, |b|) + within

    Texts agree if, apart from the numbers in them, they equal those of the new measurement, or of the measurement from a start that is
    rounded differently. Every other value is equal or differs. A value that only one side has differs.

    Parameters
    ----------
    certified : object
        Values of a certificate, nested.
    new : dict
        New ones.
    allowed : object
        How far each may be off by rounding, of the same shape where it is known.
    elsewhere : object
        The new ones from a start that is rounded elsewhere.
    """
    equal = within = 0
    differences = []
    for place, old, now, most, other in _values((), certified, new, allowed, elsewhere):
        number = is_number(old) and is_number(now)
        if number and old == now:
            equal += 1
        elif number and abs(old - now) <= RELATIVE * max(abs(old), abs(now)) + (most if is_number(most) else 0.0):
            within += 1
        elif number or not (_same(old, now) or _same(old, other)):
            differences.append(Difference(place, old, now))
    return Agreement(equal, within, tuple(differences))


def _values(place: tuple[str, ...], old: Any, now: Any, most: Any, other: Any) -> Iterator[tuple[tuple[str, ...], Any, Any, Any, Any]]:
    """Give the values of all of them side by side, by the names and numbers that lead to them."""
    if isinstance(old, dict) and isinstance(now, dict):
        for key in dict.fromkeys([*now, *old]):
            yield from _values((*place, str(key)[:80]), *(_part(tree, key) for tree in (old, now, most, other)))
    elif isinstance(old, list) and isinstance(now, list) and len(old) == len(now):
        for k in range(len(now)):
            yield from _values((*place, f"number {k + 1}"), *(_part(tree, k) for tree in (old, now, most, other)))
    else:
        yield place, old, now, most, other


def _part(tree: Any, key: Any) -> Any:
    if isinstance(tree, dict):
        return tree.get(key, UNTOLD)
    return tree[key] if isinstance(tree, list) and key < len(tree) else UNTOLD


def _same(a: Any, b: Any) -> bool:
    """Return whether two values are the same, sentences but for the numbers in them."""
    if isinstance(a, str) and isinstance(b, str) and " " in a:
        return NUMBER.sub("#", a) == NUMBER.sub("#", b)
    return a is not UNTOLD and type(a) is type(b) and bool(a == b)


def _short(value: Any) -> str:
    """Return a value in a few characters."""
    return "nothing" if value is None or value is UNTOLD else repr(value)[:120]
