"""Export of a reference to other formats: CSV for every language, JSON, NPZ for NumPy, Parquet for tables; written whole or not at all."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from daebench.errors import BadInput, unknown
from daebench.reference.keep.dense_evaluation import At, states_at
from daebench.reference.keep.record import Reference
from daebench.runs.csv_files import write_rows
from daebench.runs.files import atomic
from daebench.runs.ivp import Array
from daebench.systems.lazily import pandas as pd


def text_of(reference: Reference, at: At) -> dict[str, list[str]]:
    """Return columns t, q1, ..., p1, ..., lam1, ..., or y1, ..., as decimal strings: stored digits if there are any, otherwise 17."""
    columns = {"t": [repr(float(t)) for t in at.t]}
    for name, values in _columns(at.states).items():
        stored = reference.text[name]
        columns[name] = [stored[k] if k >= 0 else f"{value:.17g}" for k, value in zip(at.row, values, strict=True)]
    return columns


def _columns(parts: Mapping[str, Array], prefix: str = "") -> dict[str, Array]:
    """Return the components of the parts of a state by their names."""
    return {f"{prefix}{part}{i + 1}": column for part, rows in parts.items() for i, column in enumerate(rows.T)}


def write(path: Path, kind: str, reference: Reference, times: Sequence[float] | None = None) -> None:
    """Write a reference to a file at these times, by default at all stored times."""
    if kind not in WRITERS:
        raise unknown("format", kind, WRITERS)
    at = states_at(reference, reference.t if times is None else times)
    with atomic(path) as scratch:
        WRITERS[kind](scratch, reference, at)


def _csv(path: Path, reference: Reference, at: At) -> None:
    bounds = {name: [f"{x:.3g}" for x in values] for name, values in _columns(at.bound, "bound_").items()}
    columns = text_of(reference, at) | bounds
    write_rows(path, columns, zip(*columns.values(), strict=True))


def _json(path: Path, reference: Reference, at: At) -> None:
    about = {name: reference.certificate[name] for name in ("name", "problem", "case", "definition", "horizon", "checksum")}
    bounds = {part: rows.tolist() for part, rows in at.bound.items()}
    whole = about | {"columns": text_of(reference, at), "stored": at.stored.tolist(), "bound": bounds}
    path.write_text(json.dumps(whole), encoding="ascii")


def _npz(path: Path, _: Reference, at: At) -> None:
    arrays = {"t": at.t} | at.states | {f"bound_{part}": rows for part, rows in at.bound.items()}
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]


def _parquet(path: Path, _: Reference, at: At) -> None:

    columns = {"t": at.t} | _columns(at.states) | _columns(at.bound, "bound_")
    try:
        pd.DataFrame(columns).to_parquet(path, engine="pyarrow", index=False)
    except ImportError as error:
        raise BadInput("writing Parquet needs pyarrow, which is not installed; install it by pip install 'daebench[scale]'.") from error


WRITERS: dict[str, Callable[[Path, Reference, At], None]] = {"csv": _csv, "json": _json, "npz": _npz, "parquet": _parquet}
"""Formats, with the function that writes each."""
