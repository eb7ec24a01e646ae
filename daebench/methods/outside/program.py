"""A program in any language as a method: it reads one line of JSON, and writes the states and its own seconds."""

import contextlib
import json
import os
import queue
import subprocess
import tempfile
import threading
from collections.abc import Iterator, Sequence
from functools import partial
from typing import IO, Any, Self

import numpy as np

from daebench.errors import BadInput, Stopped, foreign
from daebench.methods.outside.callables import outputs
from daebench.methods.outside.ending import Limit, ending, kill, lifeline, tie
from daebench.methods.outside.method import OutsideMethod
from daebench.methods.outside.record import Block
from daebench.runs.grid import Grid
from daebench.runs.ivp import Ivp
from daebench.runs.json_values import strict
from daebench.runs.request import Request
from daebench.runs.trajectory import Array

BATCH = 4096
"""Largest number of rows of a block."""


def method_of_program(name: str, words: list[str], content: str) -> OutsideMethod:
    """Return a program as a method.

    It reads one line of JSON from standard input: ``problem``, ``case``, ``parameters`` (names to values, in the order of ``par``),
    ``h``, ``steps``, ``every`` (a state is written after this many steps, and after the last; 0: only after the last), and the start, ``p``
    and ``q`` or ``y``. It writes a line for each state, the numbers of p and then of q, or of y, with blanks or commas between them, or as
    lists of JSON, ``[1, 0]`` or ``[[1], [0]]``, and at the end ``{"seconds": 0.25}``, the time that its steps took. The first line may be
    the start, for programs that write it too: it is so where it has the same numbers and there is one line more than states.

    Parameters
    ----------
    name : str
        Name of the method.
    words : list of str
        The program and its arguments.
    content : str
        Digest of the program.
    """
    return OutsideMethod(name, partial(_blocks, words), content, every_step=False)


def _blocks(words: list[str], ivp: Ivp, grid: Grid, request: Request) -> Iterator[Block]:
    steps, limit = outputs(grid), Limit(request.seconds_limit)
    with tempfile.TemporaryFile("w+b") as errors, _Program(words, _question(ivp, grid), errors) as program:
        done = 0
        while done < len(steps):
            lines = program.lines(min(BATCH, len(steps) - done), limit)
            rows, fault = _states(lines, ivp.size)
            if not done and len(rows) and np.array_equal(rows[0], np.concatenate(ivp.start)):
                lines += program.rest(len(steps) - len(lines), limit)
                rows, fault = _states(lines, ivp.size)
                lines, rows = (lines, rows) if len(rows) == len(steps) else (lines[1:], rows[1:])
            done += len(rows)
            yield Block(steps[done - len(rows) : done], rows, 0.0)
            if fault:  # after the states before it, which are not to be lost
                raise BadInput(fault, "program-output-faulty")
            if len(rows) < len(lines) or not lines:
                raise Stopped(f"the program ended after {done} of {len(steps)} states{program.ending(ended=not lines)}")
        line = program.line(limit)
        yield Block(steps[:0], rows[:0], _seconds(line, program.ending(ended=line is None)))
        if (more := program.line(limit)) is not None:
            raise BadInput(
                f"{words[0]} writes {_quoted(more)} after its seconds; that line must be the last.", "program-writes-after-seconds"
            )


class _Program:
    """A program that runs, asked one question and read line by line beside the run, so that one that hangs can be left.

    Each pipe is used and closed by one thread alone.
    """

    def __init__(self, words: list[str], question: str, errors: IO[bytes]) -> None:
        self._errors = errors
        pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": errors}
        group = hasattr(os, "killpg")  # a group of its own, so that what it has started is ended with it
        pipes |= {"text": True, "encoding": "utf-8", "errors": "replace"}
        try:
            with lifeline() as (ends, self._held):
                self._process = subprocess.Popen(words, start_new_session=group, pass_fds=ends, **pipes)
                tie(self._process, ends)
        except OSError as error:
            self._let_go()
            raise BadInput(
                f"exec:{words[0]} cannot be started: {error.strerror}; check whether it may be executed.", "program-cannot-start"
            ) from None
        self._lines: queue.Queue[str | None] = queue.Queue(maxsize=BATCH)
        self._left, self._over = threading.Event(), False
        self._again: str | None = None
        self._threads = [
            threading.Thread(target=self._ask, args=(question,), daemon=True),
            threading.Thread(target=self._read, daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """End the program with all that it has started, and wait until its pipes are closed."""
        self._left.set()
        kill(self._process)
        self._let_go()
        for thread in self._threads:
            thread.join(PATIENCE)

    def _let_go(self) -> None:
        for held in self._held:
            os.close(held)

    def _ask(self, question: str) -> None:
        assert self._process.stdin is not None
        with contextlib.suppress(OSError), self._process.stdin as pipe:  # a program that does not read is judged by what it writes
            pipe.write(question + "\n")

    def _read(self) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as pipe:
            while not self._left.is_set() and (line := pipe.readline(LONGEST_LINE)):
                if line.strip():
                    self._put(line)
        self._put(None)

    def _put(self, line: str | None) -> None:
        while not self._left.is_set():
            with contextlib.suppress(queue.Full):
                self._lines.put(line, timeout=0.1)
                return

    def lines(self, most: int, limit: Limit) -> list[str]:
        """Return the lines that there are, at least one and at most so many; none at the end."""
        lines = list[str]()
        while (line := self.line(limit)) is not None:
            lines.append(line)
            if len(lines) == most or self._lines.empty():
                break
        return lines

    def rest(self, most: int, limit: Limit) -> list[str]:
        """Return so many lines, and one more where it is a state as well; fewer where the program ends or the time is over."""
        lines = list[str]()
        with contextlib.suppress(Stopped):
            while len(lines) <= most and (line := self.line(limit)) is not None:
                lines.append(line)
                if line.lstrip().startswith("{"):
                    self._again = lines.pop()
                    break
        return lines

    def line(self, limit: Limit) -> str | None:
        """Return the next line that is not empty, None at the end."""
        if self._again:
            again, self._again = self._again, None
            return again
        if self._over:
            return None
        try:
            line = self._lines.get(timeout=limit.left)
        except queue.Empty:
            raise Stopped(limit.over) from None
        self._over = line is None
        return line

    def ending(self, *, ended: bool) -> str:
        """Return how the program ended, where it has, and the last line that it wrote on standard error."""
        how = ""
        with contextlib.suppress(subprocess.TimeoutExpired):
            how = f": it {ending(self._process.wait(PATIENCE))}" if ended else ""
        self._errors.seek(0)
        last = foreign(self._errors.read().decode(errors="replace").strip().rpartition("\n")[2])
        return how + (f": {last}" if last else "")


BETWEEN = str.maketrans(",[]", "   ")
"""What may stand between numbers, as blanks."""

PATIENCE = 2.0
"""Seconds that a program which has closed its output, or has been ended, is waited for."""

LONGEST_LINE = 2**24
"""Most characters of a line."""


def _question(ivp: Ivp, grid: Grid) -> str:
    start = {name: vector.tolist() for name, vector in zip(ivp.state.vectors, ivp.start, strict=True)}
    about = {"problem": ivp.problem, "case": ivp.case, "parameters": dict(ivp.parameters)}
    return json.dumps(about | {"h": grid.h, "steps": grid.steps, "every": grid.every} | start)


def _states(lines: Sequence[str], size: int) -> tuple[Array, str]:
    """Return the states that lines have up to the first that is none, and why it is none; "" of one of JSON, which ends them."""
    rows, fault = list[list[float]](), ""
    for line in lines:
        if line.lstrip().startswith("{"):
            break
        try:
            numbers = [float(word) for word in line.translate(BETWEEN).split()]
        except ValueError:
            fault = f"the program writes {_quoted(line)}, which is not a state: a line must have {size} numbers."
            break
        if len(numbers) != size:
            fault = f"the program writes {len(numbers)} numbers in a line, {_quoted(line)}; a state has {size}."
            break
        rows.append(numbers)
    return np.array(rows, dtype=float).reshape(len(rows), size), fault


def _seconds(line: str | None, ending: str) -> float:
    """Return the seconds that a program says its steps took."""
    try:
        seconds = float(strict(line or "")["seconds"])
        if not 0.0 <= seconds < float("inf"):
            raise ValueError
    except (ValueError, KeyError, TypeError, RecursionError):
        what = _quoted(line) if line else f"nothing{ending}"
        raise BadInput(
            f'after its states the program writes {what}; it must write its seconds, for example {{"seconds": 0.25}}.',
            "program-seconds-malformed",
        ) from None
    return seconds


def _quoted(text: str) -> str:
    return repr(foreign(text))
