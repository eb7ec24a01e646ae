"""Checks of stored digits against their definition in multiprecision: start, conserved quantities, multipliers, rank, and bounds."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mpmath as mp
import numpy as np

from daebench.reference.check.recomputation import Check, agreed, at_most, suffered
from daebench.reference.keep.definition import Definition
from daebench.reference.keep.record import Reference
from daebench.reference.make.certify import BARELY, SINGULAR, STORED_DIGITS, WORTH
from daebench.reference.make.mathematics import Mathematics, mathematics, rank_losses
from daebench.runs.ivp import Array

DIGITS = 60
"""Decimal digits of the evaluation; more than the certificate was made with."""

SLACK = 1.01
"""Relative tolerance for numbers of certificates, which have three digits."""

NOTHING = 10.0 ** (10 - DIGITS)
"""Bound for the computed value of a number that is zero, as a fraction of the largest number."""

NEAR = 1e-6
"""Tolerance for times of rank loss, as a fraction of the distance of outputs."""

HALF_UNIT = 0.5 * 10.0 ** (1 - STORED_DIGITS)
"""Relative rounding: half a unit in the last stored place of a number whose first digits are 10..."""


@dataclass(frozen=True)
class Stored:
    """Stored digits as mpmath numbers."""

    reference: Reference
    """The stored reference."""
    definition: Definition
    """The definition that it should belong to."""

    @cached_property
    def mathematics(self) -> Mathematics:
        """The definition's functions."""
        return mathematics(self.definition)

    @cached_property
    def parts(self) -> dict[str, list[list[Any]]]:
        """Rows of each part."""
        columns_by_part: dict[str, list[list[Any]]] = {part: [] for part in self.definition.ivp.state.stored}
        for name, column in self.reference.text.items():
            if name != "t":
                columns_by_part[name.rstrip("0123456789")].append([mp.mpf(x) for x in column])
        return {part: [list(row) for row in zip(*columns, strict=True)] for part, columns in columns_by_part.items()}

    @cached_property
    def states(self) -> list[list[Any]]:
        """Rows of the parts of the state, concatenated."""
        return [
            [x for part in row for x in part] for row in zip(*(self.parts[part] for part in self.definition.ivp.state.columns), strict=True)
        ]


def checks(stored: Stored) -> Iterator[Check]:
    """Yield the checks of the stored digits, see the module's docstring."""
    with mp.workdps(DIGITS):
        digit_checks = [_start(stored), *_drifts(stored), *_derived(stored)]
    with mp.workdps(20):
        digit_checks += _rank(stored) if stored.mathematics.regular else []
    yield from [*digit_checks, *_bounds(stored.reference)]


def _start(stored: Stored) -> Check:
    """Compare the first row with the exact initial expressions, rounded once."""
    start = [x for part in stored.definition.start_numbers() for x in part]
    exact = [x for part in stored.mathematics.parts(start).values() for x in part]
    first = [x for part in stored.parts.values() for x in part[0]]
    numbers = np.array([float(abs(y)) for y in exact])
    units = np.maximum(HALF_UNIT * _leading(numbers), NOTHING * numbers.max())
    wrong = [abs(x - y) for x, y, unit in zip(first, exact, units, strict=True) if abs(x - y) > SLACK * unit]
    outcome = f"differs by {mp.nstr(max(wrong), 3)}" if wrong else "they are"
    return Check("start", f"the exact initial expressions to {STORED_DIGITS} digits", outcome, not wrong)


def _drifts(stored: Stored) -> Iterator[Check]:
    """Compare errors of conserved quantities with the certificate, and with the changes that the bounds of the state explain."""
    rows = [stored.mathematics.conserved(x) for x in stored.states]
    claimed = stored.reference.certificate["drift"]
    yield agreed("quantities of the certificate's drift", sorted(rows[0]), sorted(claimed))
    for name, first in rows[0].items():
        zero = name in stored.mathematics.zero
        start = [0] * len(first) if zero else first
        deviations = [max(abs(x - y) for x, y in zip(row[name], start, strict=True)) for row in rows]
        k = max(range(len(deviations)), key=deviations.__getitem__)
        explained = _explained(stored, name, k) + (0 if zero else _explained(stored, name, 0))
        place = f" at t = {stored.reference.t[k]:g}"
        yield _same(f"drift of {name}{place}", float(claimed.get(name, 0.0)), float(deviations[k]))
        yield at_most(f"drift of {name}, in units of what the bounds explain", 1.0, float(deviations[k] / explained), place)


def _explained(stored: Stored, name: str, k: int) -> Any:
    """Return the largest change of a conserved quantity that errors of row k within their bounds can make, to first order."""
    x, evaluate = stored.states[k], stored.mathematics.conserved
    here = evaluate(x)[name]
    change = [mp.mpf(0)] * len(here)
    for j, error in enumerate(np.concatenate([stored.reference.bound[part][k] for part in stored.definition.ivp.state.columns])):
        beside = evaluate([*x[:j], x[j] + float(error), *x[j + 1 :]])[name]
        change = [old + abs(b - a) for old, a, b in zip(change, here, beside, strict=True)]
    return max(change) or mp.mpf("1e-60")


def _derived(stored: Stored) -> Iterator[Check]:
    """Compare stored functions of the state, such as lam(p, q) of HLW (1.12), with their values, in units of their bounds.

    At the start the state is the exact one, whose rounding no bound covers. Near a rank loss, the effect of rounding the stored state
    is added to the bound.
    """
    state, reference = stored.definition.ivp.state, stored.reference
    states = [[x for part in stored.definition.start_numbers() for x in part], *stored.states[1:]]
    exact = [stored.mathematics.parts(x) for x in states] if state.derived else []
    for part in state.derived:
        rounded = HALF_UNIT * reference.size(part) * (suffered(reference, part) - 1)
        rows = zip(stored.parts[part], exact, reference.bound[part] + rounded[:, None], strict=True)
        ratios = [max(abs(x - y) / mp.mpf(float(b)) for x, y, b in zip(row, parts[part], bound, strict=True)) for row, parts, bound in rows]
        k = max(range(len(ratios)), key=ratios.__getitem__)
        what = f"{part} against {part}{state.as_tuple}, in units of its bound"
        yield at_most(what, 1.0, float(ratios[k]), f" at t = {reference.t[k]:g}")


def _rank(stored: Stored) -> list[Check]:
    """Compare the smallest singular value of G H_pp G^T, which must not lose rank, along the motion with that in the certificate."""
    mathematics = stored.mathematics
    values = np.array([mathematics.smallest_singular_value(x) for x in stored.states])
    rank, t = stored.reference.certificate["rank"], stored.reference.t
    there = values[t == rank["t"]]
    least = f"{values.min():.3g} at t = {t[np.argmin(values)]:g}"
    return [
        _same(f"smallest singular value of {mathematics.regular}", rank["smallest_singular_value"], float(values.min())),
        _same("largest of the smallest singular values", rank["largest"], float(values.max())),
        Check("time of the smallest", f"t = {rank['t']:g}", least, bool(there.size and there[0] <= values.min() * SLACK)),
        at_most("its largest over its smallest", 1 / (BARELY if mathematics.crosses else SINGULAR), float(values.max() / values.min())),
        *_losses(stored, values),
    ]


def _losses(stored: Stored, values: Array) -> Iterator[Check]:
    """Compare the times of rank loss with those from the closed form, and the singular values at all outputs."""
    rank, t = stored.reference.certificate["rank"], stored.reference.t
    lost = rank_losses(stored.mathematics, t, values) if stored.mathematics.crosses else []
    claimed = rank.get("lost", [])
    same = len(lost) == len(claimed) and np.allclose(lost, claimed, rtol=0, atol=NEAR * t[1])
    ours, theirs = (", ".join(f"{x:.6g}" for x in times) or "never" for times in (lost, claimed))
    yield Check("times of rank loss", theirs, "the same" if same else ours, same)
    if stored.mathematics.crosses:
        certified_values = np.array(rank.get("values", ()), dtype=float)
        apart = float(np.max(np.abs(np.log(certified_values / values)))) if certified_values.shape == values.shape else np.inf
        yield at_most("singular values at the outputs, logarithm of their ratio to the certificate's", np.log(SLACK), apart)


def _same(what: str, claimed: float, value: float) -> Check:
    """Check that a number equals that in the certificate, to its three digits."""
    return Check(what, f"{claimed:.3g}", f"{value:.3g}", claimed / SLACK <= value <= claimed * SLACK)


def _bounds(reference: Reference) -> Iterator[Check]:
    """Check properties of any bound: at least the rounding of the number, never decreasing, and small enough to be worth storing."""
    for part, bound in reference.bound.items():
        numbers = np.abs(reference.values[part])
        spare = float(np.min(bound - HALF_UNIT * _leading(numbers)))
        yield Check(f"bound of {part}, least", "more than the rounding of each stored number", f"{spare:+.1e} to spare", spare > 0)
        falls = np.flatnonzero(np.any(np.diff(bound, axis=0) < 0, axis=1))
        place = f"falls after t = {reference.t[falls[0]]:g}" if falls.size else "never falls"
        yield Check(f"bound of {part} along the motion", "never falls", place, not falls.size)
        yield at_most(f"bound of {part}, largest, as a part of the motion", WORTH, float(bound.max() / (numbers.max() or 1.0)))


def _leading(numbers: Array) -> Array:
    """Return the power of ten of the first digit of each number, 0 for zero."""
    with np.errstate(divide="ignore"):
        return np.where(numbers > 0, 10.0 ** np.floor(np.log10(numbers)), 0.0)
