"""A Poisson system in the notation of the book: y' = B(y) grad H(y), with its known structure."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import InitVar, dataclass, field
from functools import cached_property
from typing import Any

import sympy as sp

from daebench.errors import InvalidProblem
from daebench.systems.assumptions import require_checked, require_plain
from daebench.systems.definition_parts import (
    check_cases,
    check_coordinates,
    check_distinct,
    check_functions,
    check_parameters,
    check_real,
    several,
)
from daebench.systems.exact_text import exact, mathematics, to_the_last_digit
from daebench.systems.picture import Exact, Picture
from daebench.systems.poisson_checks import check_casimirs, check_darboux, check_jacobi, check_skew, check_splitting


@dataclass(frozen=True, kw_only=True)
class PoissonCase:
    """Named initial values, with their parameter values.

    Parameters
    ----------
    y : sequence of exact expressions, shape(n,)
        Initial state; it may contain the problem's parameters.
    parameters : mapping of str to number
        Values that replace the problem's defaults in this case.
    about : str
        Source of the case and what it shows, in one line.
    """

    y: Sequence[Exact]
    parameters: Mapping[str, float] = field(default_factory=dict)
    about: str = ""


@dataclass(frozen=True, kw_only=True)
class Part:
    """One part H^[i] of a splitting of H, with the exact flow of y' = B(y) grad H^[i](y), HLW VII.4.2.

    Parameters
    ----------
    H : Expr
        The part of the Hamiltonian.
    t : Symbol
        Time over which the flow is taken.
    y : sequence of Expr, shape(n,)
        State after it, in t and the problem's y and parameters.
    """

    H: sp.Expr
    t: sp.Symbol
    y: Sequence[sp.Expr]


@dataclass(frozen=True, kw_only=True)
class DarbouxMap:
    """Canonical coordinates z = (Q, P, C) of a Poisson system, HLW (3.13), and the inverse map.

    The signs are those of the canonical bracket (2.3): {Q_i, P_j} = delta_ij, all other brackets vanish, so that Q' = K_P, P' = -K_Q.

    Parameters
    ----------
    q, p, c : sequence of Symbol
        The coordinates; as many q as p.
    Q, P, C : sequence of Expr
        The coordinates as functions of y.
    y : sequence of Expr, shape(n,)
        The state as a function of q, p, c and the problem's parameters.
    """

    q: Sequence[sp.Symbol]
    p: Sequence[sp.Symbol]
    Q: Sequence[sp.Expr]
    P: Sequence[sp.Expr]
    y: Sequence[sp.Expr]
    c: Sequence[sp.Symbol] = ()
    C: Sequence[sp.Expr] = ()


@dataclass(frozen=True, kw_only=True)
class Lift:
    """A constrained system of the catalogue whose motion is mapped to that of the Poisson system by a function of its state.

    Parameters
    ----------
    problem : str
        Name of the constrained problem; its parameters have the names of those of the Poisson system.
    q, p : sequence of Expr
        A state (q, p) on its manifold that is mapped to y, in the problem's y and parameters.
    y : callable
        ``y(p, q, parameters)`` returns the state for sequences of numbers p and q, which may be complex; it is a Poisson map.
    """

    problem: str
    q: Sequence[sp.Expr]
    p: Sequence[sp.Expr]
    y: Callable[[Sequence[Any], Sequence[Any], Mapping[str, Any]], Sequence[Any]]


@dataclass(frozen=True, kw_only=True)
class PoissonSystem:
    """A Poisson system, HLW (2.12).

    ::

        y' = B(y) grad H(y)        B skew-symmetric, with the Jacobi identity (2.10)

    Parameters
    ----------
    y : sequence of Symbol, shape(n,)
        The state.
    B : Matrix, shape(n, n)
        Structure matrix B(y), any rank.
    H : Expr
        Hamiltonian H(y).
    casimirs : mapping of str to Expr
        Casimir functions: grad C(y)^T B(y) = 0, HLW Def. 2.5.
    integrals : mapping of str to Expr
        First integrals besides H and the Casimir functions.
    domain : sequence of Expr
        Expressions in y that stay positive; a run that leaves this domain ends there.
    parameters : mapping of Symbol to number
        The run-time parameters with their present values.
    cases : mapping of str to PoissonCase
        Named initial values.
    closed_form : callable, optional
        ``closed_form(t, y0, parameters) -> y`` with mpmath numbers, at mpmath's working precision.
    parts : mapping of str to Part
        Parts of the Hamiltonian whose flows have closed forms.
    splittings : mapping of str to sequence of str
        Names of splittings, each with its parts in the order in which their flows act; the first is the default. The parts of each add
        up to H, except for a Casimir function or a constant.
    darboux : DarbouxMap, optional
        Canonical coordinates; the form ``darboux`` needs them.
    lift : Lift, optional
        A constrained system that is mapped to this one; the form ``lifted`` needs it.
    picture : Picture, optional
        Picture of a state.
    verify : bool
        Whether the identities are verified. Those of a lattice have been verified for few sites, so its written-out system needs no check.

    Raises
    ------
    InvalidProblem
        If sizes do not match, an expression has an undeclared symbol, a coordinate has an assumption that the domain does not imply, B is
        not skew-symmetric, the Jacobi identity fails (with the triple at which it does), a declared Casimir function is not one, a part's
        flow is not the flow of the part, the parts do not add up to H, or the canonical coordinates are not canonical.
    """

    y: Sequence[sp.Symbol]
    B: sp.Matrix
    H: sp.Expr
    casimirs: Mapping[str, sp.Expr] = field(default_factory=dict)
    integrals: Mapping[str, sp.Expr] = field(default_factory=dict)
    domain: Sequence[sp.Expr] = ()
    parameters: Mapping[sp.Symbol, float] = field(default_factory=dict)
    cases: Mapping[str, PoissonCase] = field(default_factory=dict)
    closed_form: Callable[..., list[Any]] | None = None
    parts: Mapping[str, Part] = field(default_factory=dict)
    splittings: Mapping[str, Sequence[str]] = field(default_factory=dict)
    darboux: DarbouxMap | None = None
    lift: Lift | None = None
    picture: Picture | None = None
    verify: InitVar[bool] = True

    def __post_init__(self, verify: bool) -> None:
        self._check_parts()
        self._check_matrix()
        self._check_sizes()
        self._check_symbols()
        if verify:
            # In this order: each check assumes those before it, the Jacobi identity for example a skew B.
            for identity in (check_skew, check_jacobi, check_casimirs, check_splitting, check_darboux):
                identity(self)

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return len(self.y)

    @cached_property
    def fingerprint(self) -> str:
        """Exact text of the mathematics, without the values of parameters, for content hashes."""
        cases = [(name, to_the_last_digit(case.y), dict(case.parameters), case.about) for name, case in self.cases.items()]
        return repr([exact(part) for part in self._all_parts]) + repr((self._part_names, cases))

    @cached_property
    def mathematics(self) -> str:
        """Exact text of equations, parameters with defaults, cases and everything else declared; the same for all ways to write them."""
        cases = {name: (case.y, case.parameters) for name, case in self.cases.items()}
        return mathematics(self._all_parts, self._part_names, cases, self.parameters)

    @property
    def _part_names(self) -> list[Any]:
        return [list(self.casimirs), list(self.integrals), list(self.parts), {key: list(value) for key, value in self.splittings.items()}]

    @property
    def _all_parts(self) -> list[Any]:
        expressions: list[Any] = [self.y, self.B, self.H, list(self.casimirs.values()), list(self.integrals.values()), self.domain]
        expressions.append(list(self.parameters))
        expressions += [[part.H, part.t, part.y] for part in self.parts.values()]
        if (map_ := self.darboux) is not None:
            expressions += [map_.q, map_.p, map_.c, map_.Q, map_.P, map_.C, map_.y]
        if (lift := self.lift) is not None:
            expressions += [lift.q, lift.p]
        return expressions

    def _check_parts(self) -> None:
        check_coordinates("y", self.y)
        check_parameters(self.parameters)
        check_cases(self.cases, "PoissonCase", ("y",), self.parameters)
        check_real("H", [self.H])
        check_real("the domain", several("the domain", self.domain))
        for what, functions in (("Casimir function", self.casimirs), ("integral", self.integrals)):
            check_functions(what, functions)
        if self.closed_form is not None and not callable(self.closed_form):
            raise InvalidProblem(
                f"closed_form is a {type(self.closed_form).__name__}; it must be a function, or be left out.", "closed-form-not-function"
            )

    def _check_matrix(self) -> None:
        if not self.n:
            raise InvalidProblem("a Poisson system needs at least one coordinate y.", "poisson-without-coordinates")
        if not isinstance(self.B, sp.MatrixBase):
            raise InvalidProblem(
                f"the structure matrix B must be a SymPy Matrix, but is a {type(self.B).__name__}.", "structure-matrix-type"
            )
        if self.B.shape != (self.n, self.n):
            raise InvalidProblem(
                f"the structure matrix B has shape {self.B.shape}, but there are {self.n} coordinates.", "structure-matrix-shape"
            )
        check_real("B", list(self.B))

    def _check_sizes(self) -> None:
        states = {f"case {name!r}": case.y for name, case in self.cases.items()}
        states |= {f"the flow of part {name!r}": part.y for name, part in self.parts.items()}
        for what, y in states.items():
            if len(y) != self.n:
                raise InvalidProblem(f"{what} has {len(y)} coordinates; there must be {self.n}.", "coordinates-count")
        for name, parts in self.splittings.items():
            if foreign := [part for part in parts if part not in self.parts]:
                raise InvalidProblem(
                    f"splitting {name!r} has {', '.join(foreign)}, which is not a part of the problem.", "splitting-of-unknown-part"
                )
            if len(parts) < 2:
                raise InvalidProblem(f"splitting {name!r} has fewer than two parts.", "splitting-of-one-part")
        if self.darboux is not None:
            self._check_darboux_sizes(self.darboux)

    def _check_darboux_sizes(self, map_: DarbouxMap) -> None:
        pairs = len(map_.q) == len(map_.Q) == len(map_.p) == len(map_.P) and len(map_.c) == len(map_.C)
        if not pairs or not 2 * len(map_.q) + len(map_.c) == len(map_.y) == self.n:
            raise InvalidProblem(
                f"the canonical coordinates must be as many q as p, with c {self.n} in all, with an expression for each.",
                "canonical-coordinates-count",
            )
        new = {*map_.q, *map_.p, *map_.c}
        if new & {*self.y, *self.parameters} or len(new) < self.n:
            raise InvalidProblem(
                "a canonical coordinate is used twice, or is a coordinate or parameter too; rename it.", "canonical-coordinate-taken"
            )
        require_plain("canonical coordinate", [*map_.q, *map_.p, *map_.c])

    def _check_symbols(self) -> None:
        domain = [sp.sympify(condition) for condition in self.domain]
        require_plain("coordinate", self.y, domain, advice=", or add it to the domain, so that a run ends where it leaves the domain")
        require_plain("time", [part.t for part in self.parts.values()])
        require_checked(self.parameters)
        check_distinct([*self.y, *self.parameters], "coordinate or parameter")
        for where, expression, symbols in self._expressions():
            written = sp.sympify(expression)
            if extra := written.free_symbols - symbols - set(self.parameters):
                raise InvalidProblem(
                    f"{where} contains {', '.join(sorted(map(str, extra)))}, which it may not depend on; declare it.",
                    "poisson-symbol-undeclared",
                )
            if written.has(sp.I, sp.nan, sp.zoo, sp.oo, -sp.oo):
                raise InvalidProblem(
                    f"{where} is not a real number everywhere: it contains an imaginary unit, infinity or NaN.", "not-real-everywhere"
                )

    def _expressions(self) -> list[tuple[str, Any, set[sp.Symbol]]]:
        """Return a description of every expression, with the symbols other than parameters that it may contain."""
        state = set(self.y)
        expressions: list[tuple[str, Any, set[sp.Symbol]]] = [("B", self.B, state), ("H", self.H, state)]
        expressions += [(f"Casimir function {name}", casimir, state) for name, casimir in self.casimirs.items()]
        expressions += [(f"integral {name}", integral, state) for name, integral in self.integrals.items()]
        expressions += [("the domain", sp.Matrix(list(self.domain)), state)]
        expressions += [(f"case {name}", sp.Matrix(list(case.y)), set()) for name, case in self.cases.items()]
        for name, part in self.parts.items():
            expressions += [(f"part {name}", part.H, state), (f"the flow of part {name}", sp.Matrix(list(part.y)), state | {part.t})]
        if (map_ := self.darboux) is not None:
            expressions += [("the canonical coordinates", sp.Matrix([*map_.Q, *map_.P, *map_.C]), state)]
            expressions += [("the inverse of the canonical coordinates", sp.Matrix(list(map_.y)), {*map_.q, *map_.p, *map_.c})]
        return expressions
