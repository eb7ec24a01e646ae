"""Comparison of an archive of a study with new runs: equal to the bit, within a tolerance, or different."""

import math
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from daebench.errors import BadInput, DaebenchError
from daebench.methods.foreign import is_own_method
from daebench.records.code import code_version, put
from daebench.records.comparison import DIFFERS, EQUAL, WITHIN, Compared, Place, Rounding, compare, is_number, same_sentence
from daebench.records.store import StoredRow
from daebench.studies.grid.archive import Archive, foreign_names
from daebench.studies.grid.archive_code import FOLDER, placed
from daebench.studies.grid.measure import row_of
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.specification import specification_of
from daebench.studies.grid.specification_key import key_of
from daebench.systems.files.execute import executing_nothing

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
        code = {name: content for name, content in archive.files.items() if name.startswith(("definitions/", f"{FOLDER}/"))}
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
        raise BadInput(f"{specification.method} is to take {steps:.3g} steps in the archive, which are more than {MOST_STEPS:g}.")


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
