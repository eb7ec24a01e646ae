"""Trajectories as files: CSV for every language, NPZ for NumPy; written whole or not at all."""

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from daebench.errors import BadInput
from daebench.trajectory import Array, Trajectory


@contextmanager
def atomic(path: Path) -> Iterator[Path]:
    """Give a temporary path in the same folder that becomes ``path`` once all is written, and vanishes otherwise."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}", suffix=path.suffix)
    os.close(handle)
    scratch = Path(name)
    try:
        yield scratch
        scratch.chmod(0o644)
        scratch.replace(path)
    finally:
        scratch.unlink(missing_ok=True)


def check_writable(path: Path) -> None:
    """Refuse an output file before the run that would fill it.

    Raises
    ------
    BadInput
        If the ending is neither .csv nor .npz, or the folder is missing or cannot be written to.
    """
    if path.suffix not in WRITERS:
        raise BadInput(f"--out {path}: the file must end in {' or '.join(WRITERS)}.")
    if not path.parent.is_dir():
        raise BadInput(f"--out {path}: there is no folder {path.parent}; make it first.")
    if path.is_dir() or not os.access(path.parent, os.W_OK):
        raise BadInput(f"--out {path}: cannot write there; choose another place.")


def columns(trajectory: Trajectory) -> dict[str, Array]:
    """Return a trajectory's columns by name: t, q1, ..., p1, ..., and lam1, ... where it has multipliers."""
    found = {"t": trajectory.t}
    for name, rows in (("q", trajectory.q), ("p", trajectory.p), ("lam", trajectory.lam)):
        if rows is not None:
            found |= {f"{name}{i + 1}": rows[:, i] for i in range(rows.shape[1])}
    return found


def _csv(path: Path, trajectory: Trajectory) -> None:
    found = columns(trajectory)
    np.savetxt(path, np.column_stack(list(found.values())), fmt="%.17g", delimiter=",", header=",".join(found), comments="")


def _npz(path: Path, trajectory: Trajectory) -> None:
    arrays = {"t": trajectory.t, "q": trajectory.q, "p": trajectory.p}
    if trajectory.lam is not None:
        arrays["lam"] = trajectory.lam
    np.savez_compressed(path, **arrays)  # type: ignore[arg-type]


WRITERS: dict[str, Callable[[Path, Trajectory], None]] = {".csv": _csv, ".npz": _npz}


def write_trajectory(path: Path, trajectory: Trajectory) -> None:
    """Write a trajectory to FILE.csv (decimal digits that survive the round trip) or FILE.npz."""
    with atomic(path) as scratch:
        WRITERS[path.suffix](scratch, trajectory)
