"""A problem in the notation of the book: SymPy expressions and numbers, without reference to methods."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import sympy as sp

from daebench.errors import InvalidProblem
from daebench.systems.assumptions import require_checked, require_plain
from daebench.systems.constrained_checks import check_linear, check_parts, check_second_derivatives, nonholonomic, strange
from daebench.systems.definition_parts import check_coordinates, check_distinct, check_real, several
from daebench.systems.exact_text import case_texts, exact, mathematics
from daebench.systems.parts import Parts
from daebench.systems.picture import Exact
from daebench.systems.picture import Picture as Picture


@dataclass(frozen=True, kw_only=True)
class Case:
    """Named initial values, with their parameter values.

    Parameters
    ----------
    q, p : sequence of exact expressions, shape(d,)
        Initial positions and momenta; they may contain the problem's parameters.
    parameters : mapping of str to number
        Values that replace the problem's defaults in this case.
    about : str
        Source of the case and what it shows, in one line.
    on_singular : str
        Action of a run if G loses rank, unless a run requests another: "stop", "continue" or "least-squares".
    """

    q: Sequence[Exact]
    p: Sequence[Exact]
    parameters: Mapping[str, float] = field(default_factory=dict)
    about: str = ""
    on_singular: str = "stop"


@dataclass(frozen=True, kw_only=True)
class KineticFlow:
    """The flow over time t of the kinetic energy on the manifold, HLW (1.45) with H^[1] = T: motion without U, in closed form.

    ``kinetic_flows`` contains the known flows. Write each as the start plus a change that is small for small t, because a step adds this
    change to the state.

    Parameters
    ----------
    t : Symbol
        Time over which the flow is taken.
    p, q : sequence of Expr, shape(d,)
        Momenta and positions after it, in t and the problem's q, p and parameters. They must also be defined at zero momentum.
    """

    t: sp.Symbol
    p: Sequence[sp.Expr]
    q: Sequence[sp.Expr]


@dataclass(frozen=True, kw_only=True)
class Chart:
    """Local coordinates y = (eta, xi) of the manifold g = 0, G H_p = 0, HLW VII.2.3: x = chi(y), and y as a function of x.

    Parameters
    ----------
    eta, xi : sequence of Symbol, shape(n,)
        The coordinates: eta like momenta or velocities, and xi like positions; n = d - m, or d - rank G if a case solves redundant
        constraints by least squares.
    p, q : sequence of Expr, shape(d,)
        chi: momenta and positions in eta, xi and the problem's parameters.
    inverse_eta, inverse_xi : sequence of Expr, shape(n,)
        The coordinates in p, q and the problem's parameters. They are used only on the manifold.
    """

    eta: Sequence[sp.Symbol]
    xi: Sequence[sp.Symbol]
    p: Sequence[sp.Expr]
    q: Sequence[sp.Expr]
    inverse_eta: Sequence[sp.Expr]
    inverse_xi: Sequence[sp.Expr]


@dataclass(frozen=True, kw_only=True)
class ConstrainedHamiltonian:
    """A constrained Hamiltonian system, HLW (1.9), which may depend on time and have forces without a potential.

    ::

        q' = H_p(p, q, t)      p' = -H_q(p, q, t) + F(q, q', t) - G(q, t)^T lam      0 = g(q, t)      G = g_q

    Constraints on velocities, A(q, t) q' + a(q, t) = 0, are nonholonomic where no function of the positions has them as its derivative.
    Their rows A are rows of G below those of g_q: the forces that they need do no virtual work, by d'Alembert's principle.

    With t, F or a it is treated in extended phase space. The last position of its state is the time; the last momentum is the energy
    lost to F, to drivers, to moving surfaces and to the time dependence of H.

    Parameters
    ----------
    q, p : sequence of Symbol, shape(d,)
        Positions and momenta.
    g : sequence of Expr, shape(m,)
        Constraints, functions of q. They may be redundant, even m >= d, as long as rank G < d at the start of each case.
    H : Expr, optional
        Hamiltonian H(p, q); alternatively give M and U.
    M : Matrix, shape(d, d), optional
        Symmetric mass matrix, constant or depending on q, for H = 1/2 p^T M^-1 p + U(q). It is never inverted symbolically
        unless it is diagonal.
    U : Expr, optional
        Potential energy U(q), given together with M.
    t : Symbol, optional
        The time, if g, H, M, U or F contain it. Motions start at t = 0.
    force : sequence of Expr, optional, shape(d,)
        Forces F without a potential, such as those of dampers and motors, functions of q, v or p, and t.
    v : sequence of Symbol, optional, shape(d,)
        The velocities q' = H_p, as symbols for ``force`` and ``velocity``.
    velocity : sequence of Expr, optional, shape(k,)
        Constraints on velocities, each linear or affine in v: A(q, t) v + a(q, t).
    parameters : mapping of Symbol to number
        The run-time parameters with their present values.
    cases : mapping of str to Case
        Named initial values.
    integrals : mapping of str to Expr
        First integrals besides H, functions of p and q (and t).
    closed_form : callable, optional
        ``closed_form(t, q0, p0, parameters) -> (q, p)`` with mpmath numbers, at mpmath's working precision.
    kinetic_flow : KineticFlow, optional
        Flow of the kinetic energy on the manifold, if it has a closed form; splitting methods need it.
    chart : Chart, optional
        Local coordinates of the manifold; the form ``local`` needs them.
    picture : Picture, optional
        Picture of the problem.
    parts : Parts, optional
        Parts of the mechanism that it is, in words; ``Mechanism.problem`` declares them.

    Raises
    ------
    InvalidProblem
        If a part is of a wrong type, sizes do not match, an expression has an undeclared symbol, a symbol is used twice, H or g
        contains a function that is not twice differentiable, a constraint on velocities is not linear in them, a position or momentum is
        declared more than real, or H and (M, U) are both given or both missing.
    """

    q: Sequence[sp.Symbol]
    p: Sequence[sp.Symbol]
    g: Sequence[sp.Expr]
    H: sp.Expr | None = None
    M: sp.Matrix | None = None
    U: sp.Expr | None = None
    t: sp.Symbol | None = None
    force: Sequence[sp.Expr] | None = None
    v: Sequence[sp.Symbol] | None = None
    velocity: Sequence[sp.Expr] = ()
    parameters: Mapping[sp.Symbol, float] = field(default_factory=dict)
    cases: Mapping[str, Case] = field(default_factory=dict)
    integrals: Mapping[str, sp.Expr] = field(default_factory=dict)
    closed_form: Callable[..., tuple[list[Any], list[Any]]] | None = None
    kinetic_flow: KineticFlow | None = None
    chart: Chart | None = None
    picture: Picture | None = None
    parts: Parts | None = None

    def __post_init__(self) -> None:
        check_parts(self)
        object.__setattr__(self, "velocity", tuple(self.velocity))
        if self.parts and len(self.parts.constraints) != self.m:  # of a mechanism whose constraints were replaced
            object.__setattr__(self, "parts", None)
        self._check_sizes()
        self._check_symbols()
        check_second_derivatives(self)
        check_linear(self)
        if self.kinetic_flow is not None:
            self._check_kinetic_flow(self.kinetic_flow)
        if self.chart is not None:
            self._check_chart(self.chart)

    @property
    def d(self) -> int:
        """Number of positions."""
        return len(self.q)

    @property
    def m(self) -> int:
        """Number of constraints, on positions and on velocities."""
        return len(self.g) + len(self.velocity)

    @property
    def in_time(self) -> bool:
        """Whether the energy may change: there is a time, a force without a potential, or a velocity that a constraint prescribes."""
        return self.t is not None or self.force is not None or any(self.prescribed)

    @cached_property
    def prescribed(self) -> tuple[sp.Expr, ...]:
        """The terms a(q, t) of the constraints on velocities, shape(k,)."""
        at_rest = dict.fromkeys(self.v or (), 0)
        return tuple(sp.sympify(row).xreplace(at_rest) for row in self.velocity)

    @cached_property
    def fingerprint(self) -> str:
        """Exact text of the mathematics, without the values of parameters, for content hashes."""
        return repr([exact(part) for part in self._all_parts]) + repr((list(self.integrals), case_texts(self.cases)))

    @cached_property
    def mathematics(self) -> str:
        """Exact text of equations, parameters with defaults, cases, integrals, chart and flow; the same for all ways to write them."""
        # Without descriptions, unlike the fingerprint: stored runs are found by this text, and a new word must not lose them.
        cases = {name: (case.q, case.p, case.parameters, case.on_singular) for name, case in self.cases.items()}
        return mathematics(self._all_parts, list(self.integrals), cases, self.parameters)

    @property
    def _all_parts(self) -> list[Any]:
        parts = [self.q, self.p, self.g, self.H, self.M, self.U, list(self.parameters), list(self.integrals.values())]
        if self.in_time:
            parts += [self.t, self.force, self.v]
        if self.velocity:
            parts += [self.velocity, self.v]
        if (flow := self.kinetic_flow) is not None:
            parts += [flow.t, flow.p, flow.q]
        if (chart := self.chart) is not None:
            parts += [chart.eta, chart.xi, chart.p, chart.q, chart.inverse_eta, chart.inverse_xi]
        return parts

    def _check_sizes(self) -> None:
        if (self.H is None) == (self.M is None) or (self.M is None) != (self.U is None):
            raise InvalidProblem("a problem gives either H(p, q), or M and U together.", "h-beside-mass-and-potential")
        if len(self.p) != self.d:
            raise InvalidProblem(
                f"{self.d} positions but {len(self.p)} momenta; give one momentum for each position.", "momenta-not-per-position"
            )
        if self.M is not None and self.M.shape != (self.d, self.d):
            raise InvalidProblem(f"the mass matrix M has shape {self.M.shape}, but there are {self.d} positions.", "mass-matrix-shape")
        # Simplified, because entries may be equal without being written alike.
        if self.M is not None and sp.simplify(self.M - self.M.T) != sp.zeros(self.d, self.d):
            raise InvalidProblem("the mass matrix M is not symmetric.", "mass-matrix-not-symmetric")
        for name, case in self.cases.items():
            if len(case.q) != self.d or len(case.p) != self.d:
                raise InvalidProblem(
                    f"case {name!r} has {len(case.q)} positions and {len(case.p)} momenta; both must be {self.d}.", "case-sizes"
                )

    def _check_symbols(self) -> None:
        require_plain("position", self.q)
        require_plain("momentum", self.p)
        require_checked(self.parameters)
        time, velocities = [] if self.t is None else [self.t], list(self.v or ())
        require_plain("time", time)
        require_plain("velocity", velocities)
        names = "position, momentum, velocity, time or parameter" if time or velocities else "position, momentum or parameter"
        check_distinct([*self.q, *self.p, *velocities, *time, *self.parameters], names)
        positions, state, known = {*self.q, *time}, {*self.q, *self.p, *time}, set(self.parameters)
        allowed: list[tuple[str, Any, set[sp.Symbol]]] = [("g", sp.Matrix(list(self.g)), positions), ("H", self.H, state)]
        allowed += [("force", sp.Matrix(list(self.force or ())), {*state, *velocities})]
        allowed += [("velocity", sp.Matrix(list(self.velocity)), {*positions, *velocities})]
        allowed += [("M", self.M, positions), ("U", self.U, positions)]
        allowed += [(f"integral {name}", expression, state) for name, expression in self.integrals.items()]
        allowed += [(f"case {name}", sp.Matrix([*case.q, *case.p]), set()) for name, case in self.cases.items()]
        for where, expression, symbols in allowed:
            extra = set() if expression is None else sp.sympify(expression).free_symbols - symbols - known
            if extra and where == "g" and extra & {*self.p, *velocities}:
                raise nonholonomic(extra)
            if extra:
                raise strange(where, extra, {*state, *velocities, *known})

    def _check_kinetic_flow(self, flow: KineticFlow) -> None:
        check_coordinates("the time of the kinetic flow", [flow.t])
        check_real("the kinetic flow", [*several("p of the kinetic flow", flow.p), *several("q of the kinetic flow", flow.q)])
        if len(flow.p) != self.d or len(flow.q) != self.d:
            raise InvalidProblem(
                f"the kinetic flow has {len(flow.q)} positions and {len(flow.p)} momenta; both must be {self.d}.", "kinetic-flow-sizes"
            )
        known = {*self.q, *self.p, *self.parameters}
        if flow.t in known:
            raise InvalidProblem(
                f"the time {flow.t} of the kinetic flow is a position, momentum or parameter too; rename one.", "kinetic-flow-time-taken"
            )
        require_plain("time", [flow.t])
        if extra := sp.Matrix([*flow.p, *flow.q]).free_symbols - known - {flow.t}:
            raise InvalidProblem(
                f"the kinetic flow contains {', '.join(sorted(map(str, extra)))}, which is not declared; declare it.",
                "kinetic-flow-undeclared",
            )

    def _check_chart(self, chart: Chart) -> None:
        state_symbols = {*self.q, *self.p}
        y = [*several("eta of the chart", chart.eta), *several("xi of the chart", chart.xi)]
        check_coordinates("the chart's coordinates", y)
        require_plain("local coordinate", y)
        for name in ("p", "q", "inverse_eta", "inverse_xi"):
            check_real(f"{name} of the chart", several(f"{name} of the chart", getattr(chart, name)))
        n = self._size_of_chart(chart)
        if any(len(part) != n for part in (chart.eta, chart.xi, chart.inverse_eta, chart.inverse_xi)):
            raise InvalidProblem(
                f"the chart must have {n} eta and {n} xi, positions minus constraints, and an inverse of each.", "chart-counts"
            )
        if len(chart.p) != self.d or len(chart.q) != self.d:
            raise InvalidProblem(
                f"the chart has {len(chart.q)} positions and {len(chart.p)} momenta; both must be {self.d}.", "chart-sizes"
            )
        if len(set(y)) < 2 * n or set(y) & {*state_symbols, *self.parameters}:
            raise InvalidProblem(
                "a local coordinate of the chart is used twice, or is a position, momentum or parameter too; rename it.",
                "chart-coordinate-taken",
            )
        for where, values, allowed in (
            ("the chart", [*chart.p, *chart.q], set(y)),
            ("the inverse of the chart", [*chart.inverse_eta, *chart.inverse_xi], state_symbols),
        ):
            if extra := sp.Matrix(values).free_symbols - allowed - {self.t} - set(self.parameters):
                raise InvalidProblem(
                    f"{where} contains {', '.join(sorted(map(str, extra)))}, which it may not depend on; declare it.",
                    "chart-symbol-undeclared",
                )

    def _size_of_chart(self, chart: Chart) -> int:
        """Return the required number of eta: positions minus constraints, or the number of xi if constraints may be redundant."""
        least = self.d - self.m
        redundant = any(case.on_singular == "least-squares" for case in self.cases.values())
        # The rank of G is a question of numbers, which a definition does not have yet: the chart itself says how large it is.
        return min(max(len(chart.xi), least, 1), self.d - 1) if redundant else least


def coordinates(d: int) -> tuple[tuple[sp.Symbol, ...], tuple[sp.Symbol, ...]]:
    """Return symbols (q1, ..., qd) and (p1, ..., pd).

    Examples
    --------
    >>> import daebench
    >>> daebench.coordinates(2)
    ((q1, q2), (p1, p2))
    """
    return sp.symbols(f"q1:{d + 1}", real=True), sp.symbols(f"p1:{d + 1}", real=True)
