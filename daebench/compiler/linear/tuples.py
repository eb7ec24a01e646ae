"""The *values* algebra: vectors are tuples of d positions or m constraints, whose numbers are computed one by one.

Structural zeros of G are left out of every product that has a Jacobian of constraints as its first factor.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from daebench.compiler.linear.elimination import Solvers, Space, Target

Operation = Callable[..., Any]


class Values:
    """The operations that :mod:`daebench.compiler.shapes` and ``kernels/language.py`` name, for tuples of fixed length.

    Shapes: structure (m, d); inverse_mass (d, d).
    """

    elementwise = True
    """Whether entries may be arrays in place of numbers, so that a function applies to many states at once."""

    def __init__(
        self,
        d: int,
        m: int,
        structure: Sequence[Sequence[Any]],
        inverse_mass: Sequence[Sequence[Any]],
        target: Target,
        mass: Sequence[Sequence[int]] | None = None,
        unmeasured: int = 0,
    ) -> None:
        self.d, self.m, self.target, self.measured = d, m, target, d - unmeasured
        self.structure, self.inverse_mass = ([[int(bool(entry)) for entry in row] for row in rows] for rows in (structure, inverse_mass))
        self.mass = [list(block) for block in mass or [range(d)]]
        self.solvers = Solvers(d, m, self.mass, target)

    def __repr__(self) -> str:
        return f"Values{(self.d, self.m, self.structure, self.inverse_mass, self.target, self.mass, self.d - self.measured)!r}"

    @property
    def names(self) -> list[str]:
        """Names of its operations."""
        return [*self._vectors({}, _sum), *self._products(_sum), *self._matrices(), *self._halves(), *self.solvers.names]

    def provide(self, name: str, space: Space) -> None:
        """Bring an operation into the names of a module."""
        if name in self.solvers.names:
            self.solvers.provide(name, space)
        else:
            total = partial(_sum, none=space.names["float32"](0.0)) if self.target.dtype == "float32" else _sum
            operations = self._vectors(space.names, total) | self._products(total) | self._matrices() | self._halves()
            space.take(name, operations[name])

    def _vectors(self, names: Any, total: Operation) -> dict[str, Operation]:
        """Operations that return a vector, a multiplier or a number, each entry by itself."""
        d, m, measured = range(self.d), range(self.m), self.measured
        modulus = names.get("modulus", abs) if self.target.directions else abs

        def combined(w: Any, x: Any, y: Any) -> Any:
            return tuple([w * a + b for a, b in zip(x, y, strict=True)])

        def scaled(w: Any, x: Any) -> Any:
            return tuple([w * a for a in x])

        return {
            **dict.fromkeys(("axpy", "axpy_m"), combined),
            **dict.fromkeys(("scale", "scale_m"), scaled),
            "zero_m": lambda q: tuple([0.0 * q[0] for _ in m]),
            "dot": lambda x, y: total(x[i] * y[i] for i in d),
            "dot_moduli": lambda x, y: total(abs(x[i] * y[i]) for i in d),
            "exceeding": lambda y, bound: total(names["exceeds"](y[a], bound[a]) for a in m),
            "norm": lambda x: total(modulus(x[i]) if i < measured else 0.0 * modulus(x[i]) for i in d),
            "norm_m": lambda x: total(modulus(x[i]) for i in m),
        }

    def _products(self, total: Operation) -> dict[str, Operation]:
        """Products of matrices and vectors."""
        d, m = range(self.d), range(self.m)
        columns = [[i for i in d if row[i]] for row in self.structure]
        rows = [[a for a in m if self.structure[a][i]] for i in d]
        light = [[[j for j in columns[a] if self.inverse_mass[j][i]] for i in d] for a in m]
        return {
            "mul": lambda X, v: tuple([total(X[a][i] * v[i] for i in columns[a]) for a in m]),
            "mul_moduli": lambda X, x, least: tuple([total(abs(X[a][i]) * (abs(x[i]) + least) for i in columns[a]) for a in m]),
            "mul_full": lambda X, v: tuple([total(X[a][i] * v[i] for i in d) for a in m]),
            "mul_T": lambda X, y: tuple([total(X[a][i] * y[a] for a in rows[i]) for i in d]),
            "mul_full_T": lambda X, y: tuple([total(X[a][i] * y[a] for a in m) for i in d]),
            "apply": lambda S, x: tuple([total(S[i][j] * x[j] for j in d) for i in d]),
            "gram": lambda X, Y: _matrix(lambda a, b: total(X[a][i] * Y[b][i] for i in columns[a]), m, m),
            "gram_full": lambda X, Y: _matrix(lambda a, b: total(X[a][i] * Y[b][i] for i in d), m, m),
            "jacobian_times": lambda X, S: _matrix(lambda a, i: total(X[a][j] * S[j][i] for j in light[a][i]), m, d),
            "apply_md": lambda S, X: _matrix(lambda a, i: total(S[i][j] * X[a][j] for j in d), m, d),
            "product": lambda X, Y: _matrix(lambda i, j: total(X[i][k] * Y[k][j] for k in d), d, d),
            "product_T": lambda X, Y: _matrix(lambda i, j: total(X[a][i] * Y[a][j] for a in m), d, d),
        }

    def _matrices(self) -> dict[str, Operation]:
        """Operations on matrices, each entry by itself."""
        d, m = range(self.d), range(self.m)

        def scaled(left: range, right: range) -> Operation:
            return lambda w, X: _matrix(lambda i, j: w * X[i][j], left, right)

        return {
            "scale_mm": scaled(m, m),
            "scale_dd": scaled(d, d),
            "scale_md": scaled(m, d),
            "plus_mm": lambda X, Y: _matrix(lambda a, b: X[a][b] + Y[a][b], m, m),
            "minus_md": lambda X, Y: _matrix(lambda a, i: X[a][i] - Y[a][i], m, d),
            "outer_md": lambda y, x, X: _matrix(lambda a, i: y[a] * x[i] + X[a][i], m, d),
            "axpy_dd": lambda w, X, Y: _matrix(lambda i, j: w * X[i][j] + Y[i][j], d, d),
            "identity_plus": lambda w, X: _matrix(lambda i, j: 1.0 + w * X[i][j] if i == j else w * X[i][j], d, d),
            "identity_minus": lambda w, X: _matrix(lambda a, b: 1.0 - w * X[a][b] if a == b else -w * X[a][b], m, m),
            "identity_d": lambda q: _matrix(lambda i, j: float(i == j) + 0.0 * q[0], d, d),
            "transpose": lambda X: _matrix(lambda i, j: X[j][i], d, d),
        }

    def _halves(self) -> dict[str, Operation]:
        """Operations on the halves u and v of a Poisson system's state (u, v, c)."""
        m = self.m
        return {
            "first_half": lambda y: tuple([y[a] for a in range(m)]),
            "second_half": lambda y: tuple([y[m + a] for a in range(m)]),
            "joined": lambda u, v, y: (*u, *v, *(y[i] for i in range(2 * m, self.d))),
        }


def _sum(terms: Any, none: Any = 0.0) -> Any:
    """Return a sum from the first term on; if there is none, zero."""
    first, *others = [*terms] or [none]
    for term in others:
        first = first + term
    return first


def _matrix(entry: Callable[[int, int], Any], left: range, right: range) -> tuple[tuple[Any, ...], ...]:
    return tuple([tuple([entry(i, j) for j in right]) for i in left])
