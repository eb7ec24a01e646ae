"""Whether a row of a store or an archive is one of its run: what its run measures is there, once for each run that it has."""

from collections.abc import Mapping
from typing import Any

from daebench.errors import BadInput
from daebench.runs.schema import NOT_NEGATIVE, Fields, Items, Kind, Number, Text, Whole, WrongField, wrong
from daebench.studies.grid.member_runs import MemberRuns
from daebench.studies.grid.metrics import METRICS
from daebench.studies.grid.parameter_runs import ParameterRuns
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.start_runs import StartRuns

LONGEST = 10**5
"""Most characters of a sentence in a row."""

REPEATED = ("case", "method", "value", "t_end")
"""Fields of a run that its row repeats; the place of a problem's file may be another."""


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


SENTENCE = Text(LONGEST)
WORK: Mapping[str, Kind] = {"steps": Whole(), "failure": SENTENCE}
ONE: Mapping[str, Kind] = {**WORK, "knob": Text(40), "t_reached": Number()}
TIMES: Mapping[str, Kind] = {"seconds": Real(), "callback_seconds": Real()}


def require_row(specification: GridRun, row: Mapping[str, Any]) -> None:
    """Accept a row that can be of a run.

    Raises
    ------
    BadInput
        If a column is missing, or is not of its type or length, or repeats another run.
    """
    try:
        Fields({"problem": Text(LONGEST), **_columns(specification)}, _others(specification, row), open=True).read(row, "row")
        for name in REPEATED:
            if row.get(name) != getattr(specification, name):
                raise wrong(f"row.{name}", row.get(name), "that of its run")
        if isinstance(specification, StartRuns):
            _require_lengths(specification.members, row)
    except WrongField as error:
        raise BadInput(f"a row of {specification.method[:60]} is not what daebench writes: {error}.") from error


def _columns(specification: GridRun) -> dict[str, Kind]:
    """Return what a row must have."""
    if isinstance(specification, MemberRuns):
        most = specification.members
        failures = {"failed": Items(Whole(0, most - 1), most=most), "failure": Items(SENTENCE, most=most)}
        return {**failures, "arrays": Text(2**30), "seconds": NOT_NEGATIVE, "compile_seconds": NOT_NEGATIVE, "lanes": Whole()}
    if isinstance(specification, ParameterRuns):
        n = len(specification.values)
        kinds: dict[str, Kind] = {name: WORK.get(name, NumberOrText()) for name in specification.columns}
        return {name: Items(kind, n, n) for name, kind in kinds.items()}
    if isinstance(specification, StartRuns):
        n = specification.members
        parts = {f"{what}_{part}": Items(Real(), n, n) for part in specification.metrics for what in ("error", "bound")}
        return {**parts, "failure": Items(SENTENCE, n, n)}
    return {**ONE, **{column: _entry(column) for column in (next(iter(METRICS[name].columns)) for name in specification.metrics)}}


def _entry(column: str) -> Kind:
    """Return what an entry of a column of a metric is: errors and their bounds are numbers, others may be words."""
    return Real() if column.startswith(("error_", "bound_")) else NumberOrText()


def _others(specification: GridRun, row: Mapping[str, Any]) -> dict[str, Kind]:
    """Return what a row may have: older versions have fewer columns of a metric."""
    if type(specification) is not GridRun:
        return {}
    counts = {name: Whole() for name in row if name.startswith("n_")}
    return {**TIMES, **counts, **{column: _entry(column) for name in specification.metrics for column in METRICS[name].columns}}


def _require_lengths(members: int, row: Mapping[str, Any]) -> None:
    for name, value in row.items():
        if isinstance(value, list) and len(value) != members:
            raise wrong(f"row.{name}", value, f"a list of {members} entries")
