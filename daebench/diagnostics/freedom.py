"""Degrees of freedom: the rank of G at the start, and which constraints are redundant there, for the moment or for good."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from daebench.diagnostics.departure import Surroundings, goes_on, orders
from daebench.diagnostics.inverse_mass import inverse_mass
from daebench.diagnostics.second_order import dependence_at
from daebench.diagnostics.unit_rows import DEPENDENT, beyond_comparison
from daebench.errors import BadInput
from daebench.runs.ivp import ConstrainedIvp

LATER = (1e-3, 1e-1)
"""Times after the start, s, at which positions that satisfy the constraints of a system in time are sought."""

ITERATIONS = 20
"""Number of Gauss-Newton iterations of that search."""

ROUNDED = 64 * float(np.finfo(float).eps)
"""Part of the terms of G q below which |g| is one of rounding."""

UNMET = 1e-6
"""Relative residual above which a driver contradicts other constraints; one that does not leaves some roundings."""


INDEPENDENT, REDUNDANT, TANGENTIAL, CROSSING, UNDECIDED = "independent", "redundant", "tangential", "change point", "undetermined"
"""Kinds of a start by how its constraints meet."""

CURES = {
    REDUNDANT: "",
    TANGENTIAL: "keep {held}, or in {its} place hold these directions at first order: of three points in a line the middle one linearly, "
    "x2 = (x1 + x3)/2 if it is half way, and one distance",
    CROSSING: "start elsewhere on one of them",
    UNDECIDED: "write the constraints so that their gradients are independent, or start where they are",
}
"""Advice by kind, without that on redundant constraints."""


@dataclass(frozen=True)
class Freedom:
    """The rank of G at the start of a problem, and nearby, and how constraints meet there.

    Parameters
    ----------
    d, m : int
        Numbers of positions and of constraints.
    rank : int
        Rank of G at the start.
    nearby : int
        Largest rank of G at points around the start that satisfy all constraints.
    others : mapping of int to tuple of int
        Each constraint that depends on earlier constraints, with their names; if there are none, its gradient is zero.
    ivp : ConstrainedIvp
        The problem, which names its constraints.
    kind : str
        Independent, redundant, tangential, change point or undetermined.
    spare : tuple of int
        Dependent constraints that hold around the start wherever the independent ones do.
    forbidden : int
        Directions that G leaves free and dependent constraints forbid at second order.
    order : int
        Order at which the first dependent constraint departs from the independent ones; 0 if none does.
    """

    d: int
    m: int
    rank: int
    nearby: int
    others: Mapping[int, tuple[int, ...]]
    ivp: ConstrainedIvp
    kind: str = INDEPENDENT
    spare: tuple[int, ...] = ()
    forbidden: int = 0
    order: int = 0

    @property
    def degrees(self) -> int:
        """Degrees of freedom, d - rank G without what is forbidden at second order; where branches cross, those of a branch."""
        return self.d - (self.nearby if self.kind == CROSSING else self.rank + self.forbidden)

    @property
    def permanent(self) -> bool:
        """Whether some constraints are redundant, and none is tangential, or dependent for the moment only."""
        return self.kind == REDUNDANT

    @property
    def held(self) -> tuple[int, ...]:
        """Dependent constraints that are not redundant."""
        return tuple(k for k in self.others if k not in self.spare)

    @property
    def count(self) -> str:
        """The degrees of freedom in words."""
        plural = "s" if self.m > 1 else ""
        of = f"{self.m} constraint{plural}" if self.rank == self.m else f"{self.m} constraints, of rank {self.rank}"
        of += f", that forbid {self.forbidden} more at second order" if self.forbidden else ""
        of += f" there and {self.nearby} nearby" if self.kind == CROSSING else ""
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
        """How the constraints meet, as part of a sentence."""
        if self.kind == REDUNDANT:
            return "also nearby, so the constraints are redundant"
        held = self.ivp.listed(self.held)
        nearby = "also nearby" if self.nearby == self.rank else f"though G has rank {self.nearby} nearby"
        nearby = "though not nearby" if self.nearby == self.m else nearby
        if self.kind == TANGENTIAL:
            ways = f"{self.forbidden} direction{'' if self.forbidden == 1 else 's'}"
            forbid, without = ("forbid", "them") if len(self.held) > 1 else ("forbids", "it")
            return (
                f"there, {nearby}, but tangentially: {held} {forbid} at second order {ways} that G leaves free, so that without {without} "
                "there is another motion"
            )
        if self.kind == CROSSING:
            return f"there, {nearby}: branches of the set of positions cross"
        change = f"{held} depart{'s' if len(self.held) == 1 else ''} from them at order {self.order}"
        return f"there, {nearby}, and second derivatives do not decide what they forbid: {change}"

    @property
    def cure(self) -> str:
        """Advice on how to make the constraints independent, as part of a sentence."""
        spare = [f"remove {self.ivp.listed(self.spare)}"] if self.spare else []
        its = "its" if len(self.held) == 1 else "their"
        rest = CURES[self.kind].format(held=self.ivp.listed(self.held), its=its)
        if self.kind == TANGENTIAL and self.nearby > self.rank:
            rest = "start where they are independent"
        return ", and ".join([*spare, *([rest] if rest else [])])

    @property
    def remedy(self) -> str:
        """Advice on constraints that depend on others at the start, as part of a sentence."""
        solved = 'add --on-singular least-squares (on_singular="least-squares" in Python, and in a Case)'
        loosely = " and holds these directions to the root of rounding only" if self.kind == TANGENTIAL else ""
        return f"{self.cure}, or {solved}, which finds multipliers of least norm{loosely}"


def freedom(ivp: ConstrainedIvp) -> Freedom | None:
    """Return the rank of G at the start and nearby, which constraints depend on others, and how they meet.

    Rows of G are taken in the metric M^-1 and scaled to length one, so that neither masses nor units matter. Let w span the left null space
    of G, and Z its null space. *Redundant* constraints hold nearby wherever independent ones do, and the forms Z^T (w^T g_qq) Z are zero.
    They are *tangential* where one of these forms is semidefinite and not zero, and the set goes on in its kernel. At a *change point* a
    form is indefinite, and G has a larger rank at points of the set nearby.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers, examined at q0.

    Returns
    -------
    Freedom or None
        None if a value is not finite, which another check reports, or if there are more constraints than
        :data:`daebench.diagnostics.unit_rows.LARGEST`.

    Examples
    --------
    >>> import daebench
    >>> counted = freedom(daebench.initial_value_problem("double_pendulum"))
    >>> counted.rank, counted.degrees
    (2, 2)
    """
    if beyond_comparison(ivp):
        return None
    try:
        dependent = dependence_at(ivp)
        if dependent is None:
            return Freedom(ivp.moving, ivp.m, ivp.m, ivp.m, {}, ivp)
        around = Surroundings(ivp, dependent)
        order, (settled, nearby), forms = orders(around), goes_on(around), dependent.kernel[1]
    except (np.linalg.LinAlgError, ValueError):
        return None
    # Both: rounding may hide a small departure, and second derivatives do not see one of third order.
    curved = np.any(dependent.forms, axis=(1, 2))
    order = np.where(curved, 2.0, order)
    spare = np.isinf(order)
    rank, crosses = len(dependent.independent), bool(np.any(forms))
    if np.all(spare):
        kind = REDUNDANT
    elif dependent.forbidden and (settled or crosses):
        kind = TANGENTIAL
    else:
        kind = CROSSING if crosses and nearby > rank else UNDECIDED
    return Freedom(
        *(ivp.moving, ivp.m, rank, nearby, {k: tuple(of) for k, of in dependent.others.items()}, ivp, kind),
        spare=tuple(k for k, is_spare in zip(dependent.others, spare, strict=True) if is_spare),
        forbidden=dependent.forbidden,
        order=int(np.min(order[~spare], initial=9.0)) * (kind != REDUNDANT),
    )


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
        If the rank of G is the number of positions there, or tangential constraints forbid all that G leaves free.
    """
    counted = None if ivp.facts.EXTENDED else freedom(ivp)
    if counted is None or counted.degrees or counted.kind == UNDECIDED:
        return
    forbid = f"forbid{'s' if len(counted.held) == 1 else ''} at second order all that it leaves free"
    rest = f"and {ivp.listed(counted.held)} {forbid}" if counted.forbidden else "as many as there are positions"
    raise BadInput(
        f"{ivp.problem}, case {ivp.case}, cannot move: G has rank {counted.rank} at the start, {rest}; remove constraints, or start where "
        "they leave a degree of freedom.",
        "no-degree-of-freedom",
    )
