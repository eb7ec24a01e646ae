"""A row of a store: the run, or runs that are made together, its key, and its columns; all are checked, whoever wrote them."""

import base64
import json
import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from daebench.errors import BadInput
from daebench.records.code import made_by
from daebench.records.comparison import is_number, same
from daebench.records.seals import digest
from daebench.runs.json_values import strict
from daebench.runs.machine import machine
from daebench.runs.request import ON_SINGULAR, PRECISIONS
from daebench.runs.schema import (
    NOT_NEGATIVE,
    POSITIVE,
    SECONDS,
    Either,
    Fields,
    Flag,
    Items,
    Kind,
    Named,
    Number,
    Pair,
    Such,
    Text,
    Whole,
    WrongField,
    wrong,
)
from daebench.starts.draw import DISTRIBUTIONS
from daebench.studies.grid.member_runs import MemberRuns
from daebench.studies.grid.metrics import METRICS
from daebench.studies.grid.reference import certified_of
from daebench.studies.grid.run_specification import COLUMNS, GridRun, ParameterRuns, StartRuns, defined_by

LONGEST_PLACE = 4096
"""Most characters of the path of a file, or of a program with its arguments."""

MOST_MEMBERS = 10**6
"""Largest number of runs of a row."""

NAME = Text(200, 1)
NUMBERS_BY_NAME = Items(Pair(NAME, Number()), most=1000)
MEASURED = {"metrics": Items(Text(words=tuple(METRICS)), most=len(METRICS))}

REQUIRED: Mapping[str, Kind] = {
    "problem": Text(LONGEST_PLACE, 1),
    "case": Text(LONGEST_PLACE),
    "method": Text(LONGEST_PLACE, 1),
    "value": POSITIVE,
    "t_end": POSITIVE,
    **MEASURED,
}
"""Fields that every run has."""

OPTIONAL: Mapping[str, Kind] = {
    "parameters": NUMBERS_BY_NAME,
    "options": NUMBERS_BY_NAME,
    "precision": Text(words=tuple(PRECISIONS)),
    "compensated": Flag(),
    "anyway": Flag(),
    "on_singular": Text(words=("", *ON_SINGULAR)),
    "outputs": Whole(1, 10**7),
    "repeat": Whole(0, 1000),
    "sweeps": Whole(0, 1000),
    "newton": Number(0.0, 1.0),
    "calls": Whole(),
    "beside": Flag(),
    "start": Whole(0, 2**31),
    "spread": NOT_NEGATIVE,
}
"""Fields that have a default."""

PAIRS = Items(Items(Number(), most=MOST_MEMBERS))

SETTINGS = Named(
    Either((Number(), PAIRS, Named(Items(Number(), most=MOST_MEMBERS))), "a number, or lists of numbers"),
    Text(words=tuple({"vary", *(name for kind in DISTRIBUTIONS.values() for name in kind.__dataclass_fields__)})),
)
"""Settings of a distribution."""


def _reads(read: Callable[[str], Any], longest: int) -> Callable[[Any], bool]:
    """Return the test whether something is a text, not longer than this, that a function reads."""

    def fits(value: Any) -> bool:
        try:
            read(Text(longest).read(value, ""))
        except ValueError:
            return False
        return True

    return fits


SETTINGS_TEXT = Such(_reads(lambda text: SETTINGS.read(strict(text), ""), 10**6), "settings of a distribution, as a text of JSON")
BASE64 = Such(_reads(partial(base64.b64decode, validate=True), 2**30), "bytes in base64")

MEMBERS = Fields(
    {
        **REQUIRED,
        "first": Whole(),
        "members": Whole(1, MOST_MEMBERS),
        "differing": Items(NAME),
        "numbers": BASE64,
        "every": Whole(),
        "steps": Whole(1),
        "watch": Items(NAME),
        "work": Flag(),
    },
    OPTIONAL,
)
PARAMETER = Fields({**REQUIRED, "varied": NAME, "values": Items(Number(), 1, MOST_MEMBERS)}, OPTIONAL)
STARTS = Fields(
    {**REQUIRED, "members": Whole(1, MOST_MEMBERS), "distribution": Text(words=tuple(DISTRIBUTIONS)), "finest": POSITIVE},
    {**OPTIONAL, "settings": SETTINGS_TEXT, "seed": Whole()},
)
ONE = Fields(REQUIRED, OPTIONAL)

KINDS: Mapping[str, tuple[type[GridRun], Fields]] = {
    "distribution": (StartRuns, STARTS),
    "varied": (ParameterRuns, PARAMETER),
    "numbers": (MemberRuns, MEMBERS),
}
"""Runs that are made together, and their fields, by a field that they alone have."""


def specification_of(given: Mapping[str, Any]) -> GridRun:
    """Return a run, or several, with the fields that :meth:`GridRun.plain` gives."""
    kind, fields = next((KINDS[name] for name in KINDS if name in given), (GridRun, ONE))
    try:
        return kind.of_plain(fields.read(given))
    except WrongField as error:
        raise BadInput(f"this is not a run that daebench stores: {error}.", "not-a-stored-run") from error


def require_possible(specification: GridRun) -> None:
    """Accept a run that can be made; raise BadInput if it cannot, as where the method refuses the problem."""
    _require_own_columns(specification)
    solver = specification.solver
    solver.check(specification.ivp, specification.asked(solver.knob))


def _require_own_columns(specification: GridRun) -> None:
    """Refuse numbers whose column would be overwritten."""
    measured = {column for name in specification.metrics if name in METRICS for column in METRICS[name].columns}
    given = [name for name, _ in (*specification.parameters, *specification.options)]
    for k, name in enumerate(given):
        if name in COLUMNS | measured or name in given[:k]:
            raise BadInput(
                f"{name} of {specification.problem} has the name of another column of a study's table; rename it to study it.",
                "parameter-named-as-column",
            )


def key_of(specification: GridRun) -> str:
    """Return the hash of all that decides the numbers: run, definition, code, versions of libraries, reference, and processor.

    The reference is in it where an error against it is measured, the processor where time is, and of a method from outside its files. The
    place of a problem file is not, nor its name or its text: a folder that is moved, to another machine too, or a comment, loses no row.
    """
    memory = vars(specification)  # of this run alone: an equal one made later may find another text in the same file
    if "_key" not in memory:
        memory["_key"] = _key(specification)
    return str(memory["_key"])


def _key(specification: GridRun) -> str:
    name = {"problem": ""} if specification.ivp.source.outside else {}
    plain = json.dumps(specification.plain() | {"metrics": sorted(specification.metrics)} | name, sort_keys=True)
    code = filter(None, [specification.code])
    timed_on = machine() if specification.repeat else ""
    return digest(plain, *defined_by(specification.ivp), made_by(), timed_on, _certificate(specification), *code)


def _certificate(specification: GridRun) -> str:
    """Return the checksum of the certificate, which has that of the numbers in it, or that there is none; "" without errors to measure."""
    if not any(METRICS[name].certified for name in specification.metrics if name in METRICS):
        return ""
    certified = certified_of(specification)
    return str(certified.certificate["checksum"]) if certified else "a finer run"


WORDS = ("energy_verdict", "energy_law")
"""Columns of metrics that have words."""

LONGEST = 10**5
"""Most characters of a sentence in a row."""

REPEATED = ("case", "method", "value", "t_end")
"""Fields of a run that its row repeats; the place of a problem's file may be another."""

ALSO_REPEATED = ("precision", "compensated", "sweeps", "newton", "start")
"""Fields of a run that some rows repeat."""

REAL = Such(is_number, "a number")
NUMBER_OR_TEXT = Such(lambda value: is_number(value) or isinstance(value, str), "a number or a text")
UNTIMED = Such(lambda value: isinstance(value, float) and math.isnan(value), "not a number, as nothing is timed in its run")
SENTENCE = Text(LONGEST)
WORK: Mapping[str, Kind] = {"steps": Whole(), "failure": SENTENCE}
ONE_ROW: Mapping[str, Kind] = {**WORK, "knob": Text(40), "t_reached": Number()}
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
        raise BadInput(f"a row of {specification.method[:60]} is not what daebench writes: {error}.", "stored-row-malformed") from error


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
    if type(specification) is GridRun:
        return {**ONE_ROW, **{column: _entry(column) for column in (next(iter(METRICS[name].columns)) for name in specification.metrics)}}
    names = specification.columns if isinstance(specification, ParameterRuns) else ("failure", *_errors(specification.metrics))
    n = specification.count
    return {name: Items(WORK.get(name, _entry(name)), n, n) for name in names}


def _errors(metrics: Sequence[str]) -> list[str]:
    return [column for metric in metrics for column in METRICS[metric].columns]


def _entry(column: str) -> Kind:
    """Return the kind of an entry in a column of a metric: words, or not a number where there are none, or a number."""
    return NUMBER_OR_TEXT if column in WORDS else REAL


def _others(specification: GridRun, row: Mapping[str, Any]) -> dict[str, Kind]:
    """Return the columns that a row may have: older versions have fewer columns of a metric."""
    if isinstance(specification, MemberRuns | ParameterRuns):
        return {}
    time: Kind = Either((SECONDS, UNTIMED), "a time, or not a number") if specification.repeat else UNTIMED
    if isinstance(specification, StartRuns):
        n = specification.members
        return dict.fromkeys(TIMES, Either((time, Items(time, n, n)), "a time that fits its run, or a list of them"))
    counts = {name: Whole() for name in row if name.startswith("n_")}
    return {
        **dict.fromkeys(TIMES, time),
        **counts,
        **{column: _entry(column) for column in _errors(specification.metrics)},
    }


def _require_lengths(members: int, row: Mapping[str, Any]) -> None:
    for name, value in row.items():
        if isinstance(value, list) and len(value) != members:
            raise wrong(f"row.{name}", value, f"a list of {members} entries")
