"""The stages of a long piece of work, each kept as a file until all are done: what was interrupted goes on where it stopped."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mpmath as mp

from daebench.files import atomic

Rows = list[list[Any]]

KEPT_DIGITS = 60
"""Digits that numbers keep between stages: more than any difference is measured to."""


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
        if not path.exists():
            self.told(stage)
            with atomic(path) as scratch:
                scratch.write_text(json.dumps(make()), encoding="ascii")
        return dict(json.loads(path.read_text(encoding="ascii")))

    def rows(self, stage: str, make: Callable[[], Rows]) -> Rows:
        """Return rows of mpmath numbers that a stage gives."""

        def spelled() -> dict[str, Any]:
            return {"rows": [[mp.nstr(x, KEPT_DIGITS) for x in row] for row in make()]}

        return [[mp.mpf(x) for x in row] for row in self.record(stage, spelled)["rows"]]
