"""Recognition of constraints that are distances between point masses, or those of rigid water, from the expressions of a problem."""

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from daebench.systems.constrained import ConstrainedHamiltonian

WATER = [{(0, 3), (1, 4), (2, 5)}, {(0, 6), (1, 7), (2, 8)}, {(3, 6), (4, 7), (5, 8)}]
"""Pairs of coordinates whose differences occur in the constraints of water: oxygen first, the distance of the hydrogen atoms last."""


@dataclass(frozen=True)
class Distance:
    """A constraint factor (sum (q_i - q_j)^2 - square). In a distance from the origin each coordinate stands alone, as the pair (i, i)."""

    pairs: set[tuple[int, int]]
    factor: sp.Expr
    square: sp.Expr


def distance(constraint: sp.Expr, q: Sequence[sp.Symbol]) -> Distance | None:
    """Return the distance that a constraint prescribes; None if it is of another form."""
    if not constraint.is_polynomial(*q):
        return None
    polynomial = sp.Poly(constraint, *q)
    met = [[i for i, power in enumerate(powers) if power] for powers, _ in polynomial.terms()]
    pairs = {(places[0], places[1]) for places in met if len(places) == 2}
    alone = {i for places in met for i in places} - {i for pair in pairs for i in pair}
    pairs |= {(i, i) for i in alone}
    factors = {polynomial.coeff_monomial(q[i] ** 2) for pair in pairs for i in pair}
    if len(factors) != 1 or 0 in factors:
        return None
    factor, square = factors.pop(), -polynomial.coeff_monomial(1)
    sides = sum(((q[i] - q[j]) if i != j else q[i]) ** 2 for i, j in pairs)
    return Distance(pairs, factor, square / factor) if sp.expand(constraint - factor * sides + square) == 0 else None


def distances(problem: ConstrainedHamiltonian) -> list[Distance] | None:
    """Return the distances of all constraints if each is a distance between point masses or from the origin; None otherwise."""
    M = problem.M
    if M is None or not M.is_diagonal() or problem.velocity:
        return None
    lengths = []
    for constraint in problem.g:
        between = distance(sp.sympify(constraint), problem.q)
        if between is None or any(len({M[pair[side], pair[side]] for pair in between.pairs}) > 1 for side in (0, 1)):
            return None
        lengths.append(between)
    return lengths


def is_water(problem: ConstrainedHamiltonian) -> bool:
    """Return whether the constraints are the squared distances of a water molecule: oxygen first, both bonds, then both hydrogen atoms."""
    lengths = distances(problem) if (problem.d, problem.m) == (9, 3) else None
    if not lengths or problem.M is None or [between.pairs for between in lengths] != WATER:
        return False
    plain = all(between.factor == 1 for between in lengths)
    return plain and bool(problem.M[3, 3] == problem.M[6, 6]) and sp.simplify(lengths[0].square - lengths[1].square) == 0
