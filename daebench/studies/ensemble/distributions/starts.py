"""What a distribution of starts gives: members, and a sentence that says what they are."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from daebench.errors import BadInput, whole
from daebench.runs.ivp import Array, Ivp
from daebench.runs.members import Members, members


@dataclass(frozen=True)
class Starts:
    """Members whose starts are drawn.

    Parameters
    ----------
    members : Members
        The members.
    about : str
        A sentence: which measure, box, size and seed, and what was measured when they were drawn.
    measured : mapping of str to float
        The numbers in that sentence, by name.
    """

    members: Members
    about: str
    measured: Mapping[str, float] = field(default_factory=dict)


class Distribution(Protocol):
    """A distribution of starts."""

    def draw(self, ivp: Ivp, n: int | None, h: Any, parameters: Mapping[str, Any] | None = None, seed: int = 0) -> Starts:
        """Return n members, each the same however many there are.

        Parameters
        ----------
        ivp : InitialValueProblem
            The problem, its parameters, and the start that others are distributed about.
        n : int, optional
            Number of members; a grid has its own.
        h : float or array_like, shape(n,)
            Step size of all, or of each, s.
        parameters : mapping of str to array_like, shape(n,), optional
            Parameters that differ from member to member.
        seed : int
            Seeds all random numbers.

        Raises
        ------
        BadInput
            If there is nothing to draw, or it cannot be drawn.
        """


def copies(ivp: Ivp, n: int | None, h: Any, parameters: Mapping[str, Any] | None, seed: int) -> Members:
    """Return n members at the start of the problem.

    Raises
    ------
    BadInput
        If n is not a whole number greater than 0, the seed not one of at least 0, or h or a parameter not what it must be.
    """
    if n is None:
        raise BadInput("say how many members the ensemble is to have.")
    if whole("members", n) < 1:
        raise BadInput(f"members = {n} must be at least 1.")
    if whole("seed", seed) < 0:
        raise BadInput(f"seed = {seed} must be at least 0.")
    some = members(ivp, tuple(np.repeat(vector[None], n, axis=0) for vector in ivp.start), h, parameters or {})
    for name, values in some.parameters.items():
        if name in ivp.facts.POSITIVE and not np.all(values > 0):
            raise BadInput(f"{name} of {ivp.problem} must be greater than 0 in every member; the least is {np.min(values):g}.")
    return some


def require_inside(some: Members, what: str) -> Members:
    """Return members of a Poisson system, all of which start within its domain.

    Raises
    ------
    BadInput
        If some do not, with how many.
    """
    domain = " and ".join(f"{expression} > 0" for expression in some.ivp.facts.DOMAIN)
    if domain:
        outside = np.flatnonzero(~some.along("inside", some.start[0]).astype(bool))
        if len(outside):
            raise BadInput(
                f"{len(outside)} of {len(some)} starts of {what} of {some.ivp.problem} are outside its domain {domain}, the first of "
                f"them that of member {outside[0]}; stay inside."
            )
    return some


def of_case(ivp: Ivp) -> str:
    """Return the problem and its case as words."""
    return f"{ivp.problem}, case {ivp.case}" if ivp.case else ivp.problem


def differing(some: Members) -> str:
    """Return which parameters differ from member to member, as the end of a sentence."""
    return f"; {', '.join(some.parameters)} differ from member to member" if some.parameters else ""


def casimirs(some: Members) -> tuple[str, dict[str, float]]:
    """Return between which values the Casimir functions of members lie, as the end of a sentence, and these values by name."""
    names = some.ivp.facts.CASIMIRS
    if not names:
        return "", {}
    values: Array = some.along("casimirs", *some.start)
    least, most = np.min(values, axis=0), np.max(values, axis=0)
    words = ", ".join(f"{name} from {lo:.6g} to {hi:.6g}" for name, lo, hi in zip(names, least, most, strict=True))
    measured = {f"{name} {end}": float(x) for end, row in (("least", least), ("most", most)) for name, x in zip(names, row, strict=True)}
    return f"; Casimir functions differ with the start, {words}", measured
