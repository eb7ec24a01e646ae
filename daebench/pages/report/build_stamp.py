"""Build stamp of a page: a digest of the code that made it, and one of each of its files, by which it is known to be up to date."""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from daebench.pages.report.citation import versions
from daebench.records.seals import sha256
from daebench.runs.files import atomic
from daebench.runs.json_values import strict
from daebench.runs.outputs import require_own_folder
from daebench.systems.files import package

STAMP = "made.json"

WORDS = ("title", "kind", "about", "command", "digest", "day")
KINDS: Mapping[str, Callable[[Any], Any]] = {**dict.fromkeys(WORDS, str), "seconds": float, "files": dict}
"""Fields of a build stamp and their types."""

SOURCES = (".py", ".c", ".css", ".js", ".html", ".csv", ".json")
"""Endings of the package's files that decide a page: code, templates and certified references."""


@dataclass(frozen=True)
class BuildStamp:
    """Record beside a page."""

    title: str
    """Name of the part of the gallery."""
    kind: str
    """What it is: "report", "lesson" or another kind of page."""
    about: str
    """One line."""
    command: str
    """What makes it again."""
    digest: str
    """Of all that decided it."""
    seconds: float
    """How long it took."""
    day: str
    """When it was made, ISO 8601."""
    files: dict[str, str]
    """Digest of each file of its folder, by its path there."""


def read(folder: Path) -> BuildStamp | None:
    """Return the build stamp of a folder; None where there is none that can be read."""
    try:
        content = strict((folder / STAMP).read_text(encoding="utf-8"))
        return BuildStamp(**{name: kind(content[name]) for name, kind in KINDS.items()})
    except (OSError, ValueError, TypeError, KeyError):
        return None


def write(folder: Path, *, title: str, kind: str, about: str, command: str, digest: str, seconds: float) -> None:
    """Write the build stamp of a folder whose page has just been made."""
    stamp = BuildStamp(title, kind, about, command, digest, round(seconds, 1), datetime.now(UTC).date().isoformat(), contents(folder))
    with atomic(folder / STAMP) as scratch:
        scratch.write_text(json.dumps(asdict(stamp), indent=1), encoding="utf-8")


def begin(folder: Path, *, title: str, kind: str, about: str, command: str) -> None:
    """Mark a folder, before anything else is written to it, as that of a page; an interrupted page is then recognised, and is not fresh.

    BadInput is raised if the folder has files and no stamp, unless any file may be replaced.
    """
    require_own_folder(folder, own=(folder / STAMP).exists())
    folder.mkdir(parents=True, exist_ok=True)
    if read(folder) is None:
        write(folder, title=title, kind=kind, about=about, command=command, digest="", seconds=0.0)


def is_fresh(folder: Path, digest: str) -> bool:
    """Return whether a page was made of the same code, and none of its files is changed or lost."""
    stamp = read(folder)
    if stamp is None or stamp.digest != digest or not (folder / "index.html").is_file():
        return False
    now = contents(folder)
    return all(now.get(name) == content for name, content in stamp.files.items())


def contents(folder: Path) -> dict[str, str]:
    """Return the digest of every file of a page, by its path in the folder; databases of runs are no part of it."""
    shown = (".html", ".svg", ".png", ".csv")
    return {
        str(path.relative_to(folder).as_posix()): sha256(path.read_bytes())
        for path in sorted(folder.rglob("*"))
        if path.suffix in shown and not path.name.startswith(".")
    }


def digest(outside: Iterable[Path] = ()) -> str:
    """Return the digest of the package as a whole, and of the files outside of it that decide a page."""
    return package.digest_of_files(((path.name, path.read_bytes()) for path in outside), _package())


@cache
def _package() -> str:
    """Return the digest of the package's code, templates and certified references, and of the versions of the packages it stands on."""
    files = ((name, path.read_bytes()) for name, path in sorted(package.files(*SOURCES).items()))
    return package.digest_of_files(files, json.dumps(versions(), sort_keys=True))
