"""Stages of a long computation, each stored in a file until all are done: an interrupted computation continues where it stopped."""

import json
import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mpmath as mp

from daebench.errors import BadInput
from daebench.runs.files import atomic

if sys.platform != "win32":
    import fcntl

Vector = list[Any]
Rows = list[Vector]

KEPT_DIGITS = 60
"""Digits of numbers stored between stages, more than any difference needs."""


@contextmanager
def alone(path: Path, name: str) -> Iterator[None]:
    """Hold a lock on a file while a reference is built; it vanishes with this process."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as file:  # a file that it may link to is not changed
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise BadInput(f"{name} is being built by another process; wait for it.", "reference-being-built") from None
        try:
            yield
        finally:
            path.unlink(missing_ok=True)


class Stages:
    """Results of the stages of a build, stored in a folder until the reference is complete."""

    def __init__(self, folder: Path, key: str, tell: Callable[[str], None]) -> None:
        self.folder, self.told = folder, tell
        mark = folder / "key"
        if not mark.exists() or mark.read_text(encoding="ascii") != key:
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
            mark.write_text(key, encoding="ascii")

    def record(self, stage: str, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        """Return the result of a stage, from the folder if it is there."""
        path = self.folder / f"{stage}.json"
        try:
            return dict(json.loads(path.read_text(encoding="ascii")))
        except (FileNotFoundError, ValueError):  # not made yet, or damaged
            self.told(stage)
        with atomic(path) as scratch:
            scratch.write_text(json.dumps(make()), encoding="ascii")
        return dict(json.loads(path.read_text(encoding="ascii")))

    def rows(self, stage: str, make: Callable[[], Rows]) -> Rows:
        """Return the rows of mpmath numbers of a stage."""

        def spelled() -> dict[str, Any]:
            return {"rows": [[mp.nstr(x, KEPT_DIGITS) for x in row] for row in make()]}

        return [[mp.mpf(x) for x in row] for row in self.record(stage, spelled)["rows"]]
