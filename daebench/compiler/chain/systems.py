"""The linear systems of a chain, as rows of each node: those with G M^-1 G^T, and saddle points where M is not diagonal."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

from daebench.compiler.chain.band import Band, Program, Row
from daebench.compiler.chain.blocks import MOST, Block, pairs
from daebench.compiler.chain.fields import At, Field, Scalar, computed, weight
from daebench.compiler.chain.nodes import at_node
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
        system = self._saddle_rows(A, b) if saddle else self._gram_rows(A, b)
        rows, places, at = system
        positions = [i for j in range(len(b)) for i in at(j)[1]]
        band = self._banded(rows, places, [*pairs(positions), *pairs([i for j in range(len(b)) for i in at(j)[0]])])
        solution = tuple(band.unknowns("m", at(j)[0], self.program.stage) for j in range(len(b)))
        if saddle:
            for j, x in enumerate(solution):
                self.tracer.companions[A[0][j].right, x] = band.unknowns("d", at(j)[1], self.program.stage)
        return solution, Scalar(f"{band.name}_pivot", late=True)

    solve_stages_but_one = solve_stages

    def _banded(self, rows: Sequence[Row], places: Sequence[tuple[int, int, int]], order: Sequence[Block], asked: Any = "") -> Band:
        program, order = self.program, order if len(rows) <= MOST else ()
        band = Band(name=program.name("band"), nodes=self.chain.nodes, rows=rows, places=places, order=order, asked=asked)
        band = replace(band, base=program.reserve(band.columns), scratch=program.scratches(band.scratches))
        if not (band.tridiagonal or (band.blocks and asked)):
            self.tracer.banded(band.width)
        program.events.append(band)
        return band

    def _gram_rows(self, A: Any, b: Sequence[Field]) -> Any:
        """Rows of A for the unknowns x_0, x_1, ... of each node, in this order."""
        c, s = self.chain.c, len(b)
        products = [(i, j, place, *pair) for i in range(s) for j in range(s) for place in (-1, 0, 1) for pair in self.nodes.meeting[place]]
        rows, places = [], sorted({(i * c + r, place, j * c + t) for i, j, place, r, t, _, _ in products})
        for i in range(s):
            needs = [(A[i][0].left.entries, 0), (b[i], 0)]
            needs += [(A[i][j].right.entries, place) for j in range(s) for place in (-1, 0, 1)]
            for a in range(c):
                rows.append(Row(needs=needs, entries=self._gram_entries(A[i], i, a), right=_entry(b[i], a)))
        return rows, places, lambda j: (range(j * c, (j + 1) * c), ())

    def _gram_entries(self, A: Sequence[Gram], stage: int, a: int) -> Callable[[At], dict[tuple[int, int], str]]:
        c = self.chain.c

        def entries(at: At) -> dict[tuple[int, int], str]:
            coefficients: dict[tuple[int, int], str] = {}
            for j, gram in enumerate(A):
                for place in (-1, 0, 1):
                    for t in range(c):
                        terms = [
                            f"{at(gram.left.entries, 0)}[{x}] * {at(gram.right.entries, place)}[{y}]"  # type: ignore[arg-type]
                            for r, u, x, y in self.nodes.meeting[place]
                            if (r, u) == (a, t)
                        ]
                        if terms:
                            coefficients[place, j * c + t] = self._scaled(gram.factor, " + ".join(terms))
                if a < self.chain.missing:
                    coefficients[0, j * c + a] = f"({coefficients[0, j * c + a]} if k > 0 else ZERO + {float(j == stage)})"
            return coefficients

        return entries

    @staticmethod
    def _scaled(factor: Any, text: str) -> str:
        return text if factor == 1.0 else f"{weight(factor)} * ({text})"

    def _saddle_rows(self, A: Any, b: Sequence[Field]) -> Any:
        """Rows of M x_j - G_j^T lam_j = 0 and sum_j w_ij G_i x_j = b_i; node by node: joints' multipliers, positions, other multipliers."""
        chain, s = self.chain, len(b)
        joints, u = len(chain.joints), chain.c + chain.b
        of_lam: list[int] = [*range(joints), *range(joints + chain.b, u)]

        def lam(j: int, a: int) -> int:
            return of_lam[a] * s + j

        def x(j: int, i: int) -> int:
            return (joints + i) * s + j

        filled, width = self.nodes.filled, chain.b
        rows: dict[int, Row] = {}
        for j in range(s):
            right = A[0][j].right.of.entries
            for i in range(width):
                rows[x(j, i)] = self._mass_row(i, right, lambda at: "ZERO", partial(x, j), partial(lam, j))
            for a in range(chain.c):
                rows[lam(j, a)] = self._constraint_row(A[j], a, b[j], x, lam(j, a))
        places = [(x(j, r), side - 1, x(j, t)) for j in range(s) for side in range(3) for r, t in self.nodes.coupled[side]]
        for j in range(s):
            for row, column in filled:
                place = 0 if column >= width else 1
                places.append((x(j, column % width), place, lam(j, row)))
                places += [(lam(j, row), -place, x(t, column % width)) for t in range(s)]
        return [rows[r] for r in range(u * s)], places, lambda j: ([lam(j, a) for a in range(chain.c)], [x(j, i) for i in range(width)])

    @cached_property
    def _inertia_field(self) -> Field:
        self.tracer.node("inertia")
        width = sum(map(len, self.nodes.coupled))

        def write(at: At, k: str) -> list[str]:
            return [f"(ZERO + node_inertia({at_node(k)}, par)[{i}])" for i in range(width)]

        return computed("G", width, (), write)

    def _mass_row(self, i: int, J: Field | None, right: Any, x: Callable[[int], int], lam: Callable[[int], int], more: Any = ()) -> Row:
        """Row i of M x - G^T lam = right at a node; J is None if there is no lam."""
        inertia = self._inertia_field
        ordered = [(side, r, t) for side in range(3) for r, t in self.nodes.coupled[side]]

        def entries(at: At) -> dict[tuple[int, int], str]:
            coefficients = {(side - 1, x(t)): f"{at(inertia, 0)}[{e}]" for e, (side, r, t) in enumerate(ordered) if r == i}
            for e, (row, column) in enumerate(self.nodes.filled if J else ()):
                place = 0 if column >= self.chain.b else 1
                if column % self.chain.b == i:
                    coefficients[place, lam(row)] = f"-{at(J, place)}[{e}]"  # type: ignore[arg-type]
            return coefficients

        needs = [(inertia, 0), *more] + ([(J, 0), (J, 1)] if J else [])
        return Row(needs=needs, entries=entries, right=right)

    def _constraint_row(self, A: Sequence[Gram], a: int, b: Field, x: Callable[[int, int], int], multiplier: int) -> Row:
        """Row a of sum_j w_j G x_j = b at a node. If node 0 lacks the constraint, its multiplier is zero."""
        J, missing = A[0].left.entries, a < self.chain.missing

        def entries(at: At) -> dict[tuple[int, int], str]:
            coefficients: dict[tuple[int, int], str] = {(0, multiplier): "(ZERO if k > 0 else ZERO + 1.0)"} if missing else {}
            for j, gram in enumerate(A):
                for e, (row, column) in enumerate(self.nodes.filled):
                    if row == a:
                        place = 0 if column >= self.chain.b else -1
                        coefficients[place, x(j, column % self.chain.b)] = self._scaled(gram.factor, f"{at(J, 0)}[{e}]")
            return coefficients

        return Row(needs=[(J, 0), (b, 0)], entries=entries, right=_entry(b, a))

    def _velocity(self, p: Field) -> Field:
        """Return M^-1 p for a mass matrix that couples neighbours."""
        b = self.chain.b
        rows = [self._mass_row(i, None, _entry(p, i), lambda t: t, lambda a: a, [(p, 0)]) for i in range(b)]
        places = [(r, side - 1, t) for side in range(3) for r, t in self.nodes.coupled[side]]
        return self._banded(rows, places, pairs(range(b)), "solution").unknowns("d", range(b), self.program.stage)


def _entry(part: Field, i: int) -> Callable[[At], str]:
    """Return the function that gives the source of an entry of a field at the present node."""
    return lambda at: f"{at(part, 0)}[{i}]"
