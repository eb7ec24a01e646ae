"""The source of the module that evaluates a formulation of a chain: the residual as loops over nodes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import sympy as sp

from daebench.compiler import callbacks, codegen
from daebench.compiler.cache import written
from daebench.compiler.syntax import function
from daebench.methods.formulations import residuals
from daebench.methods.formulations.residuals import ALPHA, BETA, OPTIONS
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


SCALE = sp.Dummy("cj")
"""What multiplies the derivatives with respect to y'."""


@dataclass(frozen=True)
class Layout:
    """Where the unknowns of a chain are: node by node, each with joints' multipliers, positions, velocities, and its own multipliers.

    Rows stand in the same order: those of the constraints in the place of multipliers. ``ode`` is none of the formulations.
    """

    chain: ConstrainedChain
    formulation: str

    @property
    def forces(self) -> tuple[str, ...]:
        """Names of the multipliers."""
        return ("lam", "mu") if self.formulation == "ggl" else ("lam",)

    @cached_property
    def order(self) -> list[tuple[str, int]]:
        """Unknowns of a node, each as the name of its block and its number there."""
        joints = len(self.chain.joints)
        before = [(name, i) for i in range(joints) for name in self.forces]
        after = [(name, i) for i in range(joints, self.chain.c) for name in self.forces]
        return [*before, *((name, i) for name in "qv" for i in range(self.chain.b)), *after]

    @property
    def missing(self) -> int:
        """Number of unknowns that node 0 lacks, the first ones."""
        return self.chain.missing * len(self.forces)

    def index(self, name: str, i: int, place: int = 0) -> int:
        """Return the index of unknown i of the node at this place, counted from where node k would begin if none were missing."""
        return len(self.order) * place + self.order.index((name, i))

    def at(self, nodes: range, index: int) -> str:
        """Return the source of the place of an unknown or row of node k, counted from where the node would begin, in all of them."""
        return _place(nodes, len(self.order), index - self.missing)

    @property
    def places(self) -> list[tuple[int, int]]:
        """Return where the unknowns of node k stand in (q, v, lam[, mu]), each as slope and, for k = 0, start."""
        chain = self.chain
        starts = {"q": 0, "v": chain.d, "lam": 2 * chain.d - chain.missing, "mu": 2 * chain.d + chain.m - chain.missing}
        return [(chain.b if name in "qv" else chain.c, starts[name] + i) for name, i in self.order]


CALLED = """
def residual(t, y, yp, res, par):
    rows(y, yp, res, par)
    return finite(1.0, res)


def jacobian(t, y, yp, cj, above, JJ, par):
    JJ[:] = 0.0
    rows_y(y, yp, cj, above, JJ, par)
    return finite_matrix(1.0, JJ)

"""


def source(title: str, chain: ConstrainedChain, formulation: str, multipliers: str) -> str:
    """Return the source of a formulation's module.

    It has ``residual(t, y, yp, res, par)`` in the order of :class:`Layout`; ``jacobian(t, y, yp, cj, above, JJ, par)``, which fills JJ,
    shape(n, w), with entry (i, j) of dF/dy + cj dF/dy' in place (j, i - j + above); ``momenta(v, out, par)``, which fills out with M v;
    LOWER and UPPER, the widths of the band of its Jacobian below and above the diagonal; NODES; and PLACES and MISSING of the layout.

    Parameters are those of :func:`daebench.methods.formulations.residuals.source`, with a chain in place of the derivation; ``ode`` is none
    of the formulations.
    """
    layout = Layout(chain, formulation)
    parameters = {symbol: f"par[{i}]" for i, symbol in enumerate([*chain.parameters, *OPTIONS.get(formulation, ())])} | {SCALE: "cj"}
    rows, rows_y, ahead = [], [], [0]
    for nodes, of in variants(chain):
        columns, F = _columns(layout, of, multipliers), _rows(layout, of)
        names = {chain.node: _number(nodes), **parameters}
        names |= {symbol: f"{array}[{layout.at(nodes, index)}]" for symbol, (array, index) in columns.items()}
        width = len(layout.order)
        rows += _loop(nodes, width, [f"res[{layout.at(nodes, index)}]" for index, _ in F], [row for _, row in F], names)
        rows_y += _loop(nodes, width, *_entries(layout, nodes, columns, F), names)
        ahead += [columns[symbol][1] - index for index, row in F for symbol in row.free_symbols & columns.keys()]
    diagonals = [f"{_diagonal(-offset)} = above + {-offset}" for offset in sorted(set(ahead))]
    compiled = [
        residuals.HELPERS,
        function("rows(y, yp, res, par)", *rows),
        function("rows_y(y, yp, cj, above, JJ, par)", *diagonals, *rows_y),
        CALLED,
        callbacks.called_back(2 * chain.d + chain.m * len(layout.forces), len(parameters) - 1, callbacks.IMPLICIT, callbacks.BANDED),
        momenta(chain),
    ]
    facts = ["MECHANICAL = True", f"LOWER, UPPER = {-min(ahead)}, {max(ahead)}"]
    facts += [f"NODES, MISSING = {chain.nodes}, {layout.missing}", f"PLACES = {layout.places}"]
    return written(title, residuals.ROOTS, compiled, facts)


def momenta(chain: ConstrainedChain) -> str:
    """Return the source of ``momenta(v, out, par)``, which fills out, shape(d,), with M v."""
    lines = []
    for nodes, of in variants(chain):
        at = partial(_place, nodes, chain.b)
        names = {chain.node: _number(nodes), **{symbol: f"par[{i}]" for i, symbol in enumerate(chain.parameters)}}
        names |= {symbol: f"v[{at(chain.b * place + i)}]" for place in PLACES for i, symbol in enumerate(of.unknowns["v", place])}
        lines += _loop(nodes, chain.b, [f"out[{at(i)}]" for i in range(chain.b)], list(of.momentum), names)
    return function("momenta(v, out, par)", *lines)


def _columns(layout: Layout, of: NodeEquations, multipliers: str) -> dict[sp.Symbol, tuple[str, int]]:
    """Return array and index of the symbols of the unknowns of a node and of its neighbours, and of their rates."""
    columns = {}
    for place in filter(of.there, PLACES):
        for name, i in layout.order:
            arrays = ("yp", "y") if name in layout.forces and multipliers == "derivative" else ("y", "yp")
            for array, family in zip(arrays, (of.unknowns, of.rates), strict=True):
                columns[family[name, place][i]] = array, layout.index(name, i, place)
    return columns


def _rows(layout: Layout, of: NodeEquations) -> list[tuple[int, sp.Expr]]:
    """Return index and expression of the rows of a node."""
    indexed_rows = []
    for name, rows in of.rows(layout.formulation).items():
        lacking = of.missing if name in layout.forces else 0
        indexed_rows += [(layout.index(name, i + lacking), row) for i, row in enumerate(rows)]
    return indexed_rows


def _entries(
    layout: Layout, nodes: range, columns: Mapping[sp.Symbol, tuple[str, int]], F: Sequence[tuple[int, sp.Expr]]
) -> tuple[list[str], list[sp.Expr]]:
    """Return where the entries of the Jacobian in the rows of a node stand, and their expressions."""
    entries: dict[str, sp.Expr] = {}
    scale = {"y": sp.Integer(1), "yp": SCALE}
    for index, row in F:
        for symbol in row.free_symbols & columns.keys():
            array, column = columns[symbol]
            place = f"JJ[{layout.at(nodes, column)}, {_diagonal(index - column)}]"
            entries[place] = entries.get(place, 0) + scale[array] * sp.diff(row, symbol)
    return list(entries), list(entries.values())


def _diagonal(offset: int) -> str:
    """Return the name of the place, in a column of the band, of what is so far below the diagonal."""
    return f"below_{offset}" if offset >= 0 else f"above_{-offset}"


def _place(nodes: range, width: int, i: int) -> str:
    """Return the source of the place of number i of node k in an array that has so many numbers for each node."""
    return str(width * nodes.start + i) if len(nodes) == 1 else f"begin + {i}"


def _number(nodes: range) -> str:
    """Return the source of the number of node k."""
    return str(float(nodes.start)) if len(nodes) == 1 else "float(k)"


def _loop(nodes: range, width: int, targets: Sequence[str], values: Sequence[sp.Expr], names: Mapping[sp.Symbol, str]) -> list[str]:
    """Return the lines that set targets at each of these nodes, whose numbers begin at multiples of ``width``.

    One node is no loop, and its places are numbers: each operation on a place takes as long to compile as one on an unknown.
    """
    lines = codegen.assignments(targets, values, names)
    if len(nodes) == 1:
        return lines
    return [f"for k in range({nodes.start}, {nodes.stop}):", f"    begin = {width} * k", *(f"    {line}" for line in lines)]
