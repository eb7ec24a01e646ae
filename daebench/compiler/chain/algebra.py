"""The names of ``kernels/language.py`` for a chain: operations on vectors, Jacobians and linear systems, carried out on symbols."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

from daebench.compiler.chain.blocks import pairs
from daebench.compiler.chain.fields import At, Field, Scalar, combined, computed, nothing, weight, written, zeros
from daebench.compiler.chain.loops import Demand
from daebench.compiler.chain.nodes import at_node
from daebench.compiler.chain.systems import Bent, Gram, Jacobian, Mass, Rows, Systems
from daebench.compiler.syntax import LANGUAGE, Lines, pack
from daebench.errors import InvalidProblem


class ChainLanguage(Systems):
    """The names of ``kernels/language.py`` for the functions of a chain, on symbols."""

    # ---- the problem

    def _of_node(self, name: str, kind: str, width: int, arguments: Sequence[Field], masked: Sequence[int] = ()) -> Field:
        """Return the field of a function of fields at a node and at the node before it."""
        self.tracer.node(name)
        ended = self.tracer.ended(name, width, masked)

        def write(at: At, k: str) -> str:
            values = [f"{at(part, -1)} + {at(part, 0)}" for part in arguments]
            call = f"node_{name}({', '.join([*values, at_node(k), 'par'])})"
            return f"{ended}({call}, {k})" if ended else call

        return computed(kind, width, [(part, place) for part in arguments for place in (-1, 0)], write)

    def g(self, q: Field) -> Field:
        """Constraint."""
        return self._of_node("g", "m", self.chain.c, [q], range(self.chain.missing))

    def G(self, q: Field) -> Jacobian:
        """Constraint Jacobian."""
        filled = self.nodes.filled
        masked = [i for i, (row, column) in enumerate(filled) if row < self.chain.missing or column < self.chain.b]
        return Jacobian(self._of_node("G", "G", len(filled), [q], masked))

    def H_q(self, p: Field, q: Field) -> Field:
        """Gradient of U."""
        node_gradient = self._of_node("U_q", "d", self.chain.b, [q])
        if self.chain.joint_U is None:
            return node_gradient
        b = self.chain.b
        masked = range(b if self.chain.anchor is not None else 2 * b)
        joint = self._of_node("joint_U_x", "G", 2 * b, [q], masked)

        parts = ((node_gradient, 0, 0), (joint, 0, b), (joint, 1, 0))
        return self._rows("d", b, [(i, "{0} + {1} + {2}", [(part, place, first + i) for part, place, first in parts]) for i in range(b)])

    def H_p(self, p: Field, q: Field) -> Field:
        """Velocity M^-1 p."""
        v = self._lightened(p) if self.chain.diagonal else self._velocity(p)
        self.tracer.momenta[v] = p
        return v

    def _rows(self, kind: str, width: int, terms: Sequence[tuple[int, str, Sequence[tuple[Field, int, int]]]]) -> Field:
        """Return the field of sums of terms, each with its row, its form, and the entries in it: of a field, at a place, with an index."""

        def write(at: At, k: str) -> Lines:
            sums: list[Lines] = [[] for _ in range(width)]
            for row, form, entries in terms:
                sums[row].append(written(at, (form, entries)))
            return [" + ".join(texts) or "ZERO" for texts in sums]

        return computed(kind, width, [(part, place) for _, _, entries in terms for part, place, _ in entries], write)

    @cached_property
    def _lightness(self) -> Field:
        """Inverse of a diagonal mass matrix."""
        self.tracer.node("lightness")
        still = pack(zeros(2 * self.chain.b))
        return computed("d", self.chain.b, (), lambda at, k: f"node_lightness({still}, {at_node(k)}, par)")

    def _lightened(self, p: Field) -> Field:
        b = self.chain.b
        return self._rows("d", b, [(i, "{0} * {1}", [(self._lightness, 0, i), (p, 0, i)]) for i in range(b)])

    def _of_column(self, x: Field, column: int) -> tuple[Field, int, int]:
        """Return the entry of a field in a column of G, which begin with those of the node before."""
        return x, column // self.chain.b - 1, column % self.chain.b

    def H_pp(self, p: Field, q: Field) -> Mass:
        """Inverse mass."""
        return Mass(inverse=True)

    def mass(self, p: Field, q: Field) -> Mass:
        """Mass matrix."""
        return Mass(inverse=False)

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
        """Smallest relative pivot of G D^-1 G^T with a positive diagonal D, which loses rank where G does; for m = 1 that of G itself."""
        rows = self._lightened_rows(self.G(q))
        if self.chain.m == 1 and rows.entries:
            return self._sum("abs({0} * {1})", "REAL", rows.of.entries, rows.entries)
        equations, at = self._gram_rows(((Gram(rows.of, rows),),), (nothing("m", self.chain.c),))
        return Scalar(f"{self._banded(equations, pairs(at(0)[0]), 'pivot').name}_pivot", late=True)

    def _lightened_rows(self, X: Jacobian) -> Rows:
        filled = self.nodes.filled
        terms = [(i, "{0} * {1}", [(X.entries, 0, i), self._of_column(self._lightness, column)]) for i, (_, column) in enumerate(filled)]
        return Rows(X, self._rows("G", len(filled), terms))

    def row_moduli(self, p: Field, q: Field) -> tuple[Field, Field]:
        """Sums of the moduli of the rows of G, and of those of its derivative along v."""
        entries, c = self.G(q).entries, self.chain.c
        moduli = self._rows("m", c, [(row, "abs({0})", [(entries, 0, i)]) for i, (row, _) in enumerate(self.nodes.filled)])
        return moduli, self._of_node("turned", "m", c, [q, self.H_p(p, q)], range(self.chain.missing))

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

        def write(at: At) -> Lines:
            terms = [term.format(*(f"{at(part, 0)}[{i}]" for part in parts)) for i in range(parts[0].width)]
            return [f"{name} += {' + '.join(terms)}"]

        self.program.wishes.append((Demand(needs=[(part, 0) for part in parts], write=write), [f"{name} = {dtype}(0.0)"]))
        return Scalar(name, late=True)

    def mul_moduli(self, X: Jacobian, x: Field, least: Any) -> Field:
        """Sums of moduli of the rows of G, with weights |x_i| + least."""
        return self._times(X.entries, x, f"abs({{0}}) * (abs({{1}}) + {weight(least)})")

    def exceeding(self, y: Field, bound: Field) -> Scalar:
        """Number of constraints whose modulus exceeds its bound."""
        return self._sum("(1.0 if abs({0}) > {1} else 0.0)", "REAL", y, bound)

    def U(self, q: Field) -> Any:
        """Potential energy."""
        node_energy = self._sum("{0}", "DTYPE", self._of_node("U", "d", 1, [q]))
        if self.chain.joint_U is None:
            return node_energy
        masked = () if self.chain.anchor is not None else (0,)
        return node_energy + self._sum("{0}", "DTYPE", self._of_node("joint_U", "d", 1, [q], masked))

    def mul(self, X: Any, v: Field) -> Field:
        """X v for X = G, G M^-1, or the derivative of G H_p along itself."""
        if isinstance(X, Bent):
            if self.tracer.momenta.get(v) is not X.p:
                raise InvalidProblem(
                    "a scheme asks for derivatives of G H_p; long chains have only those along the motion.", "chain-other-derivatives"
                )
            return self._of_node("bent", "m", self.chain.c, [X.q, v], range(self.chain.missing))
        if isinstance(X, Rows) and X.entries is None:
            return self.mul(X.of, self._velocity(v))
        return self._times(X.entries, v)

    mul_full = mul

    def _times(self, entries: Field, v: Field, term: str = "{0} * {1}") -> Field:
        """Sums over the entries of each row of G, each with the entry of v in its column."""
        terms = [(row, term, [(entries, 0, i), self._of_column(v, column)]) for i, (row, column) in enumerate(self.nodes.filled)]
        return self._rows("m", self.chain.c, terms)

    def mul_T(self, X: Any, y: Field) -> Field:
        """X^T y."""
        if y.zero:
            return nothing("d", self.chain.b)
        if isinstance(X, Rows) and X.entries is None:
            return self.tracer.companions.get((X, y)) or self._velocity(self.mul_T(X.of, y))
        b, terms = self.chain.b, []
        for i, (row, column) in enumerate(self.nodes.filled):
            place = 1 - column // b
            terms.append((column % b, "{0} * {1}", [(X.entries, place, i), (y, place, row)]))
        return self._rows("d", b, terms)

    mul_full_T = mul_T

    def gram(self, X: Jacobian, Y: Any) -> Gram:
        """X Y^T."""
        if not (isinstance(X, Jacobian) and isinstance(Y, Rows)):
            raise InvalidProblem(
                "a scheme asks for a product of matrices other than G M^-1 G^T; long chains have no other.", "chain-other-matrix-product"
            )
        return Gram(X, Y)

    def scale_mm(self, w: Any, A: Gram) -> Gram:
        """Product w A."""
        return Gram(A.left, A.right, w * A.factor)

    def jacobian_times(self, X: Jacobian, S: Mass) -> Rows:
        """G M^-1."""
        return self.rows(X, X.entries, X.entries)

    def apply(self, S: Mass, x: Field) -> Field:
        """M^-1 x, or M x."""
        return self.H_p(x, x) if S.inverse else self._heavy(x)

    def _heavy(self, x: Field) -> Field:
        ordered = [(side - 1, r, t) for side in range(3) for r, t in self.nodes.coupled[side]]
        terms = [(r, "{0} * {1}", [(self._inertia_field, 0, e), (x, side, t)]) for e, (side, r, t) in enumerate(ordered)]
        return self._rows("d", self.chain.b, terms)

    def no_work(self) -> Scalar:
        """No work."""
        self.tracer.linker.resolve(LANGUAGE, "no_work")
        return Scalar("no_work()")
