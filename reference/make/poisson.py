"""Mathematics of a Poisson system for certification: y' = B(y) grad H(y), other coordinates, energy and Casimir functions."""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from daebench.compiler.definition import source_in
from daebench.methods.catalogue import find_problem
from daebench.methods.solvers.taylor_equations import Equations, hamiltonian, own_coordinates
from daebench.reference.keep.definition import Definition
from daebench.reference.make.coordinates import Own
from daebench.reference.make.stages import Rows, Vector
from daebench.runs.ivp import Array
from daebench.runs.make_ivp import make_ivp


def compiled(definition: Definition, arguments: Sequence[sp.Symbol], expressions: Sequence[Any]) -> Callable[..., Vector]:
    """Return expressions, with the parameters' values inserted, as a function of mpmath numbers that returns a list."""
    return sp.lambdify(list(arguments), definition.settled(expressions), modules="mpmath")  # type: ignore[no-any-return]


class Canonical:
    """The problem's canonical coordinates z = (Q, P, C), HLW Corollary 3.6: Q' = K_P, P' = -K_Q, C' = 0, with K(z) = H(y(z))."""

    name = "canonical coordinates"

    def __init__(self, definition: Definition) -> None:
        self.definition, self.map = definition, definition.problem.darboux
        self.z = [*self.map.q, *self.map.p, *self.map.c]

    @cached_property
    def equations(self) -> Equations:
        """Variables Q, P, C and their rates."""
        system, m = self.definition.problem, len(self.map.q)
        K = system.H.subs(dict(zip(system.y, self.map.y, strict=True)), simultaneous=True)
        B = sp.zeros(len(self.z), len(self.z))
        B[:m, m : 2 * m], B[m : 2 * m, :m] = sp.eye(m), -sp.eye(m)
        return hamiltonian(self.definition, self.z, B, K)

    def entered(self, x: Vector) -> Vector:
        """Return z of a state."""
        return compiled(self.definition, self.definition.problem.y, [*self.map.Q, *self.map.P, *self.map.C])(*x)

    def left(self, rows: Rows) -> Rows:
        """Return y of rows of z."""
        back = compiled(self.definition, self.z, self.map.y)
        return [back(*row) for row in rows]


class Lifted:
    """The constrained system that is mapped to a Poisson system: its index-reduced equation, HLW (1.18), and the map of its states to y."""

    def __init__(self, definition: Definition) -> None:
        self.definition, self.lift = definition, definition.problem.lift

    @property
    def name(self) -> str:
        """The name of the constrained problem."""
        return f"the constrained problem {self.lift.problem}"

    @cached_property
    def equations(self) -> Equations:
        """Variables q and p and their rates."""
        source = source_in(find_problem(self.lift.problem), {})
        case, ivp = next(iter(source.facts.CASES)), self.definition.ivp
        parameters = {name: value for name, value in ivp.parameters.items() if name in source.facts.PARAMETERS}
        return own_coordinates(Definition(make_ivp(source, case, parameters), {}))

    def entered(self, x: Vector) -> Vector:
        """Return a state q and p that is mapped to y."""
        return compiled(self.definition, self.definition.problem.y, [*self.lift.q, *self.lift.p])(*x)

    def left(self, rows: Rows) -> Rows:
        """Return y of rows of q and p."""
        values, d = self.definition.values(), len(self.lift.q)
        return [list(self.lift.y(row[d:], row[:d], values)) for row in rows]


class Skewed:
    """The coordinates z = A y, where A is 1 on the diagonal and 1/2 beside it: z' = A B A^T grad K(z), with K(z) = H(A^-1 z)."""

    name = "skewed coordinates z = A y"

    def __init__(self, definition: Definition) -> None:
        self.definition, n = definition, definition.problem.n
        self.z = sp.symbols(f"z1:{n + 1}", cls=sp.Dummy, real=True)
        self.A = sp.Matrix(n, n, lambda i, j: sp.Rational(1, 2) ** (j - i) if j - i in (0, 1) else 0)

    @cached_property
    def equations(self) -> Equations:
        """Variables z and their rates."""
        system = self.definition.problem
        at = dict(zip(system.y, self.A.inv() * sp.Matrix(self.z), strict=True))
        B = (self.A * sp.Matrix(system.B) * self.A.T).subs(at, simultaneous=True)
        return hamiltonian(self.definition, self.z, B, system.H.subs(at, simultaneous=True))

    def entered(self, x: Vector) -> Vector:
        """Return z of a state."""
        return compiled(self.definition, self.definition.problem.y, list(self.A * sp.Matrix(self.definition.problem.y)))(*x)

    def left(self, rows: Rows) -> Rows:
        """Return y of rows of z."""
        back = compiled(self.definition, self.z, list(self.A.inv() * sp.Matrix(self.z)))
        return [back(*row) for row in rows]


class Poisson:
    """See :class:`daebench.reference.make.mathematics.Mathematics`; a state is y."""

    series = "Taylor series of y' = B(y) grad H(y) in quadruple precision"
    zero: tuple[str, ...] = ()
    regular = ""
    crosses = False
    perturbations = "in all directions, whether they keep Casimir functions or not"

    def __init__(self, definition: Definition) -> None:
        self.definition, system = definition, definition.problem
        functions = {"energy": system.H, **system.casimirs, **system.integrals}
        self._conserved, self._names = compiled(definition, system.y, list(functions.values())), list(functions)

    @property
    def closed_form(self) -> bool:
        """Whether the motion has a closed form."""
        return self.definition.problem.closed_form is not None

    @cached_property
    def first(self) -> Own:
        """The equations in y of the problem itself."""
        system = self.definition.problem
        return Own(hamiltonian(self.definition, list(system.y), sp.Matrix(system.B), system.H))

    @cached_property
    def other(self) -> Canonical | Lifted | Skewed:
        """Canonical coordinates if the problem declares them, else the constrained system that is mapped to it, else skewed ones."""
        system = self.definition.problem
        if system.darboux is not None:
            return Canonical(self.definition)
        return Skewed(self.definition) if system.lift is None else Lifted(self.definition)

    @cached_property
    def directions(self) -> Array:
        """All directions, because rounding does not preserve Casimir functions; shape(n, n)."""
        return np.eye(self.definition.problem.n)

    def exact(self, times: Sequence[Any]) -> Rows:
        """Return the closed form at times, the first 0."""
        form, (y0,), values = self.definition.problem.closed_form, self.definition.start_numbers(), self.definition.values()
        return [y0, *(list(form(t, y0, values)) for t in times[1:])]

    def parts(self, x: Vector) -> dict[str, Vector]:
        """Return y."""
        return {"y": x}

    def conserved(self, x: Vector) -> dict[str, Vector]:
        """Return energy, Casimir functions and first integrals."""
        return {name: [value] for name, value in zip(self._names, self._conserved(*x), strict=True)}

    def smallest_singular_value(self, x: Vector) -> float:
        """Raise, because there is no rank to lose."""
        raise NotImplementedError
