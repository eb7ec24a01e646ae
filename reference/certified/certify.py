"""From a definition to certified digits: the truth, a second run of it, an independent one, and the bound that they leave."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath as mp
import numpy as np
from numpy.typing import NDArray

from daebench.errors import RunFailed
from daebench.reference.certified.motions import Motions, States, differences, sizes

Array = NDArray[np.float64]

WORK_DIGITS, MORE_DIGITS = 50, 70
"""Decimal digits in which closed forms are worked out, and those of the second run of them."""

STORED_DIGITS = 34
"""Significant digits of every stored number."""

SAFETY = 10.0
"""The bound is so many times the largest difference seen so far."""

AGAIN: dict[str, Any] = {"tolerance": "1e-33", "parts": 3}
"""What the second run does differently: runs of the same order with the same steps have the same rounding."""

AGREEMENT = 100.0
"""An independent motion may be so many times further away than a second run: that run is one sample of the rounding of both, and a
mistake in the equations would be larger by many orders."""

WORTH = 1e-17
"""A reference ends where its bound exceeds this part of the largest position, momentum or multiplier: it has all digits of a double."""

ROUNDING = 1e-33
"""Part of the largest modulus that rounding to 34 digits, or to quadruple precision a few times, may make up."""

SINGULAR = 1e-6
"""Smallest singular value of G H_pp G^T, as a part of the largest one met, below which a definition is refused."""

SERIES = "Taylor series of HLW (1.18) in quadruple precision"

FEWEST = 8
"""Fewest outputs before the horizon that make a reference."""


class NotCertified(RunFailed):
    """A definition whose certification failed; the message says at what."""


@dataclass(frozen=True)
class Certified:
    """Digits and what is known of their errors, up to the horizon.

    Parameters
    ----------
    t : list of mpmath number
        Times, s.
    states : States
        q, p and lam.
    bound : mapping of str to ndarray, shape(n, d) or (n, m)
        Largest error of each number.
    method : str
        How the truth was made.
    checks : list of dict
        What it was held against, and the largest difference.
    """

    t: list[Any]
    states: States
    bound: Mapping[str, Array]
    method: str
    checks: list[dict[str, Any]]


def certify(motions: Motions) -> Certified:
    """Return the certified digits of a definition.

    Where the problem has a closed form, that is the truth: worked out with 50 digits, a second time with 70, and held against the
    Taylor series of (1.18), from which it must be no further than that series is uncertain. Else the Taylor series is the truth: run a
    second time with other steps, and held against the series in the problem's chart.

    Raises
    ------
    NotCertified
        If there is neither a closed form nor a chart, the independent motion disagrees, G loses rank, or nothing is left.
    """
    problem, name = motions.definition.derivation.problem, motions.definition.name
    if problem.closed_form is None and problem.chart is None:
        raise NotCertified(f"{name} has neither a closed form nor a chart to certify it by; declare one in the problem.")
    first, second = motions.own(), motions.own(stage="taylor-again", **AGAIN)
    uncertain = largest_so_far([differences(first, second)], first, safety=AGREEMENT, floor=10 * ROUNDING)
    if problem.closed_form is not None:
        truth, more = motions.closed_form(WORK_DIGITS), motions.closed_form(MORE_DIGITS)
        _require_agreement(name, motions.times, differences(truth, first), uncertain, SERIES)
        others = {f"closed form with {MORE_DIGITS} digits": more, SERIES: first}
        return _cut(motions, truth, [more, first], f"closed form, {WORK_DIGITS} digits", others)
    local = motions.local()
    _require_agreement(name, motions.times, differences(first, local), uncertain, "Taylor series in the chart")
    others = {"second run with another order and other steps": second, "Taylor series in the problem's chart": local}
    return _cut(motions, first, [second, local], SERIES, others)


def largest_so_far(
    found: Sequence[Mapping[str, Array]], states: States, *, safety: float = SAFETY, floor: float = ROUNDING
) -> dict[str, Array]:
    """Return ten times the largest difference of each component up to each time, and what rounding to the floor makes of it."""
    largest = sizes(states)

    def bound(part: str) -> Array:
        seen = np.max([each[part] for each in found], axis=0)
        return safety * np.maximum.accumulate(seen, axis=0) + floor * largest[part]

    return {part: bound(part) for part in largest}


def _require_agreement(name: str, times: Sequence[Any], found: Mapping[str, Array], allowed: Mapping[str, Array], what: str) -> None:
    for part in ("q", "p", "lam"):
        allowed_here = allowed[part].max(axis=1)  # a component may lie still in one motion by symmetry and not in the other
        found_here = found[part].max(axis=1)
        wrong = np.flatnonzero(~(found_here <= allowed_here))
        if wrong.size:
            k = wrong[0]
            raise NotCertified(
                f"{name} was not certified: at t = {mp.nstr(times[k], 9)} the {what} differs in {part} by {found_here[k]:.2g}, "
                f"and at most {allowed_here[k]:.2g} is explained by its own error; see which of the two is wrong."
            )


def _cut(motions: Motions, truth: States, deciding: Sequence[States], method: str, others: Mapping[str, States]) -> Certified:
    """Return what lies before the horizon, with the bound that some motions leave and the differences from others."""
    bound = largest_so_far([differences(truth, each) for each in deciding], truth)
    largest, n = sizes(truth), len(truth.q)
    for part, values in bound.items():
        lost = np.flatnonzero(~np.all(values <= WORTH * largest[part], axis=1))
        n = min(n, lost[0] if lost.size else n)
    if n < FEWEST:
        name = motions.definition.name
        raise NotCertified(f"{name} was not certified: its bound exceeds {WORTH:g} of the motion after {n} outputs; give closer times.")
    kept = truth.until(n)
    checks = [{"against": name, "largest_difference": _largest(kept, each.until(n))} for name, each in others.items()]
    return Certified(list(motions.times[:n]), kept, {part: values[:n] for part, values in bound.items()}, method, checks)


def _largest(truth: States, other: States) -> dict[str, float]:
    return {part: float(f"{values.max():.2g}") for part, values in differences(truth, other).items()}


def smallest_singular_values(name: str, motions: Motions, certified: Certified) -> Array:
    """Return the smallest singular value of G H_pp G^T at each time.

    Raises
    ------
    NotCertified
        If it falls below a millionth of its largest.
    """
    states = zip(certified.states.q, certified.states.p, strict=True)
    values = np.array([motions.functions.smallest_singular_value(q, p) for q, p in states])
    k = int(np.argmin(values))
    if not values[k] > SINGULAR * values.max():
        raise NotCertified(
            f"{name} was not certified: the smallest singular value of G M^-1 G^T is {values[k]:.2g} at t = {mp.nstr(certified.t[k], 9)}, "
            f"{values.max():.2g} at most; end the reference before."
        )
    return values
