"""Whether a row of a store or an archive is one of its run: what its run measures is there, once for each run that it has."""

import math
from collections.abc import Mapping
from typing import Any

from daebench.errors import BadInput
from daebench.records.comparison import same
from daebench.runs.schema import SECONDS, Either, Fields, Items, Kind, Number, Text, Whole, WrongField, wrong
from daebench.studies.grid.member_runs import MemberRuns
from daebench.studies.grid.metrics import METRICS
from daebench.studies.grid.parameter_runs import ParameterRuns
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.start_runs import StartRuns

WORDS = ("energy_verdict", "energy_law")
"""Columns of metrics that have words."""

LONGEST = 10**5
"""Most characters of a sentence in a row."""

REPEATED = ("case", "method", "value", "t_end")
"""Fields of a run that its row repeats; the place of a problem's file may be another."""

ALSO_REPEATED = ("precision", "compensated", "sweeps", "newton", "start")
"""Fields of a run that some rows repeat."""


class Real:
    """A number, finite or not."""

    def read(self, value: Any, place: str) -> float:
        """Return the number."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise wrong(place, value, "a number")
        return value


class NumberOrText:
    """A number or a text: an entry of a column of a metric."""

    def read(self, value: Any, place: str) -> float | str:
        """Return the entry."""
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise wrong(place, value, "a number or a text")
        return value


class Untimed:
    """The time of a run that is not timed, which is not a number."""

    def read(self, value: Any, place: str) -> float:
        """Return it."""
        if not isinstance(value, float) or not math.isnan(value):
            raise wrong(place, value, "not a number, as nothing is timed in its run")
        return value


SENTENCE = Text(LONGEST)
WORK: Mapping[str, Kind] = {"steps": Whole(), "failure": SENTENCE}
ONE: Mapping[str, Kind] = {**WORK, "knob": Text(40), "t_reached": Number()}
TIMES = ("seconds", "seconds_least", "seconds_most", "callback_seconds")


def require_row(specification: GridRun, row: Mapping[str, Any]) -> None:
    """Accept a row that can be of a run."""
    try:
        Fields({"problem": Text(LONGEST), **_columns(specification)}, _others(specification, row), open=True).read(row, "row")
        for name, value in _repeated(specification, row).items():
            if not same(row.get(name), value):
                raise wrong(f"row.{name}", row.get(name), "that of its run")
        if isinstance(specification, StartRuns):
            _require_lengths(specification.members, row)
    except WrongField as error:
        raise BadInput(f"a row of {specification.method[:60]} is not what daebench writes: {error}.") from error


def _repeated(specification: GridRun, row: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a run that its row has to repeat."""
    given = {
        **{name: getattr(specification, name) for name in ALSO_REPEATED},
        **dict(specification.parameters),
        **dict(specification.options),
    }
    return {name: getattr(specification, name) for name in REPEATED} | {name: value for name, value in given.items() if name in row}


def _columns(specification: GridRun) -> dict[str, Kind]:
    """Return the columns that a row must have."""
    if isinstance(specification, MemberRuns):
        most = specification.members
        failures = {"failed": Items(Whole(0, most - 1), most=most), "failure": Items(SENTENCE, most=most)}
        return {**failures, "arrays": Text(2**30), "seconds": SECONDS, "compile_seconds": SECONDS, "lanes": Whole()}
    if isinstance(specification, ParameterRuns):
        n = len(specification.values)
        kinds: dict[str, Kind] = {name: WORK.get(name, _entry(name)) for name in specification.columns}
        return {name: Items(kind, n, n) for name, kind in kinds.items()}
    if isinstance(specification, StartRuns):
        n = specification.members
        parts = {f"{what}_{part}": Items(Real(), n, n) for part in specification.metrics for what in ("error", "bound")}
        return {**parts, "failure": Items(SENTENCE, n, n)}
    return {**ONE, **{column: _entry(column) for column in (next(iter(METRICS[name].columns)) for name in specification.metrics)}}


def _entry(column: str) -> Kind:
    """Return the kind of an entry in a column of a metric: words, or not a number where there are none, or a number."""
    return NumberOrText() if column in WORDS else Real()


def _others(specification: GridRun, row: Mapping[str, Any]) -> dict[str, Kind]:
    """Return the columns that a row may have: older versions have fewer columns of a metric."""
    if isinstance(specification, MemberRuns | ParameterRuns):
        return {}
    time: Kind = Either((SECONDS, Untimed()), "a time, or not a number") if specification.repeat else Untimed()
    if isinstance(specification, StartRuns):
        n = specification.members
        return dict.fromkeys(TIMES, Either((time, Items(time, n, n)), "a time that fits its run, or a list of them"))
    counts = {name: Whole() for name in row if name.startswith("n_")}
    return {
        **dict.fromkeys(TIMES, time),
        **counts,
        **{column: _entry(column) for name in specification.metrics for column in METRICS[name].columns},
    }


def _require_lengths(members: int, row: Mapping[str, Any]) -> None:
    for name, value in row.items():
        if isinstance(value, list) and len(value) != members:
            raise wrong(f"row.{name}", value, f"a list of {members} entries")
