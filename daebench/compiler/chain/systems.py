"""The linear systems of a chain, as rows of each node: those with G M^-1 G^T, and saddle points where M is not diagonal."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import product
from typing import Any

from daebench.compiler.chain.band import Band, Row
from daebench.compiler.chain.blocks import MOST, Block, pairs
from daebench.compiler.chain.fields import At, Field, Scalar, Term, computed, weight
from daebench.compiler.chain.nodes import at_node
from daebench.compiler.chain.program import Program
from daebench.errors import InvalidProblem


@dataclass(frozen=True, eq=False)
class Jacobian:
    """G at given positions."""

    entries: Field

    def __getitem__(self, k: int) -> Any:
        raise InvalidProblem(
            "a scheme takes single rows of G, which long chains do not have; take a shorter chain, or rattle.", "chain-single-rows"
        )


@dataclass(frozen=True, eq=False)
class Rows:
    """G M^-1: its entries for a diagonal mass matrix, otherwise a factor for linear solves."""

    of: Jacobian
    entries: Field | None


@dataclass(frozen=True, eq=False)
class Gram:
    """w G M^-1 G'^T."""

    left: Jacobian
    right: Rows
    factor: Any = 1.0


@dataclass(frozen=True)
class Mass:
    """Placeholder for the mass matrix, or for its inverse H_pp."""

    inverse: bool


@dataclass(frozen=True, eq=False)
class Bent:
    """Placeholder for the derivative of G H_p with respect to q at these positions. Only its product with H_p is known."""

    p: Field
    q: Field


class Systems:
    """Linear systems, on symbols; the base of :class:`daebench.compiler.chain.algebra.ChainLanguage`."""

    def __init__(self, tracer: Any) -> None:
        self.tracer, self.nodes = tracer, tracer.nodes
        self.chain = tracer.nodes.chain

    @property
    def program(self) -> Program:
        """The function that is being written."""
        program: Program = self.tracer.programs[-1]
        return program

    def solve(self, A: Gram, b: Field) -> tuple[Field, Scalar]:
        """Return the solution of A x = b and the smallest relative pivot."""
        (x,), pivot = self.solve_stages(((A,),), (b,))
        return x, pivot

    def solve_stages(self, A: Any, b: Sequence[Field]) -> tuple[tuple[Field, ...], Scalar]:
        """Return the solution of sum_j A_ij x_j = b_i and the smallest relative pivot."""
        saddle = A[0][0].right.entries is None
        rows, at = self._saddle_rows(A, b) if saddle else self._gram_rows(A, b)
        positions = [i for j in range(len(b)) for i in at(j)[1]]
        band = self._banded(rows, [*pairs(positions), *pairs([i for j in range(len(b)) for i in at(j)[0]])])
        solution = tuple(band.unknowns("m", at(j)[0], self.program.stage) for j in range(len(b)))
        if saddle:
            for j, x in enumerate(solution):
                self.tracer.companions[A[0][j].right, x] = band.unknowns("d", at(j)[1], self.program.stage)
        return solution, Scalar(f"{band.name}_pivot", late=True)

    solve_stages_but_one = solve_stages

    def _banded(self, rows: Sequence[Row], order: Sequence[Block], asked: Any = "") -> Band:
        program, order = self.program, order if len(rows) <= MOST else ()
        band = Band(name=program.name("band"), nodes=self.chain.nodes, rows=rows, order=order, asked=asked)
        band = replace(band, base=program.reserve(band.u), scratch=program.scratches(band.scratches))
        if not (band.tridiagonal or (band.blocks and asked)):
            self.tracer.banded(band.width)
        program.events.append(band)
        return band

    def _gram_rows(self, A: Any, b: Sequence[Field]) -> Any:
        """Rows of A for the unknowns x_0, x_1, ... of each node, in this order."""
        c, rows = self.chain.c, []
        for i, a in product(range(len(b)), range(c)):
            row = Row(("{0}", [(b[i], 0, a)]))
            for j, gram in enumerate(A[i]):
                for place, t in product((-1, 0, 1), range(c)):
                    for r, u, x, y in self.nodes.meeting[place]:
                        if (r, u) == (a, t):
                            row.add((place, j * c + t), "{0} * {1}", (gram.left.entries, 0, x), (gram.right.entries, place, y))
                            row.forms[place, j * c + t] = _scaled(gram.factor)
                if a < self.chain.missing:
                    row.forms[0, j * c + a] = f"({_scaled(gram.factor)} if k > 0 else ZERO + {float(j == i)})"
            rows.append(row)
        return rows, lambda j: (range(j * c, (j + 1) * c), ())

    def _saddle_rows(self, A: Any, b: Sequence[Field]) -> Any:
        """Rows of M x_j - G_j^T lam_j = 0 and sum_j w_ij G_i x_j = b_i; node by node: joints' multipliers, positions, other multipliers."""
        chain, s = self.chain, len(b)
        joints, u = len(chain.joints), chain.c + chain.b
        of_lam: list[int] = [*range(joints), *range(joints + chain.b, u)]

        def lam(j: int, a: int) -> int:
            return of_lam[a] * s + j

        def x(j: int, i: int) -> int:
            return (joints + i) * s + j

        rows: dict[int, Row] = {}
        for j in range(s):
            right = A[0][j].right.of.entries
            for i in range(chain.b):
                rows[x(j, i)] = self._mass_row(i, right, ("ZERO", ()), partial(x, j), partial(lam, j))
            for a in range(chain.c):
                rows[lam(j, a)] = self._constraint_row(A[j], a, b[j], x, lam(j, a))
        return [rows[r] for r in range(u * s)], lambda j: ([lam(j, a) for a in range(chain.c)], [x(j, i) for i in range(chain.b)])

    @cached_property
    def _inertia_field(self) -> Field:
        self.tracer.node("inertia")
        width = sum(map(len, self.nodes.coupled))

        def write(at: At, k: str) -> list[str]:
            return [f"(ZERO + node_inertia({at_node(k)}, par)[{i}])" for i in range(width)]

        return computed("G", width, (), write)

    def _mass_row(self, i: int, J: Field | None, right: Term, x: Callable[[int], int], lam: Callable[[int], int]) -> Row:
        """Row i of M x - G^T lam = right at a node; J is None if there is no lam."""
        row, ordered = Row(right), [(side, r, t) for side in range(3) for r, t in self.nodes.coupled[side]]
        for e, (side, r, t) in enumerate(ordered):
            if r == i:
                row.add((side - 1, x(t)), "{0}", (self._inertia_field, 0, e))
        for e, (a, column) in enumerate(self.nodes.filled if J else ()):
            place, entry = 1 - column // self.chain.b, column % self.chain.b
            if J and entry == i:
                row.add((place, lam(a)), "-{0}", (J, place, e))
        return row

    def _constraint_row(self, A: Sequence[Gram], a: int, b: Field, x: Callable[[int, int], int], multiplier: int) -> Row:
        """Row a of sum_j w_j G x_j = b at a node. If node 0 lacks the constraint, its multiplier is zero."""
        row = Row(("{0}", [(b, 0, a)]))
        if a < self.chain.missing:
            row.add((0, multiplier), "(ZERO if k > 0 else ZERO + 1.0)")
        for j, gram in enumerate(A):
            for e, (r, column) in enumerate(self.nodes.filled):
                if r == a:
                    key = column // self.chain.b - 1, x(j, column % self.chain.b)
                    row.add(key, "{0}", (A[0].left.entries, 0, e))
                    row.forms[key] = _scaled(gram.factor)
        return row

    def _velocity(self, p: Field) -> Field:
        """Return M^-1 p for a mass matrix that couples neighbours."""
        b = self.chain.b
        rows = [self._mass_row(i, None, ("{0}", [(p, 0, i)]), lambda t: t, lambda a: a) for i in range(b)]
        return self._banded(rows, pairs(range(b)), "solution").unknowns("d", range(b), self.program.stage)


def _scaled(factor: Any) -> str:
    """Return the form of a product with a factor."""
    return "{}" if factor == 1.0 else f"{weight(factor)} * ({{}})"
