"""Whether a page is still what its recipe would write: a stamp beside it, with a digest of all that decided it and of its files."""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

from daebench import package_files
from daebench.files import atomic
from daebench.report.versions import versions

STAMP = "made.json"

APART = ("reports", "cli")
"""Folders of the package whose files decide a page only where its recipe says so."""

SOURCES = (".py", ".c", ".css", ".csv", ".json")
"""Endings of the files that decide numbers: code and certified references."""


@dataclass(frozen=True)
class Stamp:
    """What is written beside a page.

    Parameters
    ----------
    title : str
        Name of the part of the gallery.
    kind : str
        What it is: "report", "lesson" or another kind of page.
    about : str
        One line.
    command : str
        What makes it again.
    digest : str
        Of all that decided it.
    seconds : float
        How long it took.
    day : str
        When it was made, ISO 8601.
    files : dict of str to str
        Digest of each file of its folder, by its path there.
    """

    title: str
    kind: str
    about: str
    command: str
    digest: str
    seconds: float
    day: str
    files: dict[str, str]


def read(folder: Path) -> Stamp | None:
    """Return the stamp of a folder; None where there is none that can be read."""
    try:
        return Stamp(**json.loads((folder / STAMP).read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None


def write(folder: Path, *, title: str, kind: str, about: str, command: str, digest: str, seconds: float) -> None:
    """Write the stamp of a folder whose page has just been made."""
    stamp = Stamp(title, kind, about, command, digest, round(seconds, 1), datetime.now(UTC).date().isoformat(), contents(folder))
    with atomic(folder / STAMP) as scratch:
        scratch.write_text(json.dumps(asdict(stamp), indent=1), encoding="utf-8")


def is_fresh(folder: Path, digest: str) -> bool:
    """Return whether a folder holds what its recipe would write: made of the same, and no file of it changed or lost."""
    stamp = read(folder)
    if stamp is None or stamp.digest != digest or not (folder / "index.html").is_file():
        return False
    now = contents(folder)
    return all(now.get(name) == content for name, content in stamp.files.items())


def contents(folder: Path) -> dict[str, str]:
    """Return the digest of every file of a page, by its path in the folder; databases of runs are no part of it."""
    shown = (".html", ".svg", ".png", ".csv")
    return {
        str(path.relative_to(folder).as_posix()): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.suffix in shown and not path.name.startswith(".")
    }


def digest(files: Iterable[Path]) -> str:
    """Return the digest of a page's own files and of all that every page stands on."""
    found = hashlib.sha256(common().encode())
    for path in files:
        content = path.read_bytes()
        found.update(f"{path.name} {len(content)}\n".encode() + content)
    return found.hexdigest()


@cache
def common() -> str:
    """Return the digest of what every page stands on: the code of the package, certified references, and versions of packages."""
    found = hashlib.sha256(json.dumps(versions(), sort_keys=True).encode())
    for name, path in sorted(sources().items()):
        content = path.read_bytes()
        found.update(f"{name} {len(content)}\n".encode() + content)
    return found.hexdigest()


def sources() -> dict[str, Path]:
    """Return the files that decide what every page stands on, by their paths in the package."""
    return {name: path for name, path in package_files.files(*SOURCES).items() if name.partition("/")[0] not in APART}
