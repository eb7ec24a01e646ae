"""Files whose content is checked before it is used, in a folder to which nobody else can write.

A sealed file begins with a digest of its purpose and its content. The digest reveals damage, and also the content of another file under
this file's name. It is no secret; the private folder protects against other users, and a file of another user is not read.
"""

import hashlib
import os
import shutil
import stat
import tempfile
import warnings
from contextlib import suppress
from functools import cache
from pathlib import Path

MARK = b"daebench sealed 1\n"
"""First bytes of every sealed file: the version of this layout."""

OTHERS = stat.S_IRWXG | stat.S_IRWXO
"""Permissions of all users except the owner."""

WRITE = stat.S_IWGRP | stat.S_IWOTH
"""Permissions of these that allow others to change a folder."""


class CacheWarning(UserWarning):
    """The cache directory cannot be used, so everything is compiled again in this process."""


@cache
def warn(message: str) -> None:
    """Give a warning once per process, not once per kernel."""
    warnings.warn(message, CacheWarning, stacklevel=4)


def digest(purpose: str, content: bytes) -> bytes:
    """Return the SHA-256 of a file's purpose and content, in hexadecimal digits."""
    return hashlib.sha256(purpose.encode() + b"\0" + content).hexdigest().encode()


def write(path: Path, purpose: str, content: bytes) -> None:
    """Write a sealed file, whole or not at all."""
    put(path, MARK + digest(purpose, content) + b"\n" + content)


def read(path: Path, purpose: str) -> bytes | None:
    """Return the content of a sealed file; None if there is none. A damaged or foreign file is removed."""
    whole = owned_bytes(path)
    # Behind the mark are 64 digits and the end of their line.
    start = len(MARK) + 65
    if whole is not None and whole[:start] == MARK + digest(purpose, whole[start:]) + b"\n":
        return whole[start:]
    remove(path)
    return None


def put(path: Path, whole: bytes) -> None:
    """Write a file under a temporary name and rename it, so that no other process ever sees a part of it."""
    if path.is_dir():
        remove(path)
    # In the same folder, because a file is replaced at once only within one file system.
    handle, scratch = tempfile.mkstemp(dir=path.parent, prefix=path.stem[:64], suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(whole)
        Path(scratch).replace(path)
    except BaseException:
        Path(scratch).unlink(missing_ok=True)
        raise


def owned_bytes(path: Path) -> bytes | None:
    """Return the bytes of a file that belongs to this user; None if there is no such file."""
    try:
        with path.open("rb") as file:
            return file.read() if _is_ours(os.fstat(file.fileno())) else None
    except OSError:
        return None


def remove(path: Path) -> None:
    """Remove a file, or a folder in its place; errors are ignored."""
    try:
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)
    except OSError:
        return


def refusal(folder: Path, prefix: str) -> str:
    """Make a folder private, and return why it cannot be trusted; "" if it can.

    A folder made here gives no permissions to others. An existing folder must belong to this user. If it contains only our files, the
    permissions of others are removed. If it contains other files, it keeps its permissions, and is trusted if others cannot write to it.
    Windows has no such permissions, and protects a user's folders by itself.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.mkdir(mode=0o700, exist_ok=True)
    if os.name == "nt":
        return ""
    status = folder.stat()
    if not _is_ours(status):
        return "belongs to another user"
    if not status.st_mode & OTHERS:
        return ""
    with os.scandir(folder) as entries:
        all_ours = all(entry.name.startswith((prefix, "__pycache__")) for entry in entries)
    if all_ours:
        with suppress(OSError):  # on a read-only disk, say; the existing permissions decide whether this matters
            folder.chmod(stat.S_IMODE(status.st_mode) & ~OTHERS)
    return "can be written to by other users" if folder.stat().st_mode & WRITE else ""


def _is_ours(status: os.stat_result) -> bool:
    return os.name == "nt" or status.st_uid == os.geteuid()
