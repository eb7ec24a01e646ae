"""Comparison of an archive of a study with new runs: equal to the bit, within a tolerance, or different."""

import hashlib
import json
import math
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any

from daebench.errors import BadInput
from daebench.studies.grid.archive import FORMAT, MANIFEST, ROWS
from daebench.studies.grid.measure import row_of
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.specification import specification_of
from daebench.studies.grid.store import StoredRow, of_json
from daebench.systems.files.execute import is_path

EQUAL, WITHIN, DIFFERS = "equal to the bit", "within", "differs"
"""What is said of a run."""

UNTOLD = frozenset({"problem", "seconds", "seconds_least", "seconds_most", "callback_seconds", "compile_seconds", "lanes"})
"""Columns that are not compared: times are of another machine or another hour, and a problem file is elsewhere."""

LARGEST = 2**31
"""Most bytes of an archive when it is unpacked."""

OTHER = "it is not an archive of a study, or is damaged"


@dataclass(frozen=True)
class Archive:
    """An archive that is what was written.

    Parameters
    ----------
    manifest : mapping
        What it says of itself.
    rows : tuple of StoredRow
        The runs.
    files : mapping of str to bytes
        All that is in it, by name.
    """

    manifest: Mapping[str, Any]
    rows: tuple[StoredRow, ...]
    files: Mapping[str, bytes]

    @property
    def own(self) -> tuple[str, ...]:
        """Problem files in it that do not come with daebench: code that is executed."""
        return tuple(self.manifest["own"])


@dataclass(frozen=True)
class Reproduced:
    """A run of an archive beside a new one.

    Parameters
    ----------
    specification : GridRun
        The run.
    verdict : str
        :data:`EQUAL`, :data:`WITHIN` or :data:`DIFFERS`.
    column : str
        Where the two differ most; "" where they are equal.
    archived, new : object
        What is there.
    """

    specification: GridRun
    verdict: str
    column: str = ""
    archived: Any = None
    new: Any = None

    @property
    def difference(self) -> float:
        """The largest difference, relative to the larger of the two numbers; 0 where they are equal, NaN where one is not a number."""
        if self.verdict == EQUAL:
            return 0.0
        numbers = isinstance(self.archived, int | float) and isinstance(self.new, int | float)
        return _relative(float(self.archived), float(self.new)) if numbers else math.nan


def read(path: Path) -> Archive:
    """Return an archive, all of it checked.

    BadInput is raised if there is none, it is damaged, of another version, or has names that lead out of it.
    """
    if not path.is_file():
        raise BadInput(f"there is no archive {path}; daebench archive STUDY.db makes one.")
    try:
        with zipfile.ZipFile(path) as archive:
            _require_safe(path, archive)
            files = {member.filename: archive.read(member) for member in archive.infolist() if not member.is_dir()}
        manifest = json.loads(files.pop(MANIFEST))
        _require_version(path, manifest)
        _require_whole(manifest["files"], files)
        rows = tuple(map(of_json, files[ROWS].decode().splitlines()))
        _require_plain(path, manifest["own"], rows, files)
    except (OSError, EOFError, ValueError, KeyError, TypeError, AttributeError, RuntimeError, zipfile.BadZipFile, zlib.error) as error:
        raise BadInput(f"{path}: {OTHER}: {_short(error)}; get it again from where it came.") from error
    return Archive(manifest, rows, files)


def _short(error: BaseException) -> str:
    return f"{type(error).__name__} {' '.join(str(error).split())[:80]}".strip().rstrip(".")


def _require_safe(path: Path, archive: zipfile.ZipFile) -> None:
    """Refuse names that lead out of the archive, and contents that are too large."""
    for member in archive.infolist():
        parts = PurePosixPath(member.filename).parts
        if not parts or ".." in parts or member.filename.startswith("/") or set(member.filename) & {"\\", ":", "\0"}:
            raise BadInput(f"{path} has a file {member.filename[:80]!r}, whose name leads out of it; it is not unpacked.")
    if sum(member.file_size for member in archive.infolist()) > LARGEST:
        raise BadInput(f"{path} is larger than 2 GB when it is unpacked; it is not unpacked.")


def _require_version(path: Path, manifest: Mapping[str, Any]) -> None:
    layout = manifest["format"]
    if layout != FORMAT:
        age = "a newer" if isinstance(layout, int) and layout > FORMAT else "another"
        raise BadInput(f"{path} was written by {age} daebench (format {str(layout)[:20]}, here {FORMAT}); take that version.")


def _require_whole(digests: Mapping[str, str], files: Mapping[str, bytes]) -> None:
    """Refuse what is not what was written."""
    wrong = [name for name in {*digests, *files} if name not in files or digests.get(name) != hashlib.sha256(files[name]).hexdigest()]
    if wrong:
        raise ValueError(f"{min(wrong)} is not what was written")


def _require_plain(path: Path, problem_files: Sequence[str], rows: Sequence[StoredRow], files: Mapping[str, bytes]) -> None:
    """Refuse runs of problem files that are not in the archive: nothing else of this machine is to be executed."""
    for row in rows:
        name = str(row.specification["problem"])
        if is_path(name) and (name not in problem_files or name not in files):
            raise BadInput(f"{path} has runs of {name[:80]}, which is not in it; nothing is run.")


@contextmanager
def unpacked(archive: Archive) -> Iterator[list[tuple[StoredRow, GridRun]]]:
    """Give the runs of an archive as they are made here, its problem files in a folder for the time of a block."""
    with tempfile.TemporaryDirectory(prefix="daebench-") as folder:
        for name, content in archive.files.items():
            if name.startswith("definitions/"):
                place = Path(folder, name)
                place.parent.mkdir(parents=True, exist_ok=True)
                place.write_bytes(content)
        yield [(row, _specification(row, Path(folder), archive.own)) for row in archive.rows]


def _specification(row: StoredRow, folder: Path, problem_files: Sequence[str]) -> GridRun:
    specification = specification_of(row.specification)
    return replace(specification, problem=str(folder / specification.problem)) if specification.problem in problem_files else specification


def reproduced(
    archive: Archive, *, rtol: float, atol: float, tell: Callable[[float], None] = lambda fraction: None
) -> Iterator[Reproduced]:
    """Make the runs of an archive again, and give each beside what is archived; ``tell`` is told which fraction of them is done.

    Two numbers are within where they differ by no more than ``rtol`` times the larger, or by ``atol``.
    """
    with unpacked(archive) as runs:
        for done, (row, specification) in enumerate(runs, 1):
            made = row_of(replace(specification, repeat=min(specification.repeat, 1)))
            comparison = compared(row.row, made, rtol=rtol, atol=atol)
            yield replace(comparison, specification=specification_of(row.specification))
            tell(done / len(runs))


def compared(archived: Mapping[str, Any], new: Mapping[str, Any], *, rtol: float, atol: float) -> Reproduced:
    """Return what is to be said of two rows: counts of work and words of failures may differ within, whether it failed may not."""
    nobody: Any = None
    worst = Reproduced(nobody, EQUAL)
    for name in archived:
        if name in UNTOLD:
            continue
        for old, now in _entries(archived[name], new.get(name)):
            word = _verdict(name, old, now, rtol, atol)
            ahead = (EQUAL, WITHIN, DIFFERS).index(word) - (EQUAL, WITHIN, DIFFERS).index(worst.verdict)
            candidate = Reproduced(nobody, word, name, old, now)
            if ahead > 0 or (ahead == 0 and word != EQUAL and candidate.difference > worst.difference):
                worst = candidate
    return worst


def _entries(old: Any, now: Any) -> list[tuple[Any, Any]]:
    """Return the values that are compared with each other: two, or those of two lists."""
    lists = isinstance(old, list) and isinstance(now, list) and len(old) == len(now)
    return list(zip(old, now, strict=True)) if lists else [(old, now)]


def _verdict(name: str, old: Any, now: Any, rtol: float, atol: float) -> str:
    if old == now or (_is_nan(old) and _is_nan(now)):
        return EQUAL
    if name == "failure":
        return WITHIN if bool(old) == bool(now) else DIFFERS
    if isinstance(old, str | bool | list | None) or isinstance(now, str | bool | list | None):
        return DIFFERS
    if name.startswith("n_") or name == "steps":
        return WITHIN
    return WITHIN if math.isfinite(old - now) and abs(old - now) <= max(atol, rtol * max(abs(old), abs(now))) else DIFFERS


def _is_nan(x: Any) -> bool:
    return isinstance(x, float) and math.isnan(x)


def _relative(a: float, b: float) -> float:
    return abs(a - b) / max(abs(a), abs(b)) if a != b else 0.0
