"""Smallest relative pivots in lanes, with divisions delayed until a value is needed.

Each iteration tests whether a pivot exceeds a bound, but only the last one needs its value. If the bound is
a power of two, a / s > bound, rounded, and a > bound s are equivalent, except for numbers that overflow or underflow.
"""

import operator as op
from collections.abc import Callable, Sequence
from typing import Any

from daebench.compiler.trace.code import Code
from daebench.compiler.trace.ir import Value, Values

INF = float("inf")


def _of_values(operation: Callable[[Any, Any], Any]) -> Any:
    """Return an operation on the values of two numbers."""
    return lambda x, y: operation(x.value, value_of(y))


class Share:
    """The smallest of several quotients ``above / below``, and of 1 if ``first`` is positive and finite, else 0."""

    __slots__ = ("above", "below", "code", "first")

    def __init__(self, code: Code, first: Value, above: Values, below: Values) -> None:
        self.code, self.first, self.above, self.below = code, first, above, below

    @property
    def kind(self) -> str:
        """Kind of its value."""
        return self.first.kind

    @property
    def value(self) -> Any:
        """Its value: what it is divided by."""
        choose = self.code.select
        smallest = choose(self._begun, 1.0, 0.0)
        for a, s in zip(self.above, self.below, strict=True):
            share = choose(s > 0.0, a / s, 0.0)
            smallest = choose(share < smallest, share, smallest)
        return smallest

    @property
    def _begun(self) -> Any:
        return self.code.both(self.first > 0.0, self.first < INF)

    def merged(self, other: Any, merge: Callable[[Any, Any], Any]) -> Any:
        """Return the number that is made of two values."""
        return merge(self.value, value_of(other))

    def __gt__(self, bound: Any) -> Any:
        if isinstance(bound, Value | Share):
            return self.value > value_of(bound)
        test = self._begun
        for a, s in zip(self.above, self.below, strict=True):
            test = self.code.both(test, a > bound * s)
        return test

    __lt__, __ge__, __le__, __mul__ = map(_of_values, (op.lt, op.ge, op.le, op.mul))
    __rmul__ = __mul__


def value_of(x: Any) -> Any:
    """Return a number in place of a share."""
    return x.value if isinstance(x, Share) else x


def smallest_share(first: Any, above: Sequence[Any], below: Sequence[Any]) -> Any:
    """Return the smallest of quotients, and of 1 if ``first`` is positive and finite, else 0: divided where these are no vectors."""
    kinds = {x.kind for x in (first, *above, *below) if isinstance(x, Value)}
    kind = max(kinds, key=len)
    code = next(x.code for x in (first, *above, *below) if isinstance(x, Value))
    share = Share(code, code.as_kind(first, kind), *([code.as_kind(x, kind) for x in row] for row in (above, below)))
    return share if len(kind) > 1 else share.value
