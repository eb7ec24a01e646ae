"""Verification of a stored reference by everything that can be known of it without the library that made it."""

from collections.abc import Callable, Iterator
from decimal import Decimal
from itertools import chain
from pathlib import Path

import mpmath as mp
import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput
from daebench.methods.foreign import ForeignName, Trust, admit
from daebench.reference.check import invariants
from daebench.reference.check.independent_runs import by_ida, method_of, row_by_row, throughout
from daebench.reference.check.invariants import SLACK
from daebench.reference.check.recomputation import Check, Digits, Verification, agreed, ida_names
from daebench.reference.keep import store
from daebench.reference.keep.definition import Definition, define, hash_of
from daebench.reference.keep.record import EPS, Reference
from daebench.reference.make.certify import LOST
from daebench.reference.make.mathematics import mathematics

Progress = Callable[[float, str], None]
"""Called with the completed fraction and the present activity."""


def verify(name: str, folder: Path | None = None, progress: Progress | None = None, *, asked: bool = True) -> Verification:
    """Return the result of the verification of a reference.

    ::

        definition     its text, hash and parameters are those of today's problem
        layout         columns, rows, times and bounds are those of the certificate
        digits         start, conserved quantities, multipliers and rank in multiprecision
        motion         a method of order 8 of our own, throughout and from row to row, and IDA, each within its own error estimate

    If something cannot be checked because an earlier check does not hold, that is a failed check.
    """
    callback = progress or (lambda fraction, doing: None)
    callback(0.0, f"{name}: definition")
    nothing = Check("digits and motion", "looked at where definition and layout hold", "not looked at", False)
    try:
        reference = store.load(name, folder)
    except store.Misshapen as error:
        return Verification(name, (Check("form", "that of a reference", str(error).rstrip("."), False), nothing))
    definition, checks = _outside(reference, asked=asked)
    if definition is None or not all(check.ok for check in checks):
        return Verification(name, (*checks, nothing))
    callback(0.1, f"{name}: invariants")
    checks += invariants.checks(invariants.Stored(reference, definition))
    digits: list[Digits] = []
    method, ida = method_of(reference, definition.ivp), ida_names(definition.ivp)[0]
    ways = ((0.2, method, throughout), (0.4, f"{method}, row by row", row_by_row), (0.7, ida, by_ida))
    for fraction, doing, recomputed in ways:
        callback(fraction, f"{name}: {doing}")
        run, run_checks = recomputed(reference)
        checks += run_checks
        if run is not None:
            checks += run.checks(reference)
            digits += run.digits(reference)
    callback(1.0, name)
    return Verification(name, tuple(checks), tuple(digits), _unseen(reference, digits))


def _outside(reference: Reference, *, asked: bool) -> tuple[Definition | None, list[Check]]:
    """Return today's definition, if there is one, and the checks of everything except the digits."""
    definition: Definition | None = None
    checks: list[Check] = []
    try:
        if not asked:
            admit(f"a folder with the reference {reference.name}", [ForeignName(reference.problem, is_method=False)], Trust())
        reference.require_named()
        definition = define(reference.problem, reference.case)
        for check in chain(_definition(reference, definition), _layout(reference, definition)):
            checks.append(check)  # one by one, so that checks before an error are not lost
    except (KeyError, IndexError, ValueError, TypeError, BadInput) as error:
        reason = str(error) if isinstance(error, BadInput) else f"{type(error).__name__}: {error}"
        checks.append(Check("certificate", "complete, and of a problem of the catalogue", reason, False))
    return definition, checks


def _definition(reference: Reference, definition: Definition) -> Iterator[Check]:
    """Compare the certificate's definition with today's problem."""
    text = dict(reference.certificate["definition"])
    claimed, today = text.pop("sha256"), definition.text
    digest = hash_of(text)
    other = [f"{key}: {text.get(key)}" for key in sorted(text.keys() | today.keys()) if text.get(key) != today.get(key)]
    yield Check("text of the definition", f"today's of {definition.name}", "; ".join(other) or "today's", not other)
    yield Check("hash of the definition", definition.hash[:12], claimed[:12], definition.hash == claimed == digest)
    yield agreed("name", definition.name, reference.name)


def _layout(reference: Reference, definition: Definition) -> Iterator[Check]:
    """Compare the columns, rows, times and bounds with the certificate and with the form of a reference."""
    certificate, system = reference.certificate, mathematics(definition)
    with mp.workdps(20):
        sizes = {part: len(x) for part, x in system.parts([x for part in definition.start_numbers() for x in part]).items()}
    columns = ["t", *(f"{part}{i + 1}" for part, size in sizes.items() for i in range(size))]
    complete = "rank" in certificate or not system.regular
    yield Check("certificate", "complete", "complete" if complete else "lacks rank", complete)
    yield agreed("columns", ", ".join(columns), ", ".join(reference.text))
    yield from _times(reference)
    if system.crosses:
        values = certificate["rank"]["values"]
        yield agreed("singular values", len(reference.t), len(values))
    yield from _horizons(reference)


def _times(reference: Reference) -> Iterator[Check]:
    t = [Decimal(x) for x in reference.text["t"]]
    yield agreed("first time", 0, t[0])
    rounded = [x for x in t if x != Decimal(float(x))]
    yield Check("times in double precision", "exact", f"{rounded[0]} is not" if rounded else "exact", not rounded)
    uneven = [x for k, x in enumerate(t) if x != k * t[1]] if len(t) > 1 and t[1] > 0 else t
    yield Check("distances of times", "equal", f"not at {uneven[0]}" if uneven else "equal", not uneven)
    yield agreed("horizon", reference.certificate["horizon"]["truth"], float(t[-1]))


def _horizons(reference: Reference) -> Iterator[Check]:
    """Check that the horizon of double precision is where the amplification puts it."""
    growth, horizon = reference.certificate["amplification"], reference.double_horizon
    least, most = (_first(reference, reference.worst_amplification * EPS > LOST * factor) for factor in (1 / SLACK, SLACK))
    yield Check("horizon of double precision", f"{least:g} to {most:g}", f"{horizon:g}", least <= horizon <= most)
    start, worst = reference.amplification, reference.worst_amplification
    yield Check("amplification at the start", "1", f"{start[0]:g}", bool(1 / SLACK <= start[0] <= SLACK))
    yield agreed("largest amplification", float(start.max()), growth["largest"])
    spare = np.min(worst * SLACK / np.maximum(start, reference.step_amplification))
    yield Check("worst amplification", "at least that from the start and from the time before", f"{spare:.3g} times", bool(spare >= 1))
    asked = reference.certificate["horizon"]["asked"]
    yield Check("horizon that was asked for", f"at least {reference.horizon:g}", f"{asked:g}", asked >= reference.horizon)


def _first(reference: Reference, lost: NDArray[np.bool_]) -> float:
    """Return the first stored time at which a condition holds; infinity if there is none."""
    return float(reference.t[np.argmax(lost)]) if lost.any() else np.inf


def _unseen(reference: Reference, digits: list[Digits]) -> str:
    """Return a sentence on the alterations that no check can detect."""
    if not digits:
        return ""
    parts = reference.state.columns
    finest = max(min(entry.visible for entry in digits if entry.part == part) for part in parts)
    names = ", ".join({"g": "constraints", "Gv": "their derivatives"}.get(name, name) for name in reference.certificate["drift"])
    return (
        f"A change of {' and '.join(parts)} along the motion, which keeps {names} to the certificate's drift, is seen from {finest:.1e} "
        f"of the motion; a smaller one takes a recomputation in quadruple precision: daebench reference build {reference.name}. "
        "How it was made, its checks, the table of IDA but for its row at 1e-12, and amplifications between are taken as they are."
        f"{_passed(reference)}"
    )


def _passed(reference: Reference) -> str:
    """Return a sentence on what is not checked for a motion that passes a rank loss."""
    if not reference.rank_losses:
        return ""
    first = f"{reference.rank_losses[0]:g}"
    return (
        f" IDA is compared with the motion only up to its first rank loss at t = {first}, and our own method is run in the problem's chart."
    )
