"""Arrays in a program: views of memory, whose entries are read and written one by one."""

import operator
from collections.abc import Callable, Iterator, Sequence
from math import prod
from typing import Any

from daebench.compiler.trace.code import Code
from daebench.compiler.trace.complex import COMPLEX, Complex, as_complex
from daebench.compiler.trace.ir import FLOAT64, INTEGER, POINTER, If, Leave, Loop, Region, Value, differs, entries_of

FEW = 4
"""Entries along an axis that are written out one after the other."""


def _operators(operation: Callable[[Any, Any], Any]) -> tuple[Any, Any]:
    """Return an operator of the entries of arrays, and the same with its operands exchanged."""
    return lambda x, y: x._each(operation, y), lambda x, y: x._each(lambda a, b: operation(b, a), y)


class Array:
    """A view of memory."""

    __slots__ = ("kind", "known", "pointer", "shape", "strides")

    def __init__(self, pointer: Value, kind: str, shape: Sequence[Any], strides: Sequence[Any], known: Sequence[Any] | None = None) -> None:
        self.pointer, self.kind, self.known = pointer, kind, known
        self.shape, self.strides = tuple(shape), tuple(strides)

    @property
    def code(self) -> Code:
        """The program."""
        code: Code = self.pointer.code
        return code

    @property
    def wide(self) -> int:
        """Number of numbers in an entry."""
        return int(self.kind[1:] or 1)

    @property
    def size(self) -> Any:
        """Number of entries."""
        return prod(self.shape)

    @property
    def dtype(self) -> str:
        """Kind of its entries."""
        return self.kind

    @property
    def real(self) -> "Array":
        """The real parts."""
        return self if self.kind != COMPLEX else Array(self.pointer, FLOAT64, self.shape, [2 * stride for stride in self.strides])

    @property
    def T(self) -> "Array":
        """The transpose."""
        return Array(self.pointer, self.kind, self.shape[::-1], self.strides[::-1])

    def __len__(self) -> int:
        if isinstance(self.shape[0], int):
            return self.shape[0]
        raise TypeError("the length of an array is only known at run time")

    def __iter__(self) -> Iterator[Any]:
        return (self[k] for k in range(len(self)))

    def __getitem__(self, index: Any) -> Any:
        if self.known is not None and isinstance(index, int):
            return self.known[index]
        offset, shape, strides = self._place(index)
        if shape:
            still = isinstance(offset, int) and offset == 0
            pointer = self.pointer if still else self.code.emit("offset", POINTER, (self.pointer, self._integer(offset), self.kind))
            return Array(pointer, self.kind, shape, strides)
        if differs(offset):
            return self._gathered(offset)
        record = self.code.emit if self.known is not None else self.code.effect
        if self.kind == COMPLEX:
            return Complex(self.code, *(record("load", FLOAT64, (self.pointer, self._integer(2 * offset + k))) for k in range(2)))
        return record("load", self.kind, (self.pointer, self._integer(offset)))

    def __setitem__(self, index: Any, value: Any) -> None:
        offset, shape, _ = self._place(index)
        if not shape and self.kind == COMPLEX:
            z = as_complex(self.code, value)
            for k, part in enumerate((z.real, z.imag)):
                self.code.effect("store", "", (self.pointer, self._integer(2 * offset + k), self.code.as_kind(part, FLOAT64)))
            return
        if not shape:
            if self.code.mask is not None and self.wide > 1:
                value = self.code.select(self.code.mask, value, self[index])
            self._put(offset, self.code.as_kind(value, self.kind))
            return
        view = self[index]
        each_place(self.code, view.shape, lambda place: view.__setitem__(place, entry_of(value, place)))

    def _put(self, offset: Any, value: Value) -> None:
        for place, part in zip(self._places(offset), entries_of(value), strict=True) if differs(offset) else [(offset, value)]:
            self.code.effect("store", "", (self.pointer, self._integer(place), part))

    def _gathered(self, offset: Value) -> Value:
        """Return the entries at places that differ from run to run."""
        parts = (self.code.effect("load", self.kind[0], (self.pointer, self._integer(place))) for place in self._places(offset))
        return self.code.emit("vset", self.kind[0] + offset.kind[1:], tuple(parts))

    def _places(self, offset: Value) -> list[Any]:
        """Return where the entry of each run is, given places that differ from run to run."""
        return [place + k * (self.wide > 1) for k, place in enumerate(entries_of(offset))]

    def _integer(self, x: Any) -> Value:
        return self.code.as_kind(x, INTEGER)

    def _place(self, index: Any) -> tuple[Any, list[Any], list[Any]]:
        """Return where an entry or a part begins, and shape and strides of the part."""
        indices = index if isinstance(index, tuple) else (index,)
        offset: Any = 0
        shape, strides = [], []
        for axis, (length, stride) in enumerate(zip(self.shape, self.strides, strict=True)):
            at = indices[axis] if axis < len(indices) else slice(None)
            if isinstance(at, slice):
                first, last = _bounds(at, length)
                offset = offset + first * stride
                shape.append(last - first)
                strides.append(stride)
            else:
                offset = offset + (length + at if isinstance(at, int) and at < 0 else at) * stride
        return offset, shape, strides

    def entry(self, index: Any) -> tuple[Value, Value]:
        """Return the pointer, and how many entries behind it that of this index is."""
        return self.pointer, self._integer(self._place(index)[0])

    def copy(self) -> "Array":
        """Return a new array with the same entries."""
        return self._each(lambda x: x)

    def _each(self, function: Callable[..., Any], other: Any = None, kind: str = "") -> "Array":
        """Return a new array of a function of the entries, and of those of another array or of a number; of a kind, if that is given."""
        wide = isinstance(other, Complex) or COMPLEX in (self.kind, getattr(other, "kind", ""))
        out = empty(self.code, self.shape, kind or (COMPLEX if wide else self.kind))
        given = (lambda place: (self[place],)) if other is None else (lambda place: (self[place], entry_of(other, place)))
        each_place(self.code, self.shape, lambda place: out.__setitem__(place, function(*given(place))))
        return out

    def merged(self, other: "Array", merge: Callable[[Any, Any], Any]) -> "Array":
        """Return an array whose pointer, lengths and distances are made of those of two."""
        pairs = [[merge(a, b) for a, b in zip(*both, strict=True)] for both in ((self.shape, other.shape), (self.strides, other.strides))]
        return Array(merge(self.pointer, other.pointer), self.kind, *pairs)

    __add__, __radd__ = _operators(operator.add)
    __sub__, __rsub__ = _operators(operator.sub)
    __mul__, __rmul__ = _operators(operator.mul)
    __truediv__, _ = _operators(operator.truediv)

    def __neg__(self) -> "Array":
        return self._each(operator.neg)

    def __abs__(self) -> "Array":
        return self._each(abs, kind=FLOAT64 if self.kind == COMPLEX else "")


def _bounds(part: slice, length: Any) -> tuple[Any, Any]:
    """Return the first index of a slice, and the one behind its last."""

    def index(at: Any, default: Any) -> Any:
        return default if at is None else length + at if isinstance(at, int) and at < 0 else at

    first, last = index(part.start, 0), index(part.stop, length)
    return first, min(last, length) if isinstance(last, int) and isinstance(length, int) else last


def entry_of(x: Any, place: Any) -> Any:
    """Return the entry of an array at a place, or a number itself."""
    return x[place] if isinstance(x, Array) else x


def contiguous(shape: Sequence[Any], wide: int = 1) -> list[Any]:
    """Return the strides of an array whose rows lie one behind the other, of entries of so many numbers."""
    strides: list[Any] = []
    step: Any = wide
    for length in reversed(shape):
        strides.insert(0, step)
        step = step * length
    return strides


def empty(code: Code, shape: Any, kind: str = FLOAT64) -> Array:
    """Return a new array, whose entries are not set; they are vectors where several runs are computed at once."""
    kind = kind + code.together * (len(kind) == 1)
    shape = shape if isinstance(shape, tuple) else (shape,)
    code.allocated += 1
    size, wide = prod(shape), int(kind[1:] or 1)
    words = 2 * size if kind == COMPLEX else size * wide
    of = FLOAT64 if kind == COMPLEX else kind[0]
    return Array(code.effect("alloc", POINTER, (code.as_kind(words, INTEGER), of)), kind, shape, contiguous(shape, wide))


def zeros(code: Code, shape: Any, kind: str = FLOAT64) -> Array:
    """Return a new array of zeros."""
    out = empty(code, shape, kind)
    flat = Array(out.pointer, out.kind, (out.size,), (out.wide,))
    each_place(code, flat.shape, lambda place: flat.__setitem__(place, 0))
    return out


def arange(code: Code, length: Any) -> Array:
    """Return a new array of 0, 1, 2, ..."""
    out = empty(code, length, INTEGER)
    each_place(code, out.shape, lambda place: out.__setitem__(place, place[0]))
    return out


def each_place(code: Code, shape: Sequence[Any], function: Callable[[tuple[Any, ...]], None], place: tuple[Any, ...] = ()) -> None:
    """Record something for each place of an array, in loops where these are many."""
    if not shape:
        function(place)
    elif isinstance(shape[0], int) and shape[0] <= FEW:
        for k in range(shape[0]):
            each_place(code, shape[1:], function, (*place, k))
    else:
        counted(code, shape[0], lambda k: each_place(code, shape[1:], function, (*place, k)))


def counted(code: Code, stop: Any, function: Callable[[Value], None]) -> None:
    """Record a loop that carries nothing but its index."""
    region, loop, k = Region(), Loop(), Value(code, "parameter", INTEGER)
    loop.parameters, loop.initial = [k], [code.as_kind(0, INTEGER)]
    region.block.append(loop)
    with code.inside(loop.block):
        test = If(k < stop)
        test.falls[1] = False
        leave = Leave(region, (), test.blocks[1])
        region.leaves.append(leave)
        test.blocks[1].append(leave)
        loop.block.append(test)
        function(k)
        loop.nexts = [code.as_kind(k + 1, INTEGER)]
    code.block.append(region)
