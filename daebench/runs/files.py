"""Writing of files and folders: places are checked before the work, and a file is written whole or not at all."""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from daebench.errors import BadInput, DaebenchError


@contextmanager
def atomic(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the same folder. It is renamed to ``path`` when all is written, and removed otherwise.

    Its name cannot be predicted, so nobody can place a link of that name to another file; the folder may be writable for others.

    Raises
    ------
    BadInput
        If the path is a folder, a device, or a link that belongs to another user.
    DaebenchError
        If it cannot be written, for example on a full disk; the message names the path.
    """
    _refuse_foreign_link(path)
    path = path.resolve()
    if path.exists() and not path.is_file():
        raise BadInput(f"{path} is not a regular file and cannot be replaced; choose another path.")
    scratch = _beside(path)
    try:
        with named(path, scratch):
            yield scratch
            scratch.replace(path)
    finally:
        scratch.unlink(missing_ok=True)


@contextmanager
def named(path: Path, scratch: Path) -> Iterator[None]:
    """Name the file or folder in the error if it cannot be written in a block; the system does not say which disk is full.

    ``scratch`` is its temporary name while it is being written. DaebenchError is raised if writing fails.
    """
    try:
        yield
    except OSError as error:
        if error.filename is not None and not Path(error.filename).is_relative_to(scratch):
            raise
        raise DaebenchError(f"{path} cannot be written ({error.strerror or error}); make room, or choose another path.") from error


def _beside(path: Path) -> Path:
    """Return a hidden path in the same folder with the same extension."""
    return path.with_name(f".{path.stem[:64]}-{secrets.token_hex(8)}{path.suffix}")


def _refuse_foreign_link(path: Path, option: str = "--out") -> None:
    """Refuse to follow a link made by another user, as Linux does for files that are opened in folders like /tmp."""
    if path.is_symlink() and hasattr(os, "geteuid") and path.lstat().st_uid not in (os.geteuid(), 0):
        raise BadInput(f"{option} {path}: that is a link of another user; choose another path.")


def check_place(path: Path, option: str = "--out") -> None:
    """Check the place of an output file before the work that would fill it.

    BadInput is raised for a folder, a device or a link of another user, and if the folder is missing or cannot be written to.
    """
    if not path.parent.is_dir():
        raise BadInput(f"{option} {path}: there is no folder {path.parent}; make it first.")
    if path.exists() and not path.is_file():
        raise BadInput(f"{option} {path}: that is not a file; choose another path.")
    _refuse_foreign_link(path, option)
    trial = _beside(path.resolve())
    try:
        trial.touch(exist_ok=False)
        trial.unlink()
    except OSError as error:
        raise BadInput(f"{option} {path}: cannot write there ({error.strerror}); choose another path.") from error


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
        raise BadInput(f"--out {path}: cannot write to that folder ({error.strerror}); choose another path.") from error
