"""Degrees of freedom: the rank of G at the start, and which constraints are redundant there, for the moment or for good."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from daebench.diagnostics.consistency import project
from daebench.diagnostics.inverse_mass import inverse_mass
from daebench.diagnostics.second_order import dependence_at
from daebench.diagnostics.unit_rows import DEPENDENT, beyond_comparison, dependent_rows, rank_of, root, unit_rows
from daebench.errors import BadInput
from daebench.runs.ivp import Array, ConstrainedIvp

NEARBY = 1e-3
"""Distance of the points nearby, as a part of the largest coordinate: redundant constraints depend on each other there too."""

POINTS = 3
"""Number of points of the manifold nearby."""

LATER = (1e-3, 1e-1)
"""Times after the start, s, at which positions that satisfy the constraints of a system in time are sought."""

ITERATIONS = 20
"""Number of Gauss-Newton iterations of that search."""

ROUNDED = 64 * float(np.finfo(float).eps)
"""Part of the terms of G q below which |g| is one of rounding."""

UNMET = 1e-6
"""Relative residual above which a driver contradicts other constraints; one that does not leaves some roundings."""


@dataclass(frozen=True)
class Freedom:
    """The rank of G at the start of a problem, and nearby.

    Parameters
    ----------
    d, m : int
        Numbers of positions and of constraints.
    rank : int
        Rank of G at the start.
    nearby : int
        Largest rank of G at points of the manifold around the start.
    others : mapping of int to tuple of int
        Each constraint that depends on earlier constraints, with their names; if there are none, its gradient is zero.
    ivp : ConstrainedIvp
        The problem, which names its constraints.
    forbidden : int
        Directions that G leaves free and dependent constraints forbid at second order.
    """

    d: int
    m: int
    rank: int
    nearby: int
    others: Mapping[int, tuple[int, ...]]
    ivp: ConstrainedIvp
    forbidden: int = 0

    @property
    def degrees(self) -> int:
        """Degrees of freedom at the start, d - rank G without what is forbidden at second order."""
        return self.d - self.rank - self.forbidden

    @property
    def permanent(self) -> bool:
        """Whether some constraints are redundant: dependent at the start and as dependent nearby, and without effect at second order."""
        return self.nearby == self.rank < self.m and not self.forbidden

    @property
    def count(self) -> str:
        """The degrees of freedom in words."""
        plural = "s" if self.m > 1 else ""
        of = f"{self.m} constraint{plural}" if self.rank == self.m else f"{self.m} constraints, of rank {self.rank}"
        of += f", that forbid {self.forbidden} more at second order" if self.forbidden else ""
        return f"{self.d} positions, {of}: {self.degrees} degree{'' if self.degrees == 1 else 's'} of freedom"

    @property
    def named(self) -> str:
        """The dependences between constraints, as part of a sentence; "" if there are none."""
        return "; ".join(
            f"{self.ivp.named(k)} is a combination of {self.ivp.listed(of)}" if of else f"the gradient of {self.ivp.named(k)} is zero"
            for k, of in self.others.items()
        )

    @property
    def where(self) -> str:
        """Whether this is so only at the start, as part of a sentence."""
        if self.forbidden:
            ways = f"{self.forbidden} direction{'' if self.forbidden == 1 else 's'}"
            return f"there, and forbids at second order {ways} that G leaves free, so that without it there is another motion"
        if self.permanent:
            return "also nearby, so the constraints are redundant"
        return "there, though not nearby" if self.nearby == self.m else f"though G has rank {self.nearby} nearby"

    @property
    def remedy(self) -> str:
        """Advice on constraints that depend on others at the start, as part of a sentence."""
        solved = 'add --on-singular least-squares (on_singular="least-squares" in Python, and in a Case)'
        advice = f"remove {self.ivp.listed(self.others)}" if self.permanent else "start where they are independent"
        if self.forbidden:
            advice = "keep it, or hold these directions at first order in its place, for points in a line by equations linear in positions"
        return f"{advice}, or {solved}, which finds multipliers of least norm"


def freedom(ivp: ConstrainedIvp) -> Freedom | None:
    """Return the rank of G at the start and nearby, and which constraints depend on others.

    Rows of G are taken in the metric M^-1 and scaled to length one, so that neither masses nor units matter. Where some depend on others,
    column-pivoted QR decides the rank, and it is taken again at points around the start, which are projected onto g = 0.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers, examined at q0.

    Returns
    -------
    Freedom or None
        None if a value is not finite, which another check reports, or if there are more constraints than
        :data:`daebench.diagnostics.unit_rows.LARGEST`.
    """
    if beyond_comparison(ivp):
        return None
    try:
        rows = unit_rows(ivp, ivp.q0)
        others = dependent_rows(rows)
        if not others:
            return Freedom(ivp.moving, ivp.m, ivp.m, ivp.m, {}, ivp)
        rank = rank_of(rows)
        # The largest rank: the generic one. Single points nearby may be singular as well.
        nearby = max((rank_of(unit_rows(ivp, q)) for q in _nearby(ivp, rows, rank)), default=rank)
        second = dependence_at(ivp)
    except (np.linalg.LinAlgError, ValueError):
        return None
    forbidden = second.forbidden if second else 0
    return Freedom(ivp.moving, ivp.m, rank, nearby, {k: tuple(of) for k, of in others.items()}, ivp, forbidden)


def _nearby(ivp: ConstrainedIvp, rows: Array, rank: int) -> Iterator[Array]:
    """Yield positions around the start, moved along directions that G leaves free and projected onto g = 0."""
    free = np.linalg.svd(rows)[2][rank:]
    if not len(free):
        return
    by_mass = root(ivp, ivp.q0)  # q = by_mass x has unit mass in x
    for k in range(POINTS):
        # Irregular weights, so that no symmetry of the problem keeps the rank low along the direction.
        direction = by_mass @ (np.cos(1.0 + k + np.arange(len(free))) @ free)
        size = NEARBY * (float(np.max(np.abs(ivp.q0))) or 1.0) / float(np.max(np.abs(direction)))
        try:
            # To both sides in turn, because the constraints may be of another rank on one of them only.
            yield project(ivp, 0.0 * ivp.p0, ivp.q0 + (-1) ** k * size * direction)[1]
        except BadInput:
            continue


def dependence(ivp: ConstrainedIvp) -> str | None:
    """Return the constraints that depend on others at the start, whether only there, and the advice; None if none are known.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers, examined at q0.
    """
    if ivp.facts.EXPLICIT and not beyond_comparison(ivp) and (fault := undetermined(ivp)):
        return fault
    counted = freedom(ivp)
    if counted is None or not counted.others:
        return None
    sentence = f"G has rank {counted.rank} of {ivp.m}: {counted.named}"
    if contradicted(ivp):
        return f"{sentence}, and no positions satisfy all of them at later times: a driver contradicts the others; leave it out"
    return f"{sentence}, {counted.where}; {counted.remedy}"


def undetermined(ivp: ConstrainedIvp) -> str:
    """Return why H_pp does not determine the multipliers of independent constraints at the start, and what to do; "" where it does."""
    try:
        return inverse_mass(ivp, ivp.p0, ivp.q0).fault
    except np.linalg.LinAlgError:
        return ""  # a value is not finite, which another check reports


def contradicted(ivp: ConstrainedIvp) -> bool:
    """Return whether constraints that a system in time keeps at its start have no positions in common a little later."""
    if not ivp.facts.EXTENDED:
        return False
    n = ivp.moving
    for later in LATER:
        q = np.append(ivp.q0[:n], ivp.q0[n:] + later)
        g = np.abs(ivp.value("g", q))
        if np.all(g <= ROUNDED * np.abs(ivp.value("G", q)) @ np.abs(q)):
            continue  # constraints that do not depend on time hold a little later as they do at the start
        asked = float(np.max(g))
        for _ in range(ITERATIONS):
            # Least squares, because the constraints depend on each other: elimination would fail.
            q[:n] -= np.linalg.lstsq(ivp.value("G", q)[:, :n], ivp.value("g", q), rcond=DEPENDENT)[0]
        if float(np.max(np.abs(ivp.value("g", q)))) > UNMET * asked:
            return True
    return False


def redundant(ivp: ConstrainedIvp) -> bool:
    """Return whether constraints are redundant permanently, not only at the start."""
    counted = freedom(ivp)
    return counted is not None and counted.permanent


def require_freedom(ivp: ConstrainedIvp) -> None:
    """Accept a problem that can move from its start; drivers may move a problem in time.

    Raises
    ------
    BadInput
        If the rank of G is the number of positions there.
    """
    if beyond_comparison(ivp) or ivp.m < ivp.d or ivp.facts.EXTENDED:
        return
    counted = freedom(ivp)
    if counted is not None and not counted.degrees:
        raise BadInput(
            f"{ivp.problem}, case {ivp.case}, cannot move: G has rank {counted.rank} at the start, as many as there are positions; "
            "remove constraints, or start where they leave a degree of freedom."
        )
