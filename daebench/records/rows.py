"""Rows of a store as text: a run's fields and what was computed, in JSON, with digests; what is read is checked."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from daebench.records.seals import sha256
from daebench.runs.json_values import strict
from daebench.runs.schema import NOT_NEGATIVE, Fields, Items, Number, Such, Text, Whole, wrong

COLUMNS = ("key", "cell", "row", "maker", "took", "digest")
"""Columns of the table of rows."""

LONGEST = 80
"""Most characters of the name of a lost row."""

NOT_FINITE = ("nan", "inf", "-inf")
"""Numbers that JSON does not have, in words."""

MOST_COUNT = 2**63
"""Largest whole number in a row."""

MOST_COLUMNS, MOST_RUNS, LONGEST_COLUMN = 1000, 10**6, 200
"""Most columns of a row, runs that are in one, and characters of the name of a column."""


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

    @property
    def columns(self) -> tuple[str, str, str, str, float, str]:
        """The entries of :data:`COLUMNS`, of which the last is a digest of the others."""
        texts = self.key, as_text(self.specification), written(self.row), self.maker, float(self.took)
        return *texts, digest_of(*texts)


def as_json(stored: StoredRow) -> str:
    """Return a row as one line of JSON, which :func:`of_json` reads; numbers that JSON does not have are words."""
    key, cell, row, maker, took, _ = stored.columns
    return as_text({"key": key, "cell": json.loads(cell), "row": json.loads(row), "maker": maker, "took": took})


def of_json(line: str) -> StoredRow:
    """Return the row of a line that :func:`as_json` gives."""
    return _row_of(strict(line))


def of_columns(key: str, cell: str, row: str, maker: str, took: float) -> StoredRow:
    """Return the row of entries of the table of rows."""
    return _row_of({"key": key, "cell": strict(cell), "row": strict(row), "maker": maker, "took": took})


def _row_of(entry: Any) -> StoredRow:
    fields = LINE.read(entry)
    return StoredRow(*(fields[name] for name in COLUMNS[:-1]))


def digest_of(*columns: object) -> str:
    """Return the SHA-256 of what a row says."""
    # repr keeps a number and a text of the same digits apart, and gives every bit of a float.
    return sha256("\0".join(map(repr, columns)).encode())


def is_whole(row: tuple[Any, ...]) -> bool:
    """Return whether a row, with its digest at the end, is what was written."""
    return bool(digest_of(*row[:-1]) == row[-1])


def name_of(row: tuple[Any, ...]) -> str:
    """Return the run of a damaged row, as far as it can be read."""
    try:
        run = json.loads(row[1])
        return f"{run['method']} on {run['problem']}, case {run['case']}, {run['value']:g}"[:LONGEST]
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError):
        return "one that cannot be told"


def as_text(content: Mapping[str, Any]) -> str:
    """Return a mapping as JSON that does not depend on its order."""
    return json.dumps(content, sort_keys=True)


def written(row: Mapping[str, Any]) -> str:
    """Return a row as JSON; numbers that JSON does not have are words."""
    return json.dumps({name: _word(value) for name, value in row.items()}, allow_nan=False)


def _word(value: Any) -> Any:
    if isinstance(value, list):
        return list(map(_word, value))
    # A bare word could not be told from a text of the same letters, such as a method of that name.
    return {"number": repr(value)} if isinstance(value, float) and not math.isfinite(value) else value


class Columns:
    """Kind of a row: a mapping of columns to values, or to lists of them."""

    fits = Such(
        lambda row: isinstance(row, Mapping) and len(row) <= MOST_COLUMNS and all(len(name) <= LONGEST_COLUMN for name in row),
        f"a mapping of at most {MOST_COLUMNS} columns",
    )

    def read(self, value: Any, place: str) -> dict[str, Any]:
        """Return the columns."""
        return {name: _value(entry, f"row.{name}") for name, entry in self.fits.read(value, place or "the row").items()}


def _value(value: Any, place: str, within: bool = False) -> Any:
    """Return an entry of a row, in which a number that JSON does not have is a word, or a list of such entries."""
    if isinstance(value, list) and len(value) <= MOST_RUNS and not within:
        return [_value(part, place, within=True) for part in value]
    if value is None or isinstance(value, float | str | bool) or (isinstance(value, int) and abs(value) <= MOST_COUNT):
        return value
    if isinstance(value, Mapping) and list(value) == ["number"] and value["number"] in NOT_FINITE:
        return float(value["number"])
    raise wrong(place, value, "a number, a text, true, false or null, or a list of these")


ROW = Columns()
"""What a row is, see :func:`written`."""

FIELDS = Fields({}, {"members": Whole(1), "values": Items(Number(), most=MOST_RUNS)}, open=True)
"""What of a run's fields is read here; all are checked where a run is made of them."""

LINE = Fields({"key": Text(200), "cell": FIELDS, "row": ROW, "maker": Text(200), "took": NOT_NEGATIVE})
"""What a line is, see :func:`as_json`."""
