"""Tables and pictures that commands write to a folder, each table with a text beside it that says how it was made."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from daebench.runs.files import make_folder
from daebench.runs.outputs import described, require_own
from daebench.runs.provenance import definition


@dataclass(frozen=True)
class Folder:
    """The folder of --out, if it is given, and what a command writes there.

    Parameters
    ----------
    out : Path, optional
        The folder.
    tables : tuple of str
        Names of tables without pictures.
    pictures : tuple of str
        Stems of pictures: STEM.svg and STEM.png, with their table STEM.csv.
    """

    out: Path | None
    tables: tuple[str, ...] = ()
    pictures: tuple[str, ...] = ()

    def check(self) -> None:
        """Refuse, before the runs, a folder that cannot be written to, and files that the command did not write."""
        if self.out is None:
            return
        make_folder(self.out)
        drawings = (f"{stem}{ending}" for stem in self.pictures for ending in (".svg", ".png"))
        for name in (*self._tables, *drawings):
            require_own(self.out / name)

    @property
    def place(self) -> Path:
        """The folder, of a command that always has one."""
        assert self.out is not None
        return self.out

    @property
    def _tables(self) -> tuple[str, ...]:
        return (*self.tables, *(f"{stem}.csv" for stem in self.pictures))

    @contextmanager
    def described(self, ivp: Any, about: Mapping[str, str]) -> Iterator[list[str]]:
        """Write, with each table of a block, how it was made; yield the paths of tables and pictures."""
        tables = [self.place / name for name in self._tables]
        with described(tables, definition(ivp) | dict(about)):
            yield [*map(str, tables), *(str(self.place / f"{stem}.svg") for stem in self.pictures)]

    def write(self, result: Any) -> list[str]:
        """Write the tables and pictures of a result of a study, if there is a folder; return their paths."""
        if self.out is None:
            return []
        with self.described(result.ivp, result.origin):
            return list(map(str, result.write(self.out)))
