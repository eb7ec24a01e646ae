"""Processes in which code from outside runs: what ends there ends no run of anything else, and none outlives daebench.

A process runs the code at one place. It is asked one question at a time; when a run has ended, it waits for the next one.
"""

import atexit
import builtins
import contextlib
import os
import queue
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput, DaebenchError, RunFailed, Stopped
from daebench.methods.outside import frames
from daebench.methods.outside.ending import Limit, ending, kill, lifeline, tie
from daebench.runs.trajectory import Array
from daebench.systems.files import package

MOST_NUMBERS = 2**18
"""Numbers of a block of states at most: 2 MB, which stay in the cache of the processor."""

MOST_IDLE = 4
"""Processes that wait for a next run at most."""

GRACE = 2.0
"""Seconds that Python code is given to say where it was when its time was over, before its process is killed."""

PATIENCE = 2.0
"""Seconds that a process which has closed its pipe is waited for."""

PROGRAM = "import sys; sys.path.append(sys.argv[1]); from daebench.methods.outside.served import main; main()"
"""What a process runs: it looks for modules neither where the code is nor where it is asked from, until the code is loaded."""


ended: dict[str, str] = {}
"""How processes have ended that were asked something, by the name of the code."""

ENDED = "the process of the code "
"""Begins the clause that says how."""


def remember(code: str, failure: str) -> None:
    """Note that a run of a code failed because its process ended, if it did: in another process, or in a run that was stored."""
    _, clause, how = failure.partition(ENDED)
    if clause:
        ended.setdefault(code, clause + how.partition(" after ")[0].rstrip("."))


class Exited(Stopped):
    """The process of the code has ended; the text says how."""


@dataclass(frozen=True)
class Place:
    """Code at a place."""

    name: str
    """The place as it was given."""
    path: Path
    """Its file."""
    function: str
    """What is taken from the file."""
    content: str
    """Digest of the code."""
    folder: str
    """Folder from which it is called."""


class Process:
    """A process that runs the code at a place."""

    def __init__(self, place: Place) -> None:
        self.place, self.owner, self._busy = place, os.getpid(), False
        self._answers: queue.SimpleQueue[frames.Frame | None] = queue.SimpleQueue()
        self._held: list[int] = []
        with _memory_file() as file:
            self._numbers = np.memmap(file, np.float64, "r+")
            try:
                self._start()
                self.about, _ = self.ask(self._code(file), np.empty(0), Limit(None))
            except BaseException:
                self.end()
                raise

    def _code(self, memory: str) -> dict[str, Any]:
        """Return the first message to the process: where the code is."""
        place = self.place
        module = f"daebench_method_{place.path.stem}_{place.content[:16]}"
        about = {"name": place.name, "path": str(place.path.absolute()), "function": place.function, "module": module}
        return about | {"memory": memory, "sys_path": sys.path}

    def _start(self) -> None:
        command = [sys.executable, "-P", "-c", PROGRAM, str(package.folder("daebench").parent.absolute())]
        pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        with lifeline() as (ends, self._held):
            group = hasattr(os, "killpg")
            self._process = subprocess.Popen(command, start_new_session=group, pass_fds=ends, **pipes)
            tie(self._process, ends)
        assert self._process.stdout is not None
        threading.Thread(target=_read, args=(self._process.stdout, self._answers), daemon=True).start()

    @property
    def waits(self) -> bool:
        """Whether it can be asked by this process."""
        return self.owner == os.getpid() and not self._busy and self._process.poll() is None

    def ask(self, question: dict[str, Any], numbers: NDArray[Any], limit: Limit) -> frames.Frame:
        """Return the answer to a question.

        Stopped is raised where the time is over, and :class:`Exited` where the process ends; what the other side says it raises is raised
        here. Where there is no answer, the process is killed.
        """
        self._busy = True
        try:
            about = {"left": limit.left, "limited": limit.seconds is not None, "over": limit.over}
            frame = self._answered(question | about, numbers, limit)
        except BaseException:
            self.end()
            raise
        self._busy = False
        if "error" in frame[0] and "seconds" not in frame[0]:
            raise told(frame[0])
        return frame

    def _answered(self, question: dict[str, Any], numbers: NDArray[Any], limit: Limit) -> frames.Frame:
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):  # a process that has ended gives no answer
            frames.write(self._process.stdin, question, numbers)
        try:
            frame = self._answers.get(timeout=limit.left + (GRACE if self.place.path.suffix == ".py" else 0.0))
        except queue.Empty:
            raise Stopped(limit.over) from None
        if frame is None:
            ended[self.place.name] = how = f"{ENDED}{self._how_it_ended()}"
            raise Exited(how)
        return frame

    def _how_it_ended(self) -> str:
        try:
            return ending(self._process.wait(PATIENCE))
        except subprocess.TimeoutExpired:
            return "has closed its connection with daebench"

    def rows(self, question: dict[str, Any], numbers: Array, size: int, limit: Limit) -> tuple[Array, float, BaseException | None]:
        """Return the states of steps, the CPU time that they took, and what ended them early, to be raised when they are kept."""
        self._numbers[0] = 0.0  # no row, whatever happens before the first
        seconds = 0.0
        stopped: BaseException | None = None
        try:
            answer, _ = self.ask({**question, "do": "steps"}, numbers, limit)
            seconds, stopped = answer["seconds"], told(answer) if "error" in answer else None
        except (Stopped, BadInput, KeyboardInterrupt) as ended:
            stopped = ended
        count = int(self._numbers[:1].view(np.int64)[0])
        return np.array(self._numbers[1 : 1 + count * size]).reshape(count, size), seconds, stopped

    def end(self) -> None:
        """End the process with all that it has started."""
        self._busy = True
        if self.owner == os.getpid() and hasattr(self, "_process"):
            kill(self._process)
            for held in self._held:
                os.close(held)
            self._held = []
            assert self._process.stdin is not None
            with contextlib.suppress(OSError):
                self._process.stdin.close()


@contextlib.contextmanager
def _memory_file() -> Iterator[str]:
    """Yield a file of the memory that both processes share; the other one removes it as soon as it has it."""
    number, name = tempfile.mkstemp(prefix="daebench-")
    try:
        with os.fdopen(number, "wb") as file:
            file.write(bytes(8 * (1 + MOST_NUMBERS)))
        yield name
    finally:
        with contextlib.suppress(OSError):
            Path(name).unlink(missing_ok=True)


def _read(pipe: IO[bytes], answers: "queue.SimpleQueue[frames.Frame | None]") -> None:
    with pipe:
        while (frame := frames.read(pipe)) is not None:
            answers.put(frame)
    answers.put(None)


KNOWN: dict[str, type[Exception]] = {"Stopped": Stopped, "BadInput": BadInput, "RunFailed": RunFailed}
"""Exceptions that are told with their whole text."""


def told(answer: dict[str, Any]) -> Exception:
    """Return the exception that the other side says it has raised, of the same type where it is one of daebench or of Python."""
    kind = KNOWN.get(answer["error"]) or getattr(builtins, answer["error"], None)
    if isinstance(kind, type) and issubclass(kind, Exception) and not issubclass(kind, UnicodeError):
        return kind(answer["text"], *([answer["code"]] if issubclass(kind, DaebenchError) else []))
    return RuntimeError(f"{answer['error']}: {answer['text']}")


_idle: list[Process] = []
_lock = threading.Lock()


def borrowed(place: Place) -> Process:
    """Return a process that runs the code at a place, one that waits or a new one; it is to be given back."""
    with _lock:
        for process in reversed(_idle):
            if process.place == place and process.owner == os.getpid():
                _idle.remove(process)
                if process.waits:
                    return process
                process.end()
                break
    return Process(place)


def give_back(process: Process) -> None:
    """Let a process wait for the next run; one that cannot is ended, as are those that have waited longest where there are too many."""
    with _lock:
        if process.waits:
            _idle.append(process)
        too_many = _idle[:-MOST_IDLE]
        del _idle[:-MOST_IDLE]
    for other in too_many if process.waits else [process, *too_many]:
        other.end()


@contextlib.contextmanager
def lent(place: Place) -> Iterator[Process]:
    """Yield a process that runs the code at a place."""
    process = borrowed(place)
    try:
        yield process
    finally:
        give_back(process)


@atexit.register
def end_all() -> None:
    """End all processes that wait."""
    while _idle:
        _idle.pop().end()
