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
import re
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import ZIP_DEFLATED, ZipFile

from daebench.draw.figures import drawing, grid_of_axes, legend_below, save
from daebench.draw.methods import curve_of
from daebench.errors import BadInput
from daebench.methods.catalogue import find_problem
from daebench.methods.foreign import ForeignName, Trust
from daebench.methods.outside.read import is_outside
from daebench.records.code import Code, code_of, code_version
from daebench.records.rows import StoredRow, as_json
from daebench.records.seals import digests, sha256
from daebench.records.store import Store
from daebench.reference.keep.record import Reference
from daebench.reference.keep.store import CERTIFICATE, digits, written
from daebench.runs import provenance
from daebench.runs.files import atomic
from daebench.runs.machine import machine
from daebench.studies.grid.export import described, frame, write
from daebench.studies.grid.metrics import METRICS
from daebench.studies.grid.reference import reference_of
from daebench.studies.grid.rows import by_method
from daebench.studies.grid.specification import key_of, specification_of
from daebench.systems.files.execute import executing_nothing, is_path
from daebench.systems.files.read import Problem
from daebench.systems.files.user import own_files

if TYPE_CHECKING:
    import pandas as pd

FORMAT = 2
"""Version of the layout of archives; version 1 has no code of methods."""

MANIFEST = "manifest.json"
ROWS = "rows.jsonl"
CODE = "code"


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
        raise BadInput(f"{store.path} cannot be archived: {why}; run its study again.", "store-not-archived")
    names = sorted(
        {row.specification["problem"] for row in rows}, key=lambda name: (is_path(name), name)
    )  # rows are in the order of their hashes
    problems = {name: find_problem(name) for name in names}
    places = {name: f"definitions/{k + 1}-{problem.path.stem}" for k, (name, problem) in enumerate(problems.items())}
    moved = {name: f"{places[name]}/{problem.path.name}" for name, problem in problems.items() if not problem.package}
    code = gathered(sorted({row.specification["method"] for row in rows}))
    rows = [_renamed(_renamed(row, "problem", moved), "method", code.names) for row in rows]
    table = frame(rows)
    files = {ROWS: "".join(f"{line}\n" for line in map(as_json, rows)).encode()}
    for name, problem in problems.items():
        files |= {f"{places[name]}/{near}": file.read_bytes() for near, file in definition_files(problem)}
    for reference in _references(row.specification for row in rows if row.specification["problem"] not in moved.values()):
        files |= _certified(reference)
    with tempfile.TemporaryDirectory() as folder:
        write(table, Path(folder) / "rows.csv")
        files["rows.csv"] = (Path(folder) / "rows.csv").read_bytes()
        files |= {f"pictures/{picture.name}": picture.read_bytes() for picture in draw(Path(folder), table)}
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
        **described(frame(rows)),
        "Files": ", ".join(files),
        **lacking,
        "To hold it against a new run": f"daebench reproduce {name}",
    }
    return provenance.text(name, about)


@dataclass(frozen=True)
class Gathered:
    """The code of methods from outside."""

    names: Mapping[str, str]
    """Names in the archive, by those in the study."""
    files: Mapping[str, bytes] = field(repr=False)
    """Files by their paths in the archive."""
    executable: tuple[str, ...]
    """Those that are started as programs."""
    without: Mapping[str, str]
    """Methods whose code is not in the archive, and why."""


def gathered(methods: Iterable[str]) -> Gathered:
    """Return the code of the methods from outside among some; its files are read, and nothing is executed."""
    codes: dict[str, Code] = {}
    without: dict[str, str] = {}
    for k, method in enumerate(filter(is_outside, methods), 1):
        try:
            codes[method] = code_of(method).below(f"{CODE}/{k}")
        except BadInput as error:
            without[method] = str(error)
    files = {name: content for code in codes.values() for name, content in code.files.items()}
    executable = tuple(name for code in codes.values() for name in sorted(code.executable))
    return Gathered({method: code.method for method, code in codes.items()}, files, executable, without)


SMALLEST, GREATEST = 1e-150, 1e150
"""Numbers between which scales of powers do not overflow; others are not drawn."""

COLUMNS = ("error_q", "error_y", "energy_error")
"""What is drawn: the first of these that is a number anywhere."""


def draw(out: Path, table: "pd.DataFrame") -> list[Path]:
    """Write the pictures, each as SVG and PNG, and return their paths; there is none where nothing can be drawn on scales of powers."""
    paths: list[Path] = []
    for (problem, case), rows in table.groupby(["problem", "case"], sort=False):
        rows = rows[rows["value"].between(SMALLEST, GREATEST)]
        column = next((name for name in COLUMNS if name in rows and rows[name].between(SMALLEST, GREATEST).any()), None)
        if column is None:
            continue
        stem = re.sub(r"[^A-Za-z0-9._+-]", "_", f"{Path(str(problem)).stem}-{case}")
        _draw(out, stem, rows[rows[column].between(SMALLEST, GREATEST)], column)
        paths += [out / f"{stem}.svg", out / f"{stem}.png"]
    return paths


def _draw(out: Path, stem: str, rows: "pd.DataFrame", column: str) -> None:
    with drawing():
        figure, axes = grid_of_axes(1, 1, 3.4)
        axis = axes[0, 0]
        for method, runs in by_method(rows):
            ordered = runs.sort_values("value")
            axis.plot(ordered["value"], ordered[column], **curve_of(method))
        axis.set(xscale="log", yscale="log", title=stem, xlabel="step size h [s], or tolerance", ylabel=column.replace("_", " "))
        legend_below(figure, axis, 4)
        save(figure, out, stem, rows)
