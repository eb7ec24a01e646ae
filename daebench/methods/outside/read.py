"""Methods from outside by their texts: ``./mine.py:step``, ``./libmine.so:step``, ``exec:./program``. Their code is executed."""

import re
import shlex
import shutil
from collections.abc import Sequence
from pathlib import Path

from daebench.errors import BadInput
from daebench.methods.outside.method import OutsideMethod
from daebench.methods.outside.place import method_at
from daebench.methods.outside.process import Place
from daebench.methods.outside.program import method_of_program
from daebench.systems.files import execute
from daebench.systems.files.imports import imported
from daebench.systems.files.package import digest_of_files

PROGRAM = "exec:"
"""What comes before a program."""

FILE = re.compile(r"(?P<path>.+\.(?P<ending>py|so|dylib|dll)):(?P<name>[^:/\\]*)", re.DOTALL)
"""A file, and what is taken from it."""


def program_of(words: Sequence[str]) -> str:
    """Return the name of a program with its arguments, given as a list of words, the first with ``exec:`` or without."""
    if not words or not all(isinstance(word, str) for word in words):
        raise BadInput("a list is a program and its arguments; give at least one word, all of them texts, as ['./program', '--fast'].")
    return PROGRAM + shlex.join([words[0].removeprefix(PROGRAM), *words[1:]])


def is_outside(name: str) -> bool:
    """Return whether the name of a method is the place of code from outside."""
    return name.startswith(PROGRAM) or FILE.fullmatch(name) is not None


def method_from(name: str) -> OutsideMethod:
    """Return the method at a place."""
    execute.require_allowed(name)
    if name.startswith(PROGRAM):
        return _program(name)
    place = FILE.fullmatch(name)
    assert place is not None
    path, function = execute.existing(place["path"], "method", "daebench list methods"), place["name"]
    if not function.isidentifier():
        raise BadInput(f"{name}: {function!r} is not a name; give the name of a function in {path.name}, for example {place['path']}:step.")
    files = [path, *imported(path)] if place["ending"] == "py" else [path]
    return method_at(Place(name, path, function, _content(files), str(Path.cwd())))


def _program(name: str) -> OutsideMethod:
    program, words = command(name)
    return method_of_program(name, [program, *words[1:]], _content(_files(program, words)))


def command(name: str) -> tuple[str, list[str]]:
    """Return the path of a program, and the words that name it and its arguments; raise BadInput where there is none."""
    try:
        words = shlex.split(name.removeprefix(PROGRAM))
    except ValueError as error:
        raise BadInput(f"{name}: {error}; give a program and its arguments as in a shell.") from None
    if not words:
        raise BadInput(f"{name} names no program; give its path, for example exec:./program.")
    program = shutil.which(words[0])
    if program is None:
        raise BadInput(f"{name}: there is no such executable program; give its path, for example exec:./program.")
    return program, words


def _files(program: str, words: Sequence[str]) -> list[Path]:
    """Return the files among a program and its arguments."""
    return [Path(program), *(path for path in map(Path, words[1:]) if path.is_file())]


def content_of(name: str) -> str:
    """Return the digest of the code at a place, as :func:`method_from` has it; its files are read, and nothing is executed."""
    if name.startswith(PROGRAM):
        return _content(_files(*command(name)))
    place = FILE.fullmatch(name)
    assert place is not None
    path = execute.existing(place["path"], "method", "daebench list methods")
    return _content([path, *imported(path)] if place["ending"] == "py" else [path])


def _content(files: Sequence[Path]) -> str:
    """Return the digest of files, which do not count by the folder that they are in."""
    return digest_of_files((file.name, file.read_bytes()) for file in files)
