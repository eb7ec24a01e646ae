"""Readable rows of a damaged SQLite file: small ranges of keys are read, so that a damaged page costs the rows on it."""

import sqlite3
from itertools import pairwise
from pathlib import Path
from typing import Any

COLUMNS = ("key", "cell", "row", "maker", "took", "digest")
"""Columns of the table of rows."""

DIGITS = "0123456789abcdef"

BESIDE = ("-wal", "-shm")
"""Endings that SQLite gives to files beside a database."""


def readable(base: sqlite3.Connection) -> list[tuple[Any, ...]]:
    """Return all rows that SQLite can still read; which of them are what was written is for their digests to say.

    Keys are read in 256 ranges by their first two digits and what lies before and after these, each from below, and where that fails from
    above too.
    """
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
    columns = ", ".join(COLUMNS)
    try:
        for row in base.execute(f"SELECT {columns} FROM rows WHERE key >= ? AND key < ? ORDER BY key {order}", (start, end)):
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
