"""Stored digits held against their own definition in multiprecision: the start, constraints, energy, multipliers, rank, and bounds."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mpmath as mp
import numpy as np
from numpy.typing import NDArray

from daebench.reference.certified.certify import SINGULAR, STORED_DIGITS, WORTH
from daebench.reference.certified.definition import Definition
from daebench.reference.certified.multiprecision import Functions
from daebench.reference.certified.record import Reference
from daebench.reference.certified.verification import Check, agreed, at_most

Array = NDArray[np.float64]

DIGITS = 60
"""Decimal digits of the evaluation: more than those that the certificate was made with."""

SLACK = 1.01
"""Certificates have three digits."""

HALF_UNIT = 0.5 * 10.0 ** (1 - STORED_DIGITS)
"""Half a unit in the last stored place of a number whose first digits are 10...; what rounding it may make, relatively."""


MANIFOLD = ("g", "Gv")
"""What is zero on the manifold; of anything else the start has the value."""

Quantity = Callable[[list[Any], list[Any]], list[Any]]
"""A function of q and p with one or several values."""


@dataclass(frozen=True)
class Stored:
    """Stored digits as mpmath numbers.

    Parameters
    ----------
    reference : Reference
        What is stored.
    definition : Definition
        What it should be of.
    """

    reference: Reference
    definition: Definition

    @cached_property
    def functions(self) -> Functions:
        """The definition's functions."""
        return Functions(self.definition)

    @cached_property
    def parts(self) -> dict[str, list[list[Any]]]:
        """Rows of q, p and lam."""
        text, sizes = self.reference.text, {"q": self.definition.scene.d, "p": self.definition.scene.d, "lam": self.definition.scene.m}
        columns = {part: [[mp.mpf(x) for x in text[f"{part}{i + 1}"]] for i in range(size)] for part, size in sizes.items()}
        return {part: [list(row) for row in zip(*each, strict=True)] for part, each in columns.items()}

    @cached_property
    def states(self) -> list[tuple[list[Any], list[Any]]]:
        """Rows of (q, p)."""
        return list(zip(self.parts["q"], self.parts["p"], strict=True))


def checks(stored: Stored) -> Iterator[Check]:
    """Yield the checks of the stored digits, see the module."""
    with mp.workdps(DIGITS):
        found = [_start(stored), *_drifts(stored), _multipliers(stored)]
    with mp.workdps(20):
        found += _rank(stored)
    yield from [*found, *_bounds(stored.reference)]


def _start(stored: Stored) -> Check:
    """Compare the first row with the exact initial expressions, rounded once."""
    q0, p0 = stored.definition.start_numbers()
    exact = [*q0, *p0, *stored.functions.lam(q0, p0)]
    first = [x for part in stored.parts.values() for x in part[0]]
    units = HALF_UNIT * _leading(np.array([float(abs(y)) for y in exact]))
    wrong = [abs(x - y) for x, y, unit in zip(first, exact, units, strict=True) if abs(x - y) > SLACK * unit]
    found = f"differs by {mp.nstr(max(wrong), 3)}" if wrong else "they are"
    return Check("start", f"the exact initial expressions to {STORED_DIGITS} digits", found, not wrong)


def _drifts(stored: Stored) -> Iterator[Check]:
    """Compare |g|, |G H_p| and errors of energy and first integrals with the certificate, and with what the bounds of q and p explain."""
    quantities = _quantities(stored)
    claimed = stored.reference.certificate["drift"]
    yield agreed("quantities of the certificate's drift", sorted(quantities), sorted(claimed))
    for name, evaluate in quantities.items():
        values = [evaluate(q, p) for q, p in stored.states]
        start = [0] * len(values[0]) if name in MANIFOLD else values[0]
        found = [max(abs(x - y) for x, y in zip(row, start, strict=True)) for row in values]
        k = max(range(len(found)), key=found.__getitem__)
        explained = _explained(stored, evaluate, k) + (0 if name in MANIFOLD else _explained(stored, evaluate, 0))
        place = f" at t = {stored.reference.t[k]:g}"
        yield _same(f"drift of {name}{place}", float(claimed.get(name, 0.0)), float(found[k]))
        yield at_most(f"drift of {name}, in units of what the bounds explain", 1.0, float(found[k] / explained), place)


def _quantities(stored: Stored) -> dict[str, Quantity]:
    functions = stored.functions
    names = stored.definition.derivation.problem.integrals
    own: dict[str, Quantity] = {"g": lambda q, p: functions.g(q), "Gv": functions.Gv, "energy": lambda q, p: [functions.energy(q, p)]}
    return own | {name: lambda q, p, k=k: [functions.integrals(q, p)[k]] for k, name in enumerate(names)}


def _explained(stored: Stored, evaluate: Quantity, k: int) -> Any:
    """Return the largest change of a quantity that errors of row k within their bounds can make, to first order."""
    (q, p), d = stored.states[k], stored.definition.scene.d
    here, x = evaluate(q, p), [*q, *p]
    change = [mp.mpf(0)] * len(here)
    for j, error in enumerate(np.concatenate([stored.reference.bound[part][k] for part in "qp"])):
        y = [*x[:j], x[j] + float(error), *x[j + 1 :]]
        change = [old + abs(b - a) for old, a, b in zip(change, here, evaluate(y[:d], y[d:]), strict=True)]
    return max(change) or mp.mpf("1e-60")


def _multipliers(stored: Stored) -> Check:
    """Compare lam with lam(p, q) of the stored q and p, HLW (1.12), in units of its bound."""
    bound = stored.reference.bound["lam"]
    exact = [stored.functions.lam(q, p) for q, p in stored.states]
    triples = ((zip(*each, strict=True)) for each in zip(stored.parts["lam"], exact, bound, strict=True))
    found = [max(abs(x - y) / mp.mpf(float(b)) for x, y, b in row) for row in triples]
    k = max(range(len(found)), key=found.__getitem__)
    return at_most("lam against lam(p, q), in units of its bound", 1.0, float(found[k]), f" at t = {stored.reference.t[k]:g}")


def _rank(stored: Stored) -> list[Check]:
    """Compare the smallest singular value of G H_pp G^T along the motion with the certificate's."""
    values = np.array([stored.functions.smallest_singular_value(q, p) for q, p in stored.states])
    rank, t = stored.reference.certificate["rank"], stored.reference.t
    there = values[t == rank["t"]]
    least = f"{values.min():.3g} at t = {t[np.argmin(values)]:g}"
    return [
        _same("smallest singular value of G M^-1 G^T", rank["smallest_singular_value"], float(values.min())),
        _same("largest of the smallest singular values", rank["largest"], float(values.max())),
        Check("time of the smallest", f"t = {rank['t']:g}", least, bool(there.size and there[0] <= values.min() * SLACK)),
        at_most("its largest over its smallest", 1 / SINGULAR, float(values.max() / values.min())),
    ]


def _same(what: str, claimed: float, found: float) -> Check:
    """Check that a number is the certificate's, which has three digits."""
    return Check(what, f"{claimed:.3g}", f"{found:.3g}", claimed / SLACK <= found <= claimed * SLACK)


def _bounds(reference: Reference) -> Iterator[Check]:
    """Look at what any bound must be: at least the rounding of the number, never falling, and small enough to be worth storing."""
    for part, bound in reference.bound.items():
        numbers = np.abs(getattr(reference, part))
        spare = float(np.min(bound - HALF_UNIT * _leading(numbers)))
        yield Check(f"bound of {part}, least", "more than the rounding of each stored number", f"{spare:+.1e} to spare", spare > 0)
        falls = np.flatnonzero(np.any(np.diff(bound, axis=0) < 0, axis=1))
        place = f"falls after t = {reference.t[falls[0]]:g}" if falls.size else "never falls"
        yield Check(f"bound of {part} along the motion", "never falls", place, not falls.size)
        yield at_most(f"bound of {part}, largest, as a part of the motion", WORTH, float(bound.max() / (numbers.max() or 1.0)))


def _leading(numbers: Array) -> Array:
    """Return the power of ten that each number begins at, 0 for zero."""
    with np.errstate(divide="ignore"):
        return np.where(numbers > 0, 10.0 ** np.floor(np.log10(numbers)), 0.0)
