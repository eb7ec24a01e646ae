"""Lanes in a program: runs in the entries of vectors, read from and written to columns of arrays, and selected.

Arrays of nested tuples have a column for each run: lane w of a block that begins at column b is in column b + w.
"""

from typing import Any

from daebench.compiler.trace.arrays import Array
from daebench.compiler.trace.ir import FLOAT64, INTEGER, POINTER, TRUTH, Code, Value, kind_of
from daebench.compiler.trace.shares import smallest_share, value_of
from daebench.compiler.trace.structure import parts_of, unset


def take_all(like: Any, array: Array, row: Any, column: Any, width: int) -> Any:
    """Return nested tuples of the form of ``like``, whose numbers are read from rows of an array, one row for each number."""
    if not isinstance(like, tuple):
        return _read(array, (row, column), width)
    found, at = [], row
    for part in like:
        found.append(take_all(part, array, at, column, width))
        at = at + length_of(part)
    return tuple(found)


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
    if isinstance(x, tuple):
        return tuple([mixed(part, array, column, width) for part in x])
    return _read(array, (x, column), width) if kind_of(x) == INTEGER else x


def entry_of(array: Array, row: Any, place: Any, width: int) -> Any:
    """Return the lanes at [row, place] of an array with a last axis for the lanes, where row and place may be lanes themselves."""
    if not _differ(row, place):
        return _read(array, (row, place, 0), width)
    entries = tuple(array[(*each, k)] for k, each in enumerate(_each(width, row, place)))
    return array.code.emit("vset", f"{array.kind}{width}", entries)


def put(array: Any, row: Any, place: Any, x: Any, width: int) -> None:
    """Write lanes, or a number for each, into an array whose last axis is the lanes, or into columns of (array, column)."""
    if isinstance(array, tuple):
        _write(array[0], (row, place, array[1]), x, width)
    elif not _differ(row, place):
        _write(array, (row, place, 0), x, width)
    else:
        lanes = array.code.as_kind(value_of(x), f"{array.kind}{width}")
        for k, each in enumerate(_each(width, row, place)):
            array[(*each, k)] = _lane(lanes, k)


def _read(array: Array, place: tuple[Any, ...], width: int) -> Value:
    return array.code.effect("load", f"{array.kind}{width}", array.entry(place))


def _write(array: Array, place: tuple[Any, ...], x: Any, width: int) -> None:
    array.code.effect("store", "", (*array.entry(place), array.code.as_kind(value_of(x), f"{array.kind}{width}")))


def _numbers(x: Any) -> list[Any]:
    """Return the numbers of nested tuples."""
    return [number for part in x for number in _numbers(part)] if isinstance(x, tuple) else [value_of(x)]


def _differ(*numbers: Any) -> bool:
    """Return whether one of several numbers is lanes."""
    return any(len(kind_of(x)) > 1 for x in numbers)


def _lane(x: Any, k: int) -> Any:
    """Return the number in one lane."""
    return x.code.emit("vget", x.kind[0], (x, k)) if _differ(x) else x


def _each(width: int, *numbers: Any) -> list[tuple[Any, ...]]:
    """Return several numbers in each lane."""
    return [tuple(_lane(x, k) for x in numbers) for k in range(width)]


class Slot:
    """A place in memory for lanes in nested tuples: results that a few runs return early are stored there, and read at the end."""

    def __init__(self, code: Code, like: Any, width: int) -> None:
        self.code, self.like, self.width = code, like, width
        self.kinds = [f"{kind_of(x)[0]}{width}" for x in _numbers(like)]
        self.pointer = code.effect("slot", POINTER, (width * len(self.kinds),))
        self.seen()

    def seen(self) -> None:
        """Keep the content in memory, where it takes no registers."""
        self.code.effect("seen", "", (self.pointer,))

    def place(self, k: int) -> tuple[Value, Value]:
        """Return where lanes are."""
        at, first = (self.code.as_kind(n, INTEGER) for n in (k * self.width, 0))
        return self.code.emit("offset", POINTER, (self.pointer, at, FLOAT64)), first


def note(slot: Slot, first: Any, x: Any) -> None:
    """Write nested tuples into a slot, in the lanes where ``first`` is true."""
    code = slot.code
    for k, (kind, number) in enumerate(zip(slot.kinds, _numbers(x), strict=True)):
        old = code.effect("load", kind, slot.place(k))
        code.effect("store", "", (*slot.place(k), code.as_kind(code.select(first, number, old), kind)))
    slot.seen()


def recall(slot: Slot) -> Any:
    """Return the nested tuples in a slot."""
    parts = iter([slot.code.effect("load", kind, slot.place(k)) for k, kind in enumerate(slot.kinds)])

    def found(like: Any) -> Any:
        return tuple([found(part) for part in like]) if isinstance(like, tuple) else next(parts)

    return found(slot.like)


def anyof(truths: Any) -> Any:
    """Return whether a truth value is true in any lane."""
    return truths.code.emit("any", TRUTH, (truths,)) if _differ(truths) else truths


def spoiled(live: Value, x: Any) -> Any:
    """Return numbers with NaN in the inactive lanes, so that no iteration continues for them."""
    if isinstance(x, tuple):
        return tuple([spoiled(live, part) for part in x])
    return live.code.select(live, x, float("nan")) if _differ(x) and kind_of(x)[0] == FLOAT64 else x


def absent(function: Any, arguments: tuple[Any, ...]) -> Any:
    """Return zeros in place of the result of a function, which is not called."""
    code = next(x.code for x in parts_of(arguments) if isinstance(x, Value))
    sizes = getattr(getattr(function, "program", None), "sizes", {})
    known = dict(sizes)
    with code.inside([]):
        result = unset(code, function(*arguments))
    sizes.clear()
    sizes.update(known)
    return result


def held(like: Any, width: int) -> Slot:
    """Return a place in memory for nested tuples of the form of ``like``, with lanes in place of numbers."""
    return Slot(next(x.code for x in parts_of(like) if isinstance(x, Value)), like, width)


FUNCTIONS = (take_all, put_all, length_of, mixed, entry_of, put, held, note, recall, smallest_share, anyof, absent, spoiled)
"""What generated modules of lanes call, besides ``select`` and ``negated``."""
