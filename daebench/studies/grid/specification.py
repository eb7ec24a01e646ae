"""The run, or runs that are made together, of a row of a store: its fields are checked, whoever wrote them."""

import base64
import binascii
from collections.abc import Mapping
from typing import Any

from daebench.errors import BadInput
from daebench.runs.json_values import strict
from daebench.runs.request import ON_SINGULAR, PRECISIONS
from daebench.runs.schema import (
    NOT_NEGATIVE,
    POSITIVE,
    Either,
    Fields,
    Flag,
    Items,
    Kind,
    Named,
    Number,
    Pair,
    Text,
    Whole,
    WrongField,
    wrong,
)
from daebench.starts.draw import DISTRIBUTIONS
from daebench.studies.grid.member_runs import MemberRuns
from daebench.studies.grid.metrics import METRICS
from daebench.studies.grid.parameter_runs import ParameterRuns
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.start_runs import StartRuns

LONGEST_PLACE = 4096
"""Most characters of the path of a file, or of a program with its arguments."""

MOST_MEMBERS = 10**6
"""Largest number of runs of a row."""

NAME = Text(200, 1)
NUMBERS_BY_NAME = Items(Pair(NAME, Number()), most=1000)
MEASURED = {"metrics": Items(Text(words=tuple(METRICS)), most=len(METRICS))}

REQUIRED: Mapping[str, Kind] = {
    "problem": Text(LONGEST_PLACE, 1),
    "case": Text(200),
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


class Settings:
    """Settings of a distribution, as a text of JSON."""

    kind = Named(
        Either((Number(), PAIRS, Named(Items(Number(), most=MOST_MEMBERS))), "a number, or lists of numbers"),
        Text(words=tuple({"vary", *(name for kind in DISTRIBUTIONS.values() for name in kind.__dataclass_fields__)})),
    )

    def read(self, value: Any, place: str) -> str:
        """Return the text."""
        text = Text(10**6).read(value, place)
        try:
            self.kind.read(strict(text), place)
        except WrongField:
            raise
        except ValueError:
            raise wrong(place, value, "a text of JSON") from None
        return text


class Base64:
    """Bytes as text."""

    def read(self, value: Any, place: str) -> str:
        """Return the text."""
        text = Text(2**30).read(value, place)
        try:
            base64.b64decode(text, validate=True)
        except (binascii.Error, ValueError):
            raise wrong(place, value, "bytes in base64") from None
        return text


MEMBERS = Fields(
    {
        **REQUIRED,
        "first": Whole(),
        "members": Whole(1, MOST_MEMBERS),
        "differing": Items(NAME),
        "numbers": Base64(),
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
    {**OPTIONAL, "settings": Settings(), "seed": Whole()},
)
ONE = Fields(REQUIRED, OPTIONAL)


def specification_of(given: Mapping[str, Any]) -> GridRun:
    """Return a run, or several, with the fields that :meth:`GridRun.plain` gives."""
    try:
        if "distribution" in given:
            return StartRuns.of_plain(STARTS.read(given))
        if "varied" in given:
            fields = PARAMETER.read(given)
            return ParameterRuns.of_plain({**fields, "values": tuple(map(float, fields["values"]))})
        if "numbers" in given:
            fields = MEMBERS.read(given)
            return MemberRuns.of_plain({**fields, **{name: tuple(fields[name]) for name in ("differing", "watch")}})
        return GridRun.of_plain(ONE.read(given))
    except WrongField as error:
        raise BadInput(f"this is no run that daebench keeps: {error}.") from error
