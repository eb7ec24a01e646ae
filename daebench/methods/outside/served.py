"""The process in which code from outside runs: it is asked on standard input, and answers on what was standard output.

Whatever the code prints goes to standard error. It imports little, because it is started often.
"""

import ctypes
import mmap
import os
import queue
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput, DaebenchError, RunFailed, Stopped, foreign, in_words
from daebench.methods.outside import frames
from daebench.methods.outside.call import Code, described, fresh, stepped
from daebench.methods.outside.compiled_loop import loop
from daebench.methods.outside.ending import Limit
from daebench.systems.files import execute
from daebench.systems.files.imports import importable, imported

if sys.platform == "linux":
    import resource

Array = NDArray[np.float64]
Question = dict[str, Any]
Answer = tuple[dict[str, Any], "NDArray[Any] | None"]

COUNT = 1
"""Numbers before the rows in the memory that both processes share: how many rows there are, a whole number."""

GUARD = 512
"""Numbers before and after each vector that a library is given, which are not its own."""

UNTOUCHED = -7.25e77
"""What they are."""

OWN_NAMES_FIRST = getattr(os, "RTLD_DEEPBIND", 0)
"""A library's functions call each other by their names, and not what else has that name: glibc has a function ``step``."""


def main() -> None:
    """Answer questions until daebench ends."""
    questions, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    _bound_memory()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    asked: queue.SimpleQueue[frames.Frame] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(questions, asked), daemon=True).start()
    served, process = None, os.getpid()
    while True:
        question, numbers = asked.get()
        try:
            if served is None:
                served = _begun(question)
                answer: Answer = served.about, None
            else:
                answer = getattr(served, question["do"])(question, numbers)
        except Exception as error:  # noqa: BLE001 - the other side is told, and raises it
            answer = _told(error), None
        except BaseException as error:  # noqa: BLE001 - code from outside can raise any
            answer = _told(Stopped(f"the code raises {in_words(error)}")), None
        if os.getpid() != process:  # a process that the code has started by a fork
            os._exit(0)
        frames.write(answers, *answer)


def _bound_memory() -> None:
    """Let the code have as much memory as the machine has: more is refused to it, where otherwise the system would end what it likes."""
    if sys.platform == "linux":
        _, most = resource.getrlimit(resource.RLIMIT_DATA)
        there = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        resource.setrlimit(resource.RLIMIT_DATA, (there if most < 0 else min(there, most), most))


def _listen(questions: IO[bytes], asked: "queue.SimpleQueue[frames.Frame]") -> None:
    """Pass questions on; where no more can come, daebench has ended, and this process with all that it has started ends with it."""
    while (frame := frames.read(questions)) is not None:
        asked.put(frame)
    if hasattr(os, "killpg") and os.getpgrp() == os.getpid():
        os.killpg(0, signal.SIGKILL)
    os._exit(1)


def _told(error: BaseException) -> dict[str, Any]:
    """Return an exception as it is told to the other side."""
    known = isinstance(error, Stopped | BadInput | RunFailed)
    code = error.code if isinstance(error, DaebenchError) else ""
    return {"error": type(error).__name__, "text": str(error) if known else foreign(str(error)), "code": code}


def _begun(question: Question) -> "_Python | _Library":
    path = Path(question["memory"])
    with path.open("r+b") as file:
        memory = mmap.mmap(file.fileno(), 0)
    with suppress(OSError):  # on Windows it is removed at the end
        path.unlink()
    sys.path[:] = question["sys_path"]
    return (_Python if question["path"].endswith(".py") else _Library)(question, memory)


class _Shared:
    """The memory that both processes share: rows of numbers, which outlive this one."""

    def __init__(self, memory: mmap.mmap) -> None:
        self._count, self._numbers = np.frombuffer(memory, np.int64, COUNT), np.frombuffer(memory, np.float64)[COUNT:]
        self.at_count = self._count.ctypes.data
        self.at_rows = self._numbers.ctypes.data

    def clear(self) -> None:
        """Begin anew, with no row."""
        self._kept = self._count[0] = 0

    def keep(self, row: Array) -> None:
        """Store a row after those that there are."""
        self._numbers[self._kept * len(row) : (self._kept + 1) * len(row)] = row
        self._kept += 1
        self._count[0] = self._kept


class _Python:
    """A callable of a Python file."""

    def __init__(self, question: Question, memory: mmap.mmap) -> None:
        self._name, self._shared = question["name"], _Shared(memory)
        self._path = Path(question["path"])
        self._callable = self._taken(question["function"], question["module"])
        about = described(self._callable, self._name)
        self._fresh = fresh(self._callable, about.remembers)
        self.about = {"remembers": about.remembers, "taken": about.taken, "claims": dict(about.claims), "knob": about.knob}
        self._code: Code | None = None

    def _naming(self, wrong: type[BadInput] | type[RunFailed]) -> Any:
        return execute.naming(self._name, self._path, lambda: [self._path, *imported(self._path)], wrong)

    def _taken(self, function: str, name: str) -> Any:
        """Return the object of this name in the file; Stopped is raised where it ends Python instead."""
        try:
            with importable(self._path.parent), self._naming(BadInput):
                module = execute.executed(self._path, name)
        except BadInput as error:
            if isinstance(error.__cause__, SystemExit):
                raise Stopped(str(error)) from error
            raise
        if not hasattr(module, function):
            has = [key for key, value in vars(module).items() if callable(value) and getattr(value, "__module__", "") == name]
            raise BadInput(
                f"{self._name}: {self._path.name} has no {function}; it has {', '.join(has) or 'no function'}.", "file-lacks-function"
            )
        return getattr(module, function)

    def fresh(self, question: Question, _: Array) -> Answer:
        """Have a callable that remembers nothing yet."""
        self._code = Code(self._name, self._fresh, partial(self._naming, RunFailed), _limit(question), cpu=True)
        return {}, None

    def _begun(self, question: Question) -> Code:
        assert self._code is not None
        self._code.limit = _limit(question)
        return self._code

    def steps(self, question: Question, numbers: Array) -> Answer:
        """Take steps from a state, whose rows go into the shared memory."""
        code = self._begun(question)
        self._shared.clear()
        state, most, seconds = np.split(numbers, question["vectors"]), question["most"], question["chunk"]
        _, took, stopped = stepped(code, state, question["h"], most, seconds, self._shared.keep)
        if isinstance(stopped, KeyboardInterrupt):
            stopped = Stopped(f"the code raises {in_words(stopped)}")
        return {"seconds": took} | (_told(stopped) if stopped is not None else {}), None

    def whole(self, question: Question, numbers: Array) -> Answer:
        """Return the states of a whole run."""
        code = self._begun(question)
        start, t = numbers[: question["size"]], numbers[question["size"] :]
        with code.limited():
            states, seconds = code.solve(np.split(start, question["vectors"]), question["h"], t)
        return {"seconds": seconds}, np.concatenate(states, axis=1)

    def step(self, question: Question, numbers: NDArray[Any]) -> Answer:
        """Return the state after one step from real vectors, or complex ones."""
        code = self._begun(question)
        state = np.split(numbers, question["vectors"])
        with code.limited():
            if not np.iscomplexobj(numbers):
                return {}, np.concatenate(code.step(state, question["h"])[0])
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", np.exceptions.ComplexWarning)  # what is dropped is seen by its effect
                result = code.of_complex(state, question["h"])
        parts = [np.asarray(part) for part in (result if question["vectors"] > 1 else [result])]
        if [part.shape for part in parts] != [vector.shape for vector in state]:
            raise TypeError(f"it returns {foreign(type(result).__name__)}")
        return {}, np.concatenate(parts)


def _limit(question: Question) -> Limit:
    """Return the rest of the limit of the other side."""
    seconds: float = question["left"]
    return Limit(seconds if question["limited"] else None, seconds, question["over"])


class _Library:
    """A function of a compiled library."""

    about: dict[str, Any] = {}  # noqa: RUF012 - nothing is known of it

    def __init__(self, question: Question, memory: mmap.mmap) -> None:
        name, path, function = question["name"], question["path"], question["function"]
        self._name, self._shared = name, _Shared(memory)
        try:
            library = ctypes.CDLL(path, mode=OWN_NAMES_FIRST)
        except OSError as error:
            raise BadInput(
                f"{name}: {Path(path).name} cannot be loaded as a library: {foreign(str(error))}.", "library-not-loadable"
            ) from None
        try:
            self._address = ctypes.cast(getattr(library, function), ctypes.c_void_p)
        except AttributeError:
            raise BadInput(
                f'{name}: {Path(path).name} has no function {function}; declare a function of C++ as extern "C".', "library-lacks-function"
            ) from None
        self._flush: Callable[[Any], int] = getattr(ctypes.CDLL(None), "fflush", int) if os.name == "posix" else int

    def begin(self, question: Question, numbers: Array) -> Answer:
        """Have a state, and parameters; the loop is compiled before the clock runs."""
        vectors = question["vectors"]
        state, self._par = np.split(numbers[: question["size"]], vectors), numbers[question["size"] :].copy()
        length = len(state[0])
        self._memory = np.full(vectors * (length + GUARD) + GUARD, UNTOUCHED)
        starts = [GUARD + k * (length + GUARD) for k in range(vectors)]
        for start, vector in zip(starts, state, strict=True):
            self._memory[start : start + length] = vector
        self._guards = np.ones(len(self._memory), bool)
        for start in starts:
            self._guards[start : start + length] = False
        places = [self._memory[start:].ctypes.data for start in starts]
        self._run = partial(loop(vectors), self._address, self._par.ctypes.data, *places, length)
        return {}, None

    def steps(self, question: Question, _: Array) -> Answer:
        """Take so many steps, whose rows go into the shared memory."""
        self._shared.clear()
        began = time.process_time()
        status = self._run(question["h"], self._shared.at_rows, question["most"], self._shared.at_count)
        seconds = time.process_time() - began
        self._flush(None)
        if not np.all(self._memory[self._guards] == UNTOUCHED):
            raise BadInput(
                f"{self._name}: the function of the library writes outside of the vectors that it is given; check its lengths.",
                "library-writes-outside",
            )
        stopped = Stopped(f"the function of the library returned {status} instead of 0") if status else None
        return {"seconds": seconds} | (_told(stopped) if stopped else {}), None
