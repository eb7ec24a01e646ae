"""The stages of a long piece of work, each kept as a file until all are done: what was interrupted goes on where it stopped."""

import json
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mpmath as mp

from daebench.errors import BadInput
from daebench.runs.files import atomic

Vector = list[Any]
Rows = list[Vector]

KEPT_DIGITS = 60
"""Digits that numbers keep between stages: more than any difference is measured to."""


@contextmanager
def alone(path: Path, name: str) -> Iterator[None]:
    """Hold a lock on a file, which vanishes with this process, while a reference is built.

    Raises
    ------
    BadInput
        If another process holds it.
    """
    import fcntl

    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as file:  # nothing is lost where it is a link to another file
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise BadInput(f"{name} is being built by another process; wait for it.") from None
        try:
            yield
        finally:
            path.unlink(missing_ok=True)


class Stages:
    """Results of the stages of a build, kept in a folder until the reference is stored.

    Parameters
    ----------
    folder : Path
        Where they are kept.
    key : str
        What they belong to; those of another key are thrown away.
    told : callable
        Told the name of a stage that begins.
    """

    def __init__(self, folder: Path, key: str, told: Callable[[str], None]) -> None:
        self.folder, self.told = folder, told
        mark = folder / "key"
        if not mark.exists() or mark.read_text(encoding="ascii") != key:
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
            mark.write_text(key, encoding="ascii")

    def record(self, stage: str, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        """Return what a stage gives, from the folder if it is there."""
        path = self.folder / f"{stage}.json"
        try:
            return dict(json.loads(path.read_text(encoding="ascii")))
        except (FileNotFoundError, ValueError):  # not made yet, or damaged
            self.told(stage)
        with atomic(path) as scratch:
            scratch.write_text(json.dumps(make()), encoding="ascii")
        return dict(json.loads(path.read_text(encoding="ascii")))

    def rows(self, stage: str, make: Callable[[], Rows]) -> Rows:
        """Return rows of mpmath numbers that a stage gives."""

        def spelled() -> dict[str, Any]:
            return {"rows": [[mp.nstr(x, KEPT_DIGITS) for x in row] for row in make()]}

        return [[mp.mpf(x) for x in row] for row in self.record(stage, spelled)["rows"]]
