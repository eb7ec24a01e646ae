"""A scheme run on symbols: what it asks of vectors, Jacobians and linear systems becomes a few loops over the nodes of a chain.

The files of schemes and kernels are executed as they stand, with the constants of the hole settled and every name of the hole bound to a
method of :class:`Hole`. Vectors are fields, worked out where a loop needs them; a linear system is a loop up the chain and one down; an
iteration is the one of ``kernels/newton.py``, whose sweep is a function of its own.
"""

import ast
import copy
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import count
from typing import TYPE_CHECKING, Any

from daebench import codegen
from daebench.chains.band import Band, Row
from daebench.chains.fields import At, Field, Needs, Scalar, applied, combined, made, nothing, say, stored, weight
from daebench.chains.loops import Demand, Loop
from daebench.chains.nodes import Nodes, at_node
from daebench.codegen import pack
from daebench.errors import InvalidProblem
from daebench.syntax import HOLE, parameters_of

if TYPE_CHECKING:
    from daebench.link import Linker

NEWTON = "daebench.kernels.newton"
ARGUMENTS: dict[str, tuple[str, ...]] = dict.fromkeys(("H", "H_p", "H_q", "Gv", "lam", "independence", "row_moduli"), ("p", "q")) | {
    "g": ("q",)
}
ARGUMENTS |= dict.fromkeys(("step", "increment", "start"), ("p0", "q0", "h"))
"""Functions that are written from loops over nodes, and their arguments."""

HOMES = {"H": "mechanical"}
"""Files in which functions of the hole are composed of others, ``composed`` if not these."""


@dataclass(frozen=True, eq=False)
class Jacobian:
    """G at some positions."""

    entries: Field


@dataclass(frozen=True, eq=False)
class Rows:
    """G M^-1: of a diagonal mass matrix its entries, else a thing to solve with."""

    of: Jacobian
    entries: Field | None


@dataclass(frozen=True, eq=False)
class Gram:
    """w G M^-1 G'^T."""

    left: Jacobian
    right: Rows
    factor: Any = 1.0


@dataclass(frozen=True, eq=False)
class Mass:
    """What stands for H_pp."""


@dataclass(frozen=True, eq=False)
class Inertia:
    """What stands for the mass matrix."""


@dataclass(frozen=True, eq=False)
class Bent:
    """What stands for the derivative of G H_p with respect to q at these positions, of which only the product with H_p is known."""

    p: Field
    q: Field


@dataclass(eq=False)
class Solve:
    """A linear system, and the loops that it is."""

    band: Band


@dataclass(eq=False)
class Iteration:
    """Newton's iteration: where its unknowns begin, and the lines that call it."""

    starts: list[Demand]
    call: list[str]


class Program:
    """The function that is being written: its linear systems and iterations in order, and what is asked of it in the end.

    Parameters
    ----------
    nodes : int
        Number of nodes.
    numbers : iterator of int
        What names are told apart by.
    outer : Program, optional
        The function that calls this one, whose slab and arrays it shares.
    """

    def __init__(self, nodes: int, numbers: Iterator[int], outer: "Program | None" = None) -> None:
        self.nodes, self.numbers = nodes, numbers
        self.top: Program = outer.top if outer else self
        self.first: int = outer.first + len(outer.events) if outer else 0
        self.events: list[Solve | Iteration] = []
        self.wishes: list[tuple[Demand, list[str]]] = []
        self.work: list[int] = []
        self.arguments: Sequence[str] = ()
        if not outer:
            self.columns, self.arrays = 0, dict[str, str]()

    @property
    def stage(self) -> int:
        """Number of the last event so far."""
        return self.first + len(self.events)

    def name(self, stem: str) -> str:
        """Return a name that nothing else has."""
        return f"{stem}{next(self.top.numbers)}"

    def reserve(self, columns: int) -> int:
        """Return the first of so many new columns of the slab."""
        self.top.columns += columns
        return self.top.columns - columns

    def lines(self) -> list[str]:
        """Return the body: every wish is met in the first loop in which it can be."""
        waiting = list(self.wishes)
        lines = [line for _, before in waiting for line in before]

        def due(stage: int) -> list[Demand]:
            ready = [wish for wish in waiting if wish[0].stage <= stage]
            waiting[:] = [wish for wish in waiting if wish not in ready]
            return [demand for demand, _ in ready]

        for number, event in enumerate(self.events, self.first + 1):
            if isinstance(event, Iteration):
                lines += Loop(self.name("f"), self.nodes, [*event.starts, *due(number - 1)]).lines() + event.call
                continue
            lines += event.band.begin
            lines += Loop(self.name("f"), self.nodes, [*event.band.elimination(), *due(number - 1)]).lines() + event.band.between
            fitting: list[Demand] = []
            for wish in [wish for wish in waiting if wish[0].stage <= number]:
                down = Loop(self.name("f"), self.nodes, [*fitting, wish[0]], up=False)
                if all(front == 0 for part, front in down.front.items() if part.stage == number and not part.needs):
                    fitting.append(wish[0])
                    waiting.remove(wish)
            lines += Loop(self.name("f"), self.nodes, fitting, up=False, head=event.band.substitution).lines()
        return lines + Loop(self.name("f"), self.nodes, [demand for demand, _ in waiting]).lines()


class Hole:
    """The names of ``kernels/hole.py`` for the functions of a chain, on symbols."""

    def __init__(self, tracer: "Tracer") -> None:
        self.tracer, self.nodes = tracer, tracer.nodes
        self.chain = tracer.nodes.chain

    @property
    def program(self) -> Program:
        """The function that is being written."""
        return self.tracer.programs[-1]

    # ---- the problem

    def _of_node(self, name: str, kind: str, width: int, needs: Needs, masked: Sequence[int] = ()) -> Field:
        """Return the field of a node's function; ``needs`` come in pairs, each for one argument."""
        self.tracer.node(name)
        ended = self.tracer.ended(name, width, masked)

        def write(at: At, k: str) -> str:
            runs = [needs[i : i + 2] for i in range(0, len(needs), 2)]
            arguments = [" + ".join(at(part, place) for part, place in run) for run in runs]
            call = f"node_{name}({', '.join([*arguments, at_node(k), 'par'])})"
            return f"{ended}({call}, {k})" if ended else call

        return made(kind, width, needs, write)

    def g(self, q: Field) -> Field:
        """Constraint."""
        return self._of_node("g", "m", self.chain.c, [(q, -1), (q, 0)], range(self.chain.missing))

    def G(self, q: Field) -> Jacobian:
        """Constraint Jacobian."""
        filled = self.nodes.filled
        masked = [i for i, (row, column) in enumerate(filled) if row < self.chain.missing or column < self.chain.b]
        return Jacobian(self._of_node("G", "G", len(filled), [(q, -1), (q, 0)], masked))

    def H_q(self, p: Field, q: Field) -> Field:
        """Gradient of U."""
        own = self._of_node("U_q", "d", self.chain.b, [(q, -1), (q, 0)])
        if self.chain.joint_U is None:
            return own
        b = self.chain.b
        masked = range(b if self.chain.anchor is not None else 2 * b)
        joint = self._of_node("joint_U_x", "G", 2 * b, [(q, -1), (q, 0)], masked)

        def write(at: At, k: str) -> list[str]:
            return [f"{at(own, 0)}[{i}] + {at(joint, 0)}[{b + i}] + {at(joint, 1)}[{i}]" for i in range(b)]

        return made("d", b, [(own, 0), (joint, 0), (joint, 1)], write)

    def H_p(self, p: Field, q: Field) -> Field:
        """Velocity M^-1 p."""
        v = self._lightened(p) if self.chain.diagonal else self._velocity(p)
        self.tracer.momenta[v] = p
        return v

    def _lightened(self, p: Field) -> Field:
        self.tracer.node("lightness")
        b = self.chain.b

        def write(at: At, k: str) -> list[str]:
            light = f"node_lightness({pack(['ZERO'] * (2 * b))}, {at_node(k)}, par)"
            return [f"{light}[{i}] * {at(p, 0)}[{i}]" for i in range(b)]

        return made("d", b, [(p, 0)], write)

    def H_pp(self, p: Field, q: Field) -> Mass:
        """Inverse mass."""
        return Mass()

    def mass(self, p: Field, q: Field) -> Inertia:
        """Mass matrix."""
        return Inertia()

    def Gv_p(self, p: Field, q: Field) -> Rows:
        """Derivative of G H_p with respect to p."""
        return self.rows(self.G(q), p, q)

    def Gv_q(self, p: Field, q: Field) -> Bent:
        """Derivative of G H_p with respect to q."""
        return Bent(p, q)

    def rows(self, X: Jacobian, p: Field, q: Field) -> Rows:
        """G M^-1."""
        return self._lightened_rows(X) if self.chain.diagonal else Rows(X, None)

    def independence(self, p: Field, q: Field) -> Scalar:
        """Smallest relative pivot of G D^-1 G^T with a positive diagonal D, which loses rank where G does; of one constraint itself."""
        rows = self._lightened_rows(self.G(q))
        if self.chain.m == 1 and rows.entries:
            return self._sum("abs({0} * {1})", "REAL", rows.of.entries, rows.entries)
        return self.solve(Gram(rows.of, rows), nothing("m", self.chain.c))[1]

    def _lightened_rows(self, X: Jacobian) -> Rows:
        self.tracer.node("lightness")
        b, filled = self.chain.b, self.nodes.filled
        still = pack(["ZERO"] * (2 * b))

        def write(at: At, k: str) -> list[str]:
            before, here = (f"node_lightness({still}, {at_node(place)}, par)" for place in (f"{k} - 1", k))
            lights = [f"({before}[{column}] if {k} > 0 else ZERO)" if column < b else f"{here}[{column - b}]" for _, column in filled]
            return [f"{at(X.entries, 0)}[{i}] * {light}" for i, light in enumerate(lights)]

        return Rows(X, made("G", len(filled), [(X.entries, 0)], write))

    def row_moduli(self, p: Field, q: Field) -> tuple[Field, Field]:
        """Sums of moduli of the rows of G, and of those of its derivative along v."""
        entries, filled, v = self.G(q).entries, self.nodes.filled, self.H_p(p, q)

        def write(at: At, k: str) -> list[str]:
            rows = [[f"abs({at(entries, 0)}[{i}])" for i, (row, _) in enumerate(filled) if row == a] for a in range(self.chain.c)]
            return [" + ".join(terms) for terms in rows]

        turned = self._of_node("turned", "m", self.chain.c, [(q, -1), (q, 0), (v, -1), (v, 0)], range(self.chain.missing))
        return made("m", self.chain.c, [(entries, 0)], write), turned

    # ---- the algebra

    def axpy(self, w: Any, x: Field, y: Field) -> Field:
        """Sum w x + y."""
        return combined(w, x, y)

    axpy_m = axpy

    def scale(self, w: Any, x: Field) -> Field:
        """Product w x."""
        return combined(w, x, None)

    scale_m = scale

    def zero_m(self, q: Field) -> Field:
        """Zero multiplier."""
        return nothing("m", self.chain.c)

    def norm(self, x: Field) -> Scalar:
        """Sum of moduli."""
        return self._sum("abs({0})", "REAL", x)

    norm_m = norm

    def dot(self, x: Field, y: Field) -> Any:
        """Scalar product."""
        return self._sum("{0} * {1}", "DTYPE", x, y)

    def dot_moduli(self, x: Field, y: Field) -> Any:
        """Scalar product of moduli."""
        return self._sum("abs({0} * {1})", "REAL", x, y)

    def _sum(self, term: str, dtype: str, *parts: Field) -> Scalar:
        name = self.program.name("sum")

        def write(at: At) -> list[str]:
            terms = [term.format(*(f"{at(part, 0)}[{i}]" for part in parts)) for i in range(parts[0].width)]
            return [f"{name} += {' + '.join(terms)}"]

        self.program.wishes.append((Demand(needs=[(part, 0) for part in parts], write=write), [f"{name} = {dtype}(0.0)"]))
        return Scalar(name, late=True)

    def U(self, q: Field) -> Scalar:
        """Potential energy."""
        own = self._sum("{0}", "DTYPE", self._of_node("U", "d", 1, [(q, -1), (q, 0)]))
        if self.chain.joint_U is None:
            return own
        masked = () if self.chain.anchor is not None else (0,)
        return own + self._sum("{0}", "DTYPE", self._of_node("joint_U", "d", 1, [(q, -1), (q, 0)], masked))

    def mul(self, X: Any, v: Field) -> Field:
        """X v for X = G, G M^-1, or the derivative of G H_p along itself."""
        if isinstance(X, Bent):
            if self.tracer.momenta.get(v) is not X.p:
                raise InvalidProblem("a scheme asks for derivatives of G H_p, of which long chains have those along the motion alone.")
            return self._of_node("bent", "m", self.chain.c, [(X.q, -1), (X.q, 0), (v, -1), (v, 0)], range(self.chain.missing))
        if isinstance(X, Rows):
            if X.entries is None:
                return self.mul(X.of, self._velocity(v))
            return self._times(X.entries, v)
        return self._times(X.entries, v)

    mul_full = mul

    def _times(self, entries: Field, v: Field) -> Field:
        b, filled = self.chain.b, self.nodes.filled

        def write(at: At, k: str) -> list[str]:
            sums: list[list[str]] = [[] for _ in range(self.chain.c)]
            for i, (row, column) in enumerate(filled):
                of_v = f"{at(v, -1)}[{column}]" if column < b else f"{at(v, 0)}[{column - b}]"
                sums[row].append(f"{at(entries, 0)}[{i}] * {of_v}")
            return [" + ".join(terms) for terms in sums]

        return made("m", self.chain.c, [(entries, 0), (v, -1), (v, 0)], write)

    def mul_T(self, X: Any, y: Field) -> Field:
        """X^T y."""
        if y.zero:
            return nothing("d", self.chain.b)
        if isinstance(X, Rows) and X.entries is None:
            return self.tracer.companions.get((X, y)) or self._velocity(self.mul_T(X.of, y))
        entries = X.entries
        b, filled = self.chain.b, self.nodes.filled

        def write(at: At, k: str) -> list[str]:
            sums: list[list[str]] = [[] for _ in range(b)]
            for i, (row, column) in enumerate(filled):
                place = 1 if column < b else 0
                sums[column % b].append(f"{at(entries, place)}[{i}] * {at(y, place)}[{row}]")
            return [" + ".join(terms) or "ZERO" for terms in sums]

        return made("d", b, [(entries, 0), (entries, 1), (y, 0), (y, 1)], write)

    mul_full_T = mul_T

    def gram(self, X: Jacobian, Y: Any) -> Gram:
        """X Y^T."""
        if not (isinstance(X, Jacobian) and isinstance(Y, Rows)):
            raise InvalidProblem("a scheme asks for a product of matrices other than G M^-1 G^T, which long chains do not have.")
        return Gram(X, Y)

    def scale_mm(self, w: Any, A: Gram) -> Gram:
        """Product w A."""
        return Gram(A.left, A.right, w * A.factor)

    def jacobian_times(self, X: Jacobian, S: Mass) -> Rows:
        """G M^-1."""
        return self.rows(X, X.entries, X.entries)

    def apply(self, S: Mass | Inertia, x: Field) -> Field:
        """M^-1 x, or M x."""
        return self.H_p(x, x) if isinstance(S, Mass) else self._heavy(x)

    def _heavy(self, x: Field) -> Field:
        inertia, b = self.tracer.inertia(self._inertia_field), self.chain.b
        ordered = [(side - 1, r, t) for side in range(3) for r, t in self.nodes.coupled[side]]

        def write(at: At, k: str) -> list[str]:
            terms = [[f"{at(inertia, 0)}[{e}] * {at(x, side)}[{t}]" for e, (side, r, t) in enumerate(ordered) if r == i] for i in range(b)]
            return [" + ".join(each) for each in terms]

        return made("d", b, [(inertia, 0), *((x, side) for side in sorted({side for side, _, _ in ordered}))], write)

    def solve(self, A: Gram, b: Field) -> tuple[Field, Scalar]:
        """Solution of A x = b, and the smallest relative pivot."""
        (x,), pivot = self.solve_stages(((A,),), (b,))
        return x, pivot

    def solve_stages(self, A: Any, b: Sequence[Field]) -> tuple[tuple[Field, ...], Scalar]:
        """Solution of sum_j A_ij x_j = b_i, and the smallest relative pivot."""
        saddle = A[0][0].right.entries is None
        system = self._saddle_rows(A, b) if saddle else self._gram_rows(A, b)
        rows, places, at = system
        band = self._banded(rows, places)
        found = tuple(band.unknowns("m", at(j)[0], self.program.stage) for j in range(len(b)))
        if saddle:
            for j, x in enumerate(found):
                self.tracer.companions[A[0][j].right, x] = band.unknowns("d", at(j)[1], self.program.stage)
        return found, Scalar(f"{band.name}_pivot", late=True)

    solve_stages_but_one = solve_stages

    def _banded(self, rows: Sequence[Row], places: Sequence[tuple[int, int, int]]) -> Band:
        program, n = self.program, self.chain.nodes
        name = program.name("band")
        band = Band(name=name, nodes=n, rows=rows, places=places)
        band = Band(name=name, nodes=n, rows=rows, places=places, base=program.reserve(band.columns))
        program.top.arrays |= band.arrays
        if not band.tridiagonal:
            self.tracer.banded()
        program.events.append(Solve(band))
        return band

    def _gram_rows(self, A: Any, b: Sequence[Field]) -> Any:
        """Rows of A for the unknowns x_0, x_1, ... of each node, one after the other."""
        c, s = self.chain.c, len(b)
        products = [(i, j, place, *pair) for i in range(s) for j in range(s) for place in (-1, 0, 1) for pair in self._meeting(place)]
        rows, places = [], sorted({(i * c + r, place, j * c + t) for i, j, place, r, t, _, _ in products})
        for i in range(s):
            needs = [(A[i][0].left.entries, 0), (b[i], 0)]
            needs += [(A[i][j].right.entries, place) for j in range(s) for place in (-1, 0, 1)]
            for a in range(c):
                rows.append(Row(needs=needs, entries=self._gram_entries(A[i], i, a), right=_entry(b[i], a)))
        return rows, places, lambda j: (range(j * c, (j + 1) * c), ())

    def _meeting(self, place: int) -> list[tuple[int, int, int, int]]:
        """Rows of a node and of the one so many places on that meet, (row, row, entry, entry)."""
        b, filled = self.chain.b, self.nodes.filled
        return [
            (r, t, i, j)
            for i, (r, column) in enumerate(filled)
            for j, (t, other) in enumerate(filled)
            if (column // b - 1, column % b) == (other // b - 1 + place, other % b)
        ]

    def _gram_entries(self, A: Sequence[Gram], stage: int, a: int) -> Callable[[At], dict[tuple[int, int], str]]:
        c = self.chain.c

        def entries(at: At) -> dict[tuple[int, int], str]:
            found: dict[tuple[int, int], str] = {}
            for j, each in enumerate(A):
                for place in (-1, 0, 1):
                    for t in range(c):
                        terms = [
                            f"{at(each.left.entries, 0)}[{x}] * {at(each.right.entries, place)}[{y}]"  # type: ignore[arg-type]
                            for r, u, x, y in self._meeting(place)
                            if (r, u) == (a, t)
                        ]
                        if terms:
                            found[place, j * c + t] = self._scaled(each.factor, " + ".join(terms))
                if a < self.chain.missing:
                    found[0, j * c + a] = f"({found[0, j * c + a]} if k > 0 else ZERO + {float(j == stage)})"
            return found

        return entries

    @staticmethod
    def _scaled(factor: Any, text: str) -> str:
        return text if factor == 1.0 else f"{weight(factor)} * ({text})"

    def _saddle_rows(self, A: Any, b: Sequence[Field]) -> Any:
        """Rows of M x_j - G_j^T lam_j = 0 and sum_j w_ij G_i x_j = b_i: joints' multipliers, positions, other multipliers, node by node."""
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

    def _inertia_field(self) -> Field:
        self.tracer.node("inertia")
        width = sum(map(len, self.nodes.coupled))

        def write(at: At, k: str) -> list[str]:
            return [f"(ZERO + node_inertia({at_node(k)}, par)[{i}])" for i in range(width)]

        return made("G", width, (), write)

    def _mass_row(self, i: int, J: Field | None, right: Any, x: Callable[[int], int], lam: Callable[[int], int], more: Any = ()) -> Row:
        """Row i of M x - G^T lam = right at a node; J is None where there is no lam."""
        inertia = self.tracer.inertia(self._inertia_field)
        ordered = [(side, r, t) for side in range(3) for r, t in self.nodes.coupled[side]]

        def entries(at: At) -> dict[tuple[int, int], str]:
            found = {(side - 1, x(t)): f"{at(inertia, 0)}[{e}]" for e, (side, r, t) in enumerate(ordered) if r == i}
            for e, (row, column) in enumerate(self.nodes.filled if J else ()):
                place = 0 if column >= self.chain.b else 1
                if column % self.chain.b == i:
                    found[place, lam(row)] = f"-{at(J, place)}[{e}]"  # type: ignore[arg-type]
            return found

        needs = [(inertia, 0), *more] + ([(J, 0), (J, 1)] if J else [])
        return Row(needs=needs, entries=entries, right=right)

    def _constraint_row(self, A: Sequence[Gram], a: int, b: Field, x: Callable[[int, int], int], own: int) -> Row:
        """Row a of sum_j w_j G x_j = b at a node; where node 0 lacks the constraint its multiplier is zero."""
        J, missing = A[0].left.entries, a < self.chain.missing

        def entries(at: At) -> dict[tuple[int, int], str]:
            found: dict[tuple[int, int], str] = {(0, own): "(ZERO if k > 0 else ZERO + 1.0)"} if missing else {}
            for j, each in enumerate(A):
                for e, (row, column) in enumerate(self.nodes.filled):
                    if row == a:
                        place = 0 if column >= self.chain.b else -1
                        found[place, x(j, column % self.chain.b)] = self._scaled(each.factor, f"{at(J, 0)}[{e}]")
            return found

        return Row(needs=[(J, 0), (b, 0)], entries=entries, right=_entry(b, a))

    def _velocity(self, p: Field) -> Field:
        """Return M^-1 p of a mass matrix that joins neighbours."""
        b = self.chain.b
        rows = [self._mass_row(i, None, _entry(p, i), lambda t: t, lambda a: a, [(p, 0)]) for i in range(b)]
        places = [(r, side - 1, t) for side in range(3) for r, t in self.nodes.coupled[side]]
        return self._banded(rows, places).unknowns("d", range(b), self.program.stage)

    # ---- iterations and reports

    def newton(self, improve: Callable[..., Any], x: tuple[Any, ...], data: Any) -> Any:
        """Newton's iteration, whose sweep becomes a function."""
        return self.tracer.iterated(improve, x, data)

    def judge(self, *arguments: Any) -> Scalar:
        """Status of a linear solve."""
        return applied(self.tracer.scalars("judge"), *arguments, Scalar("par"))

    def both(self, first: Any, second: Any) -> Scalar:
        """Report of two solutions in a row."""
        return applied(self.tracer.scalars("both"), first, second, Scalar("par"))

    def no_work(self) -> Scalar:
        """No work."""
        self.tracer.linker.resolve(HOLE, "no_work")
        return Scalar("no_work()")


class Tracer:
    """Writes the functions of a chain that a linker asks for.

    Parameters
    ----------
    linker : Linker
        It joins them with the loop over steps.
    nodes : Nodes
        The functions of one node.
    """

    def __init__(self, linker: "Linker", nodes: Nodes) -> None:
        self.linker, self.nodes = linker, nodes
        self.hole = Hole(self)
        self.programs: list[Program] = []
        self.companions: dict[tuple[Rows, Field], Field] = {}
        self.momenta: dict[Field, Field] = {}
        self.memory: Any = ()
        self.numbers = count(1)
        self._inertia: dict[int, Field] = {}
        self._functions: dict[tuple[str, str], Callable[..., Any]] = {}

    # ---- what generated functions call

    def node(self, name: str) -> None:
        """Emit a function of one node."""
        if f"node_{name}" not in self.linker.emitted:
            self.linker.emitted[f"node_{name}"] = self.nodes.source(name)

    def ended(self, name: str, width: int, masked: Sequence[int]) -> str:
        """Emit what makes those entries of a node's function zero at node 0, and all of the run's type; return its name, or ""."""
        promoted = self.linker.options.precision == "complex128"
        if not masked and not promoted:
            return ""
        typed = "ZERO + x[{i}]" if promoted else "x[{i}]"
        entries = [f"{typed.format(i=i)} if k > 0 else ZERO" if i in masked else typed.format(i=i) for i in range(width)]
        self.linker.emitted.setdefault(f"ended_{name}", codegen.function(f"ended_{name}(x, k)", f"return {pack(entries)}"))
        return f"ended_{name}"

    def scalars(self, name: str) -> str:
        """Emit a function of ``kernels/newton.py`` on numbers; return its name."""
        return self.linker.function(NEWTON, name, {})

    def banded(self) -> None:
        """Emit the elimination of banded matrices."""
        for name in ("push", "settle"):
            self.linker.function("daebench.kernels.band", name, {})

    def inertia(self, make: Callable[[], Field]) -> Field:
        """Return the blocks of M in the function that is being written."""
        return self._inertia.setdefault(id(self.programs[-1]), make())

    # ---- running files

    def _call(self, module: str, name: str) -> Callable[..., Any]:
        """Return what a name stands for: a method of the hole, or the function of a file, to be run on symbols."""
        if module == HOLE:
            if found := self.linker.filled(name):
                return self._call(found, "step" if name == "plain_step" else name)
            own = getattr(self.hole, name, None)
            if own is not None:
                return self._counted(name, own)
            return self._call(f"daebench.kernels.{HOMES.get(name, 'composed')}", name)
        if module == NEWTON and name in ("newton", "judge", "both"):
            return getattr(self.hole, name)  # type: ignore[no-any-return]
        if (module, name) not in self._functions:
            self._functions[module, name] = self._compiled(module, name)
        return self._functions[module, name]

    def _counted(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        work = self.linker.work_of("", name)

        def counting(*arguments: Any) -> Any:
            program = self.programs[-1]
            program.work = [mine + more for mine, more in zip(program.work or [0] * len(work), work, strict=True)]
            return function(*arguments)

        return counting

    def _compiled(self, module: str, name: str) -> Callable[..., Any]:
        """Return a function of a file with the names that it uses bound to what they stand for here."""
        file = self.linker.file(module)
        if name not in file.functions:
            raise InvalidProblem(f"a scheme asks for {name}, which long chains do not have; take a shorter chain, or another scheme.")
        node = file.functions[name]
        bare = copy.deepcopy(node)
        bare.returns, bare.decorator_list = None, []
        for each in bare.args.args:
            each.annotation = None
        tree = ast.fix_missing_locations(ast.Module([bare], []))
        used = {each.id for each in ast.walk(node) if isinstance(each, ast.Name)} - set(parameters_of(node))
        scope: dict[str, Any] = {"min": _least, "max": _greatest, "abs": _modulus}
        scope |= {each: self._meaning(module, each) for each in used if each in file.imports or each in file.functions}
        scope |= {each: literal.value for each, literal in file.literals.items()}
        exec(compile(tree, module, "exec"), scope)
        return scope[name]  # type: ignore[no-any-return]

    def _meaning(self, module: str, name: str) -> Any:
        home, own = self.linker.file(module).imports.get(name, (module, name))
        if home.rpartition(".")[2] in ("mechanical", "composed") and hasattr(self.hole, own):
            home = HOLE
        if home == HOLE and own in self.linker.constants:
            return self.linker.constants[own]
        if home == HOLE and own in ("EPS", "INF"):
            return Scalar(own)
        if home == HOLE and own in ("DATA", "FORM_DATA"):
            return Scalar(f"par[{len(self.nodes.parameters) + (own == 'FORM_DATA')}]")
        if home != HOLE and own in self.linker.file(home).literals:
            return self.linker.file(home).literals[own].value
        return lambda *arguments: self._call(home, own)(*arguments)

    # ---- writing functions

    def written(self, name: str) -> bool:
        """Emit a function if it is one of those that are written here; return whether it is."""
        if name in ARGUMENTS and name not in self.linker.emitted:
            several = name == "step" and self.linker.constants["MULTISTEP"]
            self._write(name, ("p0", "q0", "memory", "h") if several else ARGUMENTS[name])
        return name in ARGUMENTS

    def _run(self, name: str, arguments: Sequence[str]) -> Any:
        """Return the results of a function of the hole, the raw multipliers that nobody stores left out."""
        handed = [self._argument(each) for each in arguments]
        results = self._call(HOLE, name)(*handed)
        if name == "start":
            self.memory = results[0]
        if name in ("step", "increment") and not self.linker.options.raw:
            return (*results[:-2], (), results[-1])
        return results

    def _argument(self, name: str) -> Any:
        """Return an argument of a function: the step size, a state, or what a scheme remembers, which ``start`` made."""
        if name == "h":
            return Scalar(name)
        if name != "memory":
            return self._state(name)
        self.written("start")
        return self._remembered(self.memory, name)

    def _remembered(self, like: Any, text: str) -> Any:
        if isinstance(like, tuple):
            return tuple(self._remembered(part, f"{text}[{i}]") for i, part in enumerate(like))
        missing = self.nodes.chain.missing if like.kind == "m" else 0
        entry = f"{text}[{like.width} * {{k}} + {{i}} - {missing}]" if missing else f"{text}[{like.width} * {{k}} + {{i}}]"
        return stored(like.kind, like.width, entry, 0, like.ghost, missing)

    def _state(self, array: str) -> Field:
        """Return the field of an argument; positions continue to the anchor."""
        b, anchor = self.nodes.chain.b, self.nodes.chain.anchor
        if array.startswith("p") or anchor is None:
            return stored("d", b, f"{array}[{b} * {{k}} + {{i}}]", 0)
        self.node("anchor")
        return stored("d", b, f"{array}[{b} * {{k}} + {{i}}]", 0, [f"(ZERO + node_anchor(par)[{i}])" for i in range(b)])

    def _write(self, name: str, arguments: Sequence[str]) -> None:
        """Emit a function that no other encloses."""
        self.linker.emitted[name] = ""
        program = Program(self.nodes.chain.nodes, self.numbers)
        program.arguments = arguments
        self.programs.append(program)
        returned = self._returned(self._run(name, arguments))
        body = program.lines()
        self.programs.pop()
        self.linker.work[name] = program.work or [0] * len(self.linker.kinds)
        kept = [f"slab = numpy.empty(({program.nodes}, {program.columns}), dtype=DTYPE)"] if program.columns else []
        kept += [f"{array} = {source}" for array, source in program.arrays.items()]
        del self.linker.emitted[name]
        self.linker.emitted[name] = _written(f"{name}({', '.join([*arguments, 'par'])})", [*kept, *body, f"return {returned}"])

    def _returned(self, results: Any) -> str:
        """Return the source of results; fields become new arrays."""
        if isinstance(results, tuple):
            return pack(map(self._returned, results))
        if not isinstance(results, Field):
            return say(results)
        program, missing = self.programs[-1], self.nodes.chain.missing if results.kind == "m" else 0
        array, size = program.name("out"), program.nodes * results.width - missing

        def write(at: At) -> list[str]:
            lines = [f"{array}[{results.width} * k + {i - missing}] = {at(results, 0)}[{i}]" for i in range(results.width)]
            return [f"if k > 0: {line}" if i < missing else line for i, line in enumerate(lines)]

        program.wishes.append((Demand(needs=[(results, 0)], write=write), [f"{array} = numpy.empty({size}, dtype=DTYPE)"]))
        return array

    def iterated(self, improve: Callable[..., Any], x: Any, data: Any) -> Any:
        """Emit Newton's iteration with this sweep; return the unknowns after it and its report."""
        outer, starts = self.programs[-1], _flat(x)
        if outer.top is not outer or not all(isinstance(part, Field) for part in starts):
            raise InvalidProblem("a scheme iterates within an iteration, or on numbers, which long chains do not have.")
        places = [(outer.reserve(part.width), outer.reserve(part.width)) for part in starts]
        sweep = self._sweep(outer, improve, x, data, places)
        name = outer.name("after")
        newton = self.linker.function(NEWTON, "newton", {"improve": sweep})
        first = pack(str(place) for place, _ in places)
        call = f"{name}, report_{name} = {newton}({first}, {pack(self._shared(outer))}, par)"
        starting = [_kept(part, f"slab[k, {place} + {{i}}]") for part, (place, _) in zip(starts, places, strict=True)]
        outer.events.append(Iteration(starting, [call]))
        outer.arguments = [*outer.arguments, name]
        after = [
            stored(part.kind, part.width, f"slab[{{k}}, {name}[{i}] + {{i}}]", outer.stage, part.ghost) for i, part in enumerate(starts)
        ]
        return _shaped(x, after), Scalar(f"report_{name}", late=True)

    def _sweep(self, outer: Program, improve: Callable[..., Any], x: Any, data: Any, places: Sequence[tuple[int, int]]) -> str:
        """Emit one sweep: it reads the unknowns from one half of their columns of the slab and writes the next into the other."""
        inner = Program(outer.nodes, self.numbers, outer)
        self.programs.append(inner)
        now = [stored(part.kind, part.width, f"slab[{{k}}, now_{i} + {{i}}]", 0, part.ghost) for i, part in enumerate(_flat(x))]
        then, *judged = improve(_shaped(x, now), data)
        inner.wishes += [(_kept(part, f"slab[k, then_{i} + {{i}}]"), []) for i, part in enumerate(_flat(then))]
        body = inner.lines()
        self.programs.pop()
        name = outer.name("sweep")
        self.linker.work[name] = inner.work or [0] * len(self.linker.kinds)
        turns = [line for i, (one, other) in enumerate(places) for line in (f"now_{i} = x[{i}]", f"then_{i} = {one + other} - now_{i}")]
        back = pack(f"then_{i}" for i in range(len(places)))
        lines = [f"{', '.join(self._shared(outer))}, = data", *turns, *body, f"return {', '.join([back, *map(say, judged)])}"]
        self.linker.emitted[name] = _written(f"{name}(x, data, par)", lines)
        return name

    @staticmethod
    def _shared(outer: Program) -> list[str]:
        """Names of what a sweep shares with the function that calls it."""
        return ["slab", *outer.arrays, *outer.arguments]


def _written(signature: str, lines: Sequence[str]) -> str:
    return f"def {signature}:\n" + "\n".join(f"    {line}" for line in lines) + "\n"


def _kept(part: Field, entry: str) -> Demand:
    """Return the demand that a field be stored."""
    return Demand(needs=[(part, 0)], write=lambda at: [f"{entry.format(i=i)} = {at(part, 0)}[{i}]" for i in range(part.width)])


def _entry(part: Field, i: int) -> Callable[[At], str]:
    """Return what gives the source of an entry of a field at the present node."""
    return lambda at: f"{at(part, 0)}[{i}]"


def _flat(x: Any) -> list[Field]:
    """Return the fields of a nested tuple."""
    return [each for part in x for each in _flat(part)] if isinstance(x, tuple) else [x]


def _shaped(x: Any, parts: Sequence[Field]) -> Any:
    """Return fields as the nested tuple x has them."""
    left = iter(parts)

    def shaped(each: Any) -> Any:
        return tuple(map(shaped, each)) if isinstance(each, tuple) else next(left)

    return shaped(x)


def _least(*numbers: Any) -> Any:
    return _chosen("min", numbers)


def _greatest(*numbers: Any) -> Any:
    return _chosen("max", numbers)


def _chosen(name: str, numbers: Any) -> Any:
    numbers = tuple(numbers[0]) if len(numbers) == 1 else numbers
    return numbers[0] if len(numbers) == 1 else applied(name, *numbers)


def _modulus(x: Any) -> Scalar:
    return applied("abs", x)
