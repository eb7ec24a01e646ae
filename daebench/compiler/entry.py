"""Calls of recorded functions from Python: arguments of one form as words, and results put together of words."""

import ctypes
import mmap
import struct
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from itertools import chain, count
from typing import Any
from weakref import ref

import numpy as np

from daebench.errors import RunFailed

LEAST, PARTS = 2**26, 256
"""Bytes for new arrays: at least so many, and so many times those of the arrays that are given. Pages that are not used cost nothing."""

MATRICES = 16
"""Matrices, of as many rows and columns as there are unknowns, for which there is room in the memory of callbacks."""


class Memory:
    """Memory for new arrays of one call."""

    def __init__(self, size: int) -> None:
        self.size = size
        flags = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS | getattr(mmap, "MAP_NORESERVE", 0)
        self._map = mmap.mmap(-1, size, flags=flags)
        self._start = ctypes.addressof((ctypes.c_char * size).from_buffer(self._map))
        self._fresh = struct.pack("=4q", self._start, self._start + size, self._start, 0)
        self._words = bytearray(self._fresh)
        self._place = ctypes.addressof((ctypes.c_char * len(self._words)).from_buffer(self._words))

    @classmethod
    def of_unknowns(cls, n: int) -> "Memory":
        """Return memory for callbacks of a system of n unknowns: for matrices of n rows."""
        return cls(max(LEAST, PARTS * 8 * n, MATRICES * 8 * n * n))

    def begun(self) -> int:
        """Return the address of where its next array goes, its end, its beginning, and whether it was too small; all of it is free."""
        self._words[:] = self._fresh
        return self._place

    def require_enough(self) -> None:
        """Raise :class:`RunFailed` if it was too small."""
        if any(self._words[24:]):  # the last word is set where it was too small
            raise RunFailed(
                f"new arrays of a step need more than the {self.size >> 20} MiB set aside for them; use a smaller problem.",
                "step-arrays-exceed-memory",
            )


_memories = threading.local()


def memory_for(given: int) -> Memory:
    """Return memory of this thread for a call with arrays of so many bytes."""
    size = max(LEAST, PARTS * given)
    memory: Memory | None = getattr(_memories, "memory", None)
    if memory is None or memory.size < size:
        memory = _memories.memory = Memory(size)
    return memory


FORMATS = {"d": "d", "s": "f4x", "i": "q", "b": "q"}
"""How numbers of each kind are packed into words; complex ones are two."""

DTYPES = {
    "d": np.dtype(np.float64),
    "s": np.dtype(np.float32),
    "i": np.dtype(np.int64),
    "b": np.dtype(np.bool_),
    "z": np.dtype(np.complex128),
}


def form_of(x: Any) -> Any:
    """Return the form of an argument: a letter, a tuple of forms, or of an array its type, its axes, and whether rows follow each other."""
    if isinstance(x, tuple):
        return tuple(map(form_of, x))
    if isinstance(x, np.ndarray):
        return f"{x.dtype.kind}{x.itemsize}", x.ndim, x.flags.c_contiguous
    if x is None or isinstance(x, bool | np.bool_):
        return x if x is None else "b"
    if isinstance(x, int | np.integer):
        return "i"
    if isinstance(x, float):
        return "d"
    if isinstance(x, np.float32):
        return "s"
    if isinstance(x, complex):
        return "z"
    raise TypeError(f"{x!r} is no number that machine code takes")


ARRAYS = {"f8": "d", "f4": "s", "i8": "i", "u8": "i", "c16": "z"}
"""Kinds of entries, by what NumPy says of a type."""


def given(form: Any) -> Any:
    """Return a form as :meth:`daebench.compiler.trace.program.Program.entry` takes it."""
    if of_array(form):
        return [ARRAYS[form[0]], *form[1:]]
    return tuple(map(given, form)) if isinstance(form, tuple) else form


def described(x: Any) -> Any:
    """Return a description of a result: null for a number of the program, a list, a known number, or an array."""
    # Imported here, where something has been recorded: a process that finds its object files imports no compiler.
    from daebench.compiler.trace.arrays import Array
    from daebench.compiler.trace.complex import Complex
    from daebench.compiler.trace.ir import Value

    if isinstance(x, tuple):
        return [described(entry) for entry in x]
    if isinstance(x, Complex):
        return {"parts": [described(x.real), described(x.imag)]}
    if isinstance(x, Array):
        lengths = [[None if isinstance(length, Value) else length for length in row] for row in (x.shape, x.strides)]
        return {"kind": x.kind, "shape": lengths[0], "strides": lengths[1]}
    return None if isinstance(x, Value) else {"is": x}


class Entry:
    """A function for arguments of one form.

    What takes arguments apart and puts results together is written out for the form: a run may call its kernel for a few steps at a time.
    """

    def __init__(
        self, form: Any, head: dict[str, Any], place: Callable[[Any], Any], pack: Callable[..., Any], array: Callable[..., Any]
    ) -> None:
        self.kinds, self._allocates = head["kinds"], head["allocates"]
        self._places: dict[str, Any] = {}
        pattern, words, checks = self._pattern(form, place, count())
        space: dict[str, Any] = {f"place_{name}": place for name, place in self._places.items()}
        space |= {"array": array, "bool": bool, "complex": complex, "DTYPES": DTYPES, "inf": float("inf"), "nan": float("nan")}
        space |= {"floats": (float, np.float64), "bools": (bool, np.bool_), "complexes": (complex, np.complex128), "float32": np.float32}
        space |= {"pack": pack, "Other": Other}
        result = f"({_together(head['results'], self.kinds, count())})"
        guard = f"    if not ({' and '.join(checks)}): raise Other\n" if checks else ""
        size = " + ".join(f"{name}.nbytes" for name in self._places if self._allocates) or "0"
        text = (
            f"def taken(x):\n    {pattern} = x\n{guard}    return pack({', '.join(words)}), {size}\ndef together(v):\n    return {result}\n"
        )
        exec(text, space)
        self._taken, self._together = space["taken"], space["together"]

    def _pattern(self, form: Any, place: Callable[[Any], Any], leaves: Iterator[int]) -> tuple[str, list[str], list[str]]:
        """Return the pattern that unpacks an argument, the words that it is packed into, and tests of its form."""
        if not isinstance(form, tuple):
            name = f"x{next(leaves)}"
            if form is None:
                return name, [], [f"{name} is None"]
            if form == "z":
                return name, [f"{name}.real", f"{name}.imag"], [f"type({name}) in complexes"]
            # Formats take more than their kind: that of a double also whole numbers, that of a float also doubles, that of a truth
            # value any whole number. Whole numbers need no test, because their format refuses floats.
            tests = {"s": f"type({name}) is float32", "b": f"type({name}) in bools", "d": f"type({name}) in floats"}
            return name, [name], [tests[form]] if form in tests else []
        if of_array(form):
            name = f"x{next(leaves)}"
            self._places[name] = place(form)
            return name, [f"*place_{name}({name})"], []
        parts = [self._pattern(part, place, leaves) for part in form]
        words, checks = (list(chain.from_iterable(part[k] for part in parts)) for k in (1, 2))
        return f"[{', '.join(part[0] for part in parts)}]", words, checks

    def words(self, args: tuple[Any, ...]) -> tuple[Any, int] | None:
        """Return arguments in words, and the bytes of their arrays where new ones are made; None if they are of another form."""
        try:
            words: tuple[Any, int] = self._taken(args)
        except (Other, TypeError, ValueError, struct.error):
            return None
        return words

    def __call__(self, words: Any, given: int) -> Any:
        """Return the result for what :meth:`words` gives."""
        return self.timed(words, given)[0]

    def timed(self, words: Any, given: int) -> tuple[Any, float]:
        """Return the same, and the CPU time of the function."""
        raise NotImplementedError


class OfMachine(Entry):
    """A function at an address; other parameters as :class:`Entry`."""

    def __init__(self, form: Any, head: dict[str, Any], address: int) -> None:
        letters = "".join(packed(form)), "".join(FORMATS.get(kind, "q") for kind in head["kinds"])
        taken, self._found = (struct.Struct("=" + codes) for codes in letters)
        super().__init__(form, head, _Place, taken.pack, _array)
        self._buffer, self._unpacked = ctypes.c_char * self._found.size, self._found.unpack
        self._call = ctypes.CFUNCTYPE(None, ctypes.c_char_p, ctypes.c_void_p, ctypes.c_void_p)(address)

    def __call__(self, words: bytes, given: int) -> Any:
        """Return the result for what :meth:`words` gives."""
        # A buffer for each call: ctypes releases the interpreter, and threads run one function at the same time.
        buffer, memory = self._buffer(), memory_for(given) if self._allocates else None
        self._call(words, ctypes.addressof(buffer), memory.begun() if memory else 0)
        return self._ended(buffer, memory)

    def timed(self, words: bytes, given: int) -> tuple[Any, float]:
        """Return the same, and the CPU time of the machine code."""
        buffer, memory = self._buffer(), memory_for(given) if self._allocates else None
        place, free = ctypes.addressof(buffer), memory.begun() if memory else 0
        began = time.thread_time()
        self._call(words, place, free)
        seconds = time.thread_time() - began
        return self._ended(buffer, memory), seconds

    def _ended(self, buffer: Any, memory: Memory | None) -> Any:
        if memory:
            memory.require_enough()
        return self._together(self._unpacked(buffer))


class Other(Exception):
    """An argument is of another form."""


_NOTHING = ctypes.c_char * 0
"""What can be had of every array that can be written to: its address costs a third of what NumPy's takes."""


class _Place:
    """Where the array of one argument is, with its lengths: asked for only where it is another array than before."""

    def __init__(self, form: tuple[Any, ...]) -> None:
        self.dtype, self.axes, self.ordered = np.dtype(form[0]), form[1], form[2]
        self.last: tuple[Any, tuple[int, ...]] = (lambda: None, ())

    def __call__(self, x: Any) -> tuple[int, ...]:
        """Return where an array is, its lengths, and its strides in entries unless they follow from the lengths."""
        last, words = self.last
        if last() is x:
            return words
        if type(x) is not np.ndarray or x.dtype != self.dtype or x.ndim != self.axes or x.flags.c_contiguous != self.ordered:
            raise Other
        place = ctypes.addressof(_NOTHING.from_buffer(x.data)) if self.ordered and x.flags.writeable else x.ctypes.data
        strides = () if self.ordered else tuple(stride // x.itemsize for stride in x.strides)
        words = (place, *x.shape, *strides)
        # A weak reference, so that the rows of a long run are not kept in memory after it.
        self.last = ref(x), words
        return words


def packed(form: Any) -> Iterator[str]:
    """Return the letters of the words of a form."""
    if of_array(form):
        yield from "q" * (1 + form[1] * (1 if form[2] else 2))
    elif isinstance(form, tuple):
        for part in form:
            yield from packed(part)
    elif form:
        yield from ["d", "d"] if form == "z" else [FORMATS[form]]


def of_array(form: Any) -> bool:
    """Return whether a form is that of an array."""
    return isinstance(form, tuple) and len(form) == 3 and isinstance(form[1], int)


def _together(description: Any, kinds: str, places: Iterator[int]) -> str:
    """Return the source of a result, given its numbers as v."""
    if description is None:
        k = next(places)
        return f"bool(v[{k}])" if kinds[k] == "b" else f"v[{k}]"
    if isinstance(description, list):
        return f"({''.join(f'{_together(part, kinds, places)}, ' for part in description)})"
    if "parts" in description:
        return f"complex({', '.join(_together(part, kinds, places) for part in description['parts'])})"
    if "is" in description:
        return f"({description['is']!r})"
    pointer = f"v[{next(places)}]"
    rows = [[f"v[{next(places)}]" if n is None else str(n) for n in description[row]] for row in ("shape", "strides")]
    shape, strides = (f"[{', '.join(row)}]" for row in rows)
    return f"array({pointer}, DTYPES[{description['kind']!r}], {shape}, {strides})"


def _array(place: int, dtype: Any, shape: Sequence[int], strides: Sequence[int]) -> Any:
    """Return a copy of an array at an address."""
    if 0 in shape:
        return np.empty(shape, dtype)
    extent = 1 + sum((n - 1) * stride for n, stride in zip(shape, strides, strict=True))
    raw = (ctypes.c_char * (extent * dtype.itemsize)).from_address(place)
    view = np.lib.stride_tricks.as_strided(np.frombuffer(raw, dtype), shape, [dtype.itemsize * stride for stride in strides])
    return view.copy()
