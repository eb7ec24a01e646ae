"""Functions derived from the definition of a Poisson lattice: functions of whole states as loops over sites, for any number of sites."""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import sympy as sp

from daebench.compiler import codegen
from daebench.compiler.expressions import Expressions
from daebench.compiler.linear.algebras import Arrays
from daebench.compiler.linear.elimination import Target
from daebench.compiler.poisson.derivation import InParts
from daebench.compiler.syntax import Lines, function, pack
from daebench.systems.lattice import PoissonLattice
from daebench.systems.poisson import PoissonCase, PoissonSystem


class LatticeDerivation(InParts):
    """The functions of one Poisson lattice, under the names of :class:`daebench.compiler.poisson.derivation.PoissonDerivation`.

    States are arrays, shape(n,): all sites of the first field, then those of the next. ``splitting`` is as in the base class.
    """

    arrays = True

    def __init__(self, lattice: PoissonLattice, splitting: str = "") -> None:
        super().__init__(lattice, splitting, lattice.h, [*lattice.left, *lattice.here])
        self.lattice = lattice

    @cached_property
    def problem(self) -> PoissonSystem:
        """The system written out, with a symbol for each coordinate; only for few sites."""
        return self.lattice.expanded(self.lattice.sites)

    @property
    def fields(self) -> int:
        """Number of fields at a site, s."""
        return len(self.lattice.here)

    @cached_property
    def h_here(self) -> list[sp.Expr]:
        """Derivatives of H with respect to the fields at a site, which appear in the density there and in that of the right neighbour."""
        lattice = self.lattice
        shift = dict(zip([*lattice.left, *lattice.here], [*lattice.here, *lattice.right], strict=True))
        beyond = sp.sympify(lattice.h).xreplace(shift)
        return [sp.diff(lattice.h, symbol) + sp.diff(beyond, symbol) for symbol in lattice.here]

    @cached_property
    def field(self) -> list[sp.Expr]:
        """Right side b grad H at a site."""
        return [sp.expand(component) for component in sp.Matrix(self.lattice.b) * sp.Matrix(self.h_here)]

    @property
    def constants(self) -> dict[str, bool | int]:
        """Constants of the scheme language that are known from the lattice."""
        return {"DENSE": False, "BOUNDED": False, "CONSTRAINTS": 1}

    def facts(self) -> dict[str, Any]:
        """Return the facts of the lattice, see :meth:`daebench.compiler.poisson.derivation.InParts.facts`."""
        lattice = self.lattice
        return super().facts() | {
            "DOMAIN": (),
            "CONSTANT": not lattice.b.free_symbols & set(lattice.here),
            "BILINEAR": False,
            "HALVES": len(lattice.here) % 2 == 0,
            "CLOSED_FORM": False,
            "SITES": lattice.sites,
            "LIFT": "",
        }

    def algebra(self, target: Target) -> Arrays:
        """Return the algebra of its vectors."""
        return Arrays(self.n)

    def _flow(self, name: str, part: Any) -> str:
        return self._sites(name, part.here, time=part.t)

    def _expression(self, name: str) -> str | None:
        rule = self._rules.get(name)
        return None if rule is None else rule()

    @cached_property
    def _rules(self) -> dict[str, Callable[[], str]]:
        lattice = self.lattice
        half = self.fields // 2
        return {
            "H": lambda: self._sums("H", [lattice.h], packed=False),
            "casimirs": lambda: self._sums("casimirs", list(lattice.casimirs.values())),
            "integrals": lambda: self._sums("integrals", list(lattice.integrals.values())),
            "field": lambda: self._sites("field", self.field),
            "rate_u": lambda: self._sites("rate_u", self.field[:half]),
            "rate_v": lambda: self._sites("rate_v", self.field[half:]),
            "B": self._structure,
        }

    def _sites(self, name: str, values: Expressions, *, time: sp.Symbol | None = None) -> str:
        """Source of name(y, [time,] par), which returns this many fields at every site."""
        lines = self._loop([f"out[{i * self.lattice.sites} + k]" for i in range(len(values))], values, time=time)
        head = f"out = empty({len(values) * self.lattice.sites}, dtype=y.dtype)"
        return function(f"{name}(y, {'time, ' if time is not None else ''}par)", head, *lines, "return out")

    def _sums(self, name: str, densities: Expressions, *, packed: bool = True) -> str:
        """Source of name(y, par), which returns the sum of each density over all sites."""
        totals = [f"total_{i}" for i in range(len(densities))]
        lines = self._loop(totals, densities, add=True)
        result = pack(totals) if packed else totals[0]
        return function(f"{name}(y, par)", *(f"{total} = 0.0 * y[0]" for total in totals), *lines, f"return {result}")

    def _loop(self, targets: Sequence[str], values: Expressions, *, time: sp.Symbol | None = None, add: bool = False) -> Lines:
        """Lines of a loop over all sites that assigns the value at that site to each target, or adds it."""
        if not targets:
            return []
        lattice, N = self.lattice, self.lattice.sites
        names: dict[sp.Symbol, str] = {}
        for fields, site in ((lattice.here, "k"), (lattice.left, "k_left"), (lattice.right, "k_right")):
            names |= {symbol: f"y[{i * N} + {site}]" for i, symbol in enumerate(fields)}
        names |= {parameter: f"par[{i}]" for i, parameter in enumerate(self.parameters)} | ({} if time is None else {time: "time[0]"})
        body = codegen.assignments(targets, values, names)
        sign = " += " if add else " = "
        body = [line.replace(" = ", sign, 1) if line.startswith(tuple(targets)) else line for line in body]
        sides = {"k_left": f"k - 1 if k > 0 else {N - 1}", "k_right": f"k + 1 if k < {N - 1} else 0"}
        neighbours = [f"{side} = {where}" for side, where in sides.items() if any(side in line for line in body)]
        return [f"for k in range({N}):", *(f"    {line}" for line in [*neighbours, *body])]

    def _structure(self) -> str:
        """Source of B(y, par), the whole matrix, shape(n, n); for few sites, if a diagnostic needs it."""
        s, N = self.fields, self.lattice.sites
        pairs = [(i, j) for i in range(s) for j in range(s) if self.lattice.b[i, j] != 0]
        lines = self._loop([f"out[{i * N} + k, {j * N} + k]" for i, j in pairs], [self.lattice.b[i, j] for i, j in pairs])
        return function("B(y, par)", f"out = zeros(({self.n}, {self.n}), dtype=y.dtype)", *lines, "return out")

    def initial(self, name: str, case: PoissonCase) -> str:
        """Return the source of name(par), which returns the initial y, given by expressions in the number of the site."""
        site = {self.lattice.site: sp.Symbol("site")}
        lines = codegen.assignments(
            [f"field_{i}" for i in range(self.fields)],
            [sp.sympify(value).xreplace(site) for value in case.y],
            {sp.Symbol("site"): "site", **{parameter: f"par[{i}]" for i, parameter in enumerate(self.parameters)}},
        )
        start = f"site = arange(1.0, {self.lattice.sites} + 1.0)"
        return function(
            f"{name}(par)", start, *lines, "return concatenate((" + ", ".join(f"field_{i} + 0.0 * site" for i in range(self.fields)) + "))"
        )


class DarbouxLattice(LatticeDerivation):
    """The functions of a Poisson lattice in its canonical coordinates z = (q, p), HLW Corollary 3.6; it is a lattice again.

    The monitored quantities are functions of the lattice's own y, which the loop gets from ``chart``.
    """

    def __init__(self, derivation: LatticeDerivation) -> None:
        super().__init__(derivation.lattice)
        assert derivation.lattice.darboux is not None
        self.original, self.map, self.parts = derivation, derivation.lattice.darboux, []
        self.z = [(sp.Symbol(f"q{side}", real=True), sp.Symbol(f"p{side}", real=True)) for side in ("_left", "", "_right")]
        self.at: dict[sp.Symbol, sp.Expr] = {}
        self.back: dict[sp.Symbol, sp.Symbol] = {}
        lattice = self.lattice
        for fields, (q, p) in zip((lattice.left, lattice.here, lattice.right), self.z, strict=True):
            here = [sp.sympify(value).xreplace({self.map.q: q, self.map.p: p}) for value in self.map.here]
            self.at |= dict(zip(fields, here, strict=True))
            self.back |= dict(zip((q, p), fields, strict=True))

    @cached_property
    def field(self) -> list[sp.Expr]:
        """Right side (K_p, -K_q) at a site."""
        lattice, (q, p) = self.lattice, self.z[1]
        slopes = [derivative.xreplace(self.at) for derivative in self.original.h_here]
        here = [self.at[symbol] for symbol in lattice.here]
        K_q, K_p = (sp.Add(*(slope * sp.diff(expression, z) for slope, expression in zip(slopes, here, strict=True))) for z in (q, p))
        return [K_p, -K_q]

    def _loop(self, targets: Sequence[str], values: Expressions, *, time: sp.Symbol | None = None, add: bool = False) -> Lines:
        """Lines of a loop over all sites, in the symbols of the canonical coordinates."""
        return super()._loop(targets, [sp.sympify(value).xreplace(self.back) for value in values], time=time, add=add)

    def source(self, name: str) -> str | None:
        """Return the source of the function of this name, or None if it has none."""
        if name in ("H", "casimirs", "integrals", "B"):
            return self.original.source(name)
        if name == "chart":
            return self._sites(name, [self.at[symbol] for symbol in self.lattice.here])
        if name == "canonical":
            return self.original._sites(name, [self.map.Q, self.map.P])
        return super().source(name)
