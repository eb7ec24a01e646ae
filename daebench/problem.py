"""A problem as the book writes it: SymPy expressions and numbers, and nothing about how it is solved."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import sympy as sp

from daebench.errors import InvalidProblem

Exact = Any
"""An exact number or expression: int, str as in "9.81", or a SymPy expression in the problem's parameters."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """Named initial values, with the parameter values that belong to them.

    Parameters
    ----------
    q, p : sequence of exact expressions, shape(d,)
        Initial positions and momenta; they may contain the problem's parameters.
    parameters : mapping of str to number
        Values that replace the problem's defaults in this case.
    about : str
        Where the case comes from and what it shows, in one line.
    """

    q: Sequence[Exact]
    p: Sequence[Exact]
    parameters: Mapping[str, float] = field(default_factory=dict)
    about: str = ""


@dataclass(frozen=True, kw_only=True)
class ConstrainedHamiltonian:
    """A holonomically constrained Hamiltonian system, HLW (1.9).

    ::

        q' = H_p(p, q)      p' = -H_q(p, q) - G(q)^T lam      0 = g(q)      G = g_q

    Parameters
    ----------
    q, p : sequence of Symbol, shape(d,)
        Positions and momenta.
    g : sequence of Expr, shape(m,), m < d
        Constraints, functions of q.
    H : Expr, optional
        Hamiltonian H(p, q); or else give M and U.
    M : Matrix, shape(d, d), optional
        Symmetric mass matrix, constant or depending on q, for H = 1/2 p^T M^-1 p + U(q). It is never inverted symbolically
        unless it is diagonal.
    U : Expr, optional
        Potential energy U(q), given together with M.
    parameters : mapping of Symbol to number
        The run-time parameters with their present values.
    cases : mapping of str to Case
        Named initial values.
    integrals : mapping of str to Expr
        First integrals besides H, functions of p and q.
    closed_form : callable, optional
        ``closed_form(t, q0, p0, parameters) -> (q, p)`` with mpmath numbers, at mpmath's working precision.

    Raises
    ------
    InvalidProblem
        If sizes do not fit, an expression has an undeclared symbol, a symbol is used twice, or H and (M, U) are both given or both missing.
    """

    q: Sequence[sp.Symbol]
    p: Sequence[sp.Symbol]
    g: Sequence[sp.Expr]
    H: sp.Expr | None = None
    M: sp.Matrix | None = None
    U: sp.Expr | None = None
    parameters: Mapping[sp.Symbol, float] = field(default_factory=dict)
    cases: Mapping[str, Case] = field(default_factory=dict)
    integrals: Mapping[str, sp.Expr] = field(default_factory=dict)
    closed_form: Callable[..., tuple[list[Any], list[Any]]] | None = None

    def __post_init__(self) -> None:
        self._check_sizes()
        self._check_symbols()

    @property
    def d(self) -> int:
        """Number of positions."""
        return len(self.q)

    @property
    def m(self) -> int:
        """Number of constraints."""
        return len(self.g)

    @cached_property
    def fingerprint(self) -> str:
        """Exact text of everything that decides the mathematics, the values of parameters apart, for content hashes."""
        parts = [self.q, self.p, self.g, self.H, self.M, self.U, list(self.parameters), list(self.integrals.values())]
        cases = [(name, case.q, case.p, dict(case.parameters), case.about) for name, case in self.cases.items()]
        return repr([sp.srepr(sp.sympify(part)) for part in parts]) + repr((list(self.integrals), cases))

    def _check_sizes(self) -> None:
        if (self.H is None) == (self.M is None) or (self.M is None) != (self.U is None):
            raise InvalidProblem("a problem gives either H(p, q), or M and U together.")
        if len(self.p) != self.d:
            raise InvalidProblem(f"{self.d} positions but {len(self.p)} momenta; give one momentum for each position.")
        if not 0 < self.m < self.d:
            raise InvalidProblem(f"{self.m} constraints on {self.d} positions; there must be at least one and fewer than positions.")
        if self.M is not None and self.M.shape != (self.d, self.d):
            raise InvalidProblem(f"the mass matrix M has shape {self.M.shape}, but there are {self.d} positions.")
        if self.M is not None and sp.simplify(self.M - self.M.T) != sp.zeros(self.d, self.d):
            raise InvalidProblem("the mass matrix M is not symmetric.")
        for name, case in self.cases.items():
            if len(case.q) != self.d or len(case.p) != self.d:
                raise InvalidProblem(f"case {name!r} has {len(case.q)} positions and {len(case.p)} momenta; both must be {self.d}.")

    def _check_symbols(self) -> None:
        own = [*self.q, *self.p, *self.parameters]
        if twice := {str(symbol) for symbol in own if own.count(symbol) > 1}:
            raise InvalidProblem(f"{', '.join(sorted(twice))} stands for more than one position, momentum or parameter; rename one.")
        positions, state, known = set(self.q), {*self.q, *self.p}, set(self.parameters)
        allowed: list[tuple[str, Any, set[sp.Symbol]]] = [("g", sp.Matrix(list(self.g)), positions), ("H", self.H, state)]
        allowed += [("M", self.M, positions), ("U", self.U, positions)]
        allowed += [(f"integral {name}", expression, state) for name, expression in self.integrals.items()]
        allowed += [(f"case {name}", sp.Matrix([*case.q, *case.p]), set()) for name, case in self.cases.items()]
        for where, expression, symbols in allowed:
            extra = set() if expression is None else sp.sympify(expression).free_symbols - symbols - known
            if extra:
                raise InvalidProblem(f"{where} contains {', '.join(sorted(map(str, extra)))}, which it may not depend on; declare it.")
        names = {str(symbol) for symbol in known}
        for name, case in self.cases.items():
            if foreign := {key for key, value in case.parameters.items() if key not in names and not isinstance(value, int)}:
                raise InvalidProblem(f"case {name!r} sets {', '.join(sorted(foreign))}, which is no parameter of the problem.")


def coordinates(d: int) -> tuple[tuple[sp.Symbol, ...], tuple[sp.Symbol, ...]]:
    """Return symbols (q1, ..., qd) and (p1, ..., pd)."""
    return sp.symbols(f"q1:{d + 1}", real=True), sp.symbols(f"p1:{d + 1}", real=True)
