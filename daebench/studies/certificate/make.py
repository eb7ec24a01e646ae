"""A certificate made of a code: which problems, what is measured, and the record of it."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from daebench.errors import BadInput, DaebenchError, RunFailed, positive, unknown
from daebench.methods.catalogue import find_problem
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import CONSTRAINED, POISSON, parse
from daebench.methods.outside.method import Stated
from daebench.methods.outside.read import PROGRAM
from daebench.records.code import Code, code_digest, code_of
from daebench.records.seals import digests
from daebench.runs import provenance
from daebench.runs.machine import machine
from daebench.runs.request import Told, silent
from daebench.studies.certificate import process
from daebench.studies.certificate.record import verdicts
from daebench.studies.certificate.verify import measured
from daebench.studies.grid.archive import definition_files
from daebench.systems.files.execute import is_path

USUAL = {
    "constrained": ("double_pendulum:swing", "spherical_pendulum:fig1.2", "slider_crank:turning"),
    "poisson": ("free_rigid_body:hlw", "lotka_volterra:4,2", "heavy_top_lie_poisson:heavy_top"),
}
"""Problems on which a code is measured where none is named: two constraints, one, and a mass matrix that is not diagonal."""


@dataclass(frozen=True)
class Asked:
    """A problem that a code is to be measured on."""

    problem: str
    """Its name, or the path of its file beside the certificate."""
    case: str | None
    """Named initial values; None for the first."""
    files: Mapping[str, bytes] = field(default_factory=dict, repr=False)
    """Its files by their paths beside the certificate; none of a problem of daebench."""


@dataclass(frozen=True)
class Made:
    """Content of a certificate."""

    code: Code
    """The code."""
    files: Mapping[str, bytes] = field(repr=False)
    """Problem files."""
    content: dict[str, Any] = field(repr=False)
    """What the certificate says."""


def make(
    method: str | Callable[..., Any],
    *,
    problems: Sequence[str] = (),
    h: float | None = None,
    parameters: Mapping[str, float] | None = None,
    claims: Mapping[str, Any] | None = None,
    options: Mapping[str, float] | None = None,
    anyway: bool = False,
    on_singular: str | None = None,
    files: Iterable[str | Path] = (),
    seconds_limit: float = process.SECONDS,
    progress: Told = silent,
) -> Made:
    """Measure a code, and return what its certificate says; parameters and errors are those of :func:`daebench.certify`."""
    if h is not None:
        positive("h", h)
    code, changed = code_of(method, files), dict(parameters or {})
    about = {"options": dict(options or {}), "anyway": anyway, "on_singular": on_singular, "claims": _claims(claims or {})}
    attempts = []
    for asked in [[_asked(name, k, changed, on_singular) for k, name in enumerate(problems, 1)]] if problems else _usual(code, changed):
        guessed = not problems and not (code.of_daebench or code.method.startswith(PROGRAM))
        settings = {"parameters": changed, "setting": None, "h": h, "guessed": guessed}
        tasks = [{**about, **settings, "problem": one.problem, "case": one.case} for one in asked]
        definitions = {name: content for one in asked for name, content in one.files.items()}
        answers = measured(code, tasks, definitions, positive("seconds_limit", seconds_limit), progress)
        attempts.append(answers)
        if any("refused" not in answer for answer in answers):
            break
    else:
        raise _refused(attempts)
    entries = [_entry(one, task, answer) for one, task, answer in zip(asked, tasks, answers, strict=True)]
    whole = {"hash": code.digest, "files": digests(code.files), "executable": sorted(code.executable)}
    content = {"method": code.method, "code": whole, **about, **verdicts(entries), "problems": entries}
    return Made(code, definitions, content | {"about": _about([answer.get("seconds") for answer in answers])})


def _refused(attempts: Sequence[Sequence[Mapping[str, Any]]]) -> DaebenchError:
    """Return the error for a code that is measured on no problem: why, of the first kind of problems on which it could be run at all."""
    answers = next((answers for answers in attempts if any(answer.get("failed") for answer in answers)), attempts[0])
    sentences = list(dict.fromkeys(str(answer["refused"]) for answer in answers))
    wrong = RunFailed if any(answer.get("failed") for answer in answers) else BadInput
    if len(sentences) == 1:
        return wrong(sentences[0], answers[0]["code"])
    return wrong(
        f"none of these problems is solved: {' '.join(sentences)} Name the problem that the code is for, as --problem PROBLEM:CASE.",
        "no-problem-solved",
    )


def _entry(asked: Asked, task: Mapping[str, Any], answer: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entry of a certificate on one problem."""
    entry = {"problem": asked.problem, "case": answer.get("case", asked.case), "changed": task["parameters"]}
    entry |= {"guessed": task["guessed"], "h": task["h"], "files": digests(asked.files)}
    if "refused" in answer:
        return entry | {"refused": answer["refused"]}
    return entry | {name: answer[name] for name in ("parameters", "definition", "setting", "numbers")}


def _about(seconds: Sequence[float | None]) -> dict[str, Any]:
    """Return how a certificate was made, which is not verified."""
    versions, day = provenance.versions(), provenance.now()
    return {"made": day, "machine": machine(), "versions": versions, "daebench": code_digest(), "seconds_per_step": list(seconds)}


def _claims(claims: Mapping[str, Any]) -> dict[str, Any]:
    """Return claims that are stated of a code from outside, checked."""
    known = [entry.name for entry in fields(Stated)]
    for name, value in claims.items():
        if name not in known:
            raise unknown("claim", name, known)
        if type(value) is not (int if name == "order" else bool):
            raise BadInput(
                f"the claim {name} = {value!r} must be {'a whole number' if name == 'order' else 'True or False'}.", "claim-of-wrong-type"
            )
    return dict(claims)


def _asked(name: str, number: int, changed: Mapping[str, float], on_singular: str | None) -> Asked:
    """Return the problem PROBLEM[:CASE], found and with its numbers tried; one of a file of one's own is executed."""
    problem, _, case = (name, "", "") if name.endswith(".py") else name.rpartition(":") if ":" in name else (name, "", "")
    initial_value_problem(problem, case or None, changed, on_singular=on_singular)
    if not is_path(problem):
        return Asked(problem, case or None)
    definition = find_problem(problem)
    place = f"definitions/{number}-{definition.path.stem}"
    files = {f"{place}/{near}": file.read_bytes() for near, file in definition_files(definition)}
    return Asked(f"./{place}/{definition.path.name}", case or None, files)


def _usual(code: Code, changed: Mapping[str, float]) -> list[list[Asked]]:
    """Return the problems of daebench of the kind that a code takes; those of both, to be tried in turn, where its name does not tell."""
    if changed:
        name = next(iter(changed))
        raise BadInput(
            f"the parameter {name} belongs to one problem; name it, for example --problem double_pendulum --param {name}=2.",
            "parameter-of-no-problem",
        )
    kinds = {"constrained": CONSTRAINED, "poisson": POISSON}
    if code.of_daebench:
        kinds = dict([next((pair for pair in kinds.items() if _is_name(code.method, pair[1])), ("constrained", CONSTRAINED))])
    return [[Asked(problem, case) for problem, _, case in (name.partition(":") for name in USUAL[kind])] for kind in kinds]


def _is_name(name: str, kind: Any) -> bool:
    try:
        parse(name, kind=kind)
    except BadInput:
        return False
    return True
