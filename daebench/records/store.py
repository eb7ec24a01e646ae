"""Computed rows in one SQLite file, stored under the hash of everything that determines them, each with a digest of its content."""

import sqlite3
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

from daebench.errors import BadInput, DaebenchError, Interrupted
from daebench.records.rows import COLUMNS, FIELDS, ROW, StoredRow, as_text, is_whole, name_of, of_columns
from daebench.runs.files import FULL
from daebench.runs.json_values import strict
from daebench.runs.schema import Kind

LAYOUT = 3
"""Version of the layout of the file; it is in SQLite's own ``user_version``."""

MARK = 0x44414542
"""SQLite's ``application_id`` of our files."""

BUSY_SECONDS = 30.0
"""How long a write waits for another process that reads."""

TABLE = """CREATE TABLE IF NOT EXISTS rows (
    key TEXT PRIMARY KEY,
    cell TEXT NOT NULL,
    row TEXT NOT NULL,
    maker TEXT NOT NULL,
    took REAL NOT NULL,
    digest TEXT NOT NULL
) WITHOUT ROWID"""

ROWS = f"SELECT {', '.join(COLUMNS)} FROM rows"

MALFORMED = "malformed"
"""What SQLite calls a file whose structure is damaged."""

PUT = "INSERT OR REPLACE INTO rows VALUES (?, ?, ?, ?, ?, ?)"

NAMED = 3
"""Most lost rows that a message names."""


class StoreWarning(UserWarning):
    """Some of what was in a store is lost; the rest is kept."""


UNWRITTEN = ("SQLITE_FULL", *(f"SQLITE_IOERR_{why}" for why in ("WRITE", "SHMSIZE", "SHMMAP", "FSYNC", "TRUNCATE")))
"""Names of errors of SQLite where a disk has no room."""


def _of_disk(error: sqlite3.Error | OSError) -> bool:
    """Return whether an error is of a disk that is full, or that cannot be written, and not of the file on it."""
    code: str = getattr(error, "sqlite_errorname", "")
    return code in UNWRITTEN or getattr(error, "errno", None) in FULL


class StoreFull(DaebenchError):
    """The file cannot grow; what was written before is whole."""


class Store:
    """A file of rows. One process writes; rows that are put are in the file together before anything else is done.

    Parameters
    ----------
    path : Path
        The file; it is made with its folder if it is not there.

    Raises
    ------
    BadInput
        If the file is something else, or is of a version of daebench with another layout.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._base = self._connected()
            if lost := self._lost():
                self._renew(lost)
        except (sqlite3.Error, OSError) as error:
            if _of_disk(error):
                raise StoreFull(
                    f"{path} cannot be opened: {error}; make room, or name a file on another disk.", "store-no-room-to-open"
                ) from error
            raise BadInput(f"{path} is not a store of a study, or cannot be opened: {error}; name another file.", "not-a-store") from error

    def _connected(self) -> sqlite3.Connection:
        base = sqlite3.connect(self.path, timeout=BUSY_SECONDS, isolation_level=None)
        base.text_factory = lambda text: text.decode(errors="replace")  # what is damaged fails its digest
        try:
            self._require_ours(base)
            for command in ("PRAGMA journal_mode = WAL", "PRAGMA synchronous = NORMAL", TABLE):
                base.execute(command)
        except sqlite3.DatabaseError as error:
            if MALFORMED not in str(error):  # a damaged one is looked at more closely
                base.close()
                raise
        except BadInput:
            base.close()
            raise
        return base

    def _require_ours(self, base: sqlite3.Connection) -> None:
        """Refuse a file of something else, or of another version; mark one that is new."""
        mark, layout = (base.execute(f"PRAGMA {name}").fetchone()[0] for name in ("application_id", "user_version"))
        empty = not base.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
        if not empty and mark != MARK:
            raise BadInput(f"{self.path} is a database of something else; name another file.", "store-of-other-program")
        if not empty and layout != LAYOUT:
            age = "a newer" if layout > LAYOUT else "an older"
            raise BadInput(
                f"{self.path} was written by {age} daebench (layout {layout}, here {LAYOUT}); name another file.", "store-of-other-version"
            )
        if empty:
            base.execute(f"PRAGMA application_id = {MARK}")
            base.execute(f"PRAGMA user_version = {LAYOUT}")

    def _lost(self) -> str:
        """Return the damaged part of the file, in words; "" where nothing is."""
        try:
            verdict = self._base.execute("PRAGMA quick_check(1)").fetchone()[0]
            columns = tuple(row[1] for row in self._base.execute("PRAGMA table_info(rows)"))
            if verdict != "ok" or columns != COLUMNS:
                return "pages of it cannot be read"
            rows = [row for row in self._base.execute(ROWS) if not is_whole(row)]
        except sqlite3.DatabaseError as error:
            if isinstance(error, sqlite3.OperationalError) and MALFORMED not in str(error):
                raise
            return "pages of it cannot be read"
        listing = "; ".join(map(name_of, rows[:NAMED])) + ("; ..." if len(rows) > NAMED else "")
        return f"{'1 row is' if len(rows) == 1 else f'{len(rows)} rows are'} not what was written: {listing}" if rows else ""

    def _renew(self, lost: str) -> None:
        """Put the file aside and a new one in its place, with the rows that can be read."""
        rows = [row for row in readable(self._base) if is_whole(row)]
        self._base.close()
        aside = damaged_beside(self.path)
        self._base = self._connected()
        with self._base:
            self._base.execute("BEGIN IMMEDIATE")
            self._base.executemany(PUT, rows)
        outcome = f"{len(rows)} rows are kept, the others are computed again when requested, and the damaged file is {aside.name}"
        warnings.warn(f"{self.path} was damaged, {lost}; {outcome}.", StoreWarning, stacklevel=5)

    def close(self) -> None:
        """Close the file."""
        self._base.close()

    def __contains__(self, key: str) -> bool:
        return self._base.execute("SELECT 1 FROM rows WHERE key = ?", (key,)).fetchone() is not None

    def __len__(self) -> int:
        return int(self._base.execute("SELECT count(*) FROM rows").fetchone()[0])

    @property
    def runs(self) -> int:
        """Number of runs, of which a row may have several."""
        rows = self._base.execute("SELECT key, cell FROM rows")
        fields = [self._checked(key, FIELDS, cell) for key, cell in rows]
        return sum(some["members"] if "members" in some else len(some.get("values", [None])) for some in fields)

    def _checked(self, key: str, kind: Kind, text: str) -> Any:
        """Return some of a row as it is read; raise BadInput if it is not what daebench writes, though its digest is right."""
        try:
            return kind.read(strict(text), "")
        except (ValueError, TypeError) as error:
            raise self._wrong(key, error) from error

    def _wrong(self, key: str, error: Exception) -> BadInput:
        return BadInput(f"{self.path}, row {str(key)[:12]}: {error}; daebench does not write that, name another file.", "store-row-foreign")

    def get(self, key: str) -> dict[str, Any] | None:
        """Return the row of a key, or None.

        Parameters
        ----------
        key : str
            As ``daebench.studies.grid.specification.key_of`` gives it.
        """
        record = self._base.execute("SELECT row FROM rows WHERE key = ?", (key,)).fetchone()
        return None if record is None else self._checked(key, ROW, record[0])

    def put(self, rows: Iterable[StoredRow]) -> None:
        """Write rows, all or none, in place of those of the same keys if there are any.

        Parameters
        ----------
        rows : iterable of StoredRow
            What is written, in one transaction.

        Raises
        ------
        StoreFull
            If they cannot be written; what was there before stays.
        """
        written = [row.columns for row in rows]
        try:
            with self._base:
                self._base.execute("BEGIN IMMEDIATE")
                self._base.executemany(PUT, written)
        except sqlite3.OperationalError as error:
            advice = f"the {len(self)} rows in it are intact: make room, and run again"
            raise StoreFull(f"{self.path} cannot be written: {error}; {advice}.", "store-not-writable") from error

    def all(self) -> Iterator[StoredRow]:
        """Give all rows."""
        for row in self._base.execute("SELECT key, cell, row, maker, took FROM rows"):
            try:
                yield of_columns(*row)
            except (ValueError, TypeError) as error:
                raise self._wrong(row[0], error) from error

    def outdated(self, wanted: Mapping[str, Mapping[str, Any]]) -> list[str]:
        """Return the keys of runs that are kept under another key alone: made by other versions, or of a changed definition."""
        asked = {as_text(specification): key for key, specification in wanted.items()}
        keys_by_specification: dict[str, set[str]] = {}
        for key, specification in self._base.execute("SELECT key, cell FROM rows"):
            if specification in asked:
                keys_by_specification.setdefault(specification, set()).add(key)
        return [asked[specification] for specification, keys in keys_by_specification.items() if asked[specification] not in keys]


@contextmanager
def opened(path: Path) -> Iterator[Store]:
    """Open a store for the time of a block.

    Parameters
    ----------
    path : Path
        The file; it is made with its folder if it is not there.

    Yields
    ------
    Store
        The store, closed when the block ends.

    Raises
    ------
    BadInput
        See :class:`Store`.
    Interrupted
        If Ctrl-C ends the block; it says what is kept.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> from daebench.records.store import opened
    >>> with opened(Path(mkdtemp()) / "study.db") as store:
    ...     len(store)
    0
    """
    with closing(Store(path)) as store:
        try:
            yield store
        except KeyboardInterrupt as stop:
            raise Interrupted(f"interrupted; {store.runs} runs are stored in {path}: run again to continue.") from stop


DIGITS = "0123456789abcdef"

BESIDE = ("-wal", "-shm")
"""Endings that SQLite gives to files beside a database."""


def readable(base: sqlite3.Connection) -> list[tuple[Any, ...]]:
    """Return all rows that SQLite can still read; which of them are what was written is for their digests to say.

    Keys are read in 256 ranges by their first two digits and what lies before and after these, each from below, and where that fails from
    above too.
    """
    # A damaged page ends a scan, so that short ranges from both ends lose little more than the rows on that page.
    bounds = ["", *(a + b for a in DIGITS for b in DIGITS), "\U0010ffff"]
    rows_by_key: dict[Any, tuple[Any, ...]] = {}
    for start, end in pairwise(bounds):
        for order in ("ASC", "DESC"):
            rows, whole = _range(base, start, end, order)
            rows_by_key |= {row[0]: row for row in rows}
            if whole:
                break
    return list(rows_by_key.values())


def _range(base: sqlite3.Connection, start: str, end: str, order: str) -> tuple[list[tuple[Any, ...]], bool]:
    """Return the rows of a range up to the first that cannot be read, and whether all of them could."""
    rows: list[tuple[Any, ...]] = []
    try:
        for row in base.execute(f"{ROWS} WHERE key >= ? AND key < ? ORDER BY key {order}", (start, end)):
            rows.append(row)
    except sqlite3.DatabaseError:
        return rows, False
    return rows, True


def damaged_beside(path: Path) -> Path:
    """Move a damaged file to a free name beside it, and return that name; what SQLite has beside it goes along."""
    number = 1
    while (aside := path.with_name(f"{path.stem}.damaged-{number}{path.suffix}")).exists():
        number += 1
    path.rename(aside)
    for ending in BESIDE:
        beside = path.with_name(path.name + ending)
        if beside.exists():
            beside.rename(aside.with_name(aside.name + ending))
    return aside
