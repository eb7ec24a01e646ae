"""A certificate: what it consists of, what its fields must be whoever wrote them, what became of its claims, and how it is written."""

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from daebench.methods.outside.method import Stated
from daebench.records.seals import is_inside, sealed
from daebench.runs.files import atomic
from daebench.runs.json_values import plain
from daebench.runs.provenance import ORIGIN
from daebench.runs.request import ON_SINGULAR
from daebench.runs.result import Result
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
from daebench.studies.claims.bench import FALLS_SHORT, OK, UNDETERMINED

SCHEMA = "daebench certificate"
"""What every certificate says it is."""

FORMAT = 1
"""Version of the layout."""

NAME = "certificate.json"


@dataclass(frozen=True)
class Certificate(Result):
    """A code measured on some problems, with all that is needed to measure it again.

    Parameters
    ----------
    folder : Path
        Where it is, with its code in ``code/`` and problem files in ``definitions/``.
    content : mapping
        What the file has: ``method``, ``code`` with its hash and files, ``options``, ``anyway``, ``on_singular`` and ``claims``,
        ``problems`` with numbers or with why they were refused, ``holds``, ``falls_short`` and ``undetermined`` with names of claims, and
        ``about``: date, machine, versions and seconds of a step, none of which is verified.
    """

    folder: Path
    content: Mapping[str, Any] = field(repr=False)

    @property
    def method(self) -> str:
        """The address of the code."""
        return str(self.content["method"])

    @property
    def hash(self) -> str:
        """SHA-256 of the names and contents of its files."""
        return str(self.content["code"]["hash"])

    @property
    def measured(self) -> list[Mapping[str, Any]]:
        """The problems that the code was measured on."""
        return [problem for problem in self.content["problems"] if "refused" not in problem]

    @property
    def refused(self) -> dict[str, str]:
        """Why it was not measured on the others, by problem and case."""
        return {title(problem): str(problem["refused"]) for problem in self.content["problems"] if "refused" in problem}

    @property
    def holds(self) -> list[str]:
        """Claims that hold on every problem."""
        return list(self.content["holds"])

    @property
    def falls_short(self) -> list[str]:
        """Claims that do not hold on a problem."""
        return list(self.content["falls_short"])

    @property
    def undetermined(self) -> list[str]:
        """Claims of which it is not known on a problem."""
        return list(self.content["undetermined"])

    @property
    def stated(self) -> int:
        """Number of claims."""
        return len(self.holds) + len(self.falls_short) + len(self.undetermined)

    @property
    def _written(self) -> list[str]:
        return [str(self.folder / name) for name in ("index.html", NAME)]

    def summary(self) -> dict[str, Any]:
        """Return the content and the paths, for JSON."""
        return {**self.content, "written": self._written}

    def printed(self) -> Iterator[str]:
        """Yield the claims, the numbers of each problem, and the paths."""
        yield f"{self.method}: {f'{len(self.holds)} of {self.stated} claims hold' if self.stated else 'no claims are stated'}."
        for word, names in (("does not hold", self.falls_short), ("not known", self.undetermined)):
            if names:
                yield f"{word}: {', '.join(names)}."
        yield from (f"{title(problem)}: {_numbers(problem)}" for problem in self.measured)
        yield from (f"{where}: not measured: {why}" for where, why in self.refused.items())
        yield f"written: {', '.join(self._written)}; verify it by: daebench certificate verify {self.folder}"


def _numbers(problem: Mapping[str, Any]) -> str:
    """Return the numbers of a problem in one line."""
    numbers, h = problem["numbers"], problem["setting"]["h"]
    components = numbers["orders"]["components"].items()
    orders = ", ".join(f"{name} {'-' if part['order'] is None else format(part['order'], '.3f')}" for name, part in components)
    error = numbers["error"]
    off = "unknown" if error["value"] is None else f"{error['value']:.2g}"
    return f"order {orders}; energy {energy(numbers)}; error {off} up to t = {error['t']:g} with h = {h:g}."


def energy(numbers: Mapping[str, Any]) -> str:
    """Return the verdict on the energy of a problem, with the law of a drift."""
    return ", ".join(filter(None, (numbers["energy"]["verdict"], numbers["energy"]["law"])))


def title(problem: Mapping[str, Any]) -> str:
    """Return a problem of a certificate in words."""
    given = ", ".join(f"{name} = {value:g}" for name, value in problem["changed"].items())
    case = f", case {problem['case']}" if problem["case"] else ""
    return Path(problem["problem"]).name + case + (f", {given}" if given else "")


def verdicts(problems: Iterable[Mapping[str, Any]]) -> dict[str, list[str]]:
    """Return the claims that are stated, by what became of them on all problems together: the worst of their verdicts."""
    worst: dict[str, str] = {}
    rank = (OK, UNDETERMINED, FALLS_SHORT)
    for problem in problems:
        for name, finding in problem.get("numbers", {"claims": {}})["claims"].items():
            if finding["claimed"] and finding["verdict"] in rank:
                worst[name] = max(worst.get(name, OK), finding["verdict"], key=rank.index)
    names = {"holds": OK, "falls_short": FALLS_SHORT, "undetermined": UNDETERMINED}
    return {key: [name for name, verdict in worst.items() if verdict == word] for key, word in names.items()}


def write(folder: Path, content: Mapping[str, Any]) -> Path:
    """Write a certificate into a folder, with its checksum, and return its path."""
    whole = plain({"schema": SCHEMA, "format": FORMAT, **content})
    with atomic(folder / NAME) as scratch:
        scratch.write_text(json.dumps(sealed(whole), indent=1, allow_nan=False) + "\n", encoding="ascii")
    return folder / NAME


MOST_PROBLEMS, MOST_STEPS, MOST_RUNS = 32, 10**8, 64
"""Problems of a certificate, steps of a run, and runs of an order study, at most: a certificate of others is not to keep a machine busy."""

SHORT, PLACE, WORDS = Text(200), Text(4096, 1), Text(10_000)
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
        "property": SHORT,
        "claimed": CLAIMED,
        "verdict": SHORT,
        "note": WORDS,
        **dict.fromkeys(("measured", "bound", "standard_error"), NUMBER),
    }
)

FAILURE = maybe(WORDS, "a sentence")
ENERGY = Fields(
    {
        "t": NUMBER,
        "verdict": SHORT,
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
        "conserved": Named(NUMBER, SHORT),
        "curve": Fields(dict.fromkeys(("t", "least", "largest"), SERIES)),
        "claims": Named(FINDING, SHORT),
        "orders": Fields({"components": Named(FIT, SHORT), "contraction": NUMBER, "h": SERIES, "errors": Named(SERIES, SHORT)}),
    }
)

ASKED: Mapping[str, Kind] = {
    "problem": PLACE,
    "case": maybe(SHORT, "a name"),
    "changed": Named(Number(), SHORT),
    "guessed": Flag(),
    "h": maybe(POSITIVE, "a positive number"),
    "files": FILES,
}
MEASURED: Mapping[str, Kind] = {"parameters": Named(Number(), SHORT), "definition": DIGEST, "setting": SETTING, "numbers": NUMBERS}


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
        "options": Named(Number(), SHORT),
        "anyway": Flag(),
        "claims": STATED,
        **dict.fromkeys(("holds", "falls_short", "undetermined"), Items(SHORT)),
        "problems": Items(Problem(), 1, MOST_PROBLEMS),
        "about": Fields({**ORIGIN, "daebench": DIGEST, "seconds_per_step": Items(maybe(SECONDS, "a time"), most=MOST_PROBLEMS)}),
    },
    {"on_singular": maybe(Text(words=tuple(ON_SINGULAR)), f"one of {', '.join(ON_SINGULAR)}")},  # earlier versions have none
)


def require_form(content: Any) -> None:
    """Refuse a document that has not the fields of a certificate, or whose fields do not fit together."""
    certificate = CERTIFICATE.read(content)
    if not set(certificate["code"]["executable"]) <= set(certificate["code"]["files"]):
        raise WrongField("code.executable has a file that is not in code.files")
    stated = verdicts(certificate["problems"])
    if wrong_names := [name for name in stated if certificate[name] != stated[name]]:
        raise WrongField(f"{wrong_names[0]} are not the claims that have this verdict on the problems")
