"""From a definition to certified digits: the reference, a second run of it, an independent one, the bound, and the growth of errors."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath as mp
import numpy as np

from daebench.errors import RunFailed
from daebench.reference.keep.record import EPS
from daebench.reference.make.independent_computations import Computations, States, differences, sizes
from daebench.reference.make.stages import Rows
from daebench.runs.ivp import Array

WORK_DIGITS, MORE_DIGITS = 50, 70
"""Decimal digits with which closed forms are evaluated, first and a second time."""

STORED_DIGITS = 34
"""Significant digits of every stored number."""

SAFETY = 10.0
"""Ratio of the bound to the largest difference so far."""

AGAIN: dict[str, Any] = {"tolerance": "1e-33", "parts": 3}
"""Options of the second run. With the same order and the same steps it would have the same rounding."""

AGREEMENT = 100.0
"""Ratio by which an independent motion may differ more than a second run, which is only one sample of the rounding of both. A
mistake in the equations would cause a larger difference by many orders of magnitude."""

WORTH = 1e-17
"""Bound at which a reference ends, as a fraction of the largest number of a part, such as a position: all digits of a double are known."""

ROUNDING = 1e-33
"""Error of rounding to 34 digits, or to quadruple precision a few times, as a fraction of the largest modulus."""

FLOOR = 1e-30
"""Fraction of the largest modulus by which an independent motion may always differ. The maps into other coordinates and back, such as the
roots of an exponential minus one, may cancel three digits at once, before any error grows."""

SINGULAR = 1e-6
"""Smallest singular value of G H_pp G^T, as a fraction of the largest one along the motion, below which a definition is refused."""

BARELY = 1e-10
"""The same for outputs of a motion that may pass a rank loss; multipliers still have five digits of a double there."""

FEWEST = 8
"""Smallest number of outputs before the horizon in a reference."""


class NotCertified(RunFailed):
    """A definition whose certification failed; the message gives the reason."""


@dataclass(frozen=True)
class Certified:
    """Digits and their error bounds, up to the horizon."""

    t: list[Any]
    """Times, s."""
    states: States
    """States at these times."""
    bound: Mapping[str, Array]
    """Largest error of each number of each part; shape (n, components)."""
    method: str
    """How the reference solution was made."""
    checks: list[dict[str, Any]]
    """Computations with which it was compared, and the largest differences."""


def certify(computations: Computations) -> Certified:
    """Return the certified digits of a definition.

    If the problem has a closed form, this is the reference solution: evaluated with 50 digits, a second time with 70, and compared with
    the Taylor series in the problem's own coordinates, or in its chart if the motion may pass a rank loss. The difference must not exceed
    the uncertainty of that series. Otherwise the Taylor series is the reference solution, run a second time with other steps. Both are also
    compared with the series in other coordinates if there are any: for a constrained problem without a closed form its chart, or
    velocities along the manifold if it has no chart or a long one; for a Poisson system its
    canonical coordinates, otherwise the constrained system that is mapped to it, otherwise skewed ones.
    """
    mathematics, name = computations.mathematics, computations.definition.name
    if not mathematics.closed_form and mathematics.other is None:
        raise NotCertified(
            f"{name} has neither a closed form nor a chart to certify it by, nor M and U with a constant M, without time and forces, for "
            "velocities along the manifold; declare one in the problem.",
            "reference-not-certifiable",
        )
    first, second = computations.own(), computations.own(stage="taylor-again", **AGAIN)
    # Beside a closed form the series is the less accurate of the two, so that its own error decides what they may differ by.
    uncertain = largest_so_far([differences(first, second)], first, safety=AGREEMENT, floor=FLOOR)
    if mathematics.closed_form:
        where = ", in minimal coordinates" if mathematics.crosses else ""
        reference, method = computations.closed_form(WORK_DIGITS), f"closed form, {WORK_DIGITS} digits{where}"
        again, independent = {f"closed form with {MORE_DIGITS} digits": computations.closed_form(MORE_DIGITS)}, {mathematics.series: first}
    else:
        reference, method = first, mathematics.series
        again, independent = {"second run with another order and other steps": second}, {}
    if mathematics.other is not None:
        independent[f"Taylor series in {mathematics.other.name}"] = computations.other()
    for what, motion in independent.items():
        _require_agreement(name, computations.times, differences(reference, motion), uncertain, what)
    return _cut(computations, reference, method, again | independent)


def largest_so_far(
    deviations: Sequence[Mapping[str, Array]], states: States, *, safety: float = SAFETY, floor: float = ROUNDING
) -> dict[str, Array]:
    """Return ten times the largest difference of each component up to each time, plus the rounding at the floor."""
    largest = sizes(states)

    def bound(part: str) -> Array:
        seen = np.max([deviation[part] for deviation in deviations], axis=0)
        return safety * np.maximum.accumulate(seen, axis=0) + floor * largest[part]

    return {part: bound(part) for part in largest}


def _require_agreement(name: str, times: Sequence[Any], deviation: Mapping[str, Array], allowed: Mapping[str, Array], what: str) -> None:
    for part in deviation:
        allowed_here = allowed[part].max(axis=1)  # a component may be constant by symmetry in one motion but not in the other
        found_here = deviation[part].max(axis=1)
        wrong = np.flatnonzero(~(found_here <= allowed_here))
        if wrong.size:
            k = wrong[0]
            raise NotCertified(
                f"{name} was not certified: at t = {mp.nstr(times[k], 9)} the {what} differs in {part} by {found_here[k]:.2g}, "
                f"but its own error explains at most {allowed_here[k]:.2g}; find out which of the two is wrong.",
                "reference-computations-differ",
            )


def _cut(computations: Computations, reference: States, method: str, others: Mapping[str, States]) -> Certified:
    """Return the part before the horizon, with the bound from the other motions."""
    bound = largest_so_far([differences(reference, motion) for motion in others.values()], reference)
    largest, n = sizes(reference), len(reference.rows)
    for part, values in bound.items():
        lost = np.flatnonzero(~np.all(values <= WORTH * largest[part], axis=1))
        n = min(n, lost[0] if lost.size else n)
    if n < FEWEST:
        name = computations.definition.name
        raise NotCertified(
            f"{name} was not certified: its bound exceeds {WORTH:g} of the motion after {n} outputs; give closer times.",
            "reference-bound-too-large",
        )
    states = reference.until(n)
    checks = [{"against": name, "largest_difference": _largest(states, motion.until(n))} for name, motion in others.items()]
    return Certified(list(computations.times[:n]), states, {part: values[:n] for part, values in bound.items()}, method, checks)


def _largest(reference: States, other: States) -> dict[str, float]:
    return {part: float(f"{values.max():.2g}") for part, values in differences(reference, other).items()}


def smallest_singular_values(name: str, computations: Computations, certified: Certified) -> Array:
    """Return the smallest singular value of G H_pp G^T, which must not lose rank, at each time."""
    mathematics = computations.mathematics
    least, advice = (BARELY, "choose another distance of outputs") if mathematics.crosses else (SINGULAR, "end the reference before")
    values = np.array([mathematics.smallest_singular_value(row) for row in certified.states.rows])
    k = int(np.argmin(values))
    if not values[k] > least * values.max():
        raise NotCertified(
            f"{name} was not certified: the smallest singular value of {mathematics.regular} is {values[k]:.2g} at "
            f"t = {mp.nstr(certified.t[k], 9)}, {values.max():.2g} at most; {advice}.",
            "reference-nearly-singular",
        )
    return values


BESIDE = mp.mpf("1e-20")
"""Relative distance of the neighbours: far above quadruple rounding, and in the linear range up to amplifications of 1e16."""

RESOLVED = 1e-11
"""Fraction of the largest growth above which the growth in another direction is not lost in rounding."""

LOST = 0.01
"""A motion is lost once an error is this fraction of it. No run can follow once the rounding of a single state has grown as much."""


@dataclass(frozen=True)
class Growth:
    """Largest growth of a perturbation at each time, shape(n,): from the start, from any earlier time, from the last.

    ::

        A(t, s) = max |S^-1 dx(t)| / |S^-1 dx(s)|      S = diag(max |q|, max |p|), or max |y|

    Perturbations of a constrained problem are along the manifold; those of a Poisson system are arbitrary.
    """

    start: Array
    worst: Array
    step: Array


def amplification(computations: Computations, certified: Certified) -> Growth:
    """Return the growth of perturbations, from neighbours in quadruple precision, one for each direction.

    The rounding of an intermediate state grows from there. If the motion converges again, this is more than the growth from the start.
    """
    n, largest, state = len(certified.t), sizes(certified.states), computations.definition.ivp.state
    first = certified.states.parts
    S = np.concatenate([np.full(len(first[part][0]), largest[part]) for part in state.columns])
    Q = np.linalg.qr(computations.mathematics.directions / S[:, None])[0]
    base, columns = computations.own(), []
    for k, direction in enumerate((S[:, None] * Q).T):
        beside = computations.own([BESIDE * mp.mpf(float(x)) for x in direction], stage=f"beside-{k + 1}")
        columns.append(_apart(base.rows[:n], beside.rows) / S)
    return growth(np.stack(columns, axis=2))


def growth(C: Array) -> Growth:
    """Return the growth from columns of a tangent map, shape(n, size, directions), orthonormal at the start.

    Directions that have shrunk to below 1e-11 of the largest are not resolved by C and are left out.
    """
    back = np.linalg.pinv(C, rcond=RESOLVED)
    start = np.linalg.norm(C, ord=2, axis=(1, 2))
    worst = [max(start[k], np.linalg.norm(C[k] @ back[: k + 1], ord=2, axis=(1, 2)).max()) for k in range(len(C))]
    step = np.linalg.norm(C[1:] @ back[:-1], ord=2, axis=(1, 2))
    return Growth(start, np.array(worst), np.concatenate([[1.0], step]))


def _apart(base: Rows, beside: Rows) -> Array:
    """Return the distance of two motions in units of the perturbation, shape(n, size)."""
    return np.array([[float((y - x) / BESIDE) for x, y in zip(*rows, strict=True)] for rows in zip(base, beside, strict=False)])


def double_horizon(t: Any, worst: Array) -> float | None:
    """Return the first time at which the rounding of a state in double precision is a hundredth of the motion, or None."""
    lost = np.flatnonzero(worst * EPS > LOST)
    return float(t[lost[0]]) if lost.size else None
