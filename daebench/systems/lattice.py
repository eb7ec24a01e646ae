"""A Poisson system on a periodic lattice, defined by one site and its neighbours for any number of sites."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import sympy as sp

from daebench.errors import InvalidProblem
from daebench.systems.assumptions import require_checked, require_plain
from daebench.systems.definition_parts import check_cases, check_coordinates, check_functions, check_parameters, check_real
from daebench.systems.exact_text import mathematics
from daebench.systems.picture import Picture, Point
from daebench.systems.poisson import DarbouxMap, Part, PoissonCase, PoissonSystem

SMALLEST = 3
"""Smallest number of sites for which a site has two neighbours."""

VERIFIED_ON = 4
"""Number of sites of the lattice on which the structure is verified: the smallest for which not all sites are neighbours."""

_VERIFIED: set[str] = set()
"""Exact texts of the lattices, without their cases, whose identities have been verified in this process."""


@dataclass(frozen=True, kw_only=True)
class LatticePart:
    """One part of a splitting of H, with the exact flow of y' = B(y) grad H^[i](y) at each site."""

    h: sp.Expr
    """Its density, in the fields at a site and at the site to the left."""
    t: sp.Symbol
    """Time over which the flow is taken."""
    here: Sequence[sp.Expr]
    """Fields at a site after it, in t and the previous fields at the site and its two neighbours; shape (s,)."""


@dataclass(frozen=True, kw_only=True)
class LatticeDarboux:
    """Canonical coordinates of each site, HLW (3.13), and the inverse map; see :class:`daebench.systems.poisson.DarbouxMap`."""

    q: sp.Symbol
    p: sp.Symbol
    """The coordinates, {q, p} = 1."""
    Q: sp.Expr
    P: sp.Expr
    """The coordinates as functions of the fields at the site."""
    here: Sequence[sp.Expr]
    """The fields as functions of q and p; shape (2,)."""


@dataclass(frozen=True, kw_only=True)
class PoissonLattice:
    """A Poisson system of N sites with s fields each, whose energy couples neighbours; its bracket does not.

    ::

        y = (first field at sites 1 ... N, second field at sites 1 ... N, ...)        site 0 is site N
        H = sum_k h(y_{k-1}, y_k)        B(y) has the block b(y_k) for site k

    Parameters
    ----------
    sites : int
        Number of sites N, at least 3.
    here, left, right : sequence of Symbol, shape(s,)
        Fields of a site, and of its neighbours.
    b : Matrix, shape(s, s)
        Block of the structure matrix, in ``here``.
    h : Expr
        Density of the Hamiltonian, in ``left`` and ``here``.
    casimirs, integrals : mapping of str to Expr
        Densities of Casimir functions and of other first integrals, in ``left`` and ``here``.
    parameters : mapping of Symbol to number
        The run-time parameters with their present values.
    site : Symbol
        Number of a site, 1 ... N, in initial values.
    cases : mapping of str to PoissonCase
        Named initial values: one expression in ``site`` for each field.
    parts : mapping of str to LatticePart
        Parts of the Hamiltonian whose flows have closed forms.
    splittings : mapping of str to sequence of str
        As in :class:`daebench.systems.poisson.PoissonSystem`.
    darboux : LatticeDarboux, optional
        Canonical coordinates, for two fields.
    point : sequence of Expr, shape(2,)
        Position of a site in the drawing, in ``here``, ``site`` and the parameters; a line joins the sites. Empty for no drawing.
    axes : sequence of str, shape(2,)
        Meaning of the coordinates of the points.

    Raises
    ------
    InvalidProblem
        If there are fewer than three sites, or the system of three sites is not a Poisson system.
    """

    sites: int
    here: Sequence[sp.Symbol]
    left: Sequence[sp.Symbol]
    right: Sequence[sp.Symbol]
    b: sp.Matrix
    h: sp.Expr
    casimirs: Mapping[str, sp.Expr] = field(default_factory=dict)
    integrals: Mapping[str, sp.Expr] = field(default_factory=dict)
    parameters: Mapping[sp.Symbol, float] = field(default_factory=dict)
    site: sp.Symbol
    cases: Mapping[str, PoissonCase] = field(default_factory=dict)
    parts: Mapping[str, LatticePart] = field(default_factory=dict)
    splittings: Mapping[str, Sequence[str]] = field(default_factory=dict)
    darboux: LatticeDarboux | None = None
    point: Point = ()
    axes: Sequence[str] = ()

    def __post_init__(self) -> None:
        if self.sites < SMALLEST:
            raise InvalidProblem(
                f"in a lattice of {self.sites} sites no site has two neighbours; it needs at least {SMALLEST} sites.", "lattice-too-small"
            )
        for name, symbols in (("here", self.here), ("left", self.left), ("right", self.right)):
            check_coordinates(name, symbols)
        check_parameters(self.parameters)
        check_cases(self.cases, "PoissonCase", ("y",), self.parameters)
        if not isinstance(self.b, sp.MatrixBase) or self.b.shape != (len(self.here), len(self.here)):
            raise InvalidProblem(
                "the structure matrix b of a site must be a SymPy Matrix with a row and a column for each symbol of here.",
                "site-matrix-malformed",
            )
        check_real("b", list(self.b))
        check_real("h", [self.h])
        for what, functions in (("Casimir function", self.casimirs), ("integral", self.integrals)):
            check_functions(what, functions)
        self._check_symbols()
        # Without cases and values of parameters, on which the identities do not depend: they are verified once for all of these.
        structure = mathematics([*self._all_parts, list(self.parameters)], self._names, {}, {})
        self.expanded(VERIFIED_ON, verify=structure not in _VERIFIED)
        _VERIFIED.add(structure)

    def _check_symbols(self) -> None:
        """Check that expressions depend only on allowed symbols; others would have another meaning in a written-out lattice."""
        require_plain("field", [*self.here, *self.left, *self.right])
        require_plain("time", [part.t for part in self.parts.values()])
        require_checked(self.parameters)
        site_symbols = {*self.here, *self.parameters}
        pair = site_symbols | {*self.left}
        expressions: list[tuple[str, sp.Expr, set[sp.Symbol]]] = [("b", self.b, site_symbols), ("h", self.h, pair)]
        expressions += [(f"the density of {name}", density, pair) for name, density in {**self.casimirs, **self.integrals}.items()]
        expressions += [(f"part {name}", part.h, pair) for name, part in self.parts.items()]
        flows = {name: (sp.Matrix(list(part.here)), pair | {*self.right, part.t}) for name, part in self.parts.items()}
        expressions += [(f"the flow of part {name}", *flow) for name, flow in flows.items()]
        for where, expression, symbols in expressions:
            if extra := sp.sympify(expression).free_symbols - symbols:
                raise InvalidProblem(
                    f"{where} contains {', '.join(sorted(map(str, extra)))}, which it may not depend on; write it without.",
                    "lattice-symbol-undeclared",
                )

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return self.sites * len(self.here)

    @property
    def y(self) -> list[sp.Symbol]:
        """The state, shape(n,), of the written-out system."""
        return [symbol for fields in self._fields(self.sites) for symbol in fields]

    @property
    def picture(self) -> Picture | None:
        """Picture of a state: a line through the points of all sites."""
        if not self.point:
            return None
        fields = self._fields(self.sites)
        values = [{self.site: sp.Integer(k + 1), **{symbol: fields[i][k] for i, symbol in enumerate(self.here)}} for k in range(self.sites)]
        return Picture(rods=[[tuple(sp.sympify(x).xreplace(substitution) for x in self.point) for substitution in values]], axes=self.axes)

    def _fields(self, sites: int) -> list[list[sp.Symbol]]:
        """Return the symbols of each field at all sites."""
        return [[sp.Symbol(f"{symbol}{k}", **symbol.assumptions0) for k in range(1, sites + 1)] for symbol in self.here]

    @cached_property
    def fingerprint(self) -> str:
        """Exact text of the mathematics at every site, without the values of parameters, for content hashes."""
        return mathematics([*self._all_parts, list(self.parameters)], self._names, self._cases, {})

    @cached_property
    def mathematics(self) -> str:
        """Exact text of densities, parameters with defaults, and cases at every site; the same for all ways to write them."""
        return mathematics(self._all_parts, self._names, {name: case[:2] for name, case in self._cases.items()}, self.parameters)

    @property
    def _all_parts(self) -> list[Any]:
        parts = [self.here, self.left, self.right, self.b, self.h, self.site, *self.casimirs.values(), *self.integrals.values()]
        parts += [[part.h, part.t, part.here] for part in self.parts.values()]
        if (map_ := self.darboux) is not None:
            parts += [map_.q, map_.p, map_.Q, map_.P, map_.here]
        return parts

    @property
    def _names(self) -> list[Any]:
        return [self.sites, list(self.casimirs), list(self.integrals), list(self.parts), {k: list(x) for k, x in self.splittings.items()}]

    @property
    def _cases(self) -> dict[str, tuple[Any, ...]]:
        return {name: (case.y, case.parameters, case.about) for name, case in self.cases.items()}

    def expanded(self, sites: int, *, verify: bool = False) -> PoissonSystem:
        """Return the written-out system with this many sites. Its identities are verified for few sites, when the lattice is made."""
        symbols = self._fields(sites)

        def at(expression: sp.Expr, k: int) -> sp.Expr:
            """Return an expression of a site and its neighbours at site k, counted from 0."""
            # Site -1 is the last one by Python's indices, which makes the lattice periodic; the other end takes the remainder.
            pairs = zip((self.left, self.here, self.right), (k - 1, k, (k + 1) % sites), strict=True)
            substitution = {symbol: symbols[i][where] for fields, where in pairs for i, symbol in enumerate(fields)}
            return sp.sympify(expression).xreplace(substitution | {self.site: sp.Integer(k + 1)})

        def everywhere(expressions: Sequence[sp.Expr]) -> list[sp.Expr]:
            return [at(expression, k) for expression in expressions for k in range(sites)]

        def summed(density: sp.Expr) -> sp.Expr:
            return sp.Add(*(at(density, k) for k in range(sites)))

        s = len(self.here)
        B = sp.zeros(s * sites, s * sites)
        for i in range(s):
            for j in range(s):
                for k in range(sites):
                    B[i * sites + k, j * sites + k] = at(self.b[i, j], k)
        return PoissonSystem(
            y=[symbol for fields in symbols for symbol in fields],
            B=B,
            H=summed(self.h),
            casimirs={name: summed(density) for name, density in self.casimirs.items()},
            integrals={name: summed(density) for name, density in self.integrals.items()},
            parameters=self.parameters,
            cases={
                name: PoissonCase(y=everywhere(case.y), parameters=case.parameters, about=case.about) for name, case in self.cases.items()
            },
            parts={name: Part(H=summed(part.h), t=part.t, y=everywhere(part.here)) for name, part in self.parts.items()},
            splittings=self.splittings,
            darboux=None if self.darboux is None else self._canonical(self.darboux, sites, everywhere),
            verify=verify,
        )

    @staticmethod
    def _canonical(map_: LatticeDarboux, sites: int, everywhere: Callable[[Sequence[sp.Expr]], list[sp.Expr]]) -> DarbouxMap:
        q, p = ([sp.Symbol(f"{symbol}{k}", **symbol.assumptions0) for k in range(1, sites + 1)] for symbol in (map_.q, map_.p))
        here = [sp.sympify(expression).xreplace({map_.q: q[k], map_.p: p[k]}) for expression in map_.here for k in range(sites)]
        return DarbouxMap(q=q, p=p, Q=everywhere([map_.Q]), P=everywhere([map_.P]), y=here)
