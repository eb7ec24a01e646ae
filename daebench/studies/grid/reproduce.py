"""An archive of a study read, all of it checked, and compared with new runs: equal to the bit, within a tolerance, or different."""

import math
import tempfile
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from daebench.errors import BadInput, DaebenchError
from daebench.methods.foreign import ForeignName, Trust, admit, is_own_method
from daebench.records.code import Code, code_version, put, renamed, words_of
from daebench.records.comparison import DIFFERS, EQUAL, WITHIN, Compared, Place, Rounding, compare, is_number, same_sentence
from daebench.records.rows import StoredRow, of_json
from daebench.records.seals import digests, is_inside, of_another_version, words
from daebench.runs.json_values import MOST, strict
from daebench.runs.provenance import ORIGIN
from daebench.runs.schema import DIGEST, SECONDS, Fields, Items, Named, Text, Whole, WrongField, shown
from daebench.runs.zipped import MOST_MEMBERS, UNREADABLE
from daebench.runs.zipped import unpacked as unpacked_files
from daebench.studies.grid.archive import CODE, FORMAT, MANIFEST, ROWS
from daebench.studies.grid.measure import row_of
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.specification import key_of, require_row, specification_of
from daebench.systems.files.execute import executing_nothing

T = TypeVar("T")

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


def read(path: Path, trust: Trust | None = None) -> Archive:
    """Return an archive, all of it checked; nothing in it is executed."""
    if not path.is_file():
        raise BadInput(f"there is no archive {path}; daebench archive STUDY.db makes one.", "no-such-archive")
    try:
        files = unpacked_files(path, str(path), small=LARGEST, ratio=RATIO)
        _require_safe(path, files)
        manifest = strict(files.pop(MANIFEST))
        if sentence := of_another_version(path, manifest["format"], *READ):
            raise BadInput(sentence, "archive-of-other-version")
        manifest = MANIFESTED.read(manifest, "manifest")
        if manifest["format"] > 1 and (lacking := [name for name in LATER if name not in manifest]):
            raise WrongField(f"manifest has no {lacking[0]}")
        _require_whole(manifest["files"], files)
        rows = _rows(files[ROWS])
    except UNREADABLE as error:
        raise BadInput(f"{path}: {OTHER}: {words(error)}; get it again from where it came.", "archive-damaged") from error
    archive = Archive(manifest, rows, files)
    if not rows:
        raise BadInput(f"{path} has no runs, so that there is nothing to compare; archive a study that has some.", "archive-without-runs")
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
            raise BadInput(f"{path} has a file {name[:80]!r}, whose name leads out of it; it is not unpacked.", "archive-path-leads-out")


def _require_whole(expected: Mapping[str, str], files: Mapping[str, bytes]) -> None:
    """Refuse content that is not as it was written."""
    if altered := dict(expected.items() ^ digests(files).items()):
        raise ValueError(f"{min(altered)} is not what was written")


def _require_of(run: GridRun, row: Mapping[str, Any]) -> None:
    """Refuse a row that is not of its run, or is of another problem."""
    require_row(run, row)
    if row["problem"] != run.problem:
        raise BadInput(f"row.problem is {shown(row['problem'])}, and must be that of its run.", "archive-row-of-other-problem")


def _at_row(path: Path, number: int, check: Callable[[], T]) -> T:
    """Return the result of the check of a row; where it refuses the row, its place is named."""
    try:
        return check()
    except BadInput as error:
        raise BadInput(f"{path}, {ROWS}, row {number}: {error}", "archive-row-faulty") from error


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


def placed(method: str, folder: Path) -> str:
    """Return the name of a method of an archive that is unpacked into a folder."""
    return renamed(method, lambda word: str(folder / word) if word.startswith(f"./{CODE}/") else word)


def foreign_method(method: str, files: Mapping[str, bytes], digests: Mapping[str, str], executable: Collection[str]) -> ForeignName:
    """Return the name of a method in an archive, with the digests of the files in it that it leads to; none if it leads elsewhere.

    ``executable`` are the names of files in the archive that are started as programs.
    """
    inside = {name: content for name, content in files.items() if name.startswith(f"{CODE}/")}
    code = Code(method, inside, frozenset(executable))
    folders = {tuple(word.split("/")[1:3]) for word in words_of(method) if word.removeprefix("./") in inside}
    beside = {name: digest for name, digest in digests.items() if tuple(name.split("/")[:2]) in folders}
    return ForeignName(method, True, beside if code.is_beside else {}, code.is_alone)


UNTOLD = frozenset({"problem", "method", "seconds", "seconds_least", "seconds_most", "callback_seconds", "compile_seconds", "lanes"})
"""Columns that are not compared: times are of another machine or another hour, and files of one's own are elsewhere."""

MOST_STEPS = 1e9
"""Largest number of steps of a run: an archive of others is not to keep a machine busy for ever."""


@dataclass(frozen=True)
class Reproduced:
    """A run of an archive beside a new one."""

    specification: GridRun
    """The run."""
    verdict: str
    """Equal, within or differs, see :mod:`daebench.records.comparison`."""
    column: str = ""
    """Where the two differ most; "" where they are equal."""
    archived: Any = None
    new: Any = None
    """The values there."""
    difference: float = 0.0
    """That of the two numbers, relative to the larger; NaN where one is no finite number."""
    absent: tuple[str, ...] = ()
    """Columns that the row of another version of daebench lacks, and that are not compared."""


@contextmanager
def unpacked(archive: Archive) -> Iterator[list[tuple[StoredRow, GridRun]]]:
    """Give the runs of an archive as they are made here, its code in a folder for the time of a block."""
    with tempfile.TemporaryDirectory(prefix="daebench-") as folder:
        code = {name: content for name, content in archive.files.items() if name.startswith(("definitions/", f"{CODE}/"))}
        put(code, Path(folder), archive.executable)
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
    """
    executing = nullcontext() if any(not name.is_own for name in foreign_names(archive)) else executing_nothing(UNNAMED)
    with unpacked(archive) as runs, executing:
        for done, (row, specification) in enumerate(runs, 1):
            _require_short(specification)
            new = row_of(replace(specification, repeat=min(specification.repeat, 1)))
            named = specification_of(row.specification)
            comparison = compared(row.row, new, rtol=rtol, atol=atol, complete=row.maker == code_version(), specification=named)
            if comparison.verdict != DIFFERS and (key := _key_here(archive, row, named)) != row.key:
                comparison = Reproduced(named, DIFFERS, "key", row.key, key, math.nan)
            yield comparison
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
        raise BadInput(
            f"{specification.method} is to take {steps:.3g} steps in the archive, which are more than {MOST_STEPS:g}.",
            "archive-too-many-steps",
        )


def compared(
    archived: Mapping[str, Any], new: Mapping[str, Any], *, rtol: float, atol: float, complete: bool = True, specification: Any = None
) -> Reproduced:
    """Compare two rows of a run, and return where they differ most.

    Counts of work may differ by half of the larger, since another processor rounds otherwise, but not the number of steps of a given size;
    words of failures may differ in their numbers and places of files. Where the archived row is not ``complete``, as one of another version
    of daebench may not be, the columns that it lacks are not compared.
    """
    absent = () if complete else tuple(name for name in new if name not in archived)
    left_out = {*UNTOLD.intersection(archived), *absent}
    old, now = ({name: value for name, value in row.items() if name not in left_out} for row in (archived, new))
    worst = max(compare(old, now, _rounding(rtol, atol, fixed=new.get("knob") == "h")), key=_rank, default=None)
    if worst is None or worst.verdict == EQUAL:
        return Reproduced(specification, EQUAL, absent=absent)
    return Reproduced(specification, worst.verdict, str(worst.place[0]), worst.old, worst.new, worst.difference, absent)


def _rank(pair: Compared) -> tuple[int, float]:
    """Return how far a difference is ahead of others."""
    return (EQUAL, WITHIN, DIFFERS).index(pair.verdict), -1.0 if math.isnan(pair.difference) else pair.difference


def _rounding(rtol: float, atol: float, *, fixed: bool) -> Rounding:
    """Return which differences between two rows rounding may make, of runs whose steps are ``fixed`` in size or not."""

    def rounding(place: Place, old: Any, new: Any) -> bool:
        name = str(place[0])
        if not is_number(old) or not is_number(new):
            return name == "failure" and same_sentence(old, new)
        larger = max(abs(old), abs(new))
        if name == "steps" or name.startswith("n_"):
            return bool(abs(old - new) <= larger / 2) and not (name == "steps" and fixed)
        return bool(abs(old - new) <= max(atol, rtol * larger))

    return rounding
