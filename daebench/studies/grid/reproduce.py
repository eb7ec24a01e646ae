"""Comparison of an archive of a study with new runs: equal to the bit, within a tolerance, or different."""

import hashlib
import math
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from daebench.errors import BadInput, DaebenchError
from daebench.methods.foreign import ForeignName, Trust, admit, is_own_method
from daebench.runs.json_values import MOST, strict
from daebench.runs.provenance import ORIGIN
from daebench.runs.schema import DIGEST, SECONDS, Fields, Items, Named, Text, Whole, WrongField, shown
from daebench.runs.zipped import MOST_MEMBERS, UNREADABLE
from daebench.runs.zipped import unpacked as unpacked_files
from daebench.studies.certificate.code import is_inside
from daebench.studies.grid.archive import FORMAT, MANIFEST, ROWS
from daebench.studies.grid.archive_code import FOLDER, foreign_method, placed
from daebench.studies.grid.measure import row_of
from daebench.studies.grid.row_fields import require_row, same
from daebench.studies.grid.run_specification import GridRun, code_version
from daebench.studies.grid.specification import specification_of
from daebench.studies.grid.specification_key import key_of
from daebench.studies.grid.store import StoredRow, of_json
from daebench.systems.files.execute import executing_nothing

T = TypeVar("T")

EQUAL, WITHIN, DIFFERS = "equal to the bit", "within", "differs"
"""What is said of a run."""

UNTOLD = frozenset({"problem", "method", "seconds", "seconds_least", "seconds_most", "callback_seconds", "compile_seconds", "lanes"})
"""Columns that are not compared: times are of another machine or another hour, and files of one's own are elsewhere."""

LARGEST = 2**26
"""Bytes that an archive may have in any case when it is unpacked."""

RATIO = 50.0
"""Largest ratio of the bytes of a larger archive to those of its ZIP file; archives of studies have 3 to 30."""

MOST_ROWS = 10**6
"""Largest number of rows."""

MOST_STEPS = 1e9
"""Largest number of steps of a run: an archive of others is not to keep a machine busy for ever."""

LONGEST = 200
"""Most characters of what is said of an error."""

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

    @property
    def executable(self) -> tuple[str, ...]:
        """Files in it that are started as programs."""
        return tuple(self.manifest.get("executable", ()))


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
    absent : tuple of str
        Columns that the row of another version of daebench lacks, and that are not compared.
    """

    specification: GridRun
    verdict: str
    column: str = ""
    archived: Any = None
    new: Any = None
    absent: tuple[str, ...] = ()

    @property
    def difference(self) -> float:
        """The largest difference, relative to the larger of the two numbers; 0 where they are equal, NaN where one is not finite."""
        if self.verdict == EQUAL:
            return 0.0
        finite = all(isinstance(x, int | float) and math.isfinite(x) for x in (self.archived, self.new))
        return _relative(float(self.archived), float(self.new)) if finite else math.nan


def read(path: Path, trust: Trust | None = None) -> Archive:
    """Return an archive, all of it checked; nothing in it is executed.

    Raises
    ------
    BadInput
        If there is none, it is damaged, of another version, or too large, a field is not what daebench writes, a name leads out of it, or
        it names code that is not in it or not trusted.
    """
    if not path.is_file():
        raise BadInput(f"there is no archive {path}; daebench archive STUDY.db makes one.")
    try:
        files = unpacked_files(path, str(path), small=LARGEST, ratio=RATIO)
        _require_safe(path, files)
        manifest = strict(files.pop(MANIFEST))
        _require_version(path, manifest)
        manifest = MANIFESTED.read(manifest, "manifest")
        if manifest["format"] > 1 and (lacking := [name for name in LATER if name not in manifest]):
            raise WrongField(f"manifest has no {lacking[0]}")
        _require_whole(manifest["files"], files)
        rows = _rows(files[ROWS])
    except UNREADABLE as error:
        raise BadInput(f"{path}: {OTHER}: {_short(error)}; get it again from where it came.") from error
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


def _short(error: BaseException) -> str:
    words = " ".join(str(error).split())
    name = "" if isinstance(error, WrongField) or type(error) is ValueError else f"{type(error).__name__} "
    return (name + (words if len(words) <= LONGEST else f"{words[:LONGEST]}...")).strip().rstrip(".")


def _require_safe(path: Path, names: Iterable[str]) -> None:
    """Refuse names that lead out of the archive."""
    for name in names:
        if not is_inside(name):
            raise BadInput(f"{path} has a file {name[:80]!r}, whose name leads out of it; it is not unpacked.")


def _require_version(path: Path, manifest: Any) -> None:
    layout = manifest["format"]
    if layout not in READ or isinstance(layout, bool):
        age = "a newer" if isinstance(layout, int) and layout > FORMAT else "another"
        raise BadInput(f"{path} was written by {age} daebench (format {shown(layout)}, here {FORMAT}); take that version.")


def _require_whole(digests: Mapping[str, str], files: Mapping[str, bytes]) -> None:
    """Refuse what is not what was written."""
    wrong = [name for name in {*digests, *files} if name not in files or digests.get(name) != hashlib.sha256(files[name]).hexdigest()]
    if wrong:
        raise ValueError(f"{min(wrong)} is not what was written")


def _require_of(run: GridRun, row: Mapping[str, Any]) -> None:
    """Refuse a row that is not of its run, or is of another problem."""
    require_row(run, row)
    if row["problem"] != run.problem:
        raise BadInput(f"row.problem is {shown(row['problem'])}, and must be that of its run.")


def _at_row(path: Path, number: int, check: Callable[[], T]) -> T:
    """Return what a check of a row returns; where it refuses the row, its place is named."""
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
            foreign_method(method, digests, archive.executable),
        ]
    return names


@contextmanager
def unpacked(archive: Archive) -> Iterator[list[tuple[StoredRow, GridRun]]]:
    """Give the runs of an archive as they are made here, its code in a folder for the time of a block."""
    with tempfile.TemporaryDirectory(prefix="daebench-") as folder:
        for name, content in archive.files.items():
            if name.startswith(("definitions/", f"{FOLDER}/")):
                place = Path(folder, name)
                place.parent.mkdir(parents=True, exist_ok=True)
                place.write_bytes(content)
                place.chmod(0o700 if name in archive.executable else 0o600)
        yield [(row, _specification(row, Path(folder), archive)) for row in archive.rows]


def _specification(row: StoredRow, folder: Path, archive: Archive) -> GridRun:
    specification = specification_of(row.specification)
    problem = str(folder / specification.problem) if specification.problem in archive.own else specification.problem
    return replace(specification, problem=problem, method=placed(specification.method, folder))


def reproduced(
    archive: Archive, *, rtol: float, atol: float, tell: Callable[[float], None] = lambda fraction: None
) -> Iterator[Reproduced]:
    """Make the runs of an archive again, and give each beside what is archived; ``tell`` is told which fraction of them is done.

    Two numbers are within where they differ by no more than ``rtol`` times the larger, or by ``atol``.

    Raises
    ------
    BadInput
        If a run has more steps than :data:`MOST_STEPS`, or cannot be begun.
    """
    executing = nullcontext() if any(not name.is_own for name in foreign_names(archive)) else executing_nothing(UNNAMED)
    with unpacked(archive) as runs, executing:
        for done, (row, specification) in enumerate(runs, 1):
            _require_short(specification)
            made = row_of(replace(specification, repeat=min(specification.repeat, 1)))
            comparison = compared(row.row, made, rtol=rtol, atol=atol, complete=row.maker == code_version())
            named = specification_of(row.specification)
            if comparison.verdict != DIFFERS and (key := _key_here(archive, row, named)) != row.key:
                comparison = Reproduced(named, DIFFERS, "key", row.key, key)
            yield replace(comparison, specification=named)
            tell(done / len(runs))


UNNAMED = "was not found among the names in the archive, and is not executed."


def _key_here(archive: Archive, row: StoredRow, specification: GridRun) -> str:
    """Return the key that the row of a run has here; its own where that may be another.

    It may for rows of another version, files that were elsewhere, and runs that were timed, as the processor is in their key.
    """
    elsewhere = specification.problem in archive.own or not is_own_method(specification.method)
    return row.key if row.maker != code_version() or specification.repeat or elsewhere else key_of(specification)


def _require_short(specification: GridRun) -> None:
    """Refuse a run that takes for ever; what cannot be begun is refused where it is made."""
    try:
        resolution = specification.solver.knob
    except DaebenchError:
        return
    steps = specification.t_end / specification.value * specification.count if resolution == "h" else 0.0
    if steps > MOST_STEPS:
        raise BadInput(f"{specification.method} is to take {steps:.3g} steps in the archive, which are more than {MOST_STEPS:g}.")


def compared(archived: Mapping[str, Any], new: Mapping[str, Any], *, rtol: float, atol: float, complete: bool = True) -> Reproduced:
    """Return what is to be said of two rows: where they differ most.

    Counts of work may differ by half of the larger, since another processor rounds otherwise, but not the number of steps of a given size;
    words of failures may differ in their numbers and places of files. Where the archived row is not ``complete``, as one of another version
    of daebench may not be, the columns that it lacks are told.
    """
    nobody: Any = None
    differ = _Verdict(rtol, atol, fixed=new.get("knob") == "h")
    lacking = tuple(name for name in new if name not in archived)
    differences = [Reproduced(nobody, DIFFERS, name, None, new[name]) for name in lacking if complete]
    for name in archived:
        for old, now in () if name in UNTOLD else _entries(archived[name], new.get(name)):
            word = differ.verdict(name, old, now) if name in new else DIFFERS
            differences += [Reproduced(nobody, word, name, old, now)] if word != EQUAL else []
    worst = max(differences, key=_rank, default=Reproduced(nobody, EQUAL))
    return replace(worst, absent=() if complete else lacking)


def _rank(run: Reproduced) -> tuple[bool, float]:
    """Return how far a difference is ahead of others."""
    return run.verdict == DIFFERS, -1.0 if math.isnan(run.difference) else run.difference


def _entries(old: Any, now: Any) -> list[tuple[Any, Any]]:
    """Return the values that are compared with each other: two, or those of two lists."""
    lists = isinstance(old, list) and isinstance(now, list) and len(old) == len(now)
    return list(zip(old, now, strict=True)) if lists else [(old, now)]


PLACE_OR_NUMBER = re.compile(r"\S*[/\\]\S*|\S*\.py\b\S*|-?\d+(\.\d*)?(e[-+]?\d+)?")
"""What may be another in the words of the same failure: the place of a file, or a number."""


@dataclass(frozen=True)
class _Verdict:
    """How closely values have to agree: tolerances of numbers, and whether steps are of a given size."""

    rtol: float
    atol: float
    fixed: bool

    def verdict(self, name: str, old: Any, now: Any) -> str:
        """Return whether two values of a column are equal, within, or differ."""
        if same(old, now) or (_is_nan(old) and _is_nan(now)):
            return EQUAL
        if name == "failure":
            return WITHIN if len({PLACE_OR_NUMBER.sub("#", str(words)) for words in (old, now)}) == 1 else DIFFERS
        if isinstance(old, str | bool | list | None) or isinstance(now, str | bool | list | None):
            return DIFFERS
        return WITHIN if math.isfinite(old - now) and abs(old - now) <= self._most(name, max(abs(old), abs(now))) else DIFFERS

    def _most(self, name: str, larger: float) -> float:
        """Return the largest difference of two numbers of a column that is within."""
        if name == "steps" and self.fixed:
            return 0.0
        return larger / 2 if name.startswith("n_") or name == "steps" else max(self.atol, self.rtol * larger)


def _is_nan(x: Any) -> bool:
    return isinstance(x, float) and math.isnan(x)


def _relative(a: float, b: float) -> float:
    return abs(a - b) / max(abs(a), abs(b)) if a != b else 0.0
