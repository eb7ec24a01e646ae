"""All quantities derived from the definition of a Poisson system, each computed when it is first asked for and then stored."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, Self

import sympy as sp

from daebench.compiler.derived import Derived, Rules
from daebench.compiler.facts import POISSON_WORK
from daebench.compiler.linear.algebras import Values
from daebench.compiler.linear.elimination import Target
from daebench.compiler.monitored import Monitored, State, may_be_left_unseen, of_poisson
from daebench.compiler.syntax import function
from daebench.systems.poisson import PoissonCase, PoissonSystem


def _cost(kind: str, times: int = 1) -> list[int]:
    return [times * (counted == kind) for counted in POISSON_WORK]


class InParts(Derived):
    """Quantities derived from the definition of a Poisson system or of a Poisson lattice."""

    states = "poisson"
    work = POISSON_WORK
    arrays = False
    """Whether states are arrays."""

    def __init__(self, definition: Any, splitting: str, energy: sp.Expr, variables: Sequence[sp.Symbol]) -> None:
        self.definition, self.energy, self.variables = definition, sp.sympify(energy), list(variables)
        self.n = int(definition.n)
        self.parameters = list(definition.parameters)
        order = definition.splittings[splitting or next(iter(definition.splittings))] if definition.splittings else ()
        self.parts = [definition.parts[name] for name in order]

    def split(self, splitting: str) -> Self:
        """Return the derivation with this splitting."""
        return type(self)(self.definition, splitting)  # type: ignore[call-arg]

    @property
    def costs(self) -> Mapping[str, list[int]]:
        """Work of one call of each function."""
        others = _cost("flow", max(0, len(self.parts) - 1))
        costs = {"before": others, "after": others, "turn": _cost("flow"), "field": _cost("field")}
        costs |= dict.fromkeys(("rate_u", "rate_v"), _cost("half"))
        return costs | dict.fromkeys(("field_y", "rate_u_u", "rate_v_v"), _cost("second"))

    def of_degree(self, most: int) -> tuple[str, ...]:
        """Return the names of the first integrals that are polynomials of at most this degree, "energy" for H."""
        y, functions = self.variables, {"energy": self.energy, **self.definition.casimirs, **self.definition.integrals}
        polynomials = {name: sp.Poly(F, *y) for name, F in functions.items() if sp.sympify(F).is_polynomial(*y)}
        return tuple(name for name, F in polynomials.items() if F.total_degree() <= most)

    def facts(self) -> dict[str, Any]:
        """Return the facts of the system.

        They are N (size), CASIMIRS and INTEGRALS (names), DOMAIN (sources of what stays positive), CONSTANT and BILINEAR (classes of B, see
        :data:`daebench.schemes.kernels.claims.CLASSES`), HALVES, SPLITTINGS (names), LINEAR and QUADRATIC (names of integrals),
        CLOSED_FORM, DARBOUX, LIFT (name of the problem above, or ""), and SITES (of a lattice, or 0).
        """
        definition = self.definition
        return {
            "N": self.n,
            "CASIMIRS": tuple(definition.casimirs),
            "INTEGRALS": tuple(definition.integrals),
            "SPLITTINGS": {name: tuple(parts) for name, parts in definition.splittings.items()},
            "LINEAR": self.of_degree(1),
            "QUADRATIC": self.of_degree(2),
            "DARBOUX": definition.darboux is not None,
        }

    def monitored(self, names: Sequence[str], kinds: int, stage_multipliers: int) -> Monitored:
        """Return the functions that the loop calls besides the step."""
        guarded = may_be_left_unseen([self.energy], self.variables, getattr(self.definition, "domain", ()))
        quantities = of_poisson(len(self.definition.casimirs), len(self.definition.integrals))
        return Monitored(quantities, State((("x", self.n),), arrays=self.arrays), names, kinds, guarded=guarded)

    def needs(self, name: str) -> Sequence[str]:
        """Return the names of the system's other functions that this one calls."""
        *others, last = [f"part_{i}" for i in range(len(self.parts))] or [""]
        return {"turn": [last], "before": others, "after": others}.get(name, [])

    def source(self, name: str) -> str | None:
        """Return the source of the system's function of this name, or None if it has none."""
        if name in ("before", "turn", "after") and self.parts:
            calls = [f"y = {part}(y, time, par)" for part in self.needs(name)]
            return function(f"{name}(y, time, par)", *(reversed(calls) if name == "after" else calls), "return y")
        return self._flow(name, self.parts[int(name[5:])]) if name.startswith("part_") else self._expression(name)

    @abstractmethod
    def _flow(self, name: str, part: Any) -> str:
        """Return the source of name(y, time, par), the flow of a part of H."""

    @abstractmethod
    def _expression(self, name: str) -> str | None:
        """Return the source of a function that is not a flow."""


class PoissonDerivation(InParts):
    """The expressions of one Poisson system, under the textbook's names; ``splitting`` is as in the base class."""

    def __init__(self, system: PoissonSystem, splitting: str = "") -> None:
        super().__init__(system, splitting, system.H, system.y)
        self.problem, self.y = system, sp.Matrix(list(system.y))

    @property
    def m(self) -> int:
        """Number of coordinates in each half of the state."""
        return self.n // 2

    @cached_property
    def B(self) -> sp.Matrix:
        """Structure matrix B(y), shape(n, n)."""
        return sp.Matrix(self.problem.B)

    @cached_property
    def H(self) -> sp.Expr:
        """Hamiltonian H(y)."""
        return sp.sympify(self.problem.H)

    @cached_property
    def H_y(self) -> sp.Matrix:
        """Gradient of H, shape(n,)."""
        return sp.Matrix([self.H]).jacobian(self.y).T

    @cached_property
    def field(self) -> sp.Matrix:
        """Right side B grad H, shape(n,), expanded if this cancels a denominator of H_y."""
        return (self.B * self.H_y).applyfunc(_shorter)

    @cached_property
    def C_y(self) -> sp.Matrix:
        """Derivative of the Casimir functions, shape(k, n)."""
        return sp.Matrix(list(self.problem.casimirs.values())).jacobian(self.y) if self.problem.casimirs else sp.zeros(0, self.n)

    @cached_property
    def constant(self) -> bool:
        """Whether B does not depend on y."""
        return not self.B.free_symbols & set(self.y)

    @cached_property
    def bilinear(self) -> bool:
        """Whether B and H have the form of HLW Example 4.7, for any number of pairs.

        B has one diagonal block d_k(u_k, v_k). Either each d_k is linear in u_k and in v_k, and H is a sum of functions of one u_k or v_k.
        Or the block is constant and H is arbitrary.
        """
        m = self.m
        u, v = list(self.y[:m]), list(self.y[m : 2 * m])
        block = self.B[:m, m : 2 * m]
        rest = self.B.copy()
        rest[:m, m : 2 * m], rest[m : 2 * m, :m] = sp.zeros(m, m), sp.zeros(m, m)
        if not m or not rest.is_zero_matrix or not block.is_diagonal():
            return False
        if not block.free_symbols & set(self.y):
            return True
        second = sp.hessian(self.H, [*u, *v]).applyfunc(sp.simplify)
        return bool(second.is_diagonal()) and all(self._linear_in_each(block[k, k], u[k], v[k]) for k in range(m))

    def _linear_in_each(self, d: sp.Expr, u: sp.Symbol, v: sp.Symbol) -> bool:
        """Whether d is a function of u and v alone, linear in each."""
        local = d.free_symbols & set(self.y) <= {u, v}
        return bool(local and sp.expand(d.diff(u, 2)) == 0 and sp.expand(d.diff(v, 2)) == 0)

    @cached_property
    def constants(self) -> dict[str, bool | int]:
        """Constants of ``kernels/language.py`` and ``kernels/poisson_language.py`` that are known from the system."""
        return {"DENSE": True, "BOUNDED": bool(self.problem.domain), "CONSTRAINTS": self.m}

    def facts(self) -> dict[str, Any]:
        """Return the facts of the system, see :meth:`daebench.compiler.poisson.derivation.InParts.facts`."""
        system = self.problem
        return super().facts() | {
            "DOMAIN": tuple(map(str, system.domain)),
            "CONSTANT": self.constant,
            "BILINEAR": self.bilinear,
            "HALVES": self.n % 2 == 0,
            "CLOSED_FORM": system.closed_form is not None,
            "SITES": 0,
            "LIFT": system.lift.problem if system.lift else "",
        }

    def initial(self, name: str, case: PoissonCase) -> str:
        """Return the source of name(par), which returns the initial y."""
        return self.text(name, {}, case.y)

    def algebra(self, target: Target) -> Values:
        """Return the algebra of its vectors, whose multipliers are halves of states."""
        n, m = self.n, max(1, self.m)
        return Values(n, m, [[True] * n] * m, [[True] * n] * n, target)

    def _flow(self, name: str, part: Any) -> str:
        return self.text(name, {"y": self.problem.y, "time": [part.t]}, list(part.y))

    def _expression(self, name: str) -> str | None:
        if name == "inside":
            margins = self.text("margins", {"y": self.problem.y}, list(self.problem.domain))
            tests = " and ".join(f"margin[{i}].real > 0.0" for i in range(len(self.problem.domain)))
            return margins + function("inside(y, par)", "margin = margins(y, par)", f"return {tests}")
        return Derived.source(self, name)

    @property
    def named(self) -> Mapping[str, tuple[str, str]]:
        """Functions that are attributes: names of their arguments, and letters of their shapes."""
        return {"H": ("y", ""), "H_y": ("y", "n"), "field": ("y", "n"), "B": ("y", "nn"), "field_y": ("y", "nn"), "C_y": ("y", "kn")}

    @property
    def sizes(self) -> Mapping[str, int]:
        """Sizes by the letters of shapes."""
        return {"n": self.n, "k": len(self.problem.casimirs)}

    @cached_property
    def field_y(self) -> sp.Matrix:
        """Derivative of the right side, shape(n, n)."""
        return self.field.jacobian(self.y)

    @cached_property
    def _rules(self) -> Rules:
        y = {"y": list(self.y)}
        m, system = self.m, self.problem
        u, v = self.y[:m], self.y[m : 2 * m]
        return {
            "casimirs": lambda: (y, list(system.casimirs.values()), (len(system.casimirs),)),
            "integrals": lambda: (y, list(system.integrals.values()), (len(system.integrals),)),
            "rate_u": lambda: (y, self.field[:m], (m,)),
            "rate_v": lambda: (y, self.field[m : 2 * m], (m,)),
            "rate_u_u": lambda: (y, sp.Matrix(self.field[:m]).jacobian(u), (m, m)),
            "rate_v_v": lambda: (y, sp.Matrix(self.field[m : 2 * m]).jacobian(v), (m, m)),
        }


def _shorter(expression: sp.Expr) -> sp.Expr:
    """Return an expression in expanded form, unless that is longer."""
    expanded = sp.expand(expression)
    return expanded if sp.count_ops(expanded) <= sp.count_ops(expression) else expression


class DarbouxDerivation(PoissonDerivation):
    """The expressions of a Poisson system in its canonical coordinates z = (q, p, c), HLW Corollary 3.6: z' = B0 grad K(z).

    The monitored quantities and the domain are functions of the system's own y, which the loop gets from ``chart``.
    """

    def __init__(self, derivation: PoissonDerivation) -> None:
        assert derivation.problem.darboux is not None
        super().__init__(derivation.problem)
        self.original, self.map, self.parts = derivation, derivation.problem.darboux, []
        self.y = sp.Matrix([*self.map.q, *self.map.p, *self.map.c])

    @property
    def m(self) -> int:
        """Number of entries of q, and of p."""
        return len(self.map.q)

    @cached_property
    def B(self) -> sp.Matrix:
        """Canonical structure matrix B0, shape(n, n)."""
        matrix = sp.zeros(self.n, self.n)
        for k in range(self.m):
            matrix[k, self.m + k], matrix[self.m + k, k] = sp.Integer(1), sp.Integer(-1)
        return matrix

    @cached_property
    def H(self) -> sp.Expr:
        """Hamiltonian K(z) = H(y(z))."""
        return sp.expand(self.original.H.subs(dict(zip(self.original.y, self.map.y, strict=True)), simultaneous=True))

    def source(self, name: str) -> str | None:
        """Return the source of the function of this name, or None if it is not an expression of this system."""
        if name in ("H", "casimirs", "integrals", "inside"):
            return self.original.source(name)
        if name == "chart":
            return self.text(name, {"y": self.y}, list(self.map.y))
        if name == "canonical":
            return self.text(name, {"y": self.original.y}, [*self.map.Q, *self.map.P, *self.map.C])
        return super().source(name)
