"""Mathematics of a Poisson system for certification: y' = B(y) grad H(y), other coordinates, energy and Casimir functions."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
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


@dataclass(frozen=True)
class Mapped:
    """Coordinates of a Poisson system, with the map into them, and its inverse where that is one of expressions in them."""

    name: str
    definition: Definition
    equations: Equations
    """Variables and their rates."""
    forward: Sequence[Any]
    """The coordinates as expressions in y."""
    back: Callable[[Vector], Vector]
    """From the coordinates to y."""

    def entered(self, x: Vector) -> Vector:
        """Return the coordinates of a state."""
        return compiled(self.definition, self.definition.problem.y, self.forward)(*x)

    def left(self, rows: Rows) -> Rows:
        """Return y of rows of the coordinates."""
        return list(map(self.back, rows))


def transformed(
    definition: Definition, name: str, z: Sequence[sp.Symbol], B: sp.Matrix, y: Sequence[Any], forward: Sequence[Any]
) -> Mapped:
    """Return coordinates z, in which z' = B grad K with K(z) = H(y(z)); B and y are expressions in z, and ``forward`` is z(y)."""
    system, back = definition.problem, compiled(definition, z, y)
    K = system.H.subs(dict(zip(system.y, y, strict=True)), simultaneous=True)
    return Mapped(name, definition, hamiltonian(definition, z, B, K), forward, lambda row: back(*row))


def canonical(definition: Definition) -> Mapped:
    """Return the problem's canonical coordinates z = (Q, P, C), HLW Corollary 3.6: Q' = K_P, P' = -K_Q, C' = 0, with K(z) = H(y(z))."""
    chart = definition.problem.darboux
    z, m = [*chart.q, *chart.p, *chart.c], len(chart.q)
    B = sp.zeros(len(z), len(z))
    B[:m, m : 2 * m], B[m : 2 * m, :m] = sp.eye(m), -sp.eye(m)
    return transformed(definition, "canonical coordinates", z, B, chart.y, [*chart.Q, *chart.P, *chart.C])


def skewed(definition: Definition) -> Mapped:
    """Return z = A y, where A is 1 on the diagonal and 1/2 beside it: z' = A B A^T grad K(z), with K(z) = H(A^-1 z)."""
    system, n = definition.problem, definition.problem.n
    z = sp.symbols(f"z1:{n + 1}", cls=sp.Dummy, real=True)
    A = sp.Matrix(n, n, lambda i, j: sp.Rational(1, 2) ** (j - i) if j - i in (0, 1) else 0)
    y = list(A.inv() * sp.Matrix(z))
    B = (A * sp.Matrix(system.B) * A.T).subs(dict(zip(system.y, y, strict=True)), simultaneous=True)
    return transformed(definition, "skewed coordinates z = A y", z, B, y, list(A * sp.Matrix(system.y)))


def lifted(definition: Definition) -> Mapped:
    """Return the constrained system that is mapped to a Poisson system: its index-reduced equation, HLW (1.18), and the map to y."""
    lift, ivp, d = definition.problem.lift, definition.ivp, len(definition.problem.lift.q)
    source = source_in(find_problem(lift.problem), {})
    parameters = {name: value for name, value in ivp.parameters.items() if name in source.facts.PARAMETERS}
    equations = own_coordinates(Definition(make_ivp(source, next(iter(source.facts.CASES)), parameters), {}))

    def back(row: Vector) -> Vector:
        return list(lift.y(row[d:], row[:d], definition.values()))

    return Mapped(f"the constrained problem {lift.problem}", definition, equations, [*lift.q, *lift.p], back)


class Poisson:
    """A Poisson system, with the members of :class:`daebench.reference.make.constrained.Constrained`; a state is y."""

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
    def other(self) -> Mapped:
        """Canonical coordinates if the problem declares them, else the constrained system that is mapped to it, else skewed ones."""
        system = self.definition.problem
        make = canonical if system.darboux is not None else skewed if system.lift is None else lifted
        return make(self.definition)

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
