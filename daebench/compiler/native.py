"""Functions of generated modules as machine code: compiled for the forms of their arguments, or loaded from a sealed object file."""

import ctypes
import hashlib
import json
import mmap
import struct
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from daebench.compiler import sealed
from daebench.compiler.under_way import compiling
from daebench.errors import InvalidProblem, RunFailed

SUFFIX = ".o"
"""Ending of object files."""

FORMATS = {"d": "d", "s": "f4x", "i": "q", "b": "q"}
"""How numbers of each kind are packed into words."""

DTYPES = {"d": np.dtype(np.float64), "s": np.dtype(np.float32), "i": np.dtype(np.int64), "b": np.dtype(np.bool_)}

LEAST_MEMORY, PARTS = 2**26, 256
"""Bytes for new arrays: at least so many, and so many times those of the arrays that are given. Pages that are not used cost nothing."""

_count = count()


class Native:
    """A function of a generated module.

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
        self._made: dict[Any, _Entry] = {}
        self._last: _Entry | None = None

    def __call__(self, *args: Any) -> Any:
        """Return the result of the function."""
        entry = self._last
        if entry is not None and (words := entry.takes(args)) is not None:
            return entry(args, words)
        form = form_of(args)
        entry = self._made.get(form)
        if entry is None:
            entry = self._made[form] = self._entry(form)
        result = entry(args)
        self._last = entry
        return result

    @property
    def kinds(self) -> dict[Any, str]:
        """Kinds of the numbers that it returns, by the forms of arguments that it was called with."""
        return {form: entry.kinds for form, entry in self._made.items()}

    def _entry(self, form: Any) -> "_Entry":
        from daebench.compiler.machine import loaded, machine

        purpose = "\n".join([self._module.__name__, self._name, vars(self._module)["__digest__"], repr(form), machine()])
        key = hashlib.sha256(purpose.encode()).hexdigest()[:16]
        path = Path(str(self._module.__file__)).with_suffix(f".{self._name}.{key}{SUFFIX}")
        content = sealed.read(path, purpose) if self._cached else None
        if content is None:
            content = self._compiled(form)
            self._store(path, purpose, content)
        head, _, code = content.partition(b"\n")
        return _Entry(form, json.loads(head), loaded(f"{path.stem}_{next(_count)}", code, "entry"))

    def _compiled(self, form: Any) -> bytes:
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
            text.entry(function, "entry")
            allocates = function in text.allocating
            head = {"results": _described(structure), "kinds": "".join(result.kind for result in function.results), "allocates": allocates}
            return json.dumps(head).encode() + b"\n" + object_file(text.whole(), loops=allocates)

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


def form_of(x: Any) -> Any:
    """Return the form of an argument: a letter for a number, a tuple of forms, or the type of an array with the number of its axes."""
    if isinstance(x, tuple):
        return tuple(map(form_of, x))
    if isinstance(x, np.ndarray):
        return f"{x.dtype.kind}{x.itemsize}", x.ndim
    if isinstance(x, bool | np.bool_):
        return "b"
    if isinstance(x, int | np.integer):
        return "i"
    if isinstance(x, float):
        return "d"
    if isinstance(x, np.float32):
        return "s"
    raise TypeError(f"{x!r} is no number that machine code takes")


ARRAYS = {"f8": "d", "f4": "s", "i8": "i", "u8": "i"}
"""Kinds of entries, by what NumPy says of a type."""


def _given(form: Any) -> Any:
    """Return a form as :meth:`daebench.compiler.trace.program.Program.entry` takes it."""
    if isinstance(form, tuple) and len(form) == 2 and isinstance(form[1], int):
        return [ARRAYS[form[0]], form[1]]
    return tuple(map(_given, form)) if isinstance(form, tuple) else form


def _described(x: Any) -> Any:
    """Return a description of a result: null for a number of the program, a list, a known number, or an array."""
    from daebench.compiler.trace.arrays import Array
    from daebench.compiler.trace.ir import Value

    if isinstance(x, tuple):
        return [_described(entry) for entry in x]
    if isinstance(x, Array):
        lengths = [[None if isinstance(length, Value) else length for length in row] for row in (x.shape, x.strides)]
        return {"kind": x.kind, "shape": lengths[0], "strides": lengths[1]}
    return None if isinstance(x, Value) else {"is": x}


class _Entry:
    """A function for arguments of one form, at an address.

    What takes arguments apart and puts results together is written out for the form: a run calls its kernel for a few steps at a time.
    """

    def __init__(self, form: Any, head: dict[str, Any], address: int) -> None:
        self._call = ctypes.CFUNCTYPE(None, ctypes.c_char_p, ctypes.c_void_p, ctypes.c_void_p)(address)
        self.kinds, self._allocates = head["kinds"], head["allocates"]
        self._pack = struct.Struct("=" + "".join(_packed(form))).pack
        self._found = struct.Struct("=" + "".join(FORMATS.get(kind, "q") for kind in self.kinds))
        checks: list[str] = []
        leaves = _leaves(form, "x", checks)
        space: dict[str, Any] = {"place": _place, "array": _array, "bool": bool, "DTYPES": DTYPES, "inf": float("inf"), "nan": float("nan")}
        self._taken = eval(f"lambda x: ({''.join(f'{leaf}, ' for leaf in leaves)}) if {' and '.join(checks)} else None", space)
        self._together = eval(f"lambda v: {_together(head['results'], self.kinds, count())}", space)
        self.types: tuple[type, ...] | None = None

    def takes(self, args: tuple[Any, ...]) -> tuple[Any, ...] | None:
        """Return the numbers and places of arguments; None if they are not surely of the same form as those of the last call."""
        try:
            words: tuple[Any, ...] | None = self._taken(args)
        except (TypeError, IndexError):
            return None
        return words if words is not None and tuple(map(type, words)) == self.types else None

    def __call__(self, args: tuple[Any, ...], words: tuple[Any, ...] | None = None) -> Any:
        """Return the result for these arguments, which may have been taken apart."""
        if words is None:
            words = self._taken(args)
            self.types = tuple(map(type, words))
        found = (ctypes.c_char * (self._found.size + 8))()
        memory = _memory(args) if self._allocates else None
        self._call(self._pack(*words), ctypes.addressof(found), memory.begun() if memory else 0)
        if memory and memory.overflowed:
            raise RunFailed(f"new arrays of a step need more than the {memory.size >> 20} MiB set aside for them; use a smaller problem.")
        return self._together(self._found.unpack_from(found))


def _packed(form: Any) -> Iterator[str]:
    if _of_array(form):
        yield "q" * (1 + 2 * form[1])
    elif isinstance(form, tuple):
        for part in form:
            yield from _packed(part)
    else:
        yield FORMATS[form]


def _of_array(form: Any) -> bool:
    return isinstance(form, tuple) and len(form) == 2 and isinstance(form[1], int)


def _leaves(form: Any, path: str, checks: list[str]) -> list[str]:
    """Return the sources of the words of an argument of a form; add tests that it has as many parts as the form."""
    if _of_array(form):
        return [f"*place({path}, {form!r})"]
    if not isinstance(form, tuple):
        return [path]
    checks.append(f"len({path}) == {len(form)}")
    return [leaf for k, part in enumerate(form) for leaf in _leaves(part, f"{path}[{k}]", checks)]


def _place(x: Any, form: tuple[str, int]) -> tuple[int, ...]:
    """Return where an array is, its shape and its strides in entries."""
    if type(x) is not np.ndarray or x.ndim != form[1] or x.dtype.str[1:] != form[0]:
        raise TypeError
    size = x.itemsize
    return x.__array_interface__["data"][0], *x.shape, *[stride // size for stride in x.strides]


def _together(description: Any, kinds: str, places: Iterator[int]) -> str:
    """Return the source of a result, given its numbers as v."""
    if description is None:
        k = next(places)
        return f"bool(v[{k}])" if kinds[k] == "b" else f"v[{k}]"
    if isinstance(description, list):
        return f"({''.join(f'{_together(part, kinds, places)}, ' for part in description)})"
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


class _Memory:
    """Memory for new arrays of one call."""

    def __init__(self, size: int) -> None:
        self.size = size
        flags = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS | getattr(mmap, "MAP_NORESERVE", 0)
        self._map = mmap.mmap(-1, size, flags=flags)
        self._start = ctypes.addressof((ctypes.c_char * size).from_buffer(self._map))
        self._words = (ctypes.c_int64 * 4)()

    def begun(self) -> int:
        """Return the address of where its next array goes, its end, its beginning, and whether it was too small; all of it is free."""
        self._words[:] = [self._start, self._start + self.size, self._start, 0]
        return ctypes.addressof(self._words)

    @property
    def overflowed(self) -> bool:
        """Whether it was too small."""
        return bool(self._words[3])


_memories = threading.local()


def _memory(args: tuple[Any, ...]) -> _Memory:
    """Return memory of this thread for a call with these arguments."""
    size = max(LEAST_MEMORY, PARTS * sum(array.nbytes for array in _arrays(args)))
    memory: _Memory | None = getattr(_memories, "memory", None)
    if memory is None or memory.size < size:
        memory = _memories.memory = _Memory(size)
    return memory


def _arrays(x: Any) -> Iterator[Any]:
    if isinstance(x, tuple):
        for part in x:
            yield from _arrays(part)
    elif isinstance(x, np.ndarray):
        yield x
