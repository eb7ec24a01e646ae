"""From a problem's definition to a stored reference with its certificate; an interrupted build continues where it stopped."""

import decimal
import json
import math
import platform
import shutil
from importlib.metadata import version
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np

from daebench.errors import BadInput
from daebench.methods.catalogue import find_problem
from daebench.methods.solvers.taylor_equations import library
from daebench.records.seals import digest, sha256
from daebench.reference.check.ida_errors import ida_errors
from daebench.reference.check.recomputation import ida_names
from daebench.reference.keep.definition import Definition, define
from daebench.reference.keep.form import DATA, own_folder, require_name
from daebench.reference.keep.store import names, save
from daebench.reference.make.certify import (
    FEWEST,
    LOST,
    ROUNDING,
    STORED_DIGITS,
    WORK_DIGITS,
    WORTH,
    Certified,
    amplification,
    certify,
    double_horizon,
    smallest_singular_values,
)
from daebench.reference.make.independent_computations import Computations
from daebench.reference.make.mathematics import mathematics, rank_losses
from daebench.reference.make.stages import KEPT_DIGITS, Stages, alone
from daebench.runs.request import Told
from daebench.systems.files.package import folder

HORIZON = (
    f"truth: last time at which every bound is at most {WORTH:g} of the largest modulus; double: first time at which the rounding of the "
    f"start, or of a state on the way, to double precision has become {LOST:g} of the motion (null: not before the end)"
)
AMPLIFICATION = (
    "largest |dx(t)|/|dx(s)| over perturbations {which}; values: from the start, s = 0; worst: from any stored s <= t, "
    "which is what the rounding of every step may grow by; step: from the stored time before t"
)
BOUND = (
    "error of each stored number: 10 times the largest difference, up to its time, between the truth and what it was checked by, and "
    f"{ROUNDING:g} of the largest modulus"
)

RANK_LOSS = (
    "lost: times at which {regular} is singular and its multipliers do not exist. The motion passes them: the truth and what it was held "
    "against are in minimal coordinates, and nothing but lam at the outputs went through {regular}. values: its smallest singular value at "
    "each output. IDA must agree with the truth up to the first of these times alone"
)


def certified_text(definition: Definition, times: list[Any], stages: Stages) -> tuple[dict[str, Any], dict[str, list[str]]]:
    """Return the certificate of a definition and its columns of digits."""
    computations = Computations(definition, times, stages.rows)
    certified = certify(computations)
    rank = _rank(definition.name, computations, certified)
    growth = amplification(computations, certified)
    lost = double_horizon(certified.t, growth.worst)
    text = columns(certified)
    t = np.array([float(x) for x in certified.t])
    followed = len(t) if lost is None else int(np.searchsorted(t, lost))
    reference = {part: np.array([[float(x) for x in row] for row in rows[:followed]]) for part, rows in certified.states.parts.items()}
    passed = min(rank.get("lost", ()), default=np.inf)
    ida = ida_errors(definition.ivp, t[:followed], reference, stages.record, passed)
    return {
        "problem": definition.ivp.problem,
        "case": definition.ivp.case,
        "about": definition.problem.cases[definition.ivp.case].about,
        "definition": definition.text | {"sha256": definition.hash},
        "made": {"by": _command(definition.name, times), "method": certified.method, "checks": certified.checks},
        "horizon": {"truth": float(certified.t[-1]), "double": lost, "asked": float(times[-1]), "rule": HORIZON},
        "drift": drifts(computations, text),
        **({"rank": rank} if rank else {}),
        "ida": ida,
        "amplification": {
            "rule": AMPLIFICATION.format(which=computations.mathematics.perturbations),
            "largest": _short(growth.start.max()),
            "values": [_short(x) for x in growth.start],
            "worst": [_short(x) for x in growth.worst],
            "step": [_short(x) for x in growth.step],
        },
        "bound": {"rule": BOUND} | {part: [[_short(x) for x in row] for row in rows] for part, rows in certified.bound.items()},
    }, text


def _rank(name: str, computations: Computations, certified: Certified) -> dict[str, Any]:
    """Return the facts about the rank of the matrix that must not lose it, and about rank losses; empty if there is no such matrix."""
    mathematics = computations.mathematics
    if not mathematics.regular:
        return {}
    singular, t = smallest_singular_values(name, computations, certified), np.array([float(x) for x in certified.t])
    smallest = int(np.argmin(singular))
    entry = {"smallest_singular_value": _short(singular[smallest]), "t": float(t[smallest]), "largest": _short(singular.max())}
    if not mathematics.crosses:
        return entry
    lost = rank_losses(mathematics, t, singular)
    return entry | {"rule": RANK_LOSS.format(regular=mathematics.regular), "lost": lost, "values": [_short(x) for x in singular]}


def _command(name: str, times: list[Any]) -> str:
    """Return the command that makes this reference."""
    t_end, spacing = float(times[-1]), int(1 / times[1])
    return f"daebench reference build {name} --t-end {t_end!r} --spacing {spacing}"


def columns(certified: Certified) -> dict[str, list[str]]:
    """Return the columns t and q1, ..., p1, ..., lam1, ..., or y1, ..., as decimal strings."""
    text = {"t": [mp.nstr(x, STORED_DIGITS) for x in certified.t]}
    for part, rows in certified.states.parts.items():
        for i, column in enumerate(zip(*rows, strict=True)):
            text[f"{part}{i + 1}"] = [mp.nstr(x, STORED_DIGITS) for x in column]
    return text


def drifts(computations: Computations, text: dict[str, list[str]]) -> dict[str, float]:
    """Return the largest change of conserved quantities, and the largest modulus of vanishing ones, from stored digits with 50 digits."""
    mathematics, state = computations.mathematics, computations.definition.ivp.state
    with mp.workdps(WORK_DIGITS):
        columns = [column for name, column in text.items() if name.rstrip("0123456789") in state.columns]
        evaluations = [mathematics.conserved([mp.mpf(x) for x in row]) for row in zip(*columns, strict=True)]
        return {
            name: _short(max(_changes([evaluation[name] for evaluation in evaluations], name in mathematics.zero)))
            for name in evaluations[0]
        }


def _changes(rows: list[list[Any]], from_zero: bool) -> list[Any]:
    """Return the largest modulus of each row's difference from the first row, or from zero."""
    start = [0] * len(rows[0]) if from_zero else rows[0]
    return [max(abs(x - y) for x, y in zip(row, start, strict=True)) for row in rows]


def _short(x: Any) -> float:
    """Return a number to three digits, rounded away from zero, because it is a bound or is read as one."""
    return float(decimal.Context(prec=3, rounding=decimal.ROUND_UP).create_decimal_from_float(float(x)))


T_END, SPACING = 100, 8
"""Last output, s, and outputs per second: each time is exact in double precision."""

MOST = 100_000
"""Most outputs."""

PACKAGES = ("daebench", "numpy", "scipy", "sympy", "mpmath", "heyoka", "scikit-sundae", "llvmlite")


def build(
    name: str,
    *,
    folder: Path | None = None,
    t_end: float = T_END,
    spacing: int = SPACING,
    overwrite: bool = False,
    progress: Told | None = None,
) -> Path:
    """Make, certify and store the reference of a problem's case; return its folder."""
    definition = _defined(name)
    library()
    times = _times(t_end, spacing)
    if (where := taken(name, folder)) and not overwrite:
        raise BadInput(
            f"{name} exists in {where} already; allow it to be overwritten, or name another folder for the new one.", "reference-exists"
        )
    folder = folder or own_folder()
    done = progress or (lambda fraction, doing: None)
    begun: list[str] = []
    expected = _stages(definition)

    def told(stage: str) -> None:
        begun.append(stage)
        done(min(0.99, len(begun) / expected), stage)

    place = folder / f".{name}.building"
    versions = {package: version(package) for package in PACKAGES} | {"python": platform.python_version()}
    key = digest(json.dumps([definition.hash, *_code(definition.ivp.problem), t_end, spacing, versions]))
    with alone(folder / f".{name}.lock", name), mp.workdps(KEPT_DIGITS + 20):
        certificate, text = certified_text(definition, times, Stages(place, key, told))
        stored = save(name, certificate | {"versions": versions}, text, folder)
        shutil.rmtree(place, ignore_errors=True)
    done(1.0, "done")
    return stored


def taken(name: str, folder: Path | None = None) -> Path | None:
    """Return the folder that already has a reference of this name, if it is the one in which it would be built."""
    require_name(name)
    if folder is None and name in names(DATA):
        raise BadInput(
            f"{name} comes with daebench; to build it again, name a folder for it with --out DIR.", "reference-comes-with-daebench"
        )
    where = folder or own_folder()
    return where if where.is_dir() and name in names(where) else None


def _defined(name: str) -> Definition:
    require_name(name)
    problem, dash, case = name.partition("-")
    if not dash:
        raise BadInput(
            f"{name} is not a name of a reference, which is PROBLEM-CASE, for example spherical_pendulum-fig1.2.",
            "reference-name-unknown-form",
        )
    return define(problem, case)


def _stages(definition: Definition) -> int:
    """Return the largest number of stages: five motions, one for each direction, and six runs of IDA in each formulation."""
    return 5 + len(mathematics(definition).directions.T) + 6 * len(ida_names(definition.ivp))


def _code(problem: str) -> list[str]:
    """Return digests of the problem's file and of the files here; results of other code are not reused."""
    return [
        find_problem(problem).digest,
        *(sha256(path.read_bytes()) for path in sorted(folder("daebench.reference").rglob("*.py"))),
    ]


def _times(t_end: float, spacing: int) -> list[Any]:
    if spacing < 1 or spacing & (spacing - 1):
        raise BadInput(
            f"{spacing} outputs per second are not a power of two, so times would not be exact in double precision; give 8 or 16.",
            "spacing-not-power-of-two",
        )
    n = t_end * spacing
    if not (math.isfinite(n) and n == int(n) and FEWEST <= n <= MOST):
        after = math.ceil(min(max(n, FEWEST), MOST)) / spacing if math.isfinite(n) else FEWEST / spacing
        raise BadInput(
            f"t_end = {t_end:g} must be {FEWEST} to {MOST} whole outputs at {spacing} per second; give {after!r}, or another spacing.",
            "end-not-whole-outputs",
        )
    return [mp.mpf(k) / spacing for k in range(int(n) + 1)]
