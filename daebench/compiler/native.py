"""Functions of generated modules, recorded for the forms of their arguments: as machine code, in a sealed object file, or as Python."""

import hashlib
import json
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache, cached_property
from itertools import count
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from daebench.compiler import sealed
from daebench.compiler.callbacks import ARENA
from daebench.compiler.entry import Entry, OfMachine, described, form_of, given
from daebench.compiler.in_python import OfPython
from daebench.compiler.syntax import PREFIX
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
    """A function of a generated module, of which object files are made."""

    def __init__(self, module: ModuleType, source: str, name: str, *, cached: bool) -> None:
        self._module, self._source, self._name, self._cached = module, source, name, cached
        self._by_python = vars(module).get("BY_PYTHON", False)

    def entry(self, form: Any) -> Entry:
        """Return the function for arguments of a form."""
        if not self._by_python and not no_machine_code():
            return OfMachine(form, *self.at(form))
        if not self._by_python:
            why = no_machine_code()
            sealed.warn(f"machine code cannot be made here ({why}); functions run as Python, a hundred to five hundred times slower.")
        head, text, _ = self._made(form, "", "Python", ".text", lambda: self._printed(form))
        return OfPython(form, head, text.decode())

    def at(self, form: Any, letters: str = "") -> tuple[dict[str, Any], int]:
        """Return the head of the function for arguments of a form, and its address; ``letters`` are its types if C calls it."""
        if no_machine_code():
            raise self.missing()
        # LLVM may be missing, and functions run as Python then.
        from daebench.compiler.machine import loaded, machine

        head, code, stem = self._made(form, letters, machine(), SUFFIX, lambda: self._compiled(form, letters))
        # A number is appended because a process may load one file several times, and names of loaded files have to differ.
        return head, loaded(f"{stem}_{next(_count)}", code, "entry")

    def _made(
        self, form: Any, letters: str, machine: str, suffix: str, make: Callable[[], tuple[dict[str, Any], bytes]]
    ) -> tuple[dict[str, Any], bytes, str]:
        """Return the head of the function, its code for a machine, and the name of the sealed file that both are from."""
        purpose = "\n".join([self._module.__name__, self._name, vars(self._module)["__digest__"], repr(form), letters, machine])
        key = hashlib.sha256(purpose.encode()).hexdigest()[:16]
        path = Path(str(self._module.__file__)).with_suffix(f".{self._name}.{key}{suffix}")
        content = sealed.read(path, purpose) if self._cached else None
        if content is None:
            head, code = make()
            content = json.dumps(head).encode() + b"\n" + code
            self._store(path, purpose, content)
        line, _, code = content.partition(b"\n")
        return json.loads(line), code, path.stem

    def _compiled(self, form: Any, letters: str) -> tuple[dict[str, Any], bytes]:
        """Return the head of the function, and an object file."""
        # Imported here: a process that finds its object files imports no compiler.
        from daebench.compiler.machine import object_file
        from daebench.compiler.print.llvm import Text
        from daebench.compiler.trace.program import parameters_in

        with self._recorded(form) as (functions, structure):
            function, text = functions[-1], Text()
            for callee in functions[:-1]:
                text.add(callee)
            if letters:
                text.callback(function, "entry", letters, parameters_in(self._source, self._name).index("user"), ARENA, structure)
            else:
                text.entry(function, "entry")
            allocates = function in text.allocating
            return _head(function, structure, allocates=allocates), object_file(text.whole(), loops=allocates or bool(letters))

    def _printed(self, form: Any) -> tuple[dict[str, Any], bytes]:
        """Return the head of the function, and its text in Python."""
        from daebench.compiler.print import python

        with self._recorded(form) as (functions, structure):
            try:
                return _head(functions[-1], structure), python.text(functions).encode()
            except python.Unprintable as error:
                raise self.missing() from error

    @contextmanager
    def _recorded(self, form: Any) -> Iterator[tuple[Sequence[Any], Any]]:
        """Record the function and those that it calls, while it is said that it takes time; what cannot be recorded is one sentence."""
        from daebench.compiler.trace.program import Program

        try:
            with compiling(self.title):
                program = Program(self._source)
                _, structure = program.entry(self._name, given(form))
                yield program.functions, structure
        except (TypeError, NameError, IndexError, ZeroDivisionError) as error:
            raise InvalidProblem(
                f"{self.title} cannot be compiled: {error}, in {_innermost(error) or self._name}.", "scheme-not-compilable"
            ) from error

    @property
    def title(self) -> str:
        """The first line of the module's docstring, without its full stop."""
        return str(self._module.__doc__ or "functions").partition("\n")[0].rstrip(".")

    def missing(self) -> NoMachineCode:
        """Return that the function cannot be had without machine code."""
        why = f", which cannot be made here ({no_machine_code()})" if no_machine_code() else ""
        return NoMachineCode(f"{self.title} needs machine code{why}.", "needs-machine-code")

    def _store(self, path: Path, purpose: str, content: bytes) -> None:
        if not self._cached:
            return
        try:
            sealed.write(path, purpose, content)
        except OSError as error:
            sealed.warn(f"cannot store machine code in {path.parent} ({error.strerror}); it is compiled again next time.")


def _head(function: Any, structure: Any, *, allocates: bool = False) -> dict[str, Any]:
    """Return the head of a function: the form of its results, as :class:`daebench.compiler.entry.Entry` reads it."""
    return {
        "name": function.name,
        "results": described(structure),
        "kinds": "".join(result.kind for result in function.results),
        "allocates": allocates,
    }


def _innermost(error: BaseException) -> str:
    """Return the function in which an error was raised, the last that was executed or followed; of files with file and line."""
    innermost = ""
    for frame, line in traceback.walk_tb(error.__traceback__):
        code, name = frame.f_code, frame.f_code.co_name
        if name == "inlined" and (node := getattr(frame.f_locals["self"], "node", None)):
            file, name, line = frame.f_locals["self"].space["__file__"], node.name, node.lineno
        elif name == "inlined":
            file, name = "<string>", frame.f_locals["self"].name
        else:
            file = code.co_filename
        if file.startswith(PREFIX) and name != "<module>":
            innermost = f"{name} of {file.removeprefix(PREFIX).replace('.', '/')}.py, line {line}"
        elif file == "<string>" and name != "<module>":
            innermost = f"its function {name}"
    return innermost


class Native:
    """A function of a generated module that Python calls: compiled for each form of its arguments. Parameters: see :class:`_Function`."""

    def __init__(self, module: ModuleType, source: str, name: str, *, cached: bool) -> None:
        self._function = _Function(module, source, name, cached=cached)
        self._made: dict[Any, Entry] = {}
        self._last: Entry | None = None

    def __call__(self, *args: Any) -> Any:
        """Return the result of the function."""
        entry, words = self._for(args)
        return entry(*words)

    def timed(self, args: tuple[Any, ...]) -> tuple[Any, float]:
        """Return the result of the function for these arguments, and the CPU time of the function alone."""
        entry, words = self._for(args)
        return entry.timed(*words)

    def columns(self, *args: Any) -> Any:
        """Return the results for columns in place of numbers, of a function that Python executes and that does the same with each row."""
        form = _form_of_columns(args)
        if form not in self._made:
            self._made[form] = self._function.entry(form)
        entry = self._made[form]
        assert isinstance(entry, OfPython)
        return entry.columns(args)

    def _for(self, args: tuple[Any, ...]) -> tuple[Entry, tuple[bytes, int]]:
        """Return the function for arguments of this form, and these in words with the bytes of their arrays."""
        # A run calls with arguments of one form: to try the last entry costs less than to find the form.
        entry = self._last
        if entry is None or (words := entry.words(args)) is None:
            form = form_of(args)
            if form not in self._made:
                self._made[form] = self._function.entry(form)
            entry = self._last = self._made[form]
            words = entry.words(args)
        assert words is not None
        return entry, words

    @property
    def kinds(self) -> dict[Any, str]:
        """Kinds of the numbers that it returns, by the forms of arguments that it was called with."""
        return {form: entry.kinds for form, entry in self._made.items()}


def _form_of_columns(x: Any) -> Any:
    return tuple(map(_form_of_columns, x)) if isinstance(x, tuple) else "z" if np.iscomplexobj(x) else "d"


class Callback:
    """A function of a generated module that C calls, compiled when its address is first asked for.

    One of its arguments is called ``user``: the address of the memory of callbacks, see :mod:`daebench.compiler.callbacks`.
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
