"""What a certificate says: everything that is known of certified digits, worked out and put into words."""

import decimal
from typing import Any

import mpmath as mp
import numpy as np

from daebench.reference.certified.amplification import LOST, amplification, double_horizon
from daebench.reference.certified.certify import ROUNDING, STORED_DIGITS, WORK_DIGITS, WORTH, Certified, certify, smallest_singular_values
from daebench.reference.certified.definition import Definition
from daebench.reference.certified.ida_errors import ida_errors
from daebench.reference.certified.motions import Motions
from daebench.reference.certified.multiprecision import Functions
from daebench.reference.certified.stages import Stages

HORIZON = (
    f"truth: last time at which every bound is at most {WORTH:g} of the largest modulus; double: first time at which the rounding of the "
    f"start, or of a state on the way, to double precision has become {LOST:g} of the motion (null: not before the end)"
)
AMPLIFICATION = (
    "largest |dx(t)|/|dx(s)| over perturbations along the manifold, q measured in max |q| and p in max |p|; values: from the start, s = 0; "
    "worst: from any stored s <= t, which is what the rounding of every step may grow by; step: from the stored time before t"
)
BOUND = (
    "error of each stored number: 10 times the largest difference, up to its time, between the truth and what it was checked by, and "
    f"{ROUNDING:g} of the largest modulus"
)


def certified_text(definition: Definition, times: list[Any], stages: Stages) -> tuple[dict[str, Any], dict[str, list[str]]]:
    """Return the certificate of a definition and its columns of digits.

    Parameters
    ----------
    definition : Definition
        What is certified.
    times : list of mpmath number
        Output times, equidistant, the first 0.
    stages : Stages
        Keeps what is done.

    Raises
    ------
    NotCertified
        If the certification fails.
    """
    motions = Motions(definition, times, stages.rows)
    certified = certify(motions)
    singular = smallest_singular_values(definition.name, motions, certified)
    growth = amplification(motions, certified)
    lost = double_horizon(certified.t, growth.worst)
    text = columns(certified)
    t, *truth = (
        np.array([[float(x) for x in row] for row in part]) for part in ([[x] for x in certified.t], *certified.states.parts().values())
    )
    followed = len(t) if lost is None else int(np.searchsorted(t[:, 0], lost))
    ida = ida_errors(definition.scene, t[:followed, 0], [rows[:followed] for rows in truth], stages.record)
    smallest = int(np.argmin(singular))
    return {
        "problem": definition.scene.problem,
        "case": definition.scene.case,
        "about": definition.derivation.problem.cases[definition.scene.case].about,
        "definition": definition.text | {"sha256": definition.hash},
        "made": {"by": _command(definition.name, times), "method": certified.method, "checks": certified.checks},
        "horizon": {"truth": float(certified.t[-1]), "double": lost, "asked": float(times[-1]), "rule": HORIZON},
        "drift": drifts(definition, text),
        "rank": {
            "smallest_singular_value": _short(singular[smallest]),
            "t": float(certified.t[smallest]),
            "largest": _short(singular.max()),
        },
        "ida": ida,
        "amplification": {
            "rule": AMPLIFICATION,
            "largest": _short(growth.start.max()),
            "values": [_short(x) for x in growth.start],
            "worst": [_short(x) for x in growth.worst],
            "step": [_short(x) for x in growth.step],
        },
        "bound": {"rule": BOUND} | {part: [[_short(x) for x in row] for row in rows] for part, rows in certified.bound.items()},
    }, text


def _command(name: str, times: list[Any]) -> str:
    """Return the command that makes the same reference."""
    t_end, spacing = float(times[-1]), int(1 / times[1])
    return f"daebench reference build {name} --t-end {t_end!r} --spacing {spacing}"


def columns(certified: Certified) -> dict[str, list[str]]:
    """Return the columns t, q1, ..., p1, ..., lam1, ... as decimal strings."""
    text = {"t": [mp.nstr(x, STORED_DIGITS) for x in certified.t]}
    for part, rows in certified.states.parts().items():
        for i, column in enumerate(zip(*rows, strict=True)):
            text[f"{part}{i + 1}"] = [mp.nstr(x, STORED_DIGITS) for x in column]
    return text


def drifts(definition: Definition, text: dict[str, list[str]]) -> dict[str, float]:
    """Return the largest |g|, |G H_p| and errors of energy and integrals of stored digits, evaluated with 50 digits."""
    functions, d = Functions(definition), definition.scene.d
    with mp.workdps(WORK_DIGITS):
        rows = list(zip(*[[mp.mpf(x) for x in text[f"{part}{i + 1}"]] for part in "qp" for i in range(d)], strict=True))
        states = [(list(row[:d]), list(row[d:])) for row in rows]
        found = {"g": [functions.g(q) for q, _ in states], "Gv": [functions.Gv(q, p) for q, p in states]}
        found["energy"] = [[functions.energy(q, p)] for q, p in states]
        integrals = [functions.integrals(q, p) for q, p in states]
        for k, name in enumerate(definition.derivation.problem.integrals):
            found[name] = [[row[k]] for row in integrals]
        errors = {
            name: values if name in ("g", "Gv") else [[x - y for x, y in zip(row, values[0], strict=True)] for row in values]
            for name, values in found.items()
        }
        return {name: _short(max(abs(x) for row in values for x in row)) for name, values in errors.items()}


def _short(x: Any) -> float:
    """Return a number to three digits, away from zero, for it is a bound or is read as one."""
    return float(decimal.Context(prec=3, rounding=decimal.ROUND_UP).create_decimal_from_float(float(x)))
