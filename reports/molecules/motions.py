"""The molecules of the report, the starts of their runs, and the solvers that run on them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import pandas as pd

from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.pages.report.tables import part
from daebench.problems import butane, cyclohexane_ring
from daebench.reports.molecules.well import in_a_well
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.request import Request

WATER, BUTANE, RING = "water", "butane", "ring"
TITLES = {WATER: "rigid water", BUTANE: "butane", RING: "cyclohexane"}
CASES = {WATER: "tumbling", BUTANE: "tumbling", RING: "chair"}

STARTS = {WATER: 24, BUTANE: 24, RING: 16}
"""Starts of each molecule: states of one long run, of the same energy therefore."""

APART = 10.0
"""Time between two starts along that run, 0.1 ps."""

T_END = 100.0
"""End of all runs, 0.1 ps: 10 ps."""

OUTPUTS = 256
"""States of a run at which its energy is computed."""

STEPS = {WATER: (0.005, 0.01, 0.02, 0.04), BUTANE: (0.005, 0.01, 0.02, 0.04), RING: (0.02, 0.04)}
"""Steps, 0.1 ps: from 0.5 or 2 to 4 fs. The smallest is that of single precision alone, whose rounding it is here for."""

SMALLEST = 0.005

MIDDLE = 0.02
"""The step of which verdicts and most pictures are, 0.1 ps: 2 fs."""

TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-10, 1e-12)
LOOSER = TOLERANCES[:-2]
"""Those of butane, where tighter ones make no difference that is seen, and of the ring, where a step takes many iterations."""

SINGLE_TOLERANCES = TOLERANCES[:4]
"""Those that single precision reaches; with the smallest step the usual one alone is run."""

USUAL = 1e-5
"""The tolerance of SHAKE of which Hess speaks."""

CONVERGED = ("rattle_ilves", {"tolerance": 1e-14})
"""The solver that meets constraints to round-off, which others are compared with."""

EXPANSIONS = ((4, 1), (4, 2), (8, 1), (8, 2), (8, 4), (8, 8))
"""Orders and iterations of LINCS."""

DOUBLE, SINGLE, COMPENSATED, MIXED = "double", "single", "single, compensated", "mixed"
MULTIPLIERS, DIFFERENCES = "multipliers", "differences"
GAUSS_SEIDEL, ILVES, LINCS, SETTLE, NEWTON = "rattle_gauss_seidel", "rattle_ilves", "rattle_lincs", "rattle_settle", "rattle"

KERNELS = (
    (BUTANE, GAUSS_SEIDEL, DOUBLE),
    (WATER, GAUSS_SEIDEL, DOUBLE),
    (RING, GAUSS_SEIDEL, DOUBLE),
    (BUTANE, GAUSS_SEIDEL, SINGLE),
    (WATER, GAUSS_SEIDEL, SINGLE),
    (BUTANE, NEWTON, DOUBLE),
    (BUTANE, LINCS, SINGLE),
    (BUTANE, LINCS, DOUBLE),
    (WATER, NEWTON, DOUBLE),
    (WATER, SETTLE, SINGLE),
    (WATER, SETTLE, COMPENSATED),
    (WATER, SETTLE, MIXED),
    (WATER, SETTLE, DOUBLE),
    (WATER, LINCS, SINGLE),
    (WATER, LINCS, DOUBLE),
    (BUTANE, ILVES, DOUBLE),
    (WATER, ILVES, DOUBLE),
    (RING, ILVES, DOUBLE),
)
"""Molecule, scheme and precision of everything that is compiled, expensive ones first. The ring and Newton's iteration run in double
precision alone: Hess's sentences are on SHAKE, SETTLE and LINCS, with water and butane."""


@dataclass(frozen=True)
class Setting:
    """Setting of the runs on a molecule from all its starts."""

    molecule: str
    """Key in :data:`TITLES`."""
    scheme: str
    """Name of a scheme."""
    precision: str
    """One of :data:`DOUBLE`, :data:`SINGLE`, :data:`COMPENSATED`, :data:`MIXED`."""
    h: float
    """Step, 0.1 ps."""
    tolerance: float = float("nan")
    """Tolerance of the solver; NaN where it has none."""
    velocities: str = MULTIPLIERS
    """One of :data:`MULTIPLIERS`, :data:`DIFFERENCES`."""
    order: int = 0
    iterations: int = 0
    """Those of LINCS; 0 of others."""

    @property
    def options(self) -> dict[str, float]:
        """Options of the scheme."""
        chosen: dict[str, float] = {"differences": 1.0} if self.velocities == DIFFERENCES else {}
        if np.isfinite(self.tolerance):
            chosen["tolerance"] = self.tolerance
        return chosen | ({"order": float(self.order), "iterations": float(self.iterations)} if self.order else {})

    @property
    def method(self) -> FixedStep:
        """The scheme with its options."""
        return FixedStep(self.scheme, options=self.options, compensated=self.precision == COMPENSATED)

    @property
    def numbers(self) -> str:
        """Arithmetic of its runs, as :func:`daebench.run` names it."""
        return {DOUBLE: "float64", MIXED: "mixed"}.get(self.precision, "float32")


def settings(molecule: str, scheme: str, precision: str) -> Iterator[Setting]:
    """Give the settings of one kernel: every step, with every tolerance or expansion, and both velocities in single precision."""
    both = (MULTIPLIERS,) if precision == DOUBLE else (MULTIPLIERS, DIFFERENCES)
    for h in STEPS[molecule]:
        if h == SMALLEST and precision == DOUBLE:
            continue
        for velocities in both:
            few = velocities == DIFFERENCES or h == SMALLEST
            for choice in _choices(molecule, scheme, precision, few):
                yield Setting(molecule, scheme, precision, h, velocities=velocities, **choice)


def _choices(molecule: str, scheme: str, precision: str, few: bool) -> list[dict[str, Any]]:
    """Return the tolerances or expansions of a scheme; only the usual one where few are enough."""
    if scheme == LINCS:
        pairs = EXPANSIONS if precision == DOUBLE else ((8, 4),)
        return [{"order": order, "iterations": iterations} for order, iterations in pairs]
    if scheme in (GAUSS_SEIDEL, ILVES):
        if precision == DOUBLE:
            return [{"tolerance": tolerance} for tolerance in (TOLERANCES if molecule == WATER else LOOSER)]
        return [{"tolerance": tolerance} for tolerance in ((USUAL,) if few else SINGLE_TOLERANCES)]
    return [{}]


def double(rows: pd.DataFrame, scheme: str) -> pd.DataFrame:
    """Return the rows of a scheme in double precision."""
    return part(rows, scheme=scheme, precision=DOUBLE)


@cache
def ivp_of(molecule: str) -> ConstrainedIvp:
    """Return the initial value problem of a molecule in its potential."""
    free = {BUTANE: butane.problem, RING: cyclohexane_ring.problem}
    ivp = initial_value_problem(in_a_well(free[molecule]()) if molecule in free else "rigid_water", CASES[molecule])
    assert isinstance(ivp, ConstrainedIvp)
    return ivp


@cache
def starts(molecule: str) -> tuple[ConstrainedIvp, ...]:
    """Return the starts: states of one long run with converged constraints."""
    ivp, h = ivp_of(molecule), 0.01
    every = round(APART / h)
    request = Request(value=h, steps=every * STARTS[molecule], every=every, watch=())
    run = FixedStep(CONVERGED[0], options=CONVERGED[1]).solve(ivp, request).complete()
    return tuple(ivp.at(p, q) for p, q in zip(run.p[1:], run.q[1:], strict=True))


@dataclass(frozen=True)
class Energies:
    """Energies of runs from all starts."""

    t: Array
    """Times, 0.1 ps; shape (k,)."""
    total: Array
    kinetic: Array
    """H and the kinetic energy, kJ/mol; shape (starts, k)."""
    rounds: float
    """Rounds of the solver in a step, for positions and momenta together."""
    nanoseconds: float
    """CPU time of a step, the least over the starts, ns."""
    work: Mapping[str, float] = field(default_factory=dict)
    """Everything that is counted, in a step."""


def energies(setting: Setting, t_end: float | None = None) -> Energies:
    """Return the energies along the runs of a setting, in double precision of the states as they are; RunFailed where one stops."""
    end = T_END if t_end is None else t_end
    steps = round(end / setting.h)
    request = Request(value=setting.h, steps=steps, every=max(1, steps // OUTPUTS), watch=(), precision=setting.numbers)
    ivp = ivp_of(setting.molecule)
    runs = [setting.method.solve(start, request).complete() for start in starts(setting.molecule)]
    p, q = (np.concatenate([getattr(run, name) for run in runs]).astype(float) for name in "pq")
    total = np.asarray(ivp.along("H", p, q), dtype=float).reshape(len(runs), -1)
    kinetic = np.sum(p * np.asarray(ivp.along("H_p", p, q), dtype=float), axis=1).reshape(len(runs), -1) / 2
    counts = {name: float(np.mean([run.work[name] for run in runs])) / steps for name in runs[0].work}
    least = min(run.seconds for run in runs) / steps
    return Energies(np.asarray(runs[0].t, dtype=float), total, kinetic, counts.get("newton", 0.0), 1e9 * least, counts)


@cache
def converged(molecule: str, h: float) -> Energies:
    """Return the energies with constraints that are met to round-off, in double precision."""
    return energies(Setting(molecule, CONVERGED[0], DOUBLE, h, tolerance=CONVERGED[1]["tolerance"]))


def change(setting: Setting, runs: Energies) -> Array:
    """Return the change of the energy by the solver, in standard deviations of the kinetic energy, shape(starts, k).

    ::

        e(t) = (H(t) - H_c(t)) - (H(0) - H_c(0)),      H_c of the converged run from the same start with the same step

    What the step does to the energy by itself is in both, as long as the runs are close.
    """
    exact = converged(setting.molecule, setting.h)
    off = runs.total - exact.total
    return np.asarray((off - off[:, :1]) / fluctuation(setting.molecule, setting.h))


def fluctuation(molecule: str, h: float) -> float:
    """Return the standard deviation of the kinetic energy along the converged runs, kJ/mol."""
    return float(np.std(converged(molecule, h).kinetic))
