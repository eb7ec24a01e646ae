"""A constrained system of nodes in a row, each coupled to the one before it, defined by one node for any number of nodes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import sympy as sp

from daebench.errors import InvalidProblem
from daebench.systems.assumptions import require_checked, require_plain
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates
from daebench.systems.definition_parts import check_cases, check_coordinates, check_parameters, check_real, several
from daebench.systems.exact_text import case_texts, exact, mathematics
from daebench.systems.picture import Exact, Picture


@dataclass(frozen=True, kw_only=True)
class ConstrainedChain:
    """A constrained Hamiltonian system whose constraints and masses couple neighbours, H = 1/2 p^T M^-1 p + U(q) with constant M.

    ::

        q = (q_0, q_1, ..., q_{n-1}), each shape(b,)        g = (g_0, g_1, ..., g_{n-1}), each (joints, own)
        v^T M v = sum_k v_k^T mass v_k + sum_joints (v_{k-1}, v_k)^T joint_mass (v_{k-1}, v_k)
        U       = pull (sum_k U(q_k) + sum_joints joint_U(q_{k-1}, q_k))

    In this order, node by node, G, M and [[M, G^T], [G, 0]] are banded, and so is G M^-1 G^T if M is diagonal. A joint connects
    node k - 1 with node k. Node 0 has a joint only if there is an anchor, a point at rest in place of node -1.

    Parameters
    ----------
    nodes : int
        Number of nodes n.
    here, before : sequence of Symbol, shape(b,)
        Positions of node k, and of node k - 1.
    node : Symbol
        The number k, on which initial values, masses and constraints may depend.
    joints : sequence of Expr
        Constraints in ``before`` and ``here``.
    own : sequence of Expr
        Constraints in ``here`` only.
    anchor : sequence of Expr, optional, shape(b,)
        The point at rest.
    mass : Matrix, shape(b, b)
        Inertia of each node's own parts.
    joint_mass : Matrix, optional, shape(2 b, 2 b)
        Inertia of the part that joins two nodes.
    pull : Expr
        Common factor of all potential energies, such as the strength of gravity, in terms of the parameters.
    U : Expr
        Potential energy of each node's own parts, in ``here``.
    joint_U : Expr, optional
        Potential energy of the part that joins two nodes, in ``before`` and ``here``.
    parameters, cases : mapping
        As in :class:`daebench.systems.constrained.ConstrainedHamiltonian`; q and p of a case are those of node k.
    speeds : bool
        Whether the p of the cases are velocities, from which the momenta p = M v are computed.
    more : callable, optional
        ``more(q, p)`` returns further declarations of the written-out system, such as chart and closed form; called for few nodes only.
    drawn : callable, optional
        ``drawn(q)`` returns the chain's picture, for any number of nodes. Without it, the picture is the one that ``more`` returns, if any.

    Raises
    ------
    InvalidProblem
        If there is no node, sizes do not match, or an expression contains a symbol that it may not depend on.
    """

    nodes: int
    here: Sequence[sp.Symbol]
    before: Sequence[sp.Symbol]
    node: sp.Symbol
    joints: Sequence[sp.Expr] = ()
    own: Sequence[sp.Expr] = ()
    anchor: Sequence[sp.Expr] | None = None
    mass: sp.Matrix
    joint_mass: sp.Matrix | None = None
    pull: sp.Expr = sp.S.One
    U: sp.Expr
    joint_U: sp.Expr | None = None
    parameters: Mapping[sp.Symbol, float] = field(default_factory=dict)
    cases: Mapping[str, Case] = field(default_factory=dict)
    speeds: bool = False
    more: Callable[[Sequence[sp.Symbol], Sequence[sp.Symbol]], Mapping[str, Any]] | None = None
    drawn: Callable[[Sequence[sp.Symbol]], Picture] | None = None

    def __post_init__(self) -> None:
        self._check_parts()
        if self.nodes < 1:
            raise InvalidProblem(f"a chain of {self.nodes} nodes is not possible; it needs at least one.", "chain-without-nodes")
        b = self.b
        sizes = [(len(self.before), b), (self.mass.shape, (b, b))]
        sizes += [] if self.joint_mass is None else [(self.joint_mass.shape, (2 * b, 2 * b))]
        sizes += [] if self.anchor is None else [(len(self.anchor), b)]
        if any(size != needed for size, needed in sizes):
            raise InvalidProblem(
                f"nodes have {b} positions; before, anchor, mass and joint_mass of a chain must have the same number.", "chain-vector-sizes"
            )
        if not 0 < self.m < self.d:
            raise InvalidProblem(
                f"{self.m} constraints on {self.d} positions; there must be at least one, and fewer than positions.",
                "chain-constraint-count",
            )
        for name, matrix in (("mass", self.mass), ("joint_mass", self.joint_mass)):
            if matrix is not None and sp.simplify(matrix - matrix.T) != sp.zeros(*matrix.shape):
                raise InvalidProblem(f"{name} of the chain is not symmetric.", "chain-matrix-not-symmetric")
        for name, case in self.cases.items():
            if len(case.q) != b or len(case.p) != b:
                raise InvalidProblem(
                    f"case {name!r} has {len(case.q)} positions and {len(case.p)} momenta of a node; both must be {b}.", "chain-case-sizes"
                )
        self._check_symbols()

    def _check_parts(self) -> None:
        for name, symbols in (("here", self.here), ("before", self.before)):
            check_coordinates(name, symbols)
        check_parameters(self.parameters)
        check_cases(self.cases, "Case", ("q", "p"), self.parameters)
        for name, matrix in (("mass", self.mass), ("joint_mass", self.joint_mass)):
            if matrix is not None and not isinstance(matrix, sp.MatrixBase):
                raise InvalidProblem(f"{name} of the chain must be a SymPy Matrix, but is a {type(matrix).__name__}.", "chain-matrix-type")
        self._check_expressions()

    def _check_expressions(self) -> None:
        for name, values in (("joints", self.joints), ("own", self.own), ("anchor", self.anchor or ())):
            check_real(name, several(name, values))
        check_real("mass", list(self.mass))
        for name, value in (("pull", self.pull), ("U", self.U), ("joint_U", self.joint_U)):
            if value is not None:
                check_real(name, [value])

    def _check_symbols(self) -> None:
        require_plain("position", [*self.here, *self.before])
        require_checked(self.parameters)
        known = {self.node, *self.parameters}
        here, both = {*self.here}, {*self.here, *self.before}
        # A 0 is appended, because a matrix of an empty list has no free symbols to ask for.
        allowed: list[tuple[str, Any, set[sp.Symbol]]] = [("own", sp.Matrix([*self.own, 0]), here), ("U", self.U, here)]
        allowed += [("joints", sp.Matrix([*self.joints, 0]), both), ("joint_U", self.joint_U or 0, both), ("pull", self.pull, set())]
        allowed += [("mass", self.mass, set()), ("joint_mass", self.joint_mass or 0, set())]
        allowed += [("anchor", sp.Matrix([*(self.anchor or ()), 0]), set())]
        allowed += [(f"case {name}", sp.Matrix([*case.q, *case.p]), set()) for name, case in self.cases.items()]
        for where, expression, symbols in allowed:
            if extra := sp.sympify(expression).free_symbols - symbols - known:
                raise InvalidProblem(
                    f"{where} of the chain contains {', '.join(sorted(map(str, extra)))}, which it may not depend on.",
                    "chain-symbol-undeclared",
                )

    @property
    def b(self) -> int:
        """Number of positions of a node."""
        return len(self.here)

    @property
    def d(self) -> int:
        """Number of positions."""
        return self.nodes * self.b

    @property
    def q(self) -> tuple[sp.Symbol, ...]:
        """The positions, shape(d,), of the written-out system."""
        return coordinates(self.d)[0]

    @property
    def picture(self) -> Picture | None:
        """Picture of the chain, if it is declared."""
        if self.drawn:
            return self.drawn(self.q)
        return self.more(*coordinates(self.d)).get("picture") if self.more else None

    @property
    def c(self) -> int:
        """Number of constraints of a node with a joint."""
        return len(self.joints) + len(self.own)

    @property
    def missing(self) -> int:
        """Number of constraints that node 0 lacks."""
        return 0 if self.anchor is not None else len(self.joints)

    @property
    def m(self) -> int:
        """Number of constraints."""
        return self.nodes * self.c - self.missing

    @property
    def joined(self) -> range:
        """Nodes with a joint to the node before."""
        return range(0 if self.anchor is not None else 1, self.nodes)

    @property
    def diagonal(self) -> bool:
        """Whether the mass matrix is diagonal."""
        return self.joint_mass is None and bool(self.mass.is_diagonal())

    @cached_property
    def fingerprint(self) -> str:
        """Exact text of the mathematics, without the values of parameters, for content hashes."""
        return repr([exact(part) for part in [*self._all_parts, list(self.parameters)]]) + repr((self.speeds, case_texts(self.cases)))

    @cached_property
    def mathematics(self) -> str:
        """Exact text of equations, parameters with defaults and cases; the same for all ways to write them."""
        cases = {name: (case.q, case.p, case.parameters, case.on_singular) for name, case in self.cases.items()}
        return mathematics(self._all_parts, self.speeds, cases, self.parameters)

    @property
    def _all_parts(self) -> list[Any]:
        parts = [self.nodes, self.here, self.before, self.node, self.joints, self.own, self.anchor, self.mass, self.joint_mass, self.U]
        return [*parts, self.pull, self.joint_U]

    def inertia(self, k: int, node: Exact | None = None) -> tuple[sp.Matrix, sp.Matrix, sp.Matrix]:
        """Return the blocks M_{k, k-1}, M_{k, k} and M_{k, k+1} of the mass matrix, each shape(b, b).

        ``node`` replaces k in them; by default it is the value of k. Only the joints of node k are included.
        """
        b, n = self.b, self.nodes
        at = sp.Integer(k) if node is None else sp.sympify(node)
        zero, here = sp.zeros(b, b), sp.Matrix(self.mass.subs(self.node, at))
        if self.joint_mass is None:
            return zero, here, zero
        # The mass of a joint may depend on its node: the joint of the next node is evaluated at k + 1.
        J, beyond = sp.Matrix(self.joint_mass.subs(self.node, at)), sp.Matrix(self.joint_mass.subs(self.node, at + 1))
        if k in self.joined:
            here += J[b:, b:]
        if k + 1 < n:
            here += beyond[:b, :b]
        return sp.Matrix(J[b:, :b]) if k > 0 else zero, here, sp.Matrix(beyond[:b, b:]) if k + 1 < n else zero

    def written_out(self) -> ConstrainedHamiltonian:
        """Return the system with a symbol for each position and momentum; only for few nodes."""
        n, b = self.nodes, self.b
        q, p = coordinates(self.d)
        M = sp.zeros(self.d, self.d)
        for k in range(n):
            for j, block in zip((k - 1, k, k + 1), self.inertia(k), strict=True):
                if 0 <= j < n:
                    M[k * b : k * b + b, j * b : j * b + b] = block
        g: list[sp.Expr] = []
        for k in range(n):
            g += [self._placed(constraint, q, k) for constraint in (*(self.joints if k in self.joined else ()), *self.own)]
        potentials = [self._placed(self.U, q, k) for k in range(n)]
        joined = [self._placed(self.joint_U, q, k) for k in self.joined] if self.joint_U is not None else []
        return ConstrainedHamiltonian(
            q=q,
            p=p,
            M=M,
            U=self.pull * sp.Add(*potentials, *joined),
            g=g,
            parameters=self.parameters,
            cases={name: self._case(case, M) for name, case in self.cases.items()},
            **(({"picture": self.drawn(q)} if self.drawn else {}) | dict(self.more(q, p) if self.more else {})),
        )

    def _placed(self, expression: sp.Expr, q: Sequence[sp.Symbol], k: int) -> sp.Expr:
        """Return an expression at node k."""
        b = self.b
        # Node 0 without an anchor has no node before: its symbols stay, and no expression that contains them is placed there.
        before = q[(k - 1) * b : k * b] if k else self.anchor or self.before
        at = dict(zip([*self.before, *self.here, self.node], [*before, *q[k * b : k * b + b], sp.Integer(k)], strict=True))
        return sp.sympify(expression).subs(at, simultaneous=True)

    def _case(self, case: Case, M: sp.Matrix) -> Case:
        """Return a case with initial values of every node."""
        q, p = ([sp.sympify(x).subs(self.node, k) for k in range(self.nodes) for x in part] for part in (case.q, case.p))
        momenta = M * sp.Matrix(p) if self.speeds else p
        return Case(q=q, p=tuple(momenta), parameters=case.parameters, about=case.about, on_singular=case.on_singular)
