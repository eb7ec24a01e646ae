"""All rows of a store as one table in a file, for other programs."""

from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from daebench.errors import BadInput
from daebench.records.code import code_version
from daebench.records.rows import StoredRow
from daebench.records.store import Store
from daebench.runs.csv_files import write_frame
from daebench.runs.files import atomic, check_place
from daebench.studies.grid.specification import require_row, specification_of
from daebench.systems.lazily import pandas as pd

NOT_FIELDS = ("parameters", "options", "varied", "values", "first", "differing", "numbers", "watch", "work")
"""Fields of runs that are no columns: their rows have what they say."""

FORMATS = (".csv", ".parquet")
"""Endings of files."""


def check_file(path: Path) -> None:
    """Refuse a file before the work that would fill it: by its ending, or if it cannot be written, or pyarrow is needed and missing."""
    if path.suffix.lower() not in FORMATS:
        raise BadInput(f"{path}: the file must end in {' or '.join(FORMATS)}.", "export-file-ending")
    if path.suffix.lower() == ".parquet":
        try:
            import_module("pyarrow")
        except ImportError as error:
            raise BadInput(
                "Parquet needs pyarrow, which is not installed; install it by pip install 'daebench[scale]'.", "pyarrow-missing"
            ) from error
    check_place(path)


def table_of(store: Store) -> "pd.DataFrame":
    """Return all rows of a store, those with the same run one after the other: what was computed, the run, and what made it.

    Columns are those of the rows; the fields of runs that rows do not have; and key, maker and took, see
    :class:`daebench.records.rows.StoredRow`. What a row has not is missing. A store without rows raises BadInput.
    """
    rows = list(store.all())
    if not rows:
        raise BadInput(f"{store.path} has no rows; make some, for example by daebench work-precision.", "store-without-rows")
    return frame(rows)


def frame(rows: Sequence[StoredRow]) -> "pd.DataFrame":
    """Return rows as a table, see :func:`table_of`."""
    flat_rows = [flat for stored in rows for flat in _flat(stored)]
    return pd.DataFrame(flat_rows).sort_values(["problem", "case", "method", "value", "key"], ignore_index=True)


def described(table: "pd.DataFrame") -> dict[str, str]:
    """Return in words what a table of runs is of: problems, methods and settings, and how many runs other versions made."""
    here = code_version()
    problems = table[["problem", "case"]].drop_duplicates().itertuples(index=False)
    others = int((table["maker"] != here).sum())
    return {
        "Runs": f"{len(table)}, a row each, {others} of them made by other versions of daebench or of a library",
        "Problems": ", ".join(f"{problem} (case {case})" for problem, case in problems),
        "Methods": ", ".join(dict.fromkeys(map(str, table["method"]))),
        "Settings": "value (h or tol), t_end, parameters and options in columns of their names; what made a row has the hash in maker",
    }


def write(table: "pd.DataFrame", path: Path) -> None:
    """Write a table, whole or not at all, in the format of :data:`FORMATS` that the file ends in; CSV has all digits of its numbers."""
    with atomic(path) as scratch:
        if path.suffix.lower() == ".csv":
            write_frame(scratch, table)
        else:
            table.to_parquet(scratch, index=False, engine="pyarrow")


def _flat(stored: StoredRow) -> Iterator[dict[str, Any]]:
    """Give a row, or those of several runs, with the fields of its run; metrics are words, and pairs, which rows have, left out."""
    run = specification_of(stored.specification)
    require_row(run, stored.row)
    fields = {name: value for name, value in stored.specification.items() if name not in NOT_FIELDS}
    fields["metrics"] = " ".join(fields["metrics"])
    for row in run.rows(stored.row):
        yield {**fields, **row, "key": stored.key, "maker": stored.maker, "took": stored.took}
