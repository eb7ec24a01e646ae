"""A program in any language as a method: it reads one line of JSON, and writes the states and its own seconds."""

import contextlib
import json
import queue
import subprocess
import tempfile
import threading
import time
from collections.abc import Iterator
from functools import partial
from typing import IO, Any

import numpy as np

from daebench.errors import BadInput
from daebench.methods.outside.callables import outputs
from daebench.methods.outside.method import Block, OutsideMethod, Stopped
from daebench.runs.grid import Grid
from daebench.runs.ivp import ConstrainedIvp, Ivp
from daebench.runs.request import Request

SECONDS_LIMIT = 600.0
"""Wall-clock limit, s, where none is given."""

BATCH = 4096
"""Most rows of a block."""

LONGEST = 400
"""Most characters of a line that a sentence quotes."""


def method_of_program(name: str, words: list[str], content: str) -> OutsideMethod:
    """Return a program as a method.

    It reads one line of JSON from standard input: ``problem``, ``case``, ``parameters`` (names to values, in the order of ``par``),
    ``h``, ``steps``, ``every`` (a state is written after so many steps, and after the last; 0: after the last alone), and the start, ``p``
    and ``q`` or ``y``. It writes a line for each state, the numbers of p and then of q, or of y, with blanks or commas between them, and
    at the end ``{"seconds": 0.25}``, the time that its steps took.

    Parameters
    ----------
    name : str
        What the method is called.
    words : list of str
        The program and its arguments.
    content : str
        Digest of the program.
    """
    return OutsideMethod(name, partial(_blocks, words), content, every_step=False)


def _blocks(words: list[str], ivp: Ivp, grid: Grid, request: Request) -> Iterator[Block]:
    steps = outputs(grid)
    limit = time.monotonic() + (request.seconds_limit or SECONDS_LIMIT)
    with tempfile.TemporaryFile("w+b") as said, _started(words, said) as process:
        lines = _Lines(process, _question(ivp, grid))
        done, rows = 0, list[list[float]]()
        while done + len(rows) < len(steps):
            line = lines.next(limit)
            if line is None or line.lstrip().startswith("{"):
                yield _block(steps, done, rows)
                raise Stopped(f"the program ended after {done + len(rows)} of {len(steps)} states{_ending(process, said, line)}")
            rows.append(_numbers(line, ivp.size))
            if len(rows) == BATCH:
                yield _block(steps, done, rows)
                done, rows = done + len(rows), []
        yield _block(steps, done, rows, _seconds(lines.next(limit), process, said))
        if (more := lines.next(limit)) is not None:
            raise BadInput(f"{words[0]} writes {_quoted(more)} after its seconds; that line must be the last.")


@contextlib.contextmanager
def _started(words: list[str], said: IO[bytes]) -> Iterator["subprocess.Popen[str]"]:
    """Start the program, and end it whatever happens."""
    try:
        process = subprocess.Popen(
            words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=said, text=True, encoding="utf-8", errors="replace"
        )
    except OSError as error:
        raise BadInput(f"exec:{words[0]} cannot be started: {error.strerror}; see whether it may be executed.") from None
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout):
            with contextlib.suppress(OSError):
                stream and stream.close()


class _Lines:
    """Lines of a program, read beside the run so that one that hangs can be left."""

    def __init__(self, process: "subprocess.Popen[str]", question: str) -> None:
        self._lines: queue.Queue[str | None] = queue.Queue(maxsize=BATCH)
        self._over = False
        threading.Thread(target=self._ask, args=(process, question), daemon=True).start()
        threading.Thread(target=self._read, args=(process,), daemon=True).start()

    @staticmethod
    def _ask(process: "subprocess.Popen[str]", question: str) -> None:
        assert process.stdin is not None
        with contextlib.suppress(OSError, ValueError):  # a program that does not read is judged by what it writes
            process.stdin.write(question + "\n")
            process.stdin.close()

    def _read(self, process: "subprocess.Popen[str]") -> None:
        assert process.stdout is not None
        with contextlib.suppress(OSError, ValueError):  # it is closed where the run has been left
            while line := process.stdout.readline(LONGEST_LINE):
                if line.strip():
                    self._lines.put(line)
        self._lines.put(None)

    def next(self, limit: float) -> str | None:
        """Return the next line that is not empty, None at the end."""
        if self._over:
            return None
        try:
            line = self._lines.get(timeout=max(0.0, limit - time.monotonic()))
        except queue.Empty:
            raise Stopped("the program has not written its states within the limit of time; allow more, or see whether it hangs") from None
        self._over = line is None
        return line


LONGEST_LINE = 2**24
"""Most characters of a line."""


def _question(ivp: Ivp, grid: Grid) -> str:
    names = ("p", "q") if isinstance(ivp, ConstrainedIvp) else ("y",)
    start = {name: vector.tolist() for name, vector in zip(names, ivp.start, strict=True)}
    about = {"problem": ivp.problem, "case": ivp.case, "parameters": dict(ivp.parameters)}
    return json.dumps(about | {"h": grid.h, "steps": grid.steps, "every": grid.every} | start)


def _numbers(line: str, size: int) -> list[float]:
    """Return the numbers of a state; raise :class:`BadInput` where the line has none, or not so many."""
    try:
        numbers = [float(word) for word in line.replace(",", " ").split()]
    except ValueError:
        raise BadInput(f"the program writes {_quoted(line)}, which is no state: {size} numbers are to be in a line.") from None
    if len(numbers) != size:
        raise BadInput(f"the program writes {len(numbers)} numbers in a line, {_quoted(line)}; a state has {size}.")
    return numbers


def _block(steps: Any, done: int, rows: list[list[float]], seconds: float = 0.0) -> Block:
    size = len(rows[0]) if rows else 0
    return Block(steps[done : done + len(rows)], np.array(rows, dtype=float).reshape(len(rows), size), seconds)


def _seconds(line: str | None, process: "subprocess.Popen[str]", said: IO[bytes]) -> float:
    """Return the seconds that a program says its steps took."""
    try:
        seconds = float(json.loads(line or "")["seconds"])
        if not 0.0 <= seconds < float("inf"):
            raise ValueError
    except (ValueError, KeyError, TypeError):
        what = _quoted(line) if line else f"nothing{_ending(process, said, line)}"
        raise BadInput(f'after its states the program writes {what}; it must write its seconds, as {{"seconds": 0.25}}.') from None
    return seconds


def _ending(process: "subprocess.Popen[str]", said: IO[bytes], line: str | None) -> str:
    """Return how a program ended, and the last line that it wrote on standard error."""
    try:
        status = process.wait(1.0) if line is None else 0
    except subprocess.TimeoutExpired:
        status = 0
    said.seek(0)
    last = said.read().decode(errors="replace").strip().rpartition("\n")[2]
    return (f", with status {status}" if status else "") + (f": {last[:LONGEST]}" if last else "")


def _quoted(text: str) -> str:
    text = text.strip()
    return repr(text[:LONGEST]) + ("..." if len(text) > LONGEST else "")
