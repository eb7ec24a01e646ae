"""Everything that follows from the definition of a Poisson system, derived when first asked for and then kept."""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import sympy as sp

from daebench.compiler import codegen
from daebench.compiler.domain import may_be_left_unseen
from daebench.compiler.linear.tuples import Values
from daebench.compiler.monitored import Monitored, State, of_poisson
from daebench.compiler.work import POISSON_WORK
from daebench.systems.poisson import PoissonCase, PoissonSystem

Rule = tuple[Sequence[sp.Symbol], Sequence[sp.Expr], tuple[int, ...]]


def _cost(kind: str, times: int = 1) -> list[int]:
    return [times * (each == kind) for each in POISSON_WORK]


def work_of_parts(count: int) -> dict[str, list[int]]:
    """Return the work of one call of each function of a system whose H has so many parts."""
    others = _cost("flow", max(0, count - 1))
    own = {"before": others, "after": others, "turn": _cost("flow"), "field": _cost("field")}
    own |= dict.fromkeys(("rate_u", "rate_v"), _cost("half"))
    return own | dict.fromkeys(("field_y", "rate_u_u", "rate_v_v"), _cost("second"))


class PoissonDerivation:
    """The expressions of one Poisson system, by the textbook's names.

    Parameters
    ----------
    system : PoissonSystem
        The system.
    splitting : str
        Name of the splitting whose flows the functions ``before``, ``turn`` and ``after`` are; "" for the first.
    """

    states = "poisson"
    work = POISSON_WORK

    def __init__(self, system: PoissonSystem, splitting: str = "") -> None:
        self.definition, self.problem, self.n = system, system, system.n
        self.y = sp.Matrix(list(system.y))
        self.parameters = list(system.parameters)
        self.parts = (
            [system.parts[name] for name in system.splittings[splitting or next(iter(system.splittings))]] if system.splittings else []
        )

    def split(self, splitting: str) -> "PoissonDerivation":
        """Return the same with this splitting."""
        return PoissonDerivation(self.problem, splitting)

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
        """Right side B grad H, shape(n,), expanded where that cancels what H_y divides by."""
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
        """Whether B and H have the form of HLW Example 4.7, in as many pairs as there are.

        B has one diagonal block d_k(u_k, v_k), linear in each, and H is a sum of functions of one u_k or v_k; or it is whatever H where the
        block is constant.
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
        own = d.free_symbols & set(self.y) <= {u, v}
        return bool(own and sp.expand(d.diff(u, 2)) == 0 and sp.expand(d.diff(v, 2)) == 0)

    @cached_property
    def halves(self) -> bool:
        """Whether the state is two halves of equal length."""
        return self.n % 2 == 0

    @cached_property
    def quadratic(self) -> tuple[str, ...]:
        """Names of the first integrals that are polynomials of degree two at most, "energy" for H."""
        functions = {"energy": self.H, **self.problem.casimirs, **self.problem.integrals}
        return tuple(name for name, F in functions.items() if self._degree(F) <= 2)

    @cached_property
    def linear(self) -> tuple[str, ...]:
        """Names of those that are of degree one at most."""
        functions = {"energy": self.H, **self.problem.casimirs, **self.problem.integrals}
        return tuple(name for name, F in functions.items() if self._degree(F) <= 1)

    def _degree(self, F: sp.Expr) -> float:
        F = sp.sympify(F)
        return float(sp.Poly(F, *self.y).total_degree()) if F.is_polynomial(*self.y) else float("inf")

    @cached_property
    def constants(self) -> dict[str, bool | int]:
        """Constants of ``kernels/language.py`` and ``kernels/poisson_language.py`` that the system settles."""
        return {"DENSE": True, "BOUNDED": bool(self.problem.domain), "CONSTRAINTS": self.m}

    def facts(self) -> dict[str, Any]:
        """Return the facts of the system.

        They are N (size), CASIMIRS and INTEGRALS (names), DOMAIN (sources of what stays positive), CONSTANT and BILINEAR (classes of B, see
        :data:`daebench.schemes.kernels.claims.CLASSES`), HALVES, SPLITTINGS (names), LINEAR and QUADRATIC (names of integrals),
        CLOSED_FORM, DARBOUX, LIFT (name of the problem above, or ""), and SITES (of a lattice, or 0).
        """
        system = self.problem
        return {
            "N": self.n,
            "CASIMIRS": tuple(system.casimirs),
            "INTEGRALS": tuple(system.integrals),
            "DOMAIN": tuple(map(str, system.domain)),
            "CONSTANT": self.constant,
            "BILINEAR": self.bilinear,
            "HALVES": self.halves,
            "SPLITTINGS": {name: tuple(parts) for name, parts in system.splittings.items()},
            "LINEAR": self.linear,
            "QUADRATIC": self.quadratic,
            "CLOSED_FORM": system.closed_form is not None,
            "SITES": 0,
            "DARBOUX": system.darboux is not None,
            "LIFT": system.lift.problem if system.lift else "",
        }

    def initial(self, name: str, case: PoissonCase) -> str:
        """Return the source of name(par), which returns the initial y."""
        return codegen.expressions(name, {}, [sp.sympify(value) for value in case.y], (self.n,), self.parameters)

    @property
    def costs(self) -> Mapping[str, list[int]]:
        """Work of one call of each function."""
        return work_of_parts(len(self.parts))

    def algebra(self, stages: int, dtype: str) -> Values:
        """Return the algebra of its vectors, whose multipliers are halves of states."""
        n, m = self.n, max(1, self.m)
        return Values(n, m, [[True] * n] * m, [[True] * n] * n, stages=stages, dtype=dtype)

    def monitored(self, names: Sequence[str], kinds: int, stage_multipliers: int) -> Monitored:
        """Return what the loop does beside stepping."""
        guarded = may_be_left_unseen([self.problem.H], self.problem.y, self.problem.domain)
        quantities = of_poisson(len(self.problem.casimirs), len(self.problem.integrals))
        return Monitored(quantities, State((("x", self.n),)), names, kinds, guarded=guarded)

    def tracer(self, linker: Any) -> Any:
        """Return what writes its functions from loops over nodes: nothing, only a chain has that."""
        return None

    def needs(self, name: str) -> Sequence[str]:
        """Return the names of the system's other functions that this one calls."""
        last = len(self.parts) - 1
        return {"turn": [f"part_{last}"], "before": [f"part_{i}" for i in range(last)], "after": [f"part_{i}" for i in range(last)]}.get(
            name, []
        )

    def source(self, name: str) -> str | None:
        """Return the source of the system's function of this name, or None if it is no expression of this system."""
        if name in ("before", "turn", "after") and self.parts:
            calls = [f"y = {part}(y, time, par)" for part in self.needs(name)]
            return codegen.function(f"{name}(y, time, par)", *(reversed(calls) if name == "after" else calls), "return y")
        if name.startswith("part_"):
            part = self.parts[int(name[5:])]
            return codegen.expressions(name, {"y": self.problem.y, "time": [part.t]}, list(part.y), (self.n,), self.parameters)
        if name == "inside":
            margins = codegen.expressions(
                "margins", {"y": self.problem.y}, list(self.problem.domain), (len(self.problem.domain),), self.parameters
            )
            tests = " and ".join(f"margin[{i}].real > 0.0" for i in range(len(self.problem.domain)))
            return margins + codegen.function("inside(y, par)", "margin = margins(y, par)", f"return {tests}")
        rule = self._rules.get(name)
        if rule is None:
            return None
        arguments, values, shape = rule()
        return codegen.expressions(name, {"y": arguments}, list(values), shape, self.parameters)

    @cached_property
    def _rules(self) -> dict[str, Callable[[], Rule]]:
        """What each function's arguments, values and shape are; nothing is derived before it is called."""
        y, n, m, system = self.problem.y, self.n, self.m, self.problem
        u, v = self.y[:m], self.y[m : 2 * m]
        return {
            "H": lambda: (y, [self.H], ()),
            "H_y": lambda: (y, self.H_y, (n,)),
            "B": lambda: (y, self.B, (n, n)),
            "casimirs": lambda: (y, list(system.casimirs.values()), (len(system.casimirs),)),
            "C_y": lambda: (y, self.C_y, (len(system.casimirs), n)),
            "integrals": lambda: (y, list(system.integrals.values()), (len(system.integrals),)),
            "field": lambda: (y, self.field, (n,)),
            "field_y": lambda: (y, self.field.jacobian(self.y), (n, n)),
            "rate_u": lambda: (y, self.field[:m], (m,)),
            "rate_v": lambda: (y, self.field[m : 2 * m], (m,)),
            "rate_u_u": lambda: (y, sp.Matrix(self.field[:m]).jacobian(u), (m, m)),
            "rate_v_v": lambda: (y, sp.Matrix(self.field[m : 2 * m]).jacobian(v), (m, m)),
        }


def _shorter(expression: sp.Expr) -> sp.Expr:
    """Return an expression expanded, where that makes it no longer."""
    expanded = sp.expand(expression)
    return expanded if sp.count_ops(expanded) <= sp.count_ops(expression) else expression


class DarbouxDerivation(PoissonDerivation):
    """The expressions of a Poisson system in its canonical coordinates z = (q, p, c), HLW Corollary 3.6: z' = B0 grad K(z).

    What a run monitors, and the domain, are functions of the system's own y, which the loop has from ``chart``.

    Parameters
    ----------
    own : PoissonDerivation
        The system in its own coordinates, which declares canonical ones.
    """

    def __init__(self, own: PoissonDerivation) -> None:
        assert own.problem.darboux is not None
        super().__init__(own.problem)
        self.own, self.map, self.parts = own, own.problem.darboux, []
        self.y = sp.Matrix([*self.map.q, *self.map.p, *self.map.c])

    @property
    def m(self) -> int:
        """Number of q, and of p."""
        return len(self.map.q)

    @cached_property
    def B(self) -> sp.Matrix:
        """Canonical structure matrix B0, shape(n, n)."""
        found = sp.zeros(self.n, self.n)
        for k in range(self.m):
            found[k, self.m + k], found[self.m + k, k] = sp.Integer(1), sp.Integer(-1)
        return found

    @cached_property
    def H(self) -> sp.Expr:
        """Hamiltonian K(z) = H(y(z))."""
        return sp.expand(self.own.H.subs(dict(zip(self.own.y, self.map.y, strict=True)), simultaneous=True))

    def source(self, name: str) -> str | None:
        """Return the source of the function of this name, or None if it is no expression of this system."""
        if name in ("H", "casimirs", "integrals", "inside"):
            return self.own.source(name)
        z, y = self.y, self.own.y
        if name == "chart":
            return codegen.expressions(name, {"y": z}, list(self.map.y), (self.n,), self.parameters)
        if name == "canonical":
            return codegen.ARCTAN2 + codegen.expressions(
                name, {"y": y}, [*self.map.Q, *self.map.P, *self.map.C], (self.n,), self.parameters
            )
        return super().source(name)

    @cached_property
    def _rules(self) -> dict[str, Callable[[], Rule]]:
        rules = super()._rules
        z = list(self.y)
        return {name: (lambda rule=rule: (z, *rule()[1:])) for name, rule in rules.items()}  # type: ignore[misc]
