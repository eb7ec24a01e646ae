"""Functions of generated modules as machine code: compiled for the forms of their arguments, or loaded from a sealed object file."""

import ctypes
import hashlib
import json
import re
import struct
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from itertools import chain, count
from pathlib import Path
from types import ModuleType
from typing import Any
from weakref import ref

import numpy as np

from daebench.compiler import sealed
from daebench.compiler.callbacks import ARENA
from daebench.compiler.memory import LEAST, PARTS, Memory
from daebench.compiler.under_way import compiling
from daebench.errors import InvalidProblem

SUFFIX = ".o"
"""Ending of object files."""

FORMATS = {"d": "d", "s": "f4x", "i": "q", "b": "q", "z": "dd"}
"""How numbers of each kind are packed into words."""

DTYPES = {
    "d": np.dtype(np.float64),
    "s": np.dtype(np.float32),
    "i": np.dtype(np.int64),
    "b": np.dtype(np.bool_),
    "z": np.dtype(np.complex128),
}

_count = count()


class _Function:
    """A function of a generated module, of which object files are made.

    Parameters
    ----------
    module : ModuleType
        The module, with the digest of its source, ``__digest__``.
    source : str
        Its source.
    name : str
        Name of the function.
    cached : bool
        Whether object files are stored beside the module's file.
    """

    def __init__(self, module: ModuleType, source: str, name: str, *, cached: bool) -> None:
        self._module, self._source, self._name, self._cached = module, source, name, cached

    def at(self, form: Any, letters: str = "") -> tuple[dict[str, Any], int]:
        """Return what is known of the function for arguments of a form, and its address; ``letters`` are its types if C calls it."""
        from daebench.compiler.machine import loaded, machine

        purpose = "\n".join([self._module.__name__, self._name, vars(self._module)["__digest__"], repr(form), letters, machine()])
        key = hashlib.sha256(purpose.encode()).hexdigest()[:16]
        path = Path(str(self._module.__file__)).with_suffix(f".{self._name}.{key}{SUFFIX}")
        content = sealed.read(path, purpose) if self._cached else None
        if content is None:
            content = self._compiled(form, letters)
            self._store(path, purpose, content)
        head, _, code = content.partition(b"\n")
        return json.loads(head), loaded(f"{path.stem}_{next(_count)}", code, "entry")

    def _compiled(self, form: Any, letters: str) -> bytes:
        """Return the head of an object file, which says what the function returns, and the file."""
        from daebench.compiler.machine import object_file
        from daebench.compiler.print.llvm import Text
        from daebench.compiler.trace.program import Program

        title = str(self._module.__doc__ or "functions").partition("\n")[0].rstrip(".")
        with compiling(title), self._refusing(title):
            program = Program(self._source)
            function, structure = program.entry(self._name, _given(form))
            text = Text()
            for each in program.functions[:-1]:
                text.add(each)
            if letters:
                text.callback(function, "entry", letters, self._parameters.index("user"), ARENA, structure)
            else:
                text.entry(function, "entry")
            allocates = function in text.allocating
            head = {"results": _described(structure), "kinds": "".join(result.kind for result in function.results), "allocates": allocates}
            return json.dumps(head).encode() + b"\n" + object_file(text.whole(), loops=allocates or bool(letters))

    @property
    def _parameters(self) -> list[str]:
        found = re.search(rf"^def {self._name}\((.*)\):$", self._source, re.M)
        return found[1].split(", ") if found else []

    @contextmanager
    def _refusing(self, title: str) -> Iterator[None]:
        """Turn what cannot be recorded into one sentence."""
        try:
            yield
        except (TypeError, NameError, IndexError, ZeroDivisionError) as error:
            raise InvalidProblem(f"{title} has no machine code of {self._name}: {error}.") from error

    def _store(self, path: Path, purpose: str, content: bytes) -> None:
        if not self._cached:
            return
        try:
            sealed.write(path, purpose, content)
        except OSError as error:
            sealed.warn(f"cannot store machine code in {path.parent} ({error.strerror}); it is compiled again next time.")


class Native:
    """A function of a generated module that Python calls: compiled for each form of its arguments. Parameters: see :class:`_Function`."""

    def __init__(self, module: ModuleType, source: str, name: str, *, cached: bool) -> None:
        self._function = _Function(module, source, name, cached=cached)
        self._made: dict[Any, _Entry] = {}
        self._last: _Entry | None = None

    def __call__(self, *args: Any) -> Any:
        """Return the result of the function."""
        return self.timed(args)[0]

    def timed(self, args: tuple[Any, ...]) -> tuple[Any, float]:
        """Return the result of the function for these arguments, and the CPU time of its machine code alone."""
        entry = self._last
        if entry is None or (words := entry.words(args)) is None:
            form = form_of(args)
            if form not in self._made:
                self._made[form] = _Entry(form, *self._function.at(form))
            entry = self._last = self._made[form]
            words = entry.words(args)
        assert words is not None
        return entry(words, args)

    @property
    def kinds(self) -> dict[Any, str]:
        """Kinds of the numbers that it returns, by the forms of arguments that it was called with."""
        return {form: entry.kinds for form, entry in self._made.items()}


class Callback:
    """A function of a generated module that C calls, compiled when its address is first asked for.

    One of its arguments is called ``user``: the address of the memory of callbacks, see :mod:`daebench.compiler.callbacks`.

    Parameters
    ----------
    module, source, name, cached
        See :class:`_Function`.
    letters : str
        Types of C, that of the result first, see :data:`daebench.compiler.trace.foreign.KINDS`.
    """

    def __init__(self, module: ModuleType, source: str, name: str, letters: str, *, cached: bool) -> None:
        self._function, self._letters = _Function(module, source, name, cached=cached), letters

    @cached_property
    def address(self) -> int:
        """Its address."""
        return self._function.at(tuple("d" if letter == "d" else "i" for letter in self._letters[1:]), self._letters)[1]


def timed(function: Callable[..., Any], args: tuple[Any, ...]) -> tuple[Any, float]:
    """Return the result of a function and its CPU time: that of its machine code alone where it is a :class:`Native`."""
    if isinstance(function, Native):
        return function.timed(args)
    began = time.thread_time()
    result = function(*args)
    return result, time.thread_time() - began


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


def _given(form: Any) -> Any:
    """Return a form as :meth:`daebench.compiler.trace.program.Program.entry` takes it."""
    if _of_array(form):
        return [ARRAYS[form[0]], *form[1:]]
    return tuple(map(_given, form)) if isinstance(form, tuple) else form


def _described(x: Any) -> Any:
    """Return a description of a result: null for a number of the program, a list, a known number, or an array."""
    from daebench.compiler.trace.arrays import Array
    from daebench.compiler.trace.complex import Complex
    from daebench.compiler.trace.ir import Value

    if isinstance(x, tuple):
        return [_described(entry) for entry in x]
    if isinstance(x, Complex):
        return {"parts": [_described(x.real), _described(x.imag)]}
    if isinstance(x, Array):
        lengths = [[None if isinstance(length, Value) else length for length in row] for row in (x.shape, x.strides)]
        return {"kind": x.kind, "shape": lengths[0], "strides": lengths[1]}
    return None if isinstance(x, Value) else {"is": x}


class _Entry:
    """A function for arguments of one form, at an address.

    What takes arguments apart and puts results together is written out for the form: a run calls its kernel for a few steps at a time,
    and what lies around its steps counts as time of the run.
    """

    def __init__(self, form: Any, head: dict[str, Any], address: int) -> None:
        self.kinds, self._allocates = head["kinds"], head["allocates"]
        self._packed, self._found = (struct.Struct("=" + "".join(letters)) for letters in (_packed(form), map(_letter, self.kinds)))
        self._buffer = ctypes.c_char * (self._found.size + 8)
        self._places: list[_Place] = []
        pattern, words, checks = self._pattern(form, count())
        space: dict[str, Any] = {f"place{k}": place for k, place in enumerate(self._places)}
        space |= {"array": _array, "bool": bool, "complex": complex, "DTYPES": DTYPES, "inf": float("inf"), "nan": float("nan")}
        space |= {"floats": (float, np.float64), "bools": (bool, np.bool_), "complexes": (complex, np.complex128), "float32": np.float32}
        space |= {"pack": self._packed.pack, "Other": _Other}
        space |= {"call": ctypes.CFUNCTYPE(None, ctypes.c_char_p, ctypes.c_void_p, ctypes.c_void_p)(address)}
        found = f"({_together(head['results'], self.kinds, count())})"
        guard = f"    if not ({' and '.join(checks)}): raise Other\n" if checks else ""
        text = f"def taken(x):\n    {pattern} = x\n{guard}    return pack({', '.join(words)})\ndef together(v):\n    return {found}\n"
        exec(text, space)
        self._call, self._taken, self._together = space["call"], space["taken"], space["together"]

    def _pattern(self, form: Any, leaves: Iterator[int]) -> tuple[str, list[str], list[str]]:
        """Return what an argument is unpacked to, the words that it is packed into, and tests of its form."""
        if not isinstance(form, tuple):
            name = f"x{next(leaves)}"
            if form is None:
                return name, [], [f"{name} is None"]
            if form == "z":
                return name, [f"{name}.real", f"{name}.imag"], [f"type({name}) in complexes"]
            tests = {"s": f"type({name}) is float32", "b": f"type({name}) in bools", "d": f"type({name}) in floats"}
            return name, [name], [tests[form]] if form in tests else []
        if _of_array(form):
            name, k = f"x{next(leaves)}", len(self._places)
            self._places.append(_Place(form))
            return name, [f"*place{k}({name})"], []
        parts = [self._pattern(part, leaves) for part in form]
        words, checks = (list(chain.from_iterable(part[k] for part in parts)) for k in (1, 2))
        return f"[{', '.join(part[0] for part in parts)}]", words, checks

    def words(self, args: tuple[Any, ...]) -> bytes | None:
        """Return arguments in words; None if they are of another form."""
        try:
            words: bytes = self._taken(args)
        except (_Other, TypeError, ValueError, struct.error):
            return None
        return words

    def __call__(self, words: bytes, args: tuple[Any, ...]) -> tuple[Any, float]:
        """Return the result for these arguments, and the CPU time of the machine code."""
        found = self._buffer()
        memory = _memory(args) if self._allocates else None
        place, free = ctypes.addressof(found), memory.begun() if memory else 0
        began = time.thread_time()
        self._call(words, place, free)
        seconds = time.thread_time() - began
        if memory:
            memory.require_enough()
        return self._together(self._found.unpack_from(found)), seconds


class _Other(Exception):
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
            raise _Other
        place = ctypes.addressof(_NOTHING.from_buffer(x.data)) if self.ordered and x.flags.writeable else x.ctypes.data
        strides = () if self.ordered else tuple(stride // x.itemsize for stride in x.strides)
        words = (place, *x.shape, *strides)
        self.last = ref(x), words
        return words


def _letter(kind: str) -> str:
    return FORMATS.get(kind, "q")


def _packed(form: Any) -> Iterator[str]:
    if _of_array(form):
        yield "q" * (1 + form[1] * (1 if form[2] else 2))
    elif isinstance(form, tuple):
        for part in form:
            yield from _packed(part)
    elif form:
        yield FORMATS[form]


def _of_array(form: Any) -> bool:
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


_memories = threading.local()


def _memory(args: tuple[Any, ...]) -> Memory:
    """Return memory of this thread for a call with these arguments."""
    size = max(LEAST, PARTS * sum(array.nbytes for array in _arrays(args)))
    memory: Memory | None = getattr(_memories, "memory", None)
    if memory is None or memory.size < size:
        memory = _memories.memory = Memory(size)
    return memory


def _arrays(x: Any) -> Iterator[Any]:
    if isinstance(x, tuple):
        for part in x:
            yield from _arrays(part)
    elif isinstance(x, np.ndarray):
        yield x
