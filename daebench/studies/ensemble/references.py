"""References for the errors of the members of an ensemble: runs of heyoka's batch mode, or of a composition with small steps."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput
from daebench.methods.ensemble.heyoka_batches import in_batches, refusal
from daebench.methods.ensemble.run import run_members
from daebench.methods.fixed_step.base import FixedStepMethod
from daebench.methods.names import method_of
from daebench.reference.solution import CONSERVED, EPS, SAFETY
from daebench.runs.ivp import Array
from daebench.runs.members import Members
from daebench.runs.request import Request
from daebench.runs.state import CONSTRAINED, POISSON

TIGHT, LOOSE = 2.2e-16, 1e-14
"""Tolerance of heyoka's run that is used, and of the one whose difference from it tells how good it is."""

COMPOSITIONS = {
    CONSTRAINED: ("rattle/kahan_li8", "lobatto3/kahan_li8", "dla/kahan_li8"),
    POISSON: ("strang/kahan_li8", "midpoint/kahan_li8"),
}
"""Compositions of order 8 by the state of the problem; the first that takes it is used."""

FINE, LESS_FINE = 3, 2
"""Parts of a step that the composition takes in the run that is used, and in that whose difference from it tells how good it is."""


@dataclass(frozen=True)
class MemberReferences:
    """Motions of all members, and by how much each may be wrong.

    Parameters
    ----------
    words : str
        How they were made.
    t : ndarray, shape(k,)
        Times, s, from 0.
    states : mapping of str to ndarray, shape(k, n, d)
        "p" and "q", or "y".
    bound : mapping of str to ndarray, shape(n,)
        Largest error of a component of each; infinite for a member that has no reference.
    """

    words: str
    t: Array
    states: Mapping[str, Array]
    bound: Mapping[str, Array]


def member_references(members: Members, t_end: float, outputs: int, h: float) -> MemberReferences:
    """Return the motions of members by heyoka's batch mode, or where it does not take the problem by a composition of order 8.

    heyoka runs with the tolerance 2.2e-16, the composition with a third of ``h``. What each may be wrong by is taken as 10 times the
    largest difference from a second run, with the tolerance 1e-14 or half of ``h``, of this member or of the median one if that is more:
    two runs may come close to each other by chance. A member whose energy changes by more than 1e-6 of its largest modulus has passed
    something unseen, and has no reference.

    ::

        >>> from daebench import initial_value_problem
        >>> from daebench.starts.draw import draw_starts
        >>> some = draw_starts(initial_value_problem("planar_pendulum"), members=4, h=0.1).members
        >>> references = member_references(some, t_end=1.0, outputs=10, h=0.1)
        >>> references.states["q"].shape, bool(references.bound["q"].max() < 1e-11)
        ((11, 4, 2), True)

    Parameters
    ----------
    members : Members
        The members.
    t_end : float
        End, s.
    outputs : int
        Number of equidistant times after the start.
    h : float
        Step size of which the composition takes a third, s; the distance of outputs is a multiple of it.

    Raises
    ------
    BadInput
        If neither takes the problem.
    """
    t: Array = t_end / outputs * np.arange(outputs + 1, dtype=np.float64)
    if (why := refusal(members)) is None:
        used, other = (in_batches(members, t, tol) for tol in (TIGHT, LOOSE))
        words = f"heyoka in batches (tol {TIGHT:g})"
    else:
        used, other, words = _composed(members, t_end, outputs, h, why)
    names = members.ivp.state.vectors
    states, others = (dict(zip(names, members.ivp.vectors(rows), strict=True)) for rows in (used, other))
    lost = _lost(members, [states[name] for name in names])
    bound = {name: np.where(lost, np.inf, bounds_of(states[name], others[name])) for name in names}
    return MemberReferences(words, t, states, bound)


def bounds_of(used: Array, other: Array) -> Array:
    """Return bounds on the errors of states, shape(n,), from two runs, each shape(k, n, d); infinite where one has ended."""
    off = np.max(np.abs(used - other), axis=(0, 2))
    known = np.isfinite(off)
    if not known.any():
        return np.full(len(off), np.inf)
    size = np.max(np.abs(used), axis=(0, 2))
    return np.where(known, np.maximum(SAFETY * np.maximum(off, np.median(off[known])), EPS * size), np.inf)


def _composed(members: Members, t_end: float, outputs: int, h: float, why: str) -> tuple[Array, Array, str]:
    """Return states by a composition with a third of a step and with half of it, and words."""
    method = _composition(members, why)
    rows = []
    for parts in (FINE, LESS_FINE):
        every = round(t_end / outputs / h) * parts
        some = replace(members, h=t_end / outputs / every)
        asked = Request(value=some.h, steps=every * outputs, every=every, watch=(), count=False)
        rows.append(run_members(method, some, asked).states)
    return rows[0], rows[1], f"{method.name} (h {t_end / outputs / (round(t_end / outputs / h) * FINE):.3g})"


def _composition(members: Members, why: str) -> FixedStepMethod[Any, Any]:
    """Return the first composition that takes the problem; ``why`` is why heyoka does not."""
    refusals, ivp = [why], members.ivp
    for name in COMPOSITIONS[ivp.state]:
        try:
            method: FixedStepMethod[Any, Any] = method_of(ivp, name)
            if (refused := method.refusal(ivp)) is None:
                return method
            refusals.append(refused)
        except BadInput as error:
            refusals.append(str(error))
    raise BadInput(f"{ivp.problem} has no references for many starts: {' '.join(refusals)}", "no-references-for-starts")


def _lost(members: Members, states: Sequence[Array]) -> NDArray[np.bool_]:
    """Return which members do not keep the energy, or have ended, shape(n,)."""
    H = members.along("H", *states)
    size = np.abs(H[0])
    if len(states) == 2:
        products = np.asarray(states[0] * members.along("H_p", *states))
        size = np.maximum(size, np.max(np.abs(np.sum(products[..., : members.ivp.moving], axis=2)), axis=0))
    with np.errstate(all="ignore"):
        conserved: NDArray[np.bool_] = np.max(np.abs(H - H[0]), axis=0) <= CONSERVED * size
    return ~conserved
