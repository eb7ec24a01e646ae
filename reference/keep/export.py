"""A reference as a file of another kind: CSV for every language, JSON, NPZ for NumPy, Parquet for tables; written whole or not at all."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from daebench.errors import BadInput, unknown
from daebench.reference.keep.dense_evaluation import At, states_at
from daebench.reference.keep.record import Reference
from daebench.runs.csv_files import write_rows
from daebench.runs.files import atomic
from daebench.runs.ivp import Array


@dataclass(frozen=True)
class Extract:
    """A reference at some times.

    Parameters
    ----------
    reference : Reference
        Where it is from.
    at : At
        States and bounds.
    """

    reference: Reference
    at: At

    def text(self) -> dict[str, list[str]]:
        """Return columns t, q1, ..., p1, ..., lam1, ..., or y1, ..., as decimal strings: stored digits where there are some, else 17."""
        found = {"t": [repr(float(t)) for t in self.at.t]}
        for name, values in self._columns(""):
            stored = self.reference.text[name]
            found[name] = [stored[k] if k >= 0 else f"{value:.17g}" for k, value in zip(self.at.row, values, strict=True)]
        return found

    def numbers(self) -> dict[str, Array]:
        """Return the same columns in double precision, and their bounds, such as bound_q1, beside them."""
        return {"t": self.at.t} | dict(self._columns("")) | dict(self._columns("bound_"))

    def _columns(self, prefix: str) -> list[tuple[str, Array]]:
        found = self.at.bound if prefix else self.at.states
        return [(f"{prefix}{part}{i + 1}", column) for part, rows in found.items() for i, column in enumerate(rows.T)]


def extract(reference: Reference, times: Sequence[float] | None = None) -> Extract:
    """Return a reference at these times, by default at all that are stored.

    Raises
    ------
    BadInput
        If a time is outside of the reference.
    """
    return Extract(reference, states_at(reference, reference.t if times is None else times))


def write(path: Path, kind: str, found: Extract) -> None:
    """Write an extract as a file.

    Parameters
    ----------
    path : Path
        The file; it is replaced if it is there.
    kind : str
        One of ``WRITERS``.
    found : Extract
        What is written.

    Raises
    ------
    BadInput
        If the kind is unknown, or takes a package that is not installed.
    """
    if kind not in WRITERS:
        raise unknown("format", kind, WRITERS)
    with atomic(path) as scratch:
        WRITERS[kind](scratch, found)


def _csv(path: Path, found: Extract) -> None:
    bounds = {name: [f"{x:.3g}" for x in values] for name, values in found.numbers().items() if name.startswith("bound_")}
    columns = found.text() | bounds
    write_rows(path, columns, zip(*columns.values(), strict=True))


def _json(path: Path, found: Extract) -> None:
    about = {name: found.reference.certificate[name] for name in ("name", "problem", "case", "definition", "horizon", "checksum")}
    bounds = {part: rows.tolist() for part, rows in found.at.bound.items()}
    path.write_text(json.dumps(about | {"columns": found.text(), "stored": found.at.stored.tolist(), "bound": bounds}), encoding="ascii")


def _npz(path: Path, found: Extract) -> None:
    at = found.at
    arrays = {"t": at.t} | at.states | {f"bound_{part}": rows for part, rows in at.bound.items()}
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]


def _parquet(path: Path, found: Extract) -> None:
    import pandas as pd

    try:
        pd.DataFrame(found.numbers()).to_parquet(path, engine="pyarrow", index=False)
    except ImportError as error:
        raise BadInput("to write Parquet takes pyarrow, which is not installed; install it by pip install 'daebench[scale]'.") from error


WRITERS: dict[str, Callable[[Path, Extract], None]] = {"csv": _csv, "json": _json, "npz": _npz, "parquet": _parquet}
"""Formats and how each is written."""
