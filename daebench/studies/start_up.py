"""Time to begin: seconds from a fresh process to the first step, on an empty cache and on a full one, beside NumPy alone."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from daebench.errors import DaebenchError

FIRST_STEP = """
import time
began = time.perf_counter()
import daebench
daebench.run({problem!r}, case={case!r}, method={method!r}, h={h!r}, steps=1, every=0, watch=(), count=False{more}).complete()
print(time.perf_counter() - began)
"""
NUMPY_ALONE = """
import time
began = time.perf_counter()
import numpy
print(time.perf_counter() - began)
"""


def first_step(problem: str, case: str, method: str, h: float, *, repeat: int, **more: Any) -> tuple[float, float]:
    """Return wall-clock seconds from a fresh process to the end of its first step: on an empty cache, and the best on a full one.

    ``more`` is passed to :func:`daebench.run`; DaebenchError is raised if that fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        given = "".join(f", {name}={value!r}" for name, value in more.items())
        script = _script(folder, FIRST_STEP.format(problem=problem, case=case, method=method, h=h, more=given))
        cold = _seconds(script, folder)
        return cold, min(_seconds(script, folder) for _ in range(repeat))


def numpy_alone(*, repeat: int) -> float:
    """Return the best wall-clock seconds that a fresh process takes to load NumPy."""
    with tempfile.TemporaryDirectory() as folder:
        script = _script(folder, NUMPY_ALONE)
        _seconds(script, folder)
        return min(_seconds(script, folder) for _ in range(repeat))


def _script(folder: str, text: str) -> Path:
    path = Path(folder) / "first_step.py"
    path.write_text(text, encoding="utf-8")
    return path


def _seconds(script: Path, cache: str) -> float:
    environment = os.environ | {"DAEBENCH_CACHE": cache}
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, env=environment)
    if done.returncode:
        raise DaebenchError(
            f"a fresh process cannot take a step: {done.stderr.strip().splitlines()[-1] if done.stderr else ''}.", "fresh-process-failed"
        )
    return float(done.stdout)
