"""Writing of files and folders: places are checked before the work, and a file is written whole or not at all."""

import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from errno import EDQUOT, ENOSPC
from pathlib import Path

from daebench.errors import BadInput, DaebenchError

Hook = Callable[[Path, Path], None]

_before_rename: ContextVar[Hook | None] = ContextVar("_before_rename", default=None)

FULL = (ENOSPC, EDQUOT)
"""Numbers of errors of a disk that is full, and of a person's part of it."""


@contextmanager
def before_rename(hook: Hook) -> Iterator[None]:
    """In a block, call a function with the path and the temporary path of each file that is written, before it gets its name."""
    token = _before_rename.set(hook)
    try:
        yield
    finally:
        _before_rename.reset(token)


@contextmanager
def atomic(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the same folder. It is renamed to ``path`` when all is written, and removed otherwise.

    Its name cannot be predicted, so nobody can place a link of that name to another file; the folder may be writable for others.
    """
    _refuse_foreign_link(path)
    # A link is followed and not replaced: its target is the file that is meant.
    given, path = path, path.resolve()
    if path.exists() and not path.is_file():
        raise BadInput(f"{path} is not a regular file and cannot be replaced; choose another path.", "not-a-regular-file")
    scratch = _beside(path)
    try:
        with named(path, scratch):
            yield scratch
            if hook := _before_rename.get():
                hook(given, scratch)
            scratch.replace(path)
    finally:
        scratch.unlink(missing_ok=True)


@contextmanager
def atomic_folder(path: Path) -> Iterator[Path]:
    """Yield a temporary folder beside ``path``. It takes the place of that folder when all is written, and is removed otherwise.

    What else an older folder of that name has in it is kept.
    """
    path = path.resolve()
    scratch, old = _beside(path), _beside(path)
    try:
        with named(path, scratch):
            scratch.mkdir(parents=True)
            yield scratch
            if path.exists():
                _copy_the_rest(path, scratch)
                # The old folder is moved away first: a folder cannot be renamed onto one that is not empty.
                path.rename(old)
            scratch.rename(path)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
        if path.exists():
            shutil.rmtree(old, ignore_errors=True)


def _copy_the_rest(old: Path, new: Path) -> None:
    """Copy the entries of a folder that its successor has not."""
    for entry in old.iterdir():
        target = new / entry.name
        if entry.is_dir() and not entry.is_symlink():
            target.mkdir(exist_ok=True)
            _copy_the_rest(entry, target)
        elif not target.exists():
            shutil.copy2(entry, target, follow_symlinks=False)


def why(error: OSError) -> str:
    """Return in words why the system cannot write, and what to do: on a full disk another name alone is of no help."""
    if error.errno in FULL:
        return f"({error.strerror}); make room, or choose another path"
    return f"({error.strerror or error}); choose another path"


@contextmanager
def named(path: Path, scratch: Path) -> Iterator[None]:
    """Name the file or folder in the error if it cannot be written in a block; the system does not say which disk is full.

    ``scratch`` is its temporary name while it is being written. DaebenchError is raised if writing fails.
    """
    try:
        yield
    except OSError as error:
        # An error about another file, such as one that the block reads, has its own sentence.
        if error.filename is not None and not Path(error.filename).is_relative_to(scratch):
            raise
        raise DaebenchError(
            f"{path} cannot be written ({error.strerror or error}); make room, or choose another path.", "file-not-writable"
        ) from error


def _beside(path: Path) -> Path:
    """Return a hidden path in the same folder with the same extension."""
    # Cut, because the name with its random part must not be too long for the file system.
    return path.with_name(f".{path.stem[:64]}-{secrets.token_hex(8)}{path.suffix}")


def _refuse_foreign_link(path: Path, option: str = "--out") -> None:
    """Refuse to follow a link made by another user, as Linux does for files that are opened in folders like /tmp."""
    if path.is_symlink() and hasattr(os, "geteuid") and path.lstat().st_uid not in (os.geteuid(), 0):
        raise BadInput(f"{option} {path}: that is a link of another user; choose another path.", "link-of-another-user")


def check_place(path: Path, option: str = "--out") -> None:
    """Check the place of an output file before the work that would fill it.

    BadInput is raised for a folder, a device or a link of another user, and if the folder is missing or cannot be written to.
    """
    if not path.parent.is_dir():
        raise BadInput(f"{option} {path}: there is no folder {path.parent}; make it first.", "no-such-parent-folder")
    if path.exists() and not path.is_file():
        raise BadInput(f"{option} {path}: that is not a file; choose another path.", "place-not-a-file")
    _refuse_foreign_link(path, option)
    # By a trial: permissions, full disks and file systems that are read-only show only when something is written.
    trial = _beside(path.resolve())
    try:
        trial.touch(exist_ok=False)
        trial.unlink()
    except OSError as error:
        raise BadInput(f"{option} {path}: cannot write there {why(error)}.", "place-not-writable") from error


def check_zip(path: Path, option: str = "--out") -> None:
    """Refuse a file that does not end in .zip, or whose place :func:`check_place` refuses, before the work that would fill it."""
    if path.suffix.lower() != ".zip":
        raise BadInput(f"{option} {path}: the file must end in .zip.", "zip-file-ending")
    check_place(path, option)


def require_new(folder: Path) -> None:
    """Accept a folder that is not there; raise :class:`BadInput` otherwise."""
    if folder.exists():
        raise BadInput(f"{folder} is there already; choose a new folder, or --overwrite.", "folder-already-there")


def make_folder(path: Path) -> None:
    """Make an output folder before the work that would fill it; raise BadInput if it cannot be made or written to."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        trial = _beside(path / "trial")
        trial.touch(exist_ok=False)
        trial.unlink()
    except OSError as error:
        raise BadInput(f"--out {path}: cannot write to that folder {why(error)}.", "folder-not-writable") from error
