"""The equations of a chain at one node, in its unknowns and those of its neighbours, with the names of ``equations``."""

from collections.abc import Sequence
from functools import cached_property

import sympy as sp

from daebench.methods.formulations.equations import ALPHA, BETA
from daebench.systems.chain import ConstrainedChain

PLACES = (-1, 0, 1)
"""Places of the nodes that meet, counted from the present one."""

FAMILIES = ("q", "v", "lam", "mu")
"""Unknowns of a node: of b positions, b velocities, and c multipliers, twice where there are two."""


class NodeEquations:
    """Rows of a node from which every formulation is put together, each zero along the motion.

    Of nodes with positions q_k, velocities v_k, and multipliers::

        q_k' = v_k - (G^T mu)_k        (M v')_k = -U_{q_k} - (G^T lam)_k        0 = g_k, (G v)_k, or g_qq(v, v)_k + (G v')_k

    M is constant. Terms of the joints to the nodes k - 1 and k + 1 are left out where there are none.

    ``first`` and ``last`` say whether the node is at the beginning of the chain, and at its end.
    """

    def __init__(self, chain: ConstrainedChain, *, first: bool, last: bool) -> None:
        self.chain, self.first, self.last = chain, first, last
        sizes = {"q": chain.b, "v": chain.b, "lam": chain.c, "mu": chain.c}
        self.unknowns, self.rates = (
            {
                (name, place): sp.Matrix([sp.Dummy(f"{name}{place}", real=True) for _ in range(sizes[name])])
                for name in FAMILIES
                for place in PLACES
            }
            for _ in range(2)
        )

    def there(self, place: int) -> bool:
        """Whether the chain has a node at this place."""
        return not ((place < 0 and self.first) or (place > 0 and self.last))

    def joined(self, place: int) -> bool:
        """Whether a joint leads to the node at this place, from the one before it."""
        return self.there(place) and (place > 0 or not self.first or self.chain.anchor is not None)

    def _placed(self, expressions: Sequence[sp.Expr], place: int) -> sp.Matrix:
        """Return expressions in the positions of a node and of the one before it, at the node of this place."""
        chain = self.chain
        rest = chain.before if chain.anchor is None else chain.anchor
        before = self.unknowns["q", place - 1] if self.there(place - 1) else rest
        symbols = [*chain.before, *chain.here, chain.node]
        values = [*before, *self.unknowns["q", place], chain.node + place]
        at = dict(zip(symbols, values, strict=True))
        return sp.Matrix(len(expressions), 1, [sp.sympify(expression).subs(at, simultaneous=True) for expression in expressions])

    def constraints(self, place: int) -> sp.Matrix:
        """Constraints of the node at this place: those of its joint, where it has one, and its own."""
        joints = self.chain.joints if self.joined(place) else ()
        return self._placed([*joints, *self.chain.own], place)

    @property
    def missing(self) -> int:
        """Number of constraints that the node lacks."""
        return 0 if self.joined(0) else len(self.chain.joints)

    def _pulled(self, name: str) -> sp.Matrix:
        """Return (G^T lam)_k, shape(b,), of these multipliers."""
        here = self.unknowns["q", 0]
        force = self.constraints(0).jacobian(here).T * self.unknowns[name, 0][self.missing :, :]
        if self.there(1):
            force += self.constraints(1).jacobian(here).T * self.unknowns[name, 1]
        return force

    def _along(self, family: dict[tuple[str, int], sp.Matrix], of: sp.Matrix) -> sp.Matrix:
        """Return the derivative of rows along the velocities, or along their rates."""
        places = [place for place in (-1, 0) if self.there(place)]
        return sum((of.jacobian(self.unknowns["q", place]) * family["v", place] for place in places), sp.zeros(of.rows, 1))

    @cached_property
    def momentum(self) -> sp.Matrix:
        """(M v)_k, shape(b,)."""
        return self._weighed(self.unknowns)

    def _weighed(self, family: dict[tuple[str, int], sp.Matrix]) -> sp.Matrix:
        chain, b, k = self.chain, self.chain.b, self.chain.node
        total = chain.mass * family["v", 0]
        J = chain.joint_mass
        if J is None:
            return total
        if self.joined(0):
            total += J[b:, b:] * family["v", 0]
            total += (J[b:, :b] * family["v", -1]) * int(self.there(-1))
        if self.there(1):
            total += (J[:b, :b] * family["v", 0] + J[:b, b:] * family["v", 1]).subs(k, k + 1)
        return total

    @property
    def _slope(self) -> sp.Matrix:
        """Gradient of U with respect to the node's positions, shape(b,)."""
        joint_U = self.chain.joint_U
        U = self._placed([self.chain.U], 0)
        if joint_U is not None:
            for place in filter(self.joined, (0, 1)):
                U += self._placed([joint_U], place)
        return self.chain.pull * U.jacobian(self.unknowns["q", 0]).T

    @property
    def first_derivative(self) -> sp.Matrix:
        """(G v)_k, HLW (1.11)."""
        return self._along(self.unknowns, self.constraints(0))

    @property
    def second_derivative(self) -> sp.Matrix:
        """g_qq(v, v)_k + (G v')_k, HLW (1.12)."""
        return self._along(self.unknowns, self.first_derivative) + self._along(self.rates, self.constraints(0))

    def rows(self, formulation: str) -> dict[str, sp.Matrix]:
        """Return the rows of a formulation by the unknowns in whose place they stand."""
        rows = {
            "q": self.rates["q", 0] - self.unknowns["v", 0] + (self._pulled("mu") if formulation == "ggl" else sp.zeros(self.chain.b, 1)),
            "v": self._weighed(self.rates) + self._slope + self._pulled("lam"),
        }
        if formulation == "ggl":
            return {**rows, "lam": self.constraints(0), "mu": self.first_derivative}
        return {**rows, "lam": self._constraint(formulation)}

    def _constraint(self, formulation: str) -> sp.Matrix:
        """Return the row that lam fulfils."""
        if formulation == "index3":
            return self.constraints(0)
        if formulation == "index2":
            return self.first_derivative
        if formulation == "baumgarte":
            return self.second_derivative + 2 * ALPHA * self.first_derivative + BETA**2 * self.constraints(0)
        return self.second_derivative


def variants(chain: ConstrainedChain) -> Sequence[tuple[range, NodeEquations]]:
    """Return the equations of the first node, of those between, and of the last, each with the nodes that it holds for."""
    n = chain.nodes
    ends = [(range(1), True, n == 1), (range(1, n - 1), False, False), (range(max(n - 1, 1), n), False, True)]
    return [(nodes, NodeEquations(chain, first=first, last=last)) for nodes, first, last in ends if len(nodes)]
