"""Certificates of certified digits: everything that is known of them, computed and put into words."""

import decimal
from typing import Any

import mpmath as mp
import numpy as np

from daebench.reference.check.ida_errors import ida_errors
from daebench.reference.keep.definition import Definition
from daebench.reference.make.amplification import LOST, amplification, double_horizon
from daebench.reference.make.certify import ROUNDING, STORED_DIGITS, WORK_DIGITS, WORTH, Certified, certify, smallest_singular_values
from daebench.reference.make.independent_computations import Computations
from daebench.reference.make.rank_loss import rank_losses
from daebench.reference.make.stages import Stages

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
