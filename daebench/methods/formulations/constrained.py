"""Pose an initial value problem in a formulation: index 3, 2, 1, Gear-Gupta-Leimkuhler, Baumgarte, or the index-reduced ODE."""

import math
import types
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.compiler.cache import generated
from daebench.compiler.callbacks import SINGULAR
from daebench.compiler.linear.compiled_solvers import eliminate
from daebench.diagnostics.freedom import dependence
from daebench.errors import BadInput, DaebenchError, unknown
from daebench.methods.formulations.table import FORMULATIONS, OPTIONS
from daebench.runs.ivp import ConstrainedIvp, Ivp

Array = NDArray[np.float64]
Kernel = Callable[..., float]


@dataclass(frozen=True, eq=False)
class Posed:
    """An initial value problem as F(t, y, y') = 0, and where it is an ODE as y' = f(y) too."""

    formulation: str
    """Name of the formulation."""
    multipliers: str
    """"plain": multipliers are unknowns; "derivative": the unknowns are functions whose derivatives are the multipliers."""
    ivp: Ivp
    """What was posed."""
    par: Array
    """Run-time data of the functions below: the problem's parameters, then the formulation's own numbers; shape (k,)."""
    y0: Array
    yp0: Array
    """Consistent initial values. Derivatives of plain multipliers, which no equation has, are 0; shape (n,)."""
    module: types.ModuleType = field(repr=False)
    """The generated functions."""

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return len(self.y0)

    @property
    def copies(self) -> int:
        """Number of repetitions of the blocks: more than one if derivatives of the unknowns are also unknowns."""
        return 1

    residual = property(attrgetter("module.residual"))
    """Compiled ``residual(t, y, yp, res, par)``: fills res, shape(n,), with F.

    It returns the smallest relative pivot of the linear solves (1 without any), NaN if a value is not finite.
    """
    jacobian = property(attrgetter("module.jacobian"))
    """Compiled ``jacobian(t, y, yp, res, cj, JJ, par)``: fills JJ, shape(n, n), with dF/dy + cj dF/dy'; returns as ``residual``."""
    rhs = property(attrgetter("module.rhs"))
    """Compiled ``rhs(t, y, out, par)`` of ``ode``: fills out, shape(n,), with f; returns as ``residual``."""
    rhs_jacobian = property(attrgetter("module.rhs_jacobian"))
    """Compiled ``rhs_jacobian(t, y, JJ, par)`` of ``ode``: fills JJ, shape(n, n), with f_y; returns as ``residual``."""

    @property
    def blocks(self) -> dict[str, slice]:
        """Places of the unknowns, by name."""
        raise NotImplementedError

    def outside(self, y: Array) -> str:
        """Return the set that the unknowns have left, for example "the domain u > 0", or "" if they are allowed."""
        return ""


@dataclass(frozen=True, eq=False)
class Dae(Posed):
    """One initial value problem as F(t, y, y') = 0, with y = (q, v, lam[, mu]), or (q, p, lam[, mu]) where the problem is given by H(p, q).

    The formulation is one of ``FORMULATIONS``, and ``ode`` is HLW (1.18). Multipliers as derivatives have the unknowns Lam with Lam' = lam
    (and Mu' = mu). At the start rates and lam solve [[M, G^T], [G, 0]] (v', lam) = (-(U_q + c), -g_qv v), or (1.12) for H(p, q); mu = 0.
    """

    ivp: ConstrainedIvp
    d: int
    m: int
    """Numbers of positions and of constraints."""

    @property
    def mechanical(self) -> bool:
        """Whether velocities are unknowns; otherwise momenta are."""
        return bool(self.module.MECHANICAL)

    @property
    def blocks(self) -> dict[str, slice]:
        """Where the unknowns are: "q", "v" (velocities, or the momenta in their place), and "lam", "mu" where there are any."""
        names = ("q", "v", *_multiplier_names(self.formulation))
        lengths = {"q": self.d, "v": self.d, "lam": self.m, "mu": self.ivp.holonomic}
        ends = np.cumsum([0, *(lengths[name] for name in names)])
        return {name: slice(int(a), int(b)) for name, a, b in zip(names, ends[:-1], ends[1:], strict=True)}

    def unpack(self, Y: Array) -> tuple[Array, Array]:
        """Return (q, v), or (q, p) where momenta are the unknowns, each shape(rows, d), from rows of unknowns; as copies."""
        return Y[:, : self.d].copy(), Y[:, self.d : 2 * self.d].copy()

    def momenta(self, q: Array, v: Array) -> Array:
        """Return p = M(q) v, shape(rows, d), of what ``unpack`` gave."""
        return np.einsum("rij,rj->ri", self.ivp.along("M", q), v) if self.mechanical else v


def pose(ivp: ConstrainedIvp, formulation: str, options: Mapping[str, float] | None = None, *, multipliers: str = "plain") -> Dae:
    """Return the initial value problem in a formulation."""
    if formulation not in FORMULATIONS:
        raise unknown("formulation", formulation, FORMULATIONS)
    if multipliers not in ("plain", "derivative"):
        raise unknown("treatment of multipliers", multipliers, ("plain", "derivative"))
    par = np.array([*ivp.par, *free_numbers(formulation, options or {}).values()], dtype=float)
    module = _module(ivp, formulation, multipliers if formulation != "ode" else "plain")
    with np.errstate(all="ignore"):
        y0, yp0 = _start(ivp, formulation, multipliers, module, par)
    return Dae(formulation, multipliers, ivp, par, y0, yp0, module, ivp.d, ivp.m)


def _multiplier_names(formulation: str) -> tuple[str, ...]:
    return {"ode": (), "ggl": ("lam", "mu")}.get(formulation, ("lam",))


def free_numbers(formulation: str, given: Mapping[str, float]) -> dict[str, float]:
    """Return the free numbers of a formulation, with the given values over the defaults."""
    values = dict(OPTIONS.get(formulation, {}))
    for name, value in given.items():
        if name not in values:
            raise unknown(f"option of {formulation}", name, values)
        if not (math.isfinite(value) and value >= 0):
            raise BadInput(f"{name} = {value} of {formulation} must be a finite number of at least 0.", "number-negative-or-infinite")
        values[name] = float(value)
    return values


def _module(ivp: ConstrainedIvp, formulation: str, multipliers: str) -> types.ModuleType:
    def build() -> str:
        from daebench.methods.formulations import residuals

        title = f"{ivp.problem} as {formulation}, multipliers {multipliers}."
        return residuals.source(title, ivp.source.derivation, formulation, multipliers)

    return generated(f"{ivp.problem}_{formulation}", f"{ivp.source.key} dae {formulation} {multipliers}", build)


def _start(ivp: ConstrainedIvp, formulation: str, multipliers: str, module: types.ModuleType, par: Array) -> tuple[Array, Array]:
    """Return consistent y0 and yp0."""
    state = np.concatenate([ivp.q0, _velocity(ivp) if module.MECHANICAL else ivp.p0])
    rates = np.empty_like(state)
    if formulation == "ode":
        require_determined(ivp, module.rhs(0.0, state, rates, par))
        return state, rates
    A, b = np.empty((module.K, module.K)), np.empty((module.K, 1))
    module.system(state, A, b[:, 0], par)
    require_determined(ivp, eliminate(A, b))
    module.slope(state, b[:, 0], rates, par)
    lam = b[-ivp.m :, 0]
    mu: Any = np.zeros(ivp.holonomic * (len(_multiplier_names(formulation)) - 1))
    forces, nothing = np.concatenate([lam, mu]), np.zeros(len(lam) + len(mu))
    require_determined(ivp, float(np.sum(0.0 * rates) + np.sum(0.0 * lam) + 1.0))
    plain = multipliers == "plain"
    return np.concatenate([state, forces if plain else nothing]), np.concatenate([rates, nothing if plain else forces])


def _velocity(ivp: ConstrainedIvp) -> Array:
    """Return v0 with M(q0) v0 = p0."""
    M, v = ivp.value("M", ivp.q0).astype(float), ivp.p0[:, None].copy()
    if not eliminate(M, v) > SINGULAR:
        raise DaebenchError(
            f"the mass matrix of {ivp.problem}, case {ivp.case}, is singular at the start; give other masses.", "mass-singular-at-start"
        )
    return v[:, 0]


def require_determined(ivp: ConstrainedIvp, health: float) -> None:
    """Raise if the multiplier at the start is not determined."""
    if not health > SINGULAR:
        where = f"{ivp.problem}, case {ivp.case}, has no multiplier at the start"
        if why := dependence(ivp):
            raise DaebenchError(f"{where}: G M^-1 G^T is singular there; {why}.", "constraints-dependent")
        if math.isnan(health):
            raise DaebenchError(f"{where}: a value is not finite there; check parameters and initial values.", "not-finite-at-start")
        raise DaebenchError(
            f"{where}: G M^-1 G^T is singular there (relative pivot {health:.1e}); "
            "remove redundant constraints, or start where the constraints are independent.",
            "constraints-nearly-dependent",
        )
