"""Functions derived from the definition of a chain at one node: functions of scalars, called by loops over nodes."""

from collections.abc import Callable, Sequence
from functools import cached_property

import sympy as sp

from daebench.compiler import codegen
from daebench.compiler.syntax import function, pack
from daebench.systems.chain import ConstrainedChain


class Nodes:
    """Source of the functions of one node of a chain.

    Each takes x, the positions of the node before and of the node itself, shape(2 b,), the number k of the node, and the parameters.
    Some also take the velocities w in the same order.
    """

    def __init__(self, chain: ConstrainedChain) -> None:
        self.chain = chain
        self.x = [*chain.before, *chain.here]
        self.w = [sp.Dummy(f"w{i}", real=True) for i in range(2 * chain.b)]
        self.parameters = list(chain.parameters)

    @cached_property
    def g(self) -> sp.Matrix:
        """Constraints of a node, shape(c,)."""
        return sp.Matrix([*self.chain.joints, *self.chain.own])

    @cached_property
    def G(self) -> sp.Matrix:
        """Their derivatives, shape(c, 2 b)."""
        return self.g.jacobian(self.x)

    @cached_property
    def filled(self) -> list[tuple[int, int]]:
        """Places of the entries of G that are not zero, row by row."""
        return [(row, column) for row in range(self.G.rows) for column in range(self.G.cols) if self.G[row, column] != 0]

    @cached_property
    def bent(self) -> sp.Matrix:
        """Second derivative of the constraints along w, g_qq(w, w), shape(c,)."""
        along = sp.Matrix(self.w)
        return (self.G * along).jacobian(self.x) * along

    @property
    def masses(self) -> list[sp.Expr]:
        """Diagonal of the mass matrix at a node with joints on either side, shape(b,)."""
        mass, joint, b = self.chain.mass, self.chain.joint_mass, self.chain.b
        return [mass[i, i] + (joint[i, i] + joint[b + i, b + i] if joint is not None else 0) for i in range(b)]

    @cached_property
    def turned(self) -> list[sp.Expr]:
        """Sums of moduli of the rows of g_qv, the derivative of G w with respect to x, shape(c,)."""
        rows = (self.G * sp.Matrix(self.w)).jacobian(self.x)
        return [sp.Add(*(sp.Abs(entry) for entry in rows.row(a))) for a in range(rows.rows)]

    @cached_property
    def coupled(self) -> list[list[tuple[int, int]]]:
        """Places of the nonzero entries in the blocks of M left of the diagonal, on it, and right of it."""
        blocks = [self.chain.inertia(k, self.chain.node) for k in range(min(self.chain.nodes, 4))]
        b = range(self.chain.b)
        return [[(i, j) for i in b for j in b if any(block[side][i, j] != 0 for block in blocks)] for side in range(3)]

    @cached_property
    def meeting(self) -> dict[int, list[tuple[int, int, int, int]]]:
        """Rows of G of a node and of a node at this distance that couple in G M^-1 G^T: (row, row, entry, entry)."""
        b = self.chain.b
        return {
            place: [
                (r, t, i, j)
                for i, (r, column) in enumerate(self.filled)
                for j, (t, other) in enumerate(self.filled)
                if (column // b - 1, column % b) == (other // b - 1 + place, other % b)
            ]
            for place in (-1, 0, 1)
        }

    def source(self, name: str) -> str:
        """Return the source of ``node_name``."""
        return self._rules[name]()

    @cached_property
    def _rules(self) -> dict[str, Callable[[], str]]:
        chain, here = self.chain, list(self.chain.here)
        entries = [self.G[place] for place in self.filled]
        return {
            "g": lambda: self._of_x("g", self.g),
            "G": lambda: self._of_x("G", entries),
            "bent": lambda: self._written("bent", {"x": self.x, "w": self.w}, list(self.bent)),
            "turned": lambda: self._written("turned", {"x": self.x, "w": self.w}, self.turned),
            "U": lambda: self._of_x("U", [chain.pull * chain.U]),
            "joint_U": lambda: self._of_x("joint_U", [chain.pull * chain.joint_U]),
            "joint_U_x": lambda: self._of_x("joint_U_x", [sp.diff(chain.pull * chain.joint_U, coordinate) for coordinate in self.x]),
            "U_q": lambda: self._of_x("U_q", [sp.diff(chain.pull * chain.U, coordinate) for coordinate in here]),
            "lightness": lambda: self._of_x("lightness", [1 / mass for mass in self.masses]),
            "inertia": self._inertia,
            "anchor": lambda: codegen.expressions("node_anchor", {}, list(chain.anchor or ()), (chain.b,), self.parameters),
        }

    def _of_x(self, name: str, values: list[sp.Expr] | sp.Matrix) -> str:
        return self._written(name, {"x": self.x}, list(values))

    def _written(self, name: str, arguments: dict[str, list[sp.Symbol]], values: list[sp.Expr]) -> str:
        return codegen.expressions(f"node_{name}", {**arguments, "k": [self.chain.node]}, values, (len(values),), self.parameters)

    def _inertia(self) -> str:
        """Source of the entries of M that may be nonzero, side by side. At the ends of the chain the entries of missing joints are zero."""

        def entries(k: int) -> list[sp.Expr]:
            blocks = self.chain.inertia(k, self.chain.node)
            return [blocks[side][place] for side in range(3) for place in self.coupled[side]]

        return "\n\n".join(self.at_ends("node_inertia", entries))

    def at_ends(self, name: str, values: Callable[[int], Sequence[sp.Expr]]) -> list[str]:
        """Sources of name(k, par) and of functions that it calls, which differ between the first node, inner nodes and the last node."""
        n = self.chain.nodes
        ends = sorted({0, min(1, n - 1), n - 1})
        parts, lines = [], []
        for case, k in enumerate(ends):
            entries = list(values(k))
            parts.append(codegen.expressions(f"{name}_{case}", {"k": [self.chain.node]}, entries, (len(entries),), self.parameters))
            if not 0 < k < n - 1:
                lines.append(f"if k[0] == {float(k)}: return {name}_{case}(k, par)")
        return [*parts, function(f"{name}(k, par)", *lines, f"return {name}_{ends.index(1) if n > 2 else 0}(k, par)")]


def at_node(k: str) -> str:
    """Return the source of the tuple that passes a node's number to its functions."""
    return pack([f"REAL({k})"])
