"""Functions of generated modules as machine code: compiled for the forms of their arguments, or loaded from a sealed object file."""

import hashlib
import json
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, cached_property
from itertools import count
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from daebench.compiler import sealed
from daebench.compiler.callbacks import ARENA
from daebench.compiler.entry import Entry, described, form_of, given
from daebench.compiler.under_way import compiling
from daebench.errors import DaebenchError, InvalidProblem, in_words

SUFFIX = ".o"
"""Ending of object files."""

_count = count()


class NoMachineCode(DaebenchError):
    """Machine code cannot be made on this computer."""


@cache
def no_machine_code() -> str:
    """Return why machine code cannot be made on this computer; "" where it can."""
    try:
        from daebench.compiler.machine import machine, session

        machine()
        session()
    except (ImportError, OSError, RuntimeError) as error:
        return in_words(error)
    return ""


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
        if no_machine_code():
            raise self.missing()
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
        from daebench.compiler.trace.program import Program, parameters_in

        with compiling(self.title), self._refusing(self.title):
            program = Program(self._source)
            function, structure = program.entry(self._name, given(form))
            text = Text()
            for each in program.functions[:-1]:
                text.add(each)
            if letters:
                text.callback(function, "entry", letters, parameters_in(self._source, self._name).index("user"), ARENA, structure)
            else:
                text.entry(function, "entry")
            allocates = function in text.allocating
            head = {"results": described(structure), "kinds": "".join(result.kind for result in function.results), "allocates": allocates}
            return json.dumps(head).encode() + b"\n" + object_file(text.whole(), loops=allocates or bool(letters))

    @property
    def title(self) -> str:
        """What the module has, in words."""
        return str(self._module.__doc__ or "functions").partition("\n")[0].rstrip(".")

    def missing(self) -> NoMachineCode:
        """Return that the function cannot be had without machine code."""
        return NoMachineCode(f"machine code cannot be made here ({no_machine_code()}), and {self.title} needs it.")

    @cached_property
    def in_python(self) -> Callable[..., Any]:
        """The function as Python executes it."""
        space = {**_names(), **vars(self._module)}
        exec(self._source, space)
        sealed.warn(
            f"machine code cannot be made here ({no_machine_code()}); functions run as Python, a hundred to a thousand times slower."
        )
        return space[self._name]  # type: ignore[no-any-return]

    @contextmanager
    def _refusing(self, title: str) -> Iterator[None]:
        """Turn what cannot be recorded into one sentence."""
        try:
            yield
        except (TypeError, NameError, IndexError, ZeroDivisionError) as error:
            from daebench.compiler.places import place_of

            where = place_of(_innermost(error) or self._name)
            raise InvalidProblem(f"{title} cannot be compiled: {error}, in {where}.") from error

    def _store(self, path: Path, purpose: str, content: bytes) -> None:
        if not self._cached:
            return
        try:
            sealed.write(path, purpose, content)
        except OSError as error:
            sealed.warn(f"cannot store machine code in {path.parent} ({error.strerror}); it is compiled again next time.")


def _innermost(error: BaseException) -> str:
    """Return the name of the generated function in which an error was raised: the last that Python executed, or that was followed."""
    name = ""
    for frame, _ in traceback.walk_tb(error.__traceback__):
        code = frame.f_code
        if code.co_filename == "<string>" and code.co_name != "<module>":
            name = code.co_name
        elif code.co_name == "inlined":
            name = frame.f_locals["self"].name
    return name


class Native:
    """A function of a generated module that Python calls: compiled for each form of its arguments. Parameters: see :class:`_Function`."""

    def __init__(self, module: ModuleType, source: str, name: str, *, cached: bool) -> None:
        self._function = _Function(module, source, name, cached=cached)
        self._made: dict[Any, Entry] = {}
        self._last: Entry | None = None

    def __call__(self, *args: Any) -> Any:
        """Return the result of the function."""
        if no_machine_code():
            return self._executed(args)[0]
        entry, words = self._for(args)
        return entry(*words)

    def timed(self, args: tuple[Any, ...]) -> tuple[Any, float]:
        """Return the result of the function for these arguments, and the CPU time of its machine code alone."""
        if no_machine_code():
            return self._executed(args)
        entry, words = self._for(args)
        return entry.timed(*words)

    def _for(self, args: tuple[Any, ...]) -> tuple[Entry, tuple[bytes, int]]:
        """Return the function for arguments of this form, and these in words with the bytes of their arrays."""
        entry = self._last
        if entry is None or (words := entry.words(args)) is None:
            form = form_of(args)
            if form not in self._made:
                self._made[form] = Entry(form, *self._function.at(form))
            entry = self._last = self._made[form]
            words = entry.words(args)
        assert words is not None
        return entry, words

    def _executed(self, args: tuple[Any, ...]) -> tuple[Any, float]:
        """Return the result as Python computes it, and the CPU time."""
        began = time.thread_time()
        try:
            with np.errstate(all="ignore"):
                result = self._function.in_python(*map(_of_numpy, args))
        except NameError as error:  # of dual numbers, say
            raise self._function.missing() from error
        return result, time.thread_time() - began

    @property
    def kinds(self) -> dict[Any, str]:
        """Kinds of the numbers that it returns, by the forms of arguments that it was called with."""
        return {form: entry.kinds for form, entry in self._made.items()}


def _of_numpy(x: Any) -> Any:
    """Return nested tuples of NumPy's numbers, whose quotients by zero are infinite."""
    if isinstance(x, tuple):
        return tuple(map(_of_numpy, x))
    return np.float64(x) if isinstance(x, float) else np.complex128(x) if isinstance(x, complex) else x


@cache
def _names() -> dict[str, Any]:
    """Return what functions take from NumPy and from Python."""
    names = {name: getattr(np, name) for name in np.__all__ if isinstance(getattr(np, name, None), np.ufunc)}
    arrays = {"numpy": np, "inf": np.inf, "empty": np.empty, "zeros": np.zeros, "arange": np.arange}
    return names | arrays | {"abs": abs, "max": max, "min": min}


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
