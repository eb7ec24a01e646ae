"""A code is measured in a process of its own: one that crashes, hangs or ends Python takes nothing else with it.

The process is told a task in a line of JSON, and answers in one. What the code prints goes to neither.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import IO, Any, Self

from daebench.errors import DaebenchError, RunFailed
from daebench.runs.json_values import plain
from daebench.runs.machine import cores
from daebench.runs.request import Told, silent
from daebench.studies.certificate.measure import NotSolved, Setting, default_setting, measure, posed
from daebench.studies.grid.schedulers import THREADS
from daebench.systems.files import package

SECONDS = 300.0
"""Wall-clock limit of a code on one problem, s, where none is given."""

ENDING_SECONDS = 5.0
"""How long a process that is asked to end may take: it may have started a program."""

LONGEST = 400
"""Most characters that a sentence quotes of what a process wrote last."""

PAUSE = 0.05
"""Seconds between two looks at processes."""

PROGRAM = "import sys; sys.path.append(sys.argv[1]); from daebench.studies.certificate.process import main; main()"
"""What the process runs: it looks for modules neither where the code is nor where it is asked from, and for daebench where it is here."""


def measured(tasks: Sequence[Mapping[str, Any]], folder: Path, seconds: float = SECONDS, progress: Told = silent) -> list[dict[str, Any]]:
    """Return the answers of :func:`answer` to tasks, each in a process of its own, as many at a time as there are cores."""
    answers: dict[int, dict[str, Any]] = {}
    waiting = list(enumerate(tasks))
    with ExitStack() as stack:
        running: dict[int, _Process] = {}
        while waiting or running:
            while waiting and len(running) < cores():
                k, task = waiting.pop(0)
                files = [stack.enter_context(tempfile.TemporaryFile()) for _ in range(3)]
                running[k] = stack.enter_context(_Process(task, folder, seconds, files))
                progress(len(answers) / len(tasks), f"{task['method']} on {task['problem']}")
            time.sleep(PAUSE)
            for k in [k for k, process in running.items() if process.is_over()]:
                answers[k] = running.pop(k).answer()
    return [answers[k] for k in range(len(tasks))]


class _Process:
    """A process that does one task; it ends with the block, whatever ends that."""

    def __init__(self, task: Mapping[str, Any], folder: Path, seconds: float, files: Sequence[IO[bytes]]) -> None:
        self._method, self._seconds, self._limit = str(task["method"]), seconds, time.monotonic() + seconds
        given, self._out, self._errors = files
        given.write(json.dumps(plain(task)).encode())
        given.seek(0)
        environment = {**os.environ, **dict.fromkeys(THREADS, "1")}
        settings: dict[str, Any] = {"cwd": folder, "env": environment, "start_new_session": hasattr(os, "killpg")}
        command = [sys.executable, "-P", "-c", PROGRAM, str(package.folder("daebench").parent.absolute())]
        self._process = subprocess.Popen(command, stdin=given, stdout=self._out, stderr=self._errors, **settings)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def is_over(self) -> bool:
        """Return whether the process has ended, or its time is over."""
        return self._process.poll() is not None or time.monotonic() > self._limit

    def _end(self) -> None:
        """End the process: it is interrupted, so that it can end what it has started, and then killed."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(ENDING_SECONDS)
        with contextlib.suppress(ProcessLookupError, PermissionError):
            if hasattr(os, "killpg"):
                os.killpg(self._process.pid, signal.SIGKILL)
            else:
                self._process.kill()
        self._process.wait()

    def answer(self) -> dict[str, Any]:
        """Return the answer that the process wrote, or why there is none; DaebenchError is raised where that is no fault of the code."""
        if self._process.poll() is None:
            self._end()
            return {
                "refused": f"the measurement of {self._method} took over {self._seconds:g} s; check whether it hangs, or allow more time.",
                "code": "measurement-too-long",
                "failed": True,
            }
        self._out.seek(0)
        try:
            result: dict[str, Any] = json.loads(self._out.read())
        except ValueError:
            return {
                "refused": f"{self._method} ends the process in which it runs, {self._ending()}.",
                "code": "measured-code-ends-process",
                "failed": True,
            }
        if fault := result.get("fault"):
            raise DaebenchError(f"{self._method} could not be measured: {fault}.", "certificate-not-measured")
        return result

    def _ending(self) -> str:
        """Return how a process ended, and the last line that it wrote."""
        status = self._process.returncode
        self._errors.seek(0)
        last = self._errors.read().decode(errors="replace").strip().rpartition("\n")[2][:LONGEST].rstrip(".")
        how = f"by signal {-status}" if status < 0 else f"with status {status}"
        return how + (f": {last}" if last else "")


def answer(task: Mapping[str, Any]) -> dict[str, Any]:
    """Return the measurements of a task: ``case``, ``parameters``, ``definition``, ``setting``, and the parts of a measurement."""
    try:
        ivp, method = posed(task)
        given = task["setting"]
        setting = Setting(**{**given, "counts": tuple(given["counts"])}) if given else default_setting(ivp, method, task["h"])
        result = measure(ivp, method, setting, guessed=task["guessed"])
    except DaebenchError as error:
        return {"refused": str(error), "code": error.code, "failed": isinstance(error, RunFailed | NotSolved)}
    about = {"case": ivp.case, "parameters": dict(ivp.parameters), "definition": ivp.facts.FINGERPRINT}
    parts = {name: value for name, value in vars(result).items() if name != "setting"}
    whole: dict[str, Any] = plain({**about, **parts, "setting": asdict(result.setting)})
    return whole


def main() -> None:
    """Read a task, and write the answer; what the code prints goes to standard error."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    task = json.loads(sys.stdin.buffer.read())
    with os.fdopen(os.dup(1), "w", encoding="ascii") as answers:
        os.dup2(2, 1)
        try:
            result = answer(task)
        except KeyboardInterrupt:
            sys.exit(130)
        except Exception as error:  # noqa: BLE001 - whatever it is, the other side has to be told
            result = {"fault": f"{type(error).__name__}: {' '.join(str(error).split())}"}
        json.dump(result, answers, allow_nan=False)
