"""Methods from outside by their texts: ``./mine.py:step``, ``./libmine.so:step``, ``exec:./program``. Their code is executed.

That of a file or a library runs in a process of its own.
"""

import re
import shlex
import shutil
import time
import weakref
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from daebench.errors import BadInput, Stopped
from daebench.methods.fixed_step import stepping
from daebench.methods.outside import callables
from daebench.methods.outside.call import Stated
from daebench.methods.outside.callables import Taken, in_blocks, outputs, require_step_size, takes_one_step
from daebench.methods.outside.ending import Limit
from daebench.methods.outside.method import OutsideMethod
from daebench.methods.outside.process import MOST_NUMBERS, Exited, Place, Process, borrowed, give_back, lent
from daebench.methods.outside.program import method_of_program
from daebench.methods.outside.record import Block
from daebench.runs.grid import Grid
from daebench.runs.ivp import Ivp
from daebench.runs.request import Request
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
        raise BadInput(
            "a list is a program and its arguments; give at least one word, all of them texts, as ['./program', '--fast'].",
            "program-list-malformed",
        )
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
        raise BadInput(
            f"{name}: {function!r} is not a name; give the name of a function in {path.name}, for example {place['path']}:step.",
            "function-name-malformed",
        )
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
        raise BadInput(f"{name}: {error}; give a program and its arguments as in a shell.", "exec-words-malformed") from None
    if not words:
        raise BadInput(f"{name} names no program; give its path, for example exec:./program.", "exec-names-no-program")
    program = shutil.which(words[0])
    if program is None:
        raise BadInput(f"{name}: there is no such executable program; give its path, for example exec:./program.", "exec-no-such-program")
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


def method_at(place: Place) -> OutsideMethod:
    """Return the code at a place as a method.

    It is a callable of a Python file, see :func:`daebench.methods.outside.callables.method_of_callable`, or a function of a compiled
    library, ``int step(const double *par, double *p, double *q, double h)``, or with y for p and q, that updates p and q in place and
    returns 0; another status stops the run. A file that ends its process when it is loaded is a method all of whose runs fail.

    Raises
    ------
    BadInput
        If the file cannot be loaded, or has nothing of this name that can be called.
    """
    try:
        with lent(place) as process:
            about = process.about
    except Stopped as stopped:
        why = f"{stopped} while the file was loaded" if isinstance(stopped, Exited) else str(stopped)
        return OutsideMethod(place.name, partial(_never, why), place.content)
    if not about.get("taken"):
        return OutsideMethod(place.name, partial(_of_library, place), place.content)
    taken, remembers, claims = about["taken"], about["remembers"], Stated(**about["claims"])
    step = partial(RemoteStep, place) if taken < 4 else None
    blocks = partial(_of_file, place, taken)
    knob = about["knob"]
    return OutsideMethod(place.name, blocks, place.content, every_step=taken < 4, remembers=remembers, step=step, claims=claims, knob=knob)


def _never(why: str, ivp: Ivp, grid: Grid, request: Request) -> Iterator[Block]:
    """Take no step, because the code ends its process when it is loaded."""
    raise Stopped(why)


def _of_file(place: Place, taken: int, ivp: Ivp, grid: Grid, request: Request) -> Iterator[Block]:
    steps_alone = takes_one_step(place.name, taken, ivp)
    with lent(place) as process:
        limit = Limit(request.seconds_limit)
        process.ask({"do": "fresh"}, np.empty(0), limit)
        if steps_alone:
            require_step_size(place.name, grid)
            yield from _steps(process, ivp, grid, limit)
            return
        steps = outputs(grid)
        given = np.concatenate([*ivp.start, grid.times(steps)])
        about = {"do": "whole", "vectors": len(ivp.start), "h": request.value, "size": ivp.size}
        answer, numbers = process.ask(about, given, limit)
        yield Block(steps, numbers.reshape(len(steps), ivp.size), answer["seconds"])


def _steps(process: Process, ivp: Ivp, grid: Grid, limit: Limit) -> Iterator[Block]:
    """Take all steps, in blocks of about a fifth of a second."""
    state, room = np.concatenate(ivp.start), max(1, MOST_NUMBERS // ivp.size)

    def take(left: int) -> Taken:
        nonlocal state
        question = {"vectors": len(ivp.start), "h": grid.h, "most": min(left, room), "chunk": callables.CHUNK_SECONDS}
        rows, seconds, stopped = process.rows(question, state, ivp.size, limit)
        state = rows[-1] if len(rows) else state
        return rows, seconds, stopped

    return in_blocks(take, grid)


def _of_library(place: Place, ivp: Ivp, grid: Grid, request: Request) -> Iterator[Block]:
    with lent(place) as process:
        about = {"do": "begin", "vectors": len(ivp.start), "size": ivp.size}
        process.ask(about, np.concatenate([*ivp.start, ivp.par]), Limit(None))
        piece, limit = 1, Limit(request.seconds_limit)

        def take(left: int) -> Taken:
            nonlocal piece
            most, began = min(piece, left, max(1, MOST_NUMBERS // ivp.size)), time.perf_counter()
            taken = process.rows({"h": grid.h, "most": most}, np.empty(0), ivp.size, limit)
            piece = stepping.next_piece(most, time.perf_counter() - began)
            return taken

        yield from in_blocks(take, grid)


class RemoteStep:
    """One step as a map, of a callable without a memory yet: of real vectors checked as in a run, of complex ones as the code has it."""

    def __init__(self, place: Place) -> None:
        self._process = borrowed(place)
        weakref.finalize(self, give_back, self._process)
        self._process.ask({"do": "fresh"}, np.empty(0), Limit(None))

    def __call__(self, *arguments: Any) -> Any:
        """Return the vectors after a step, given those before it and h."""
        *state, h = arguments
        about = {"do": "step", "vectors": len(state), "h": float(h)}
        _, numbers = self._process.ask(about, np.concatenate(state), Limit(None))
        after = np.split(numbers, len(state))
        return after if len(after) > 1 else after[0]
