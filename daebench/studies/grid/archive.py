"""A study in one file: its rows, problem files, certificates and pictures, and a text that says how they were made.

The archive is a ZIP file::

    README.txt             how it was made, in words
    manifest.json          format, versions, and a SHA-256 of every other file
    rows.jsonl             a run a line, with the run that it is of, exactly
    rows.csv               the same as a table
    definitions/...        the problem files, with what those of one's own import
    code/...               the files of methods from outside
    references/...         certified references that errors were measured against
    pictures/...           errors over step sizes or tolerances
"""

import json
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar
from zipfile import ZIP_DEFLATED, ZipFile

from daebench.errors import BadInput
from daebench.methods.catalogue import find_problem
from daebench.methods.foreign import ForeignName, Trust, admit
from daebench.records.code import code_version
from daebench.records.seals import digests, is_inside, of_another_version, sha256, words
from daebench.records.store import Store, StoredRow, as_json, of_json
from daebench.reference.keep.record import Reference
from daebench.reference.keep.store import CERTIFICATE, digits, written
from daebench.runs import provenance
from daebench.runs.files import atomic
from daebench.runs.json_values import MOST, strict
from daebench.runs.machine import machine
from daebench.runs.provenance import ORIGIN
from daebench.runs.schema import DIGEST, SECONDS, Fields, Items, Named, Text, Whole, WrongField, shown
from daebench.runs.zipped import MOST_MEMBERS, UNREADABLE
from daebench.runs.zipped import unpacked as unpacked_files
from daebench.studies.grid import archive_figure, export
from daebench.studies.grid.archive_code import foreign_method, gathered
from daebench.studies.grid.metrics import METRICS
from daebench.studies.grid.reference import reference_of
from daebench.studies.grid.row_fields import require_row
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.specification import specification_of
from daebench.studies.grid.specification_key import key_of
from daebench.systems.files.execute import executing_nothing, is_path
from daebench.systems.files.read import Problem
from daebench.systems.files.user import own_files

T = TypeVar("T")

FORMAT = 2
"""Version of the layout of archives; version 1 has no code of methods."""

MANIFEST = "manifest.json"
ROWS = "rows.jsonl"

LARGEST = 2**26
"""Bytes that an archive may have in any case when it is unpacked."""

RATIO = 50.0
"""Largest ratio of the bytes of a larger archive to those of its ZIP file; archives of studies have 3 to 30."""

MOST_ROWS = 10**6
"""Largest number of rows."""

OTHER = "it is not an archive of a study, or is damaged"

READ = (1, FORMAT)
"""Versions of the layout that are read."""

PLACE = Text(4096, 1)
MANIFESTED = Fields(
    {
        "format": Whole(),
        **ORIGIN,
        "own": Items(PLACE),
        "files": Named(DIGEST, PLACE, MOST_MEMBERS),
    },
    {"maker": DIGEST, "executable": Items(PLACE), "without": Named(Text(10_000), PLACE)},
)
"""What a manifest says."""

LATER = ("maker", "executable", "without")
"""What a manifest says since version 2 of the layout."""


@dataclass(frozen=True)
class Archive:
    """An archive that is what was written."""

    manifest: Mapping[str, Any]
    """What it says of itself."""
    rows: tuple[StoredRow, ...]
    """The runs."""
    files: Mapping[str, bytes]
    """All that is in it, by name."""

    @property
    def own(self) -> tuple[str, ...]:
        """Problem files in it that do not come with daebench: code that is executed."""
        return tuple(self.manifest["own"])

    @property
    def executable(self) -> tuple[str, ...]:
        """Files in it that are started as programs."""
        return tuple(self.manifest.get("executable", ()))


@dataclass(frozen=True)
class Archived:
    """Content of an archive."""

    files: tuple[str, ...]
    """Names of the files in it."""
    rows: int
    """Runs."""
    changed: int
    """Runs that were left out, because the definition that they are of has changed since."""
    without: tuple[str, ...] = ()
    """Methods from outside whose code is not in it; their runs cannot be repeated."""


def write_archive(store: Store, path: Path, trust: Trust | None = None) -> Archived:
    """Write the archive of a store.

    Files that the store names are read, and executed only where that is trusted. That is needed for a problem file of which nothing is
    known in the cache, for example because it was never run on this machine.
    """
    rows = list(store.all())
    with _executing(store.path, rows, trust or Trust()):
        return _write_archive(store, path, rows)


def _write_archive(store: Store, path: Path, rows: list[StoredRow]) -> Archived:
    rows, changed = _current(rows)
    if not rows:
        why = f"all of its {changed} runs are of definitions that have changed since" if changed else "it has no rows"
        raise BadInput(f"{store.path} cannot be archived: {why}; run its study again.")
    names = sorted(
        {row.specification["problem"] for row in rows}, key=lambda name: (is_path(name), name)
    )  # rows are in the order of their hashes
    problems = {name: find_problem(name) for name in names}
    places = {name: f"definitions/{k + 1}-{problem.path.stem}" for k, (name, problem) in enumerate(problems.items())}
    moved = {name: f"{places[name]}/{problem.path.name}" for name, problem in problems.items() if not problem.package}
    code = gathered(sorted({row.specification["method"] for row in rows}))
    rows = [_renamed(_renamed(row, "problem", moved), "method", code.names) for row in rows]
    table = export.frame(rows)
    files = {ROWS: "".join(f"{line}\n" for line in map(as_json, rows)).encode()}
    for name, problem in problems.items():
        files |= {f"{places[name]}/{near}": file.read_bytes() for near, file in definition_files(problem)}
    for reference in _references(row.specification for row in rows if row.specification["problem"] not in moved.values()):
        files |= _certified(reference)
    with tempfile.TemporaryDirectory() as folder:
        export.write(table, Path(folder) / "rows.csv")
        files["rows.csv"] = (Path(folder) / "rows.csv").read_bytes()
        files |= {f"pictures/{picture.name}": picture.read_bytes() for picture in archive_figure.draw(Path(folder), table)}
    files |= code.files
    files["README.txt"] = _readme(path.name, rows, files, code.without).encode()
    _write(path, files, own=sorted(moved.values()), executable=code.executable, without=code.without)
    return Archived(tuple(files), len(rows), changed, tuple(code.without))


@contextmanager
def _executing(place: Path, rows: Sequence[StoredRow], trust: Trust) -> Iterator[None]:
    """Let code that rows name be executed for the time of a block if it is trusted; otherwise what would be executed is refused."""
    if trust.everything or (trust.digests and all(name.is_own or name.is_within(trust.digests) for name in _problems(rows))):
        yield
    else:
        with executing_nothing(f"is named in {place}, and would be executed; read it, and add --trust, or name the same file by --code."):
            yield


def _problems(rows: Sequence[StoredRow]) -> Iterator[ForeignName]:
    """Give the names of problems in rows, with the files of those that are files."""
    for name in {row.specification["problem"] for row in rows}:
        files = [file for _, file in definition_files(find_problem(name))] if is_path(name) else []
        yield ForeignName(name, False, {str(file): sha256(file.read_bytes()) for file in files})


def _write(path: Path, files: Mapping[str, bytes], **about: Any) -> None:
    """Write files with a manifest of them, and what it says besides.

    These are ``own``, problem files that do not come with daebench; ``executable``, files that are started as programs; and ``without``,
    methods whose code is not in the archive, with why.
    """
    manifest = {
        "format": FORMAT,
        "made": provenance.now(),
        "versions": provenance.versions(),
        "machine": machine(),
        "maker": code_version(),
        **about,
        "files": digests(files),
    }
    with atomic(path) as scratch, ZipFile(scratch, "w", ZIP_DEFLATED) as archive:
        archive.writestr(MANIFEST, json.dumps(manifest, indent=1))
        for name, content in files.items():
            archive.writestr(name, content)


def _current(rows: Sequence[StoredRow]) -> tuple[list[StoredRow], int]:
    """Return the rows whose definition is still there, and how many others there are; those of other versions are not told apart."""
    here = code_version()
    current = [row for row in rows if row.maker != here or key_of(specification_of(row.specification)) == row.key]
    return current, len(rows) - len(current)


def _renamed(row: StoredRow, what: str, moved: Mapping[str, str]) -> StoredRow:
    """Return a row whose problem or method is where it is in the archive."""
    if (name := row.specification[what]) not in moved:
        return row
    return replace(row, specification={**row.specification, what: moved[name]}, row={**row.row, what: moved[name]})


def definition_files(problem: Problem) -> Iterator[tuple[str, Path]]:
    """Give the files of a definition by their names beside the problem file, without what comes with daebench."""
    apart = {file.resolve() for file in own_files()} if not problem.own else set()
    for file in [problem.path] if problem.own else problem.depends_on(problem):
        if file.resolve() not in apart and file.is_relative_to(problem.path.parent):
            yield file.relative_to(problem.path.parent).as_posix(), file


def _references(specifications: Iterable[Mapping[str, Any]]) -> list[Reference]:
    """Return the references that errors are measured against."""
    asked = {
        (specification.problem, specification.case)
        for specification in map(specification_of, specifications)
        if any(METRICS[name].certified for name in specification.metrics if name in METRICS)
    }
    references = []
    for problem, case in sorted(asked):
        try:
            references.append(reference_of(problem, case))
        except BadInput:
            continue
    return references


def _certified(reference: Reference) -> dict[str, bytes]:
    """Return the two files of a reference, as they are kept."""
    place = f"references/{reference.name}"
    certificate = written(reference.certificate).encode("ascii")
    return {f"{place}/{CERTIFICATE}": certificate, f"{place}/{reference.name}.csv": digits(reference.text)}


def _readme(name: str, rows: Sequence[StoredRow], files: Mapping[str, bytes], without: Mapping[str, str]) -> str:
    lacking = {"Not in it": "; ".join(f"the code of {method}: {why}" for method, why in without.items())} if without else {}
    about = {
        **export.described(export.frame(rows)),
        "Files": ", ".join(files),
        **lacking,
        "To hold it against a new run": f"daebench reproduce {name}",
    }
    return provenance.text(name, about)


def read(path: Path, trust: Trust | None = None) -> Archive:
    """Return an archive, all of it checked; nothing in it is executed."""
    if not path.is_file():
        raise BadInput(f"there is no archive {path}; daebench archive STUDY.db makes one.")
    try:
        files = unpacked_files(path, str(path), small=LARGEST, ratio=RATIO)
        _require_safe(path, files)
        manifest = strict(files.pop(MANIFEST))
        if sentence := of_another_version(path, manifest["format"], *READ):
            raise BadInput(sentence)
        manifest = MANIFESTED.read(manifest, "manifest")
        if manifest["format"] > 1 and (lacking := [name for name in LATER if name not in manifest]):
            raise WrongField(f"manifest has no {lacking[0]}")
        _require_whole(manifest["files"], files)
        rows = _rows(files[ROWS])
    except UNREADABLE as error:
        raise BadInput(f"{path}: {OTHER}: {words(error)}; get it again from where it came.") from error
    archive = Archive(manifest, rows, files)
    if not rows:
        raise BadInput(f"{path} has no runs, so that there is nothing to compare; archive a study that has some.")
    runs = [_at_row(path, number, partial(specification_of, row.specification)) for number, row in enumerate(rows, 1)]
    admit(path, foreign_names(archive), trust or Trust())
    for number, (run, row) in enumerate(zip(runs, rows, strict=True), 1):
        _at_row(path, number, partial(_require_of, run, row.row))
    return archive


def _rows(content: bytes) -> tuple[StoredRow, ...]:
    """Return the rows of a file of them."""
    if content.count(b"\n") > MOST_ROWS or content.count(b",") > MOST:
        raise ValueError(f"{ROWS} has too many rows or values")
    rows = []
    for number, line in enumerate(content.decode().split("\n"), 1):
        if line:
            try:
                rows.append(_of_digests(of_json(line)))
            except ValueError as error:
                raise ValueError(f"{ROWS}, line {number}: {error}") from error
    return tuple(rows)


def _of_digests(row: StoredRow) -> StoredRow:
    """Return a row whose key and maker are digests, and which took a time."""
    DIGEST.read(row.key, "key")
    DIGEST.read(row.maker, "maker")
    SECONDS.read(row.took, "took")
    return row


def _require_safe(path: Path, names: Iterable[str]) -> None:
    """Refuse names that lead out of the archive."""
    for name in names:
        if not is_inside(name):
            raise BadInput(f"{path} has a file {name[:80]!r}, whose name leads out of it; it is not unpacked.")


def _require_whole(expected: Mapping[str, str], files: Mapping[str, bytes]) -> None:
    """Refuse content that is not as it was written."""
    if altered := dict(expected.items() ^ digests(files).items()):
        raise ValueError(f"{min(altered)} is not what was written")


def _require_of(run: GridRun, row: Mapping[str, Any]) -> None:
    """Refuse a row that is not of its run, or is of another problem."""
    require_row(run, row)
    if row["problem"] != run.problem:
        raise BadInput(f"row.problem is {shown(row['problem'])}, and must be that of its run.")


def _at_row(path: Path, number: int, check: Callable[[], T]) -> T:
    """Return the result of the check of a row; where it refuses the row, its place is named."""
    try:
        return check()
    except BadInput as error:
        raise BadInput(f"{path}, {ROWS}, row {number}: {error}") from error


def foreign_names(archive: Archive) -> list[ForeignName]:
    """Return the names of problems and methods in an archive, with the files in it that they lead to."""
    digests, names = archive.manifest["files"], []
    for row in archive.rows:
        problem, method = row.specification["problem"], row.specification["method"]
        folder = f"{problem.rpartition('/')[0]}/"
        there = problem in archive.own and problem in digests and problem.startswith("definitions/")
        names += [
            ForeignName(problem, False, {name: digest for name, digest in digests.items() if there and name.startswith(folder)}),
            foreign_method(method, archive.files, digests, archive.executable),
        ]
    return names
