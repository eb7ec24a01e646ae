"""Lanes in a program: numbers of several runs in the entries of vectors, read from columns of arrays and written to them.

Arrays of nested tuples have a column for each run: lane w of a block that begins at column b is in column b + w.
"""

from typing import Any

from daebench.compiler.trace.arrays import Array
from daebench.compiler.trace.code import Code
from daebench.compiler.trace.ir import FLOAT64, INTEGER, POINTER, TRUTH, Value, common, differs, kind_of
from daebench.compiler.trace.pivots import smallest_share, value_of
from daebench.compiler.trace.structure import parts_of, unset
from daebench.compiler.trace.turns import Wider
from daebench.compiler.values import flat, mapped


def take_all(form: Any, array: Array, row: Any, column: Any, width: int) -> Any:
    """Return nested tuples of this form, whose numbers are read from rows of an array, one row for each number."""
    if not isinstance(form, tuple):
        return _read(array, (row, column), width)
    numbers, at = [], row
    for part in form:
        numbers.append(take_all(part, array, at, column, width))
        at = at + length_of(part)
    return tuple(numbers)


def put_all(array: Array, row: Any, column: Any, live: Any, x: Any) -> None:
    """Write the numbers of nested tuples into rows of an array, in the active lanes only."""
    for k, part in enumerate(_numbers(x)):
        place = row + k, column
        _write(array, place, array.code.select(live, part, _read(array, place, int(live.kind[1:]))), int(live.kind[1:]))


def length_of(x: Any) -> int:
    """Return how many numbers there are in nested tuples."""
    return len(_numbers(x))


def mixed(x: Any, array: Array, column: Any, width: int) -> Any:
    """Return nested tuples in which each integer is replaced by the row of an array that it denotes; other entries stay."""
    return mapped(lambda part: _read(array, (part, column), width) if kind_of(part) == INTEGER else part, x)


def columns(array: Array, column: Any, width: int) -> Array:
    """Return a part of an array, without its last axis: the entries in columns from one on, for a block of runs."""
    *shape, _ = array.shape
    *strides, step = array.strides
    pointer = array.code.emit("offset", POINTER, (array.pointer, array.code.as_kind(column * step, INTEGER), array.kind))
    return Array(pointer, f"{array.kind}{width}", shape, strides)


def _read(array: Array, place: tuple[Any, ...], width: int) -> Value:
    return array.code.effect("load", f"{array.kind}{width}", array.entry(place))


def _write(array: Array, place: tuple[Any, ...], x: Any, width: int) -> None:
    array.code.effect("store", "", (*array.entry(place), array.code.as_kind(value_of(x), f"{array.kind}{width}")))


def _numbers(x: Any) -> list[Any]:
    """Return the numbers of nested tuples, and of elements in them."""
    return list(map(value_of, flat(x)))


class Slot:
    """A place in memory for nested tuples of lanes: results that a few runs return early are stored there, and read at the end."""

    def __init__(self, code: Code, width: int) -> None:
        self.code, self.width = code, width
        self.kinds: list[str] = []
        self.like: Any = None
        self.pointer: Value | None = None

    def note(self, first: Value, x: Any) -> None:
        """Write nested tuples, in the lanes where ``first`` is true."""
        code, numbers = self.code, _numbers(x)
        kinds = [f"{kind_of(number)[0]}{self.width}" for number in numbers]
        if self.pointer is None:
            self.pointer, self.like, self.kinds = Value(code, "slot", POINTER, (self.width * len(kinds),)), x, kinds
        wider = [common(*both) for both in zip(self.kinds, kinds, strict=True)]
        if wider != self.kinds:
            self.kinds = wider
            raise Wider
        for k, (kind, number) in enumerate(zip(self.kinds, numbers, strict=True)):
            old = code.effect("load", kind, self._place(k))
            code.effect("store", "", (*self._place(k), code.as_kind(code.select(first, number, old), kind)))
        code.effect("seen", "", (self.pointer,))

    def recalled(self) -> Any:
        """Return the value that was written."""
        parts = iter([self.code.effect("load", kind, self._place(k)) for k, kind in enumerate(self.kinds)])
        return mapped(lambda _: next(parts), self.like)

    def _place(self, k: int) -> tuple[Value, Value]:
        """Return where the lanes of a number are."""
        at, first = (self.code.as_kind(n, INTEGER) for n in (k * self.width, 0))
        return self.code.emit("offset", POINTER, (self.pointer, at, FLOAT64)), first


def anyof(truths: Any) -> Any:
    """Return whether a truth value is true in any lane."""
    return truths.code.emit("any", TRUTH, (truths,)) if differs(truths) else truths


NAN = float("nan")


def spoiled(live: Value, x: Any) -> Any:
    """Return numbers with NaN in the inactive lanes, so that no iteration continues for them."""
    return mapped(lambda part: live.code.select(live, part, NAN) if differs(part) and kind_of(part)[0] == FLOAT64 else part, x)


def absent(function: Any, arguments: tuple[Any, ...]) -> Any:
    """Return zeros in place of the result of a function, which is not called."""
    code = next(x.code for x in parts_of(arguments) if isinstance(x, Value))
    sizes = getattr(getattr(function, "program", None), "sizes", {})
    # The block is dropped, and with it the sizes of functions that were first met in it: the next call of each is then the first.
    known = dict(sizes)
    with code.inside([]):
        result = unset(code, function(*arguments))
    sizes.clear()
    sizes.update(known)
    return result


FUNCTIONS = (take_all, put_all, length_of, mixed, columns, smallest_share, anyof, absent, spoiled)
"""What generated modules of lanes call, besides ``select`` and ``negated``."""
