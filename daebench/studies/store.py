"""Rows that were computed, kept in one SQLite file under the hash of all that decided them."""

import json
import math
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from daebench.errors import BadInput, DaebenchError

LAYOUT = 1
"""Version of the layout of the file; it is in SQLite's own ``user_version``."""

MARK = 0x44414542
"""SQLite's ``application_id`` of our files."""

BUSY_SECONDS = 30.0
"""How long a write waits for another process that reads."""

TABLE = """CREATE TABLE IF NOT EXISTS rows (
    key TEXT PRIMARY KEY,
    cell TEXT NOT NULL,
    row TEXT NOT NULL
) WITHOUT ROWID"""


class StoreFull(DaebenchError):
    """The file cannot grow; what was written before is whole."""


class Store:
    """A file of rows. One process writes; each row is on disk before the next is begun.

    Parameters
    ----------
    path : Path
        The file; it is made with its folder if it is not there.

    Raises
    ------
    BadInput
        If the file is something else, or is of a newer version of daebench.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._base = sqlite3.connect(path, timeout=BUSY_SECONDS, isolation_level=None)
            self._open()
        except (sqlite3.DatabaseError, OSError) as error:
            raise BadInput(f"{path} is no store of a study, or cannot be opened: {error}; name another file.") from error

    def _open(self) -> None:
        mark, layout = (self._base.execute(f"PRAGMA {name}").fetchone()[0] for name in ("application_id", "user_version"))
        empty = not self._base.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
        if not empty and mark != MARK:
            raise BadInput(f"{self.path} is a database of something else; name another file.")
        if layout > LAYOUT:
            raise BadInput(
                f"{self.path} was written by a newer daebench (layout {layout}, here {LAYOUT}); install that, or name another file."
            )
        if empty:
            self._base.execute(f"PRAGMA application_id = {MARK}")
            self._base.execute(f"PRAGMA user_version = {LAYOUT}")
        self._base.execute("PRAGMA journal_mode = WAL")
        self._base.execute("PRAGMA synchronous = NORMAL")
        self._base.execute(TABLE)

    def close(self) -> None:
        """Close the file."""
        self._base.close()

    def __contains__(self, key: str) -> bool:
        return self._base.execute("SELECT 1 FROM rows WHERE key = ?", (key,)).fetchone() is not None

    def __len__(self) -> int:
        return int(self._base.execute("SELECT count(*) FROM rows").fetchone()[0])

    def get(self, key: str) -> dict[str, Any] | None:
        """Return the row of a key, or None."""
        found = self._base.execute("SELECT row FROM rows WHERE key = ?", (key,)).fetchone()
        return None if found is None else _read(found[0])

    def put(self, entries: Iterable[tuple[str, Mapping[str, Any], Mapping[str, Any]]]) -> None:
        """Write rows, each with its key and its cell, all or none, in place of those of these keys if there are any.

        Raises
        ------
        StoreFull
            If they cannot be written; what was there before stays.
        """
        written = [(key, json.dumps(cell), _written(row)) for key, cell, row in entries]
        try:
            with self._base:
                self._base.execute("BEGIN IMMEDIATE")
                self._base.executemany("INSERT OR REPLACE INTO rows VALUES (?, ?, ?)", written)
        except sqlite3.OperationalError as error:
            kept = f"the {len(self)} rows in it are kept: make room, and run again"
            raise StoreFull(f"{self.path} cannot be written: {error}; {kept}.") from error

    def others(self, keys: Iterable[str]) -> int:
        """Return how many rows are of none of these keys: of other studies, or made by other versions."""
        known = set(keys)
        return sum(key not in known for (key,) in self._base.execute("SELECT key FROM rows"))


@contextmanager
def opened(path: Path) -> Iterator[Store]:
    """Open a store for the time of a block."""
    with closing(Store(path)) as store:
        yield store


def _written(row: Mapping[str, Any]) -> str:
    """Return a row as JSON; numbers that JSON does not have are words."""
    return json.dumps({name: _word(value) for name, value in row.items()}, allow_nan=False)


def _word(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return {"number": repr(value)}
    return value


def _read(text: str) -> dict[str, Any]:
    return {name: float(value["number"]) if isinstance(value, dict) else value for name, value in json.loads(text).items()}
