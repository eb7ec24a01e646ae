"""Methods from outside by their texts: ``./mine.py:step``, ``./libmine.so:step``, ``exec:./program``. Their code is executed."""

import hashlib
import re
import shlex
import shutil
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import Any

from daebench.errors import BadInput, RunFailed
from daebench.methods.outside.callables import method_of_callable
from daebench.methods.outside.library import method_of_library
from daebench.methods.outside.method import OutsideMethod
from daebench.methods.outside.program import method_of_program
from daebench.systems.files import execute
from daebench.systems.files.imports import importable, imported

PROGRAM = "exec:"
"""What comes before a program."""

FILE = re.compile(r"(?P<path>.+\.(?P<ending>py|so|dylib|dll)):(?P<name>[^:/\\]*)", re.DOTALL)
"""A file, and what is taken from it."""


def is_outside(name: str) -> bool:
    """Return whether the name of a method is the place of code from outside."""
    return name.startswith(PROGRAM) or FILE.fullmatch(name) is not None


def method_from(name: str) -> OutsideMethod:
    """Return the method that is at a place.

    Parameters
    ----------
    name : str
        ``FILE.py:NAME``, see :func:`daebench.methods.outside.callables.method_of_callable`; ``LIBRARY:NAME``, see
        :func:`daebench.methods.outside.library.method_of_library`; or ``exec:PROGRAM [ARGUMENTS]``, see
        :func:`daebench.methods.outside.program.method_of_program`.

    Raises
    ------
    BadInput
        If there is no such file, or it has nothing of this name that is a method.
    """
    if name.startswith(PROGRAM):
        return _program(name)
    found = FILE.fullmatch(name)
    assert found is not None
    path = execute.existing(found["path"], "method", "daebench list methods")
    if not found["name"].isidentifier():
        raise BadInput(f"{name}: {found['name']!r} is no name; give the name of a function in {path.name}, as {found['path']}:step.")
    if found["ending"] != "py":
        return method_of_library(name, path, found["name"], _digest(path))
    return _python(name, path, found["name"])


def _python(name: str, path: Path, wanted: str) -> OutsideMethod:
    files = [path, *imported(path)]
    content = _digest(*files)

    def naming(wrong: type[Exception]) -> AbstractContextManager[None]:
        return execute.naming(name, path, lambda: files, wrong)  # type: ignore[arg-type]

    with importable(path.parent), naming(BadInput):
        module = execute.executed(path, f"daebench_method_{path.stem}_{content[:16]}")
    if not hasattr(module, wanted):
        there = [each for each, value in vars(module).items() if callable(value) and getattr(value, "__module__", "") == module.__name__]
        raise BadInput(f"{name}: {path.name} has no {wanted}; it has {', '.join(there) or 'no function'}.")
    code: Any = getattr(module, wanted)
    return method_of_callable(code, name, content, partial(naming, RunFailed))


def _program(name: str) -> OutsideMethod:
    try:
        words = shlex.split(name.removeprefix(PROGRAM))
    except ValueError as error:
        raise BadInput(f"{name}: {error}; give a program and its arguments as a shell takes them.") from None
    program = shutil.which(words[0]) if words else None
    if program is None:
        raise BadInput(f"{name}: there is no such program that may be executed; give its path, as exec:./program.")
    files = [Path(program), *(path for path in map(Path, words[1:]) if path.is_file())]
    return method_of_program(name, [program, *words[1:]], _digest(*files))


def _digest(*files: Path) -> str:
    """Return the digest of the texts of files, in this order."""
    whole = hashlib.sha256()
    for file in files:
        whole.update(hashlib.sha256(file.read_bytes()).digest())
    return whole.hexdigest()
