"""Trajectories as files and tables: CSV for every language, NPZ for NumPy and for :func:`daebench.load`, frames and datasets."""

import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput
from daebench.runs.csv_files import write_numbers, write_rows
from daebench.runs.files import atomic, check_place
from daebench.runs.json_values import plain

Array = NDArray[np.float64]

ABOUT = "about"
"""Name of the JSON text in an NPZ file that describes its arrays."""


def columns(trajectory: Any) -> dict[str, Array]:
    """Return a trajectory's columns by name: t, then q1, ..., p1, ..., and lam1, ... if it has multipliers, or y1, ...

    Sensitivities follow, as dq1_dgravity and dq1_dq0_1.
    """
    arrays = {"t": trajectory.t}
    for name, rows in trajectory.states.items():
        arrays |= {f"{name}{i + 1}": rows[:, i] for i in range(rows.shape[1])}
    for part, by, rows in derivatives(trajectory):
        arrays |= {f"d{part}{i + 1}_d{by}": rows[:, i] for i in range(rows.shape[1])}
    return arrays


def derivatives(trajectory: Any) -> Iterator[tuple[str, str, Array]]:
    """Yield each derivative of states with respect to one number: name of the states, of the number, and rows of shape(n, d)."""
    for name, parts in trajectory.sensitivities.items():
        for part, rows in parts.items():
            if rows.ndim == 2:
                yield part, name, rows
            else:
                yield from ((part, f"{name}_{j + 1}", rows[:, :, j]) for j in range(rows.shape[2]))


def dataset(trajectory: Any) -> Any:
    """Return a trajectory as an xarray Dataset: states over time and component, with a description of the run as attributes."""
    try:
        import xarray as xr
    except ImportError as error:
        raise BadInput(
            "to_xarray needs xarray, which is not installed; install it by pip install 'daebench[notebooks]'.", "xarray-missing"
        ) from error

    variables: dict[str, Any] = {}
    for name, rows in trajectory.states.items():
        variables[name] = (("t", f"{name}_component"), rows)
    for name, parts in trajectory.sensitivities.items():
        for part, rows in parts.items():
            of = ("t", f"{part}_component") if rows.ndim == 2 else ("t", f"{part}_component", f"{name}_component")
            variables[f"d{part}_d{name}"] = (of, rows)
    about = trajectory.summary()
    attributes = {name: value if isinstance(value, str | int | float) else json.dumps(plain(value)) for name, value in about.items()}
    return xr.Dataset(variables, coords={"t": ("t", trajectory.t, {"units": "s"})}, attrs=attributes)


def _csv(path: Path, trajectory: Any) -> None:
    write_numbers(path, columns(trajectory))


def _npz(path: Path, trajectory: Any) -> None:
    arrays: dict[str, Any] = {"t": trajectory.t, **trajectory.states}
    for name, (t, values) in trajectory.stage_multipliers.items():
        arrays |= {f"raw_{name}": values, f"raw_{name}_t": t}
    for name, parts in trajectory.sensitivities.items():
        arrays |= {f"d{part}_d{name}": rows for part, rows in parts.items()}
    arrays[ABOUT] = np.array(json.dumps(plain(trajectory.about())))
    with path.open("wb") as file:  # given a name that ends in .NPZ, NumPy would append .npz
        np.savez_compressed(file, **arrays)


WRITERS: dict[str, Callable[[Path, Any], None]] = {".csv": _csv, ".npz": _npz}


def check_writable(path: Path) -> None:
    """Check an output file before the run that would fill it: its extension, .csv or .npz, and its place."""
    if path.suffix.lower() not in WRITERS:
        raise BadInput(f"--out {path}: the file must end in {' or '.join(WRITERS)}.", "out-file-ending")
    check_place(path)


def written(path: Path, *, raw: bool) -> list[Path]:
    """Return the files that :func:`write_trajectory` writes, of a trajectory with or without stage multipliers."""
    return [path, path.with_suffix(".raw.csv")] if raw and path.suffix.lower() == ".csv" else [path]


def write_trajectory(path: Path, trajectory: Any) -> list[Path]:
    """Write a trajectory to FILE.csv (with enough decimal digits for the round trip) or FILE.npz; return the files that were written.

    Stage multipliers have times of their own. They are written beside FILE.csv as FILE.raw.csv, one multiplier of one step per row, or into
    FILE.npz as ``raw_NAME`` and ``raw_NAME_t``.
    """
    with atomic(path) as scratch:
        WRITERS[path.suffix.lower()](scratch, trajectory)
    raw = trajectory.stage_multipliers
    if not raw or path.suffix.lower() != ".csv":
        return [path]
    beside = path.with_suffix(".raw.csv")
    with atomic(beside) as scratch:
        _stage_multipliers_csv(scratch, raw)
    return [path, beside]


def _stage_multipliers_csv(path: Path, raw: Mapping[str, tuple[Array, Array]]) -> None:
    m = max(values.shape[1] for _, values in raw.values())
    rows = ([name, *(f"{x:.17g}" for x in row)] for name, (t, values) in raw.items() for row in np.column_stack([t, values]))
    write_rows(path, ["multiplier", "t", *(f"lam{i + 1}" for i in range(m))], rows)
