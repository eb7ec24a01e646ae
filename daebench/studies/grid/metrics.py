"""The metrics of one run, by name: each a few columns of the table, with units and requirements."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.branch import largest_jump
from daebench.diagnostics.energy_verdict import energy_error, energy_scales, kinetic_energy, size
from daebench.diagnostics.integrals import integral_errors
from daebench.diagnostics.poisson import poisson_defect
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis
from daebench.errors import BadInput, unknown
from daebench.reference.keep.dense_evaluation import At, states_at
from daebench.reference.solution import OwnRun
from daebench.runs.ivp import Ivp
from daebench.runs.state import CONSTRAINED
from daebench.runs.trajectory import Array, PoissonTrajectory, Trajectory
from daebench.studies.claims.bench import DEFECT_STEPS
from daebench.studies.grid.reference import certified_of, own_of, require_reference
from daebench.studies.grid.run_specification import FEWEST, GridRun
from daebench.studies.held_verdict import held_verdict

LOST = 1e-2
"""Error, in parts of the largest coordinate, with which a motion is lost."""

ENOUGH = 8
"""Outputs at stored times from which on errors are taken at these alone: between stored times a reference has to be integrated."""


@dataclass(frozen=True)
class Measured:
    """A run, and its reference.

    Parameters
    ----------
    specification : GridRun
        What was asked.
    ivp : InitialValueProblem
        The problem.
    solver : method
        The method.
    run : Trajectory or PoissonTrajectory
        What it gave.
    """

    specification: GridRun
    ivp: Ivp
    solver: Any
    run: Trajectory | PoissonTrajectory

    @property
    def told(self) -> bool:
        """Whether the run tells anything: it took a step, did not fail, and was looked at more than twice."""
        return self.run.failure is None and self.run.steps > 0 and len(self.run.t) >= FEWEST

    @property
    def states(self) -> tuple[Array, ...]:
        """States at the outputs: p and q, or y."""
        return self.run.vectors

    @cached_property
    def compared(self) -> NDArray[np.bool_]:
        """Which outputs errors are taken at, shape(n,)."""
        certified = certified_of(self.specification)
        stored = np.isin(self.run.t, certified.t if certified else ())
        return stored if np.sum(stored) >= ENOUGH else np.ones(len(self.run.t), dtype=bool)

    @cached_property
    def reference_solution(self) -> At | OwnRun:
        """The certified reference at these outputs, or a finer run where there is none."""
        certified, t = certified_of(self.specification), self.run.t[self.compared]
        return states_at(certified, t) if certified else own_of(self.specification, t)

    @property
    def against(self) -> str:
        """The reference of errors, in words."""
        reference = self.reference_solution
        return reference.words if isinstance(reference, OwnRun) else f"certified {self.specification.problem}-{self.specification.case}"

    def part(self, name: str) -> Array:
        """Return a part of the run's states at these outputs: "q", "p", "y", or "lam"."""
        if name != "lam":
            return np.asarray(getattr(self.run, name))[self.compared]
        return np.asarray(self.ivp.along("lam", *(x[self.compared] for x in self.states)), dtype=float)


Columns = Mapping[str, float | str]


@dataclass(frozen=True)
class Metric:
    """A metric of a run.

    Parameters
    ----------
    name : str
        Name.
    columns : mapping of str to str
        Names of its columns, and their units.
    about : str
        Description in one line.
    measure : callable
        Returns the columns of a usable run.
    poisson, constrained : bool
        For which kinds of problems it is.
    certified : bool
        Whether it is an error against a reference: the certified one where it fits, else a finer run.
    fixed_step : bool
        Whether it is for fixed-step methods only; other methods of a study have NaN.
    """

    name: str
    columns: Mapping[str, str]
    about: str
    measure: Callable[[Measured], Columns]
    constrained: bool = True
    poisson: bool = True
    certified: bool = False
    fixed_step: bool = False

    def measures(self, solver: Any) -> bool:
        """Whether it is for methods like this one."""
        return not self.fixed_step or bool(solver.knob == "h")

    def refusal(self, specification: GridRun) -> str | None:
        """Return why a run cannot be measured by it, as a sentence, or None."""
        ivp = specification.ivp
        if self.name == "defect" and ivp.nonholonomic:
            return f"{self.name} is not measured on {ivp.problem}: where constraints are on velocities, the motion preserves no two-form."
        missing = {*CONSTRAINED.monitors, *CONSTRAINED.stored} - {*ivp.state.monitors, *ivp.state.stored}
        if not (self.constrained if ivp.on_manifold else self.poisson) or self.name in missing:
            return f"{self.name} is not measured on {ivp.problem}, which is {ivp.state.words}."
        if not self.measures(specification.solver):
            return f"{self.name} is for fixed-step methods, and {specification.method} is not one; leave out one of them."
        try:
            require_reference(specification, f"the error {self.name}") if self.certified else None
        except BadInput as error:
            return str(error)
        return None


def _error(part: str) -> Callable[[Measured], Columns]:
    def measure(measured: Measured) -> Columns:
        reference = measured.reference_solution
        off = np.abs(measured.part(part) - reference.states[part])
        return {f"error_{part}": float(np.max(off)), f"bound_{part}": float(np.max(reference.bound[part]))}

    return measure


def _phase(measured: Measured) -> Columns:
    """Return by how much time the run is early or late, at most: its error along the motion over the speed there."""
    reference, parts = measured.reference_solution, measured.ivp.state.vectors
    n = measured.ivp.moving  # the time itself is never late, and has a unit of its own
    rates = np.concatenate([rate[:, :n] for rate in _rates(measured.ivp, *(reference.states[part] for part in parts))], axis=1)
    off = np.concatenate([(measured.part(part) - reference.states[part])[:, :n] for part in parts], axis=1)
    speed = np.sum(rates**2, axis=1)
    moving = speed > 1e-12 * float(np.max(speed))
    late = np.sum(off * rates, axis=1)[moving] / speed[moving]
    return {"phase": float(np.max(np.abs(late)))}


def _rates(ivp: Ivp, *states: Array) -> list[Array]:
    """Return p' and q' of HLW (1.18), or y', one row a state."""
    if not ivp.on_manifold:
        return [np.asarray(ivp.along("field", *states), dtype=float)]
    p, q = states
    lam, G = (np.asarray(ivp.along(name, *arguments), dtype=float) for name, arguments in (("lam", (p, q)), ("G", (q,))))
    force = np.einsum("nij,ni->nj", G.reshape(len(q), ivp.m, ivp.d), lam)
    dp = -np.asarray(ivp.along("H_q", p, q), dtype=float) - force
    return [dp, np.asarray(ivp.along("H_p", p, q), dtype=float)]


def _energy(measured: Measured) -> Columns:
    request, scales = measured.specification.asked(measured.solver.knob), energy_scales(measured.ivp, measured.run)
    drift = held_verdict(measured.ivp, measured.solver, request, measured.run)
    worst = float(measured.run.maxima.get("energy", np.max(np.abs(energy_error(measured.ivp, measured.run)))))
    columns: dict[str, float | str] = {"energy_error": worst, "energy_size": size(worst, scales), "energy_scale": _energy_scale(measured)}
    columns |= {"energy_verdict": drift.verdict, "energy_law": drift.words, "energy_change_bound": drift.change_bound}
    return {
        **columns,
        "energy_slope": drift.slope,
        "growth": drift.exponent,
        "growth_low": drift.exponent_low,
        "growth_high": drift.exponent_high,
    }


def _energy_scale(measured: Measured) -> float:
    """Return the scale of an error of the energy: the largest |p^T H_p|, twice the kinetic energy, or the largest |H|."""
    T = kinetic_energy(measured.ivp, *measured.states)
    return float(np.max(np.abs(measured.ivp.along("H", *measured.states) if T is None else 2 * T)))


def _jump(measured: Measured) -> Columns:
    """Return the largest jump of a step; NaN where not every step was looked at."""
    run = measured.run
    if not measured.ivp.on_manifold or len(run.t) <= run.steps:
        return {"jump": math.nan}
    q, v = (x[:, : measured.ivp.moving] for x in (run.position, np.asarray(measured.ivp.along("H_p", *run.vectors), dtype=float)))
    return {"jump": largest_jump(run.t, q, v)}


def _horizon(measured: Measured) -> Columns:
    """Return the last time up to which the error of the position, or of the state, is at most a part of its size."""
    part = measured.ivp.state.position
    n = measured.ivp.moving
    reference, states = (x[:, :n] for x in (measured.reference_solution.states[part], measured.part(part)))
    off = np.max(np.abs(states - reference), axis=1) > LOST * np.max(np.abs(reference))
    t = measured.run.t[measured.compared]
    return {"horizon": float(t[max(int(np.argmax(off)) - 1, 0)] if np.any(off) else t[-1])}


def _integrals(measured: Measured) -> Columns:
    errors = integral_errors(measured.ivp, measured.run)
    return {"integrals": float(max((np.max(np.abs(error)) for error in errors.values()), default=math.nan))}


def _maxima(*names: str) -> Callable[[Measured], Columns]:
    return lambda measured: {name: float(measured.run.maxima.get(name, math.nan)) for name in names}


def _casimirs(measured: Measured) -> Columns:
    maxima = [value for name, value in measured.run.maxima.items() if name in measured.ivp.casimirs]
    return {"casimirs": float(max(maxima, default=math.nan))}


def defect_of(ivp: Ivp, solver: Any, h: float) -> float:
    """Return the symplecticity defect of a few steps of a method with fixed steps, or on a Poisson system the Poisson defect."""
    if not ivp.on_manifold:
        return float(poisson_defect(solver.flow(ivp, h, DEFECT_STEPS), ivp.y0, lambda y: ivp.value("B", y)))
    basis = tangent_basis(ivp, ivp.p0, ivp.q0)
    return float(symplecticity_defect(solver.flow(ivp, h, DEFECT_STEPS), ivp.p0, ivp.q0, basis))


def _defect(measured: Measured) -> Columns:
    """Return the defect of the map in double precision; of that with single precision in it, which is a rounding of it, it is NaN."""
    if measured.specification.precision != "float64":
        return {"defect": math.nan}
    return {"defect": defect_of(measured.ivp, measured.solver, measured.specification.value)}


METRICS: Mapping[str, Metric] = {
    metric.name: metric
    for metric in (
        Metric("q", {"error_q": "length", "bound_q": "length"}, "largest error of a position", _error("q"), poisson=False, certified=True),
        Metric("p", {"error_p": "", "bound_p": ""}, "largest error of a momentum", _error("p"), poisson=False, certified=True),
        Metric("lam", {"error_lam": "", "bound_lam": ""}, "largest error of a multiplier", _error("lam"), poisson=False, certified=True),
        Metric("y", {"error_y": "", "bound_y": ""}, "largest error of a component", _error("y"), constrained=False, certified=True),
        Metric("phase", {"phase": "s"}, "largest time by which it is early or late", _phase, certified=True),
        Metric(
            "energy",
            {
                "energy_error": "",
                "energy_size": "",
                "energy_verdict": "",
                "energy_law": "",
                "energy_change_bound": "",
                "energy_slope": "1/s",
                "growth": "",
                "growth_low": "",
                "growth_high": "",
                "energy_scale": "",
            },
            "largest energy error, also over the mean kinetic energy, and the verdict on its trend; its scale is 2 max T, or |H|",
            _energy,
        ),
        Metric("manifold", {"g": "", "Gv": ""}, "largest |g| and |G H_p|", _maxima("g", "Gv"), poisson=False),
        Metric("casimirs", {"casimirs": ""}, "largest error of a Casimir function", _casimirs, constrained=False),
        Metric("jump", {"jump": ""}, "largest jump of a step, see daebench.diagnostics.branch", _jump, poisson=False, fixed_step=True),
        Metric("horizon", {"horizon": "s"}, f"time until which its error is within {LOST:g} of its size", _horizon, certified=True),
        Metric("integrals", {"integrals": ""}, "largest error of another first integral that the problem declares", _integrals),
        Metric("defect", {"defect": ""}, f"defect of the two-form over {DEFECT_STEPS} steps", _defect, fixed_step=True),
    )
}
"""The metrics other than work and time, which every run has."""


def metrics_of(names: Sequence[str]) -> list[Metric]:
    """Return metrics by their names; raise BadInput if a name is unknown, or there are none."""
    if not names:
        raise BadInput(f"a study needs metrics; name some of {', '.join(METRICS)}.", "metrics-missing")
    for name in names:
        if name not in METRICS:
            raise unknown("metric", name, METRICS)
    return [METRICS[name] for name in names]
