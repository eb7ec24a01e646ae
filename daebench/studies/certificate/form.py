"""What the fields of a certificate must be, whoever wrote it: type, range and length of each."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from daebench.methods.outside.method import Stated
from daebench.records.sealed import is_inside
from daebench.runs.provenance import ORIGIN
from daebench.runs.request import ON_SINGULAR
from daebench.runs.schema import (
    DIGEST,
    POSITIVE,
    SECONDS,
    Either,
    Fields,
    Flag,
    Items,
    Kind,
    Named,
    Nothing,
    Number,
    Text,
    Whole,
    WrongField,
    maybe,
    wrong,
)
from daebench.studies.certificate.record import FORMAT, SCHEMA, verdicts

MOST_PROBLEMS, MOST_STEPS, MOST_RUNS = 32, 10**8, 64
"""Problems of a certificate, steps of a run, and runs of an order study, at most: a certificate of others is not to keep a machine busy."""

NAME, PLACE, WORDS = Text(200), Text(4096, 1), Text(10_000)
NUMBER = maybe(Number(), "a finite number")
SERIES = Items(NUMBER)
STEPS = Whole(1, MOST_STEPS)


class Inside:
    """The path of a file that stands beside a certificate."""

    def read(self, value: Any, place: str) -> str:
        """Return the path; refuse one that leads out of its folder."""
        if not is_inside(PLACE.read(value, place)):
            raise wrong(place, value, "a path that does not lead out of its folder")
        return str(value)


FILES = Named(DIGEST, Inside())
CODE = Fields({"hash": DIGEST, "files": FILES, "executable": Items(Inside())})

SETTING = Fields(
    {
        "h": POSITIVE,
        "counts": Items(STEPS, 1, MOST_RUNS),
        **dict.fromkeys(("steps", "every", "error_steps", "checked_steps"), STEPS),
    }
)

CLAIMED = Either((Nothing(), Flag(), Whole()), "nothing, true, false or an order")
FINDING = Fields(
    {
        "property": NAME,
        "claimed": CLAIMED,
        "verdict": NAME,
        "note": WORDS,
        **dict.fromkeys(("measured", "bound", "standard_error"), NUMBER),
    }
)

FAILURE = maybe(WORDS, "a sentence")
ENERGY = Fields(
    {
        "t": NUMBER,
        "verdict": NAME,
        "law": WORDS,
        "reason": WORDS,
        "failure": FAILURE,
        **dict.fromkeys(("largest", "exponent", "change_bound", "size"), NUMBER),
    }
)

ERROR: Mapping[str, Kind] = {
    "t": NUMBER,
    "value": NUMBER,
    "bound": NUMBER,
    "reference": WORDS,
    "sha256": maybe(DIGEST, "a SHA-256"),
    "failure": FAILURE,
}
FIT = Fields({"order": NUMBER, "standard_error": NUMBER})

NUMBERS = Fields(
    {
        "error": Fields(ERROR),
        "energy": ENERGY,
        "conserved": Named(NUMBER, NAME),
        "curve": Fields(dict.fromkeys(("t", "least", "largest"), SERIES)),
        "claims": Named(FINDING, NAME),
        "orders": Fields({"components": Named(FIT, NAME), "contraction": NUMBER, "h": SERIES, "errors": Named(SERIES, NAME)}),
    }
)

ASKED: Mapping[str, Kind] = {
    "problem": PLACE,
    "case": maybe(NAME, "a name"),
    "changed": Named(Number(), NAME),
    "guessed": Flag(),
    "h": maybe(POSITIVE, "a positive number"),
    "files": FILES,
}
MEASURED: Mapping[str, Kind] = {"parameters": Named(Number(), NAME), "definition": DIGEST, "setting": SETTING, "numbers": NUMBERS}


class Problem:
    """A problem: with what was measured, or with why it was refused."""

    measured, refused = Fields({**ASKED, **MEASURED}), Fields({**ASKED, "refused": WORDS}, MEASURED)

    def read(self, value: Any, place: str) -> dict[str, Any]:
        """Return its fields; refuse a step size that is not the one that was asked for."""
        is_refused = isinstance(value, Mapping) and "refused" in value
        problem = (self.refused if is_refused else self.measured).read(value, place)
        if "setting" in problem and problem["h"] not in (None, problem["setting"]["h"]):
            raise WrongField(f"{place}.setting.h is not the step size that was asked for")
        return problem


STATED = Fields({}, {entry.name: Whole() if entry.name == "order" else Flag() for entry in fields(Stated)})

CERTIFICATE = Fields(
    {
        "schema": Text(words=(SCHEMA,)),
        "format": Whole(FORMAT, FORMAT),
        "checksum": DIGEST,
        "method": PLACE,
        "code": CODE,
        "options": Named(Number(), NAME),
        "anyway": Flag(),
        "claims": STATED,
        **dict.fromkeys(("holds", "falls_short", "undetermined"), Items(NAME)),
        "problems": Items(Problem(), 1, MOST_PROBLEMS),
        "about": Fields({**ORIGIN, "daebench": DIGEST, "seconds_per_step": Items(maybe(SECONDS, "a time"), most=MOST_PROBLEMS)}),
    },
    {"on_singular": maybe(Text(words=tuple(ON_SINGULAR)), f"one of {', '.join(ON_SINGULAR)}")},  # earlier versions have none
)


def require_form(content: Any) -> None:
    """Refuse what has not the fields of a certificate, or whose fields do not fit together."""
    certificate = CERTIFICATE.read(content)
    if not set(certificate["code"]["executable"]) <= set(certificate["code"]["files"]):
        raise WrongField("code.executable has a file that is not in code.files")
    stated = verdicts(certificate["problems"])
    if wrong_names := [name for name in stated if certificate[name] != stated[name]]:
        raise WrongField(f"{wrong_names[0]} are not the claims that have this verdict on the problems")
