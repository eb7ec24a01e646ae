"""Seals of contents: digests by which what is read is known to be what was written, and sentences on what is not."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from daebench.runs.schema import WrongField, shown

LONGEST = 200
"""Most characters that are quoted of an error."""


def sha256(content: bytes) -> str:
    """Return the SHA-256 of a content in hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


def digest(*texts: str) -> str:
    """Return the SHA-256 of some texts."""
    return sha256("\n".join(texts).encode())


def digests(files: Mapping[str, bytes]) -> dict[str, str]:
    """Return the SHA-256 of each of some files."""
    return {name: sha256(content) for name, content in files.items()}


def checksum(document: Mapping[str, Any]) -> str:
    """Return the SHA-256 of a document without its own checksum, with sorted keys and no spaces."""
    content = {key: value for key, value in document.items() if key != "checksum"}
    return sha256(json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False).encode())


def sealed(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return a document with its checksum."""
    return {**document, "checksum": checksum(document)}


def is_inside(name: str) -> bool:
    """Return whether a path leads into a folder, and nowhere else, on every system."""
    parts = PurePosixPath(name).parts
    return bool(parts) and ".." not in parts and not name.startswith("/") and not set(name) & {"\\", ":", "\0"}


def of_another_version(path: Path, layout: Any, *read: int) -> str:
    """Return the sentence on a file whose layout is none of those that are read, of which the last is written; "" where it is one."""
    if layout in read and not isinstance(layout, bool):
        return ""
    age = "a newer" if isinstance(layout, int) and layout > read[-1] else "another"
    return f"{path} was written by {age} daebench (format {shown(layout)}, here {read[-1]}); take that version."


def words(error: BaseException) -> str:
    """Return an error of reading as part of a sentence: its text, after the name of its class where the text may not say enough."""
    name = "" if isinstance(error, WrongField) or type(error) is ValueError else f"{type(error).__name__} "
    text = " ".join(str(error).split())
    return (name + (text if len(text) <= LONGEST else f"{text[:LONGEST]}...")).strip().rstrip(".")
