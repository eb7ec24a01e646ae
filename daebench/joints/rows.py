"""Rows of equal cells: a mechanism that is a chain of nodes, each tied only to its neighbours, is defined at one node.

A node is one moving point or a few, in the order in which bodies name them. Equations, energy and starting places have to be the same
at all nodes, but for polynomials of degree 2 in the node's number, as of pivots in a row. Then [[M, G^T], [G, 0]] is banded, and a step
costs as much per body however many there are.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import sympy as sp

from daebench.joints.constraints import Labelled
from daebench.joints.inertia import Terms
from daebench.joints.placing import Places
from daebench.joints.starts import Start, positions
from daebench.systems.chain import ConstrainedChain
from daebench.systems.constrained import Case

FEWEST = 8
"""Fewest nodes that make a chain: of fewer the equations are written out."""

WIDEST = 4
"""Most points of a node."""

k = sp.Symbol("k", integer=True, nonnegative=True)


@dataclass(frozen=True)
class Row:
    """Nodes of equal numbers of unknowns, and symbols for two neighbours."""

    blocks: list[list[sp.Symbol]]
    """Unknowns of each node."""
    before: tuple[sp.Symbol, ...]
    here: tuple[sp.Symbol, ...]
    """Symbols of the node before and of the one here."""
    node: Mapping[sp.Symbol, int]

    def sorted(self, expressions: Sequence[sp.Expr]) -> tuple[list[list[sp.Expr]], list[list[sp.Expr]]] | None:
        """Return expressions at each node, in ``here``, and to the node before, in ``before`` and ``here``; None if one goes further."""
        single: list[list[sp.Expr]] = [[] for _ in self.blocks]
        joined: list[list[sp.Expr]] = [[] for _ in self.blocks]
        for expression in expressions:
            nodes = {self.node[x] for x in expression.free_symbols if x in self.node}
            last = max(nodes, default=0)
            if not nodes <= {last - 1, last}:
                return None
            at = dict(zip(self.blocks[last], self.here, strict=True))
            if len(nodes) == 2:
                at |= dict(zip(self.blocks[last - 1], self.before, strict=True))
            (joined if len(nodes) == 2 else single)[last].append(expression.xreplace(at))
        return single, joined


def row_of(places: Places, points: int) -> Row | None:
    """Return nodes of this number of points each, or None if nodes would have different numbers of unknowns."""
    owners = list(places.owners.values())
    blocks = [[x for unknowns in owners[i : i + points] for x in unknowns] for i in range(0, len(owners), points)]
    if len(blocks) < FEWEST or len({len(block) for block in blocks}) > 1:
        return None
    before, here = (sp.symbols(f"{name}1:{len(blocks[0]) + 1}", real=True) for name in ("before", "here"))
    return Row(blocks, before, here, {x: i for i, block in enumerate(blocks) for x in block})


def in_k(values: Sequence[sp.Expr], first: int = 0) -> sp.Expr | None:
    """Return the polynomial of degree 2 in k through the values at k = first, first + 1, ..., or None if there is none."""
    a, b, c = values[:3]
    s = k - first
    polynomial = sp.expand(a + s * (b - a) + s * (s - 1) / 2 * (c - 2 * b + a))
    return polynomial if all(sp.expand(polynomial.subs(k, first + i) - x) == 0 for i, x in enumerate(values)) else None


def chain_of(
    places: Places, terms: Terms, energies: Sequence[sp.Expr], g: Labelled, starts: Mapping[str, Start], **more: Any
) -> ConstrainedChain | None:
    """Return the chain of a mechanism, or None if it is not a chain."""
    if any(start.velocity or start.spin for start in starts.values()):
        return None
    for points in range(1, WIDEST + 1):
        row = row_of(places, points)
        parts = row and _parts(row, places, terms, energies, [x for _, x in g])
        if not row or not parts:
            continue
        recognised = {name: _case(row, positions(name, start, places), start) for name, start in starts.items()}
        cases = {name: case for name, case in recognised.items() if case is not None}
        if len(cases) == len(recognised):
            return ConstrainedChain(nodes=len(row.blocks), here=row.here, before=row.before, node=k, cases=cases, **parts, **more)
    return None


def _parts(row: Row, places: Places, terms: Terms, energies: Sequence[sp.Expr], g: Sequence[sp.Expr]) -> dict[str, Any] | None:
    """Return the parts of a chain."""
    equations, potentials = row.sorted(g), row.sorted(energies)
    masses = _masses(row, places, terms)
    if equations is None or potentials is None or masses is None:
        return None
    # Node 0 is left out: it may have an anchor, or lack a joint, and is compared with the others afterwards.
    single = _uniform(equations[0][1:], 1)
    joints = _uniform(equations[1][1:], 1)
    U = _uniform([[sp.Add(*x)] for x in potentials[0][1:]], 1)
    joint_U = _uniform([[sp.Add(*x)] for x in potentials[1][1:]], 1)
    if single is None or joints is None or U is None or joint_U is None:
        return None
    for anchor in _anchors(row, places):
        expected = [*single, *(_anchored(row, joints, anchor) if anchor is not None else [])]
        weight = [U[0] + (_anchored(row, joint_U, anchor)[0] if anchor is not None else 0)]
        # A potential matters up to a constant, which an anchor may add.
        if _same(equations[0][0], expected) and _same([sp.Add(*potentials[0][0])], weight, up_to=row.here):
            mass, joint_mass = masses[anchor is not None]
            parts = {"own": single, "joints": joints, "anchor": anchor, "mass": mass, "joint_mass": joint_mass, "U": U[0]}
            return parts | ({"joint_U": joint_U[0]} if joint_U[0] != 0 else {})
    return None


def _anchors(row: Row, places: Places) -> list[tuple[sp.Expr, ...] | None]:
    """Return the candidates for the place of node -1: none, or points of the ground."""
    ground = [tuple(column.reference) for column in places.columns.values() if column.weight and not column.now.free_symbols & {*places.q}]
    one = len(row.here) == places.dimension
    return [None, *(ground if one else (a + b for a, b in combinations(ground, 2)))]


def _anchored(row: Row, expressions: Sequence[sp.Expr], anchor: Sequence[sp.Expr]) -> list[sp.Expr]:
    # An anchor has two points at most; a node of more then keeps symbols of ``before``, and is no match.
    at = dict(zip(row.before, anchor, strict=False))
    return [x.subs(at).subs(k, 0) for x in expressions]


def _same(expressions: Sequence[sp.Expr], expected: Sequence[sp.Expr], up_to: Sequence[sp.Symbol] = ()) -> bool:
    """Return whether expressions are those expected at node 0, in any order, or up to what does not depend on some symbols."""
    left = [sp.expand(x.subs(k, 0)) for x in expected]
    if up_to:
        rest = sp.expand(expressions[0] - left[0])
        return not rest.free_symbols & {*up_to}
    return len(expressions) == len(left) and all(sp.expand(x) in left for x in expressions)


def _uniform(rows: Sequence[Sequence[sp.Expr]], first: int) -> list[sp.Expr] | None:
    """Return expressions that all nodes have, in k."""
    if len({len(row) for row in rows}) != 1:
        return None
    polynomials = [in_k(column, first) for column in zip(*rows, strict=True)]
    return None if None in polynomials else polynomials


def _masses(row: Row, places: Places, terms: Terms) -> tuple[tuple[Any, Any], tuple[Any, Any]] | None:
    """Return the mass of a node and that of a joint: of a chain that is free at both ends, and of one that hangs from an anchor."""
    b, n = len(row.here), len(row.blocks)
    diagonal, beside = [sp.zeros(b, b) for _ in range(n)], [sp.zeros(b, b) for _ in range(n)]
    for (i, j), entry in terms.items():
        if abs(i // b - j // b) > 1:
            return None
        if i // b <= j // b:
            (diagonal if i // b == j // b else beside)[i // b][i % b, j % b] = entry
    if any(x != diagonal[1] for x in diagonal[2:-1]) or any(x != beside[0] for x in beside[1:-1]):
        return None
    first, within, last, off = diagonal[0], diagonal[1], diagonal[-1], beside[0]
    # The last node has no joint behind it: the difference from one within the row is the joint's part.
    before = within - last
    free = _joined(within - before - (within - first), before, off, within - first)
    hung = _joined(last, before, off, sp.zeros(b, b)) if first == within else free
    return free, hung


def _joined(mass: sp.Matrix, before: sp.Matrix, off: sp.Matrix, here: sp.Matrix) -> tuple[sp.Matrix, sp.Matrix | None]:
    whole = sp.Matrix(sp.BlockMatrix([[before, off], [off.T, here]]))
    return sp.Matrix(mass), whole if any(whole) else None


def _case(row: Row, q0: Sequence[sp.Expr], start: Start) -> Case | None:
    """Return a case of a node, at rest."""
    b = len(row.here)
    q = [in_k(q0[i::b]) for i in range(b)]
    if None in q:
        return None
    return Case(q=q, p=[0] * b, parameters=start.parameters, about=start.about, on_singular=start.on_singular)
