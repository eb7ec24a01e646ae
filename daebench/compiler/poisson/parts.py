"""Common parts of Poisson systems and lattices: H, whole or split into parts with known flows, and the other integrals."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, Self

import sympy as sp

from daebench.compiler.domain import may_be_left_unseen
from daebench.compiler.facts import Derived
from daebench.compiler.monitored import Monitored, State, of_poisson
from daebench.compiler.python_text import function
from daebench.compiler.work import POISSON_WORK


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
