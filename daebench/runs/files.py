"""Trajectories as files: CSV for every language, NPZ for NumPy; written whole or not at all."""

import os
import secrets
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from daebench.errors import BadInput, DaebenchError
from daebench.runs.csv_files import write_numbers, write_rows
from daebench.runs.trajectory import Array, PoissonTrajectory, Trajectory


@contextmanager
def atomic(path: Path) -> Iterator[Path]:
    """Give a temporary path in the same folder that becomes ``path`` once all is written, and vanishes otherwise.

    Nobody can foresee its name, and so put a link there that leads to another file: the folder may be one that others write to.

    Raises
    ------
    BadInput
        If the path is a folder or a device, or a link of another user's.
    DaebenchError
        If it cannot be written, as on a full disk; it names the path.
    """
    _refuse_foreign_link(path)
    path = path.resolve()
    if path.exists() and not path.is_file():
        raise BadInput(f"{path} is no file that could be replaced; choose another place.")
    scratch = _beside(path)
    try:
        with named(path, scratch):
            yield scratch
            scratch.replace(path)
    finally:
        scratch.unlink(missing_ok=True)


@contextmanager
def named(path: Path, scratch: Path) -> Iterator[None]:
    """Name a file, or folder, that cannot be written in a block: the system does not say which disk is full.

    ``scratch`` is the name that it has while it is being written. DaebenchError is raised if that fails.
    """
    try:
        yield
    except OSError as error:
        if error.filename is not None and not Path(error.filename).is_relative_to(scratch):
            raise
        raise DaebenchError(f"{path} cannot be written ({error.strerror or error}); make room, or choose another place.") from error


def _beside(path: Path) -> Path:
    """Return a hidden path in the same folder with the same ending."""
    return path.with_name(f".{path.stem[:64]}-{secrets.token_hex(8)}{path.suffix}")


def _refuse_foreign_link(path: Path, option: str = "--out") -> None:
    """Refuse to follow a link that another user has made, as Linux does for files that are opened in folders like /tmp."""
    if path.is_symlink() and hasattr(os, "geteuid") and path.lstat().st_uid not in (os.geteuid(), 0):
        raise BadInput(f"{option} {path}: that is a link which another user has made; choose another place.")


def check_writable(path: Path) -> None:
    """Refuse an output file before the run that would fill it: by its ending, neither .csv nor .npz, or by its place."""
    if path.suffix.lower() not in WRITERS:
        raise BadInput(f"--out {path}: the file must end in {' or '.join(WRITERS)}.")
    check_place(path)


def check_place(path: Path, option: str = "--out") -> None:
    """Refuse a place of an output file before the work that would fill it.

    BadInput is raised for a folder or device or a link of another user's, and where the folder is missing or cannot be written to.
    """
    if not path.parent.is_dir():
        raise BadInput(f"{option} {path}: there is no folder {path.parent}; make it first.")
    if path.exists() and not path.is_file():
        raise BadInput(f"{option} {path}: that is no file; choose another place.")
    _refuse_foreign_link(path, option)
    trial = _beside(path.resolve())
    try:
        trial.touch(exist_ok=False)
        trial.unlink()
    except OSError as error:
        raise BadInput(f"{option} {path}: cannot write there ({error.strerror}); choose another place.") from error


def check_zip(path: Path, option: str = "--out") -> None:
    """Refuse a file that does not end in .zip, or whose place :func:`check_place` refuses, before the work that would fill it."""
    if path.suffix.lower() != ".zip":
        raise BadInput(f"{option} {path}: the file must end in .zip.")
    check_place(path, option)


def make_folder(path: Path) -> None:
    """Make an output folder before the work that would fill it; raise BadInput if it cannot be made or written to."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        trial = _beside(path / "trial")
        trial.touch(exist_ok=False)
        trial.unlink()
    except OSError as error:
        raise BadInput(f"--out {path}: cannot write to that folder ({error.strerror}); choose another place.") from error


AnyTrajectory = Trajectory | PoissonTrajectory


def columns(trajectory: AnyTrajectory) -> dict[str, Array]:
    """Return a trajectory's columns by name: t, then q1, ..., p1, ..., and lam1, ... where it has multipliers, or y1, ...

    Sensitivities follow, as dq1_dgravity and dq1_dq0_1.
    """
    arrays = {"t": trajectory.t}
    for name, rows in trajectory.states.items():
        arrays |= {f"{name}{i + 1}": rows[:, i] for i in range(rows.shape[1])}
    for part, by, rows in derivatives(trajectory):
        arrays |= {f"d{part}{i + 1}_d{by}": rows[:, i] for i in range(rows.shape[1])}
    return arrays


def derivatives(trajectory: AnyTrajectory) -> Iterator[tuple[str, str, Array]]:
    """Return each derivative of states by one number: name of the states, of the number, and rows of shape(n, d)."""
    for name, parts in trajectory.sensitivities.items():
        for part, rows in parts.items():
            if rows.ndim == 2:
                yield part, name, rows
            else:
                yield from ((part, f"{name}_{j + 1}", rows[:, :, j]) for j in range(rows.shape[2]))


def _csv(path: Path, trajectory: AnyTrajectory) -> None:
    write_numbers(path, columns(trajectory))


def _npz(path: Path, trajectory: AnyTrajectory) -> None:
    arrays = {"t": trajectory.t, **trajectory.states}
    for name, (t, values) in _stage_multipliers(trajectory).items():
        arrays |= {f"raw_{name}": values, f"raw_{name}_t": t}
    for name, parts in trajectory.sensitivities.items():
        arrays |= {f"d{part}_d{name}": rows for part, rows in parts.items()}
    with path.open("wb") as file:  # a name would be given the ending .npz where it ends in .NPZ
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]


WRITERS: dict[str, Callable[[Path, AnyTrajectory], None]] = {".csv": _csv, ".npz": _npz}


def written(path: Path, *, raw: bool) -> list[Path]:
    """Return the files that :func:`write_trajectory` writes, of a trajectory with or without stage multipliers."""
    return [path, path.with_suffix(".raw.csv")] if raw and path.suffix.lower() == ".csv" else [path]


def write_trajectory(path: Path, trajectory: AnyTrajectory) -> list[Path]:
    """Write a trajectory to FILE.csv (decimal digits that survive the round trip) or FILE.npz; return what was written.

    Stage multipliers belong to times of their own: they go beside FILE.csv as FILE.raw.csv, one multiplier of one step a row, or into
    FILE.npz as ``raw_NAME`` and ``raw_NAME_t``.
    """
    with atomic(path) as scratch:
        WRITERS[path.suffix.lower()](scratch, trajectory)
    raw = _stage_multipliers(trajectory)
    if not raw or path.suffix.lower() != ".csv":
        return [path]
    beside = path.with_suffix(".raw.csv")
    with atomic(beside) as scratch:
        _stage_multipliers_csv(scratch, raw)
    return [path, beside]


def _stage_multipliers(trajectory: AnyTrajectory) -> Mapping[str, tuple[Array, Array]]:
    return trajectory.raw if isinstance(trajectory, Trajectory) else {}


def _stage_multipliers_csv(path: Path, raw: Mapping[str, tuple[Array, Array]]) -> None:
    m = max(values.shape[1] for _, values in raw.values())
    rows = ([name, *(f"{x:.17g}" for x in row)] for name, (t, values) in raw.items() for row in np.column_stack([t, values]))
    write_rows(path, ["multiplier", "t", *(f"lam{i + 1}" for i in range(m))], rows)
