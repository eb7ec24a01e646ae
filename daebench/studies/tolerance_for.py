"""The tolerance of a constraint solver for a given energy drift."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from daebench.diagnostics.energy import BOUNDED, DRIFTS, KEPT, Drift
from daebench.diagnostics.energy_verdict import energy_verdict
from daebench.diagnostics.freedom import freedom
from daebench.errors import BadInput, positive, require_known
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.fixed_step.constraint_structure import finest
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.registry import registry
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.request import PRECISIONS, Request
from daebench.runs.trajectory import Trajectory

TOLERANCES = tuple(10.0**-k for k in range(3, 15))
"""Tolerances that are tried, the loosest first."""

OUTPUTS = 2000
"""States of a run from which its drift is read, about."""


@dataclass(frozen=True)
class TriedTolerance:
    """One tolerance, and the drift of the energy with it.

    Parameters
    ----------
    tolerance : float
        Tolerance of the constraints, relative to their terms.
    drift : Drift
        Verdict on the energy, and its change, in the unit of H.
    ratio : float
        Upper bound on the change of the mean of H over the run, in standard deviations of the kinetic energy; infinite where the run
        stopped.
    rate : float
        The same bound per time and degree of freedom, in the unit of H per s.
    rounds : float
        Rounds of the solver in a step, for positions and for momenta together.
    """

    tolerance: float
    drift: Drift
    ratio: float
    rate: float
    rounds: float

    def keeps(self, most: float) -> bool:
        """Return whether the mean of the energy surely changes by so many standard deviations of the kinetic energy at most."""
        return self.drift.verdict == KEPT or (self.drift.verdict in (BOUNDED, DRIFTS) and self.ratio <= most)


@dataclass(frozen=True)
class ToleranceFor:
    """What was tried, the loosest tolerance first.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem.
    method : str
        Name of the method.
    h, t : float
        Step size and time of the runs, s.
    most : float
        Largest drift over that time, in parts of the standard deviation of the kinetic energy.
    tried : tuple of TriedTolerance
        The runs.
    """

    ivp: ConstrainedIvp
    method: str
    h: float
    t: float
    most: float
    tried: tuple[TriedTolerance, ...]

    @property
    def tolerance(self) -> float | None:
        """The loosest tolerance with which, and with all tighter ones, the drift is small enough; None where there is none."""
        found = None
        for row in reversed(self.tried):
            if not row.keeps(self.most):
                break
            found = row.tolerance
        return found

    @property
    def fortuitous(self) -> tuple[float, ...]:
        """Looser tolerances whose drift is small enough although that of a tighter one is not."""
        return tuple(row.tolerance for row in self.tried if row.keeps(self.most) and row.tolerance > (self.tolerance or 0.0))

    def summary(self) -> dict[str, Any]:
        """Return the results, for text and JSON."""
        rows = [
            {"tolerance": row.tolerance, "verdict": row.drift.verdict, "ratio": row.ratio, "rate": row.rate, "rounds": row.rounds}
            for row in self.tried
        ]
        about = {
            "problem": self.ivp.problem,
            "case": self.ivp.case,
            "method": self.method,
            "h": self.h,
            "t_end": self.t,
            "drift": self.most,
        }
        return about | {"tolerance": self.tolerance, "fortuitous": list(self.fortuitous), "tried": rows}


def tolerance_for(
    problem: Any,
    *,
    drift: float,
    h: float,
    t_end: float,
    method: str = "rattle_gauss_seidel",
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    precision: str = "float64",
    tolerances: Sequence[float] = TOLERANCES,
    progress: Callable[[float], object] | None = None,
) -> ToleranceFor:
    """Return the loosest tolerance of a constraint solver such that with it and all tighter ones the energy drift is small enough.

    The drift is an upper bound on the change of the mean of H over the run, see :class:`daebench.diagnostics.energy.Drift`, in standard
    deviations of the kinetic energy along the run, so that it has no unit. A tolerance whose drift is small while that of a tighter one is
    not is reported separately, and not chosen::

        >>> import daebench
        >>> found = daebench.tolerance_for("rigid_water", case="tumbling", drift=1e-3, h=0.01, t_end=40, tolerances=[1e-3, 1e-9])
        >>> found.tolerance
        1e-09

    Parameters
    ----------
    problem : str, ConstrainedHamiltonian or InitialValueProblem
        Name in the catalogue, the path of a problem file, which is executed, a definition, or an initial value problem.
    drift : float
        Largest change over the run, in parts of the standard deviation of the kinetic energy.
    h, t_end : float
        Step size and time of the runs, s.
    method : str
        Name of a scheme with a tolerance: "rattle_gauss_seidel" or "rattle_ilves".
    case, parameters
        As for :func:`daebench.run`.
    precision : str
        "float64", "mixed" or "float32": tolerances that its rounding does not reach are left out.
    tolerances : sequence of float
        What is tried.
    progress : callable, optional
        Called with the fraction of the runs done.

    Raises
    ------
    BadInput
        If the method has no tolerance, refuses the problem, or the request cannot be met.
    """
    require_known(("precision", precision, PRECISIONS))
    ivp = initial_value_problem(problem, case, parameters)
    with_tolerance = [name for name, (_, member) in registry().items() if "tolerance" in member.options]
    if method not in with_tolerance:
        raise BadInput(f"{method} has no tolerance of its own; take one of {', '.join(with_tolerance)}.")
    if not isinstance(ivp, ConstrainedIvp):
        raise BadInput(f"tolerances are those of constraints, and {ivp.problem} is a Poisson system, without any.")
    positive("drift", drift)
    wanted = sorted((tolerance for tolerance in tolerances if tolerance >= finest(precision)), reverse=True)
    if not wanted:
        raise BadInput(
            f"none of these tolerances is reached in {precision}, whose rounding leaves {finest(precision):.2g}; give larger ones."
        )
    tried = []
    for k, tolerance in enumerate(wanted):
        tried.append(_tried(ivp, method, tolerance, float(h), float(t_end), precision))
        if progress:
            progress((k + 1) / len(wanted))
    return ToleranceFor(ivp, method, float(h), float(t_end), drift, tuple(tried))


def _tried(ivp: ConstrainedIvp, method: str, tolerance: float, h: float, t_end: float, precision: str) -> TriedTolerance:
    """Return the drift with one tolerance."""
    request = Request(value=h, t_end=t_end, every=max(1, int(t_end / h / OUTPUTS)), precision=cast(Any, precision))
    run = FixedStep(method, options={"tolerance": tolerance}).solve(ivp, request)
    drift = energy_verdict(ivp, run)
    found = freedom(ivp)
    degrees = max(1, found.degrees if found else ivp.d - ivp.m)
    change = float(np.nanmax([abs(drift.change), drift.change_bound, 0.0])) if run.failure is None else np.inf
    size = fluctuation(ivp, run)
    ratio = change / size if size > 0 else np.inf
    rate = change / t_end / degrees
    rounds = run.work.get("newton", 0) / max(1, run.steps)
    return TriedTolerance(tolerance, drift, float(ratio), float(rate), rounds)


def fluctuation(ivp: ConstrainedIvp, run: Trajectory) -> float:
    """Return the standard deviation of the kinetic energy along a run."""
    return float(np.std(np.sum(run.p * np.asarray(ivp.along("H_p", run.p, run.q)), axis=1) / 2))
