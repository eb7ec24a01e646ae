"""Computed rows in one SQLite file, stored under the hash of everything that determines them, each with a digest of its content."""

import json
import math
import sqlite3
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from daebench.errors import BadInput, DaebenchError, Interrupted
from daebench.records.salvage import COLUMNS, damaged_beside, readable
from daebench.records.seals import sha256
from daebench.runs.files import FULL
from daebench.runs.json_values import strict
from daebench.runs.schema import NOT_NEGATIVE, Fields, Items, Kind, Number, Text, Whole, wrong

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

LONGEST = 80
"""Most characters of the name of a lost row."""

NAMED = 3
"""Most lost rows that a message names."""


class StoreWarning(UserWarning):
    """Some of what was in a store is lost; the rest is kept."""


@dataclass(frozen=True)
class StoredRow:
    """A row of a store.

    Parameters
    ----------
    key : str
        Hash of all that decided it.
    specification : mapping
        Fields of the run, as :meth:`daebench.studies.grid.run_specification.GridRun.plain` gives them.
    row : mapping
        What was computed, by column.
    maker : str
        Hash of daebench's own source and of the versions of the packages that made it.
    took : float
        How long it took, s.
    """

    key: str
    specification: Mapping[str, Any]
    row: Mapping[str, Any]
    maker: str
    took: float


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
                raise StoreFull(f"{path} cannot be opened: {error}; make room, or name a file on another disk.") from error
            raise BadInput(f"{path} is not a store of a study, or cannot be opened: {error}; name another file.") from error

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
            raise BadInput(f"{self.path} is a database of something else; name another file.")
        if not empty and layout != LAYOUT:
            age = "a newer" if layout > LAYOUT else "an older"
            raise BadInput(f"{self.path} was written by {age} daebench (layout {layout}, here {LAYOUT}); name another file.")
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
            rows = [row for row in self._base.execute(ROWS) if not _is_whole(row)]
        except sqlite3.DatabaseError as error:
            if isinstance(error, sqlite3.OperationalError) and MALFORMED not in str(error):
                raise
            return "pages of it cannot be read"
        listing = "; ".join(map(_named, rows[:NAMED])) + ("; ..." if len(rows) > NAMED else "")
        return f"{'1 row is' if len(rows) == 1 else f'{len(rows)} rows are'} not what was written: {listing}" if rows else ""

    def _renew(self, lost: str) -> None:
        """Put the file aside and a new one in its place, with the rows that can be read."""
        rows = [row for row in readable(self._base) if _is_whole(row)]
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
        fields = [self._checked(key, FIELDS, partial(strict, cell)) for key, cell in rows]
        return sum(some["members"] if "members" in some else len(some.get("values", [None])) for some in fields)

    def _checked(self, key: str, kind: Kind, content: Callable[[], Any]) -> Any:
        """Return some of a row as it is read; raise BadInput if it is not what daebench writes, though its digest is right."""
        try:
            return kind.read(content(), "")
        except (ValueError, TypeError) as error:
            raise BadInput(f"{self.path}, row {str(key)[:12]}: {error}; daebench does not write that, name another file.") from error

    def get(self, key: str) -> dict[str, Any] | None:
        """Return the row of a key, or None.

        Parameters
        ----------
        key : str
            As ``specification_key.key_of`` gives it.
        """
        record = self._base.execute("SELECT row FROM rows WHERE key = ?", (key,)).fetchone()
        return None if record is None else self._checked(key, ROW, partial(strict, record[0]))

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
        written = [(row.key, _text(row.specification), _written(row.row), row.maker, float(row.took)) for row in rows]
        try:
            with self._base:
                self._base.execute("BEGIN IMMEDIATE")
                self._base.executemany(PUT, [(*row, _digest(*row)) for row in written])
        except sqlite3.OperationalError as error:
            advice = f"the {len(self)} rows in it are intact: make room, and run again"
            raise StoreFull(f"{self.path} cannot be written: {error}; {advice}.") from error

    def all(self) -> Iterator[StoredRow]:
        """Give all rows."""
        for key, *texts, code_version, took in self._base.execute("SELECT key, cell, row, maker, took FROM rows"):
            yield _stored(self._checked(key, LINE, partial(_entry, key, texts, code_version, took)))

    def outdated(self, wanted: Mapping[str, Mapping[str, Any]]) -> list[str]:
        """Return the keys of runs that are kept under another key alone: made by other versions, or of a changed definition."""
        asked = {_text(specification): key for key, specification in wanted.items()}
        keys_by_specification: dict[str, set[str]] = {}
        for key, specification in self._base.execute("SELECT key, cell FROM rows"):
            if specification in asked:
                keys_by_specification.setdefault(specification, set()).add(key)
        return [asked[specification] for specification, keys in keys_by_specification.items() if asked[specification] not in keys]


def as_json(stored: StoredRow) -> str:
    """Return a row as one line of JSON, which :func:`of_json` reads; numbers that JSON does not have are words."""
    return json.dumps(
        {
            "key": stored.key,
            "cell": dict(stored.specification),
            "row": json.loads(_written(stored.row)),
            "maker": stored.maker,
            "took": stored.took,
        },
        sort_keys=True,
    )


def of_json(line: str) -> StoredRow:
    """Return the row of a line that :func:`as_json` gives."""
    return _stored(LINE.read(strict(line)))


def _entry(key: str, texts: Sequence[str], code_version: str, took: float) -> dict[str, Any]:
    return {"key": key, **dict(zip(("cell", "row"), map(strict, texts), strict=True)), "maker": code_version, "took": took}


def _stored(entry: Mapping[str, Any]) -> StoredRow:
    return StoredRow(entry["key"], entry["cell"], entry["row"], entry["maker"], float(entry["took"]))


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
    """
    with closing(Store(path)) as store:
        try:
            yield store
        except KeyboardInterrupt as stop:
            raise Interrupted(f"interrupted; {store.runs} runs are stored in {path}: run again to continue.") from stop


def _digest(*columns: object) -> str:
    """Return the SHA-256 of what a row says."""
    return sha256("\0".join(map(repr, columns)).encode())


def _is_whole(row: tuple[Any, ...]) -> bool:
    """Whether a row, with its digest at the end, is what was written."""
    return bool(_digest(*row[:-1]) == row[-1])


def _named(row: tuple[Any, ...]) -> str:
    """Return the run of a damaged row, as far as it can be read."""
    try:
        specification = json.loads(row[1])
        return f"{specification['method']} on {specification['problem']}, case {specification['case']}, {specification['value']:g}"[
            :LONGEST
        ]
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError):
        return "one that cannot be told"


def _text(specification: Mapping[str, Any]) -> str:
    return json.dumps(specification, sort_keys=True)


def _written(row: Mapping[str, Any]) -> str:
    """Return a row as JSON; numbers that JSON does not have are words."""
    return json.dumps({name: _word(value) for name, value in row.items()}, allow_nan=False)


def _word(value: Any) -> Any:
    if isinstance(value, list):
        return list(map(_word, value))
    if isinstance(value, float) and not math.isfinite(value):
        return {"number": repr(value)}
    return value


class _Row:
    """A mapping of columns to values, or to lists of them; a number that JSON does not have is a word."""

    def read(self, value: Any, place: str) -> dict[str, Any]:
        """Return the columns."""
        if not isinstance(value, Mapping) or len(value) > MOST_COLUMNS or any(len(name) > LONGEST_COLUMN for name in value):
            raise wrong(place or "the row", value, f"a mapping of at most {MOST_COLUMNS} columns")
        return {name: _values(entry, f"row.{name}") for name, entry in value.items()}


def _values(entry: Any, place: str) -> Any:
    if isinstance(entry, list) and len(entry) <= MOST_RUNS:
        return [_value(part, place) for part in entry]
    return _value(entry, place)


def _value(value: Any, place: str) -> Any:
    if value is None or isinstance(value, float | str | bool) or (isinstance(value, int) and abs(value) <= MOST_COUNT):
        return value
    if isinstance(value, Mapping) and list(value) == ["number"] and value["number"] in NOT_FINITE:
        return float(value["number"])
    raise wrong(place, value, "a number, a text, true, false or null, or a list of these")


NOT_FINITE = ("nan", "inf", "-inf")
"""Numbers that JSON does not have, in words."""

MOST_COUNT = 2**63
"""Largest whole number in a row."""

MOST_COLUMNS, MOST_RUNS, LONGEST_COLUMN = 1000, 10**6, 200
"""Most columns of a row, runs that are in one, and characters of the name of a column."""

ROW = _Row()
"""What a row is, see :func:`_written`."""

FIELDS = Fields({}, {"members": Whole(1), "values": Items(Number(), most=MOST_RUNS)}, open=True)
"""What of a run's fields is read here; all are checked where a run is made of them."""

LINE = Fields({"key": Text(200), "cell": FIELDS, "row": ROW, "maker": Text(200), "took": NOT_NEGATIVE})
"""What a line is, see :func:`as_json`."""
