"""The tolerance of a constraint solver for a given energy drift."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, Unpack, cast

import numpy as np

from daebench.diagnostics.drift import BOUNDED, DRIFTS, KEPT, Drift
from daebench.diagnostics.energy import ROUNDED
from daebench.diagnostics.energy_verdict import energy_error, energy_scales, energy_verdict, kinetic_energy
from daebench.diagnostics.freedom import freedom
from daebench.errors import BadInput, positive, require_known
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.fixed_step.constraint_structure import finest
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.registry import registry
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.make_ivp import require_constraints
from daebench.runs.own_start import OwnStart
from daebench.runs.request import PRECISIONS, Request
from daebench.runs.result import Result, Table
from daebench.runs.trajectory import Trajectory

TOLERANCES = tuple(10.0**-k for k in range(3, 15))
"""Tolerances that are tried, the loosest first."""

LITTLE = 0.1
"""Standard deviation of the kinetic energy, in parts of its mean, up to which it is asked whether it is that of the motion."""

REST = 1e-6
"""Part of the largest energy that the mean kinetic energy counts for at least."""

EPS = float(np.finfo(float).eps)

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
class ToleranceFor(Result):
    """Tolerances that were tried, the loosest first.

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

    fails_if: ClassVar[str] = "there is none"

    ivp: ConstrainedIvp
    method: str
    h: float
    t: float
    most: float
    tried: tuple[TriedTolerance, ...]

    @property
    def tolerance(self) -> float | None:
        """The loosest tolerance with which, and with all tighter ones, the drift is small enough; None where there is none."""
        loosest = None
        for row in reversed(self.tried):
            if not row.keeps(self.most):
                break
            loosest = row.tolerance
        return loosest

    @property
    def fortuitous(self) -> tuple[float, ...]:
        """Looser tolerances whose drift is small enough although that of a tighter one is not."""
        return tuple(row.tolerance for row in self.tried if row.keeps(self.most) and row.tolerance > (self.tolerance or 0.0))

    def summary(self) -> dict[str, Any]:
        """Return the results, for text and JSON."""
        about = {"problem": self.ivp.problem, "case": self.ivp.case, "method": self.method, "h": self.h, "t_end": self.t}
        names = ("ratio", "rate", "rounds")
        return {
            **about,
            "drift": self.most,
            "tolerance": self.tolerance,
            "fortuitous": list(self.fortuitous),
            "tried": [
                {"tolerance": row.tolerance, "verdict": row.drift.verdict, **{name: getattr(row, name) for name in names}}
                for row in self.tried
            ],
        }

    @property
    def status(self) -> int:
        """1 if no tolerance is small enough."""
        return int(self.tolerance is None)

    def printed(self) -> Iterator[str | Table]:
        """Yield the tolerances that were tried, and the answer."""
        rows = [[f"{r.tolerance:g}", r.drift.verdict, f"{r.ratio:.2g}", f"{r.rate:.2g}", f"{r.rounds:.3g}"] for r in self.tried]
        yield Table(["tolerance", "energy", "drift / std(T), at most", "per s and degree of freedom", "rounds a step"], rows)
        yield "no tolerance tried is small enough" if self.tolerance is None else f"tolerance = {self.tolerance:g}"
        if self.fortuitous:
            yield f"small enough too, but not with every tighter tolerance: {', '.join(f'{x:g}' for x in self.fortuitous)}"


def tolerance_for(
    problem: Any,
    *,
    drift: float,
    h: float,
    t_end: float,
    method: str = "rattle_gauss_seidel",
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    on_singular: str | None = None,
    precision: str = "float64",
    tolerances: Sequence[float] = TOLERANCES,
    progress: Callable[[float], object] | None = None,
    **start: Unpack[OwnStart],
) -> ToleranceFor:
    """Find the loosest tolerance of constraints for which, as for all tighter ones, the energy drift is small enough.

    The drift is an upper bound on the change of the mean of H over the run, see :class:`daebench.diagnostics.drift.Drift`, in standard
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
        Largest change of the energy over the run, in parts of the standard deviation of the kinetic energy.
    h : float
        Step size, s.
    t_end : float
        Time of each run, s.
    method : str
        Name of a scheme with a tolerance: "rattle_gauss_seidel" or "rattle_ilves".
    case, parameters, on_singular
        As for :func:`daebench.run`.
    precision : str
        "float64", "mixed" or "float32": tolerances that its rounding does not reach are left out.
    tolerances : sequence of float
        Tolerances that are tried.
    progress : callable, optional
        Called with the fraction of the runs done.
    **start : OwnStart
        A start of one's own in place of the case's: q0, p0, v0, y0 and project, as for :func:`daebench.initial_value_problem`.

    Raises
    ------
    BadInput
        If the method has no tolerance, refuses the problem, or the request cannot be met; or if the kinetic energy does not fluctuate.
    """
    require_known(("precision", precision, PRECISIONS))
    ivp = initial_value_problem(problem, case, parameters, on_singular=on_singular, **start)
    with_tolerance = [name for name, (_, member) in registry().items() if "tolerance" in member.options]
    if method not in with_tolerance:
        raise BadInput(f"{method} has no tolerance of its own; take one of {', '.join(with_tolerance)}.", "method-without-tolerance")
    ivp = require_constraints(ivp, "without any", "tolerances are those of constraints, and ")
    positive("drift", drift)
    wanted = sorted((tolerance for tolerance in tolerances if tolerance >= finest(precision)), reverse=True)
    if not wanted:
        raise BadInput(
            f"none of these tolerances is reached in {precision}, whose rounding leaves {finest(precision):.2g}; give larger ones.",
            "tolerances-below-round-off",
        )
    run = partial(_run, ivp, method, float(t_end), precision)
    tightest = run(wanted[-1], float(h))
    _require_fluctuation(ivp, tightest, partial(run, wanted[-1], float(h) / 2))
    counted = freedom(ivp)
    degrees = max(1, counted.degrees if counted else ivp.moving - ivp.m)
    tried = []
    for k, tolerance in enumerate(wanted):
        one = tightest if tolerance == wanted[-1] else run(tolerance, float(h))
        tried.append(_tried(ivp, tolerance, one, float(t_end) * degrees))
        if progress:
            progress((k + 1) / len(wanted))
    return ToleranceFor(ivp, method, float(h), float(t_end), drift, tuple(tried))


def _tried(ivp: ConstrainedIvp, tolerance: float, run: Trajectory, over: float) -> TriedTolerance:
    """Return the drift of a run with one tolerance; its rate is that over a time and for each degree of freedom, whose product is given."""
    drift = energy_verdict(ivp, run)
    change = float(np.nanmax([abs(drift.change), drift.change_bound, 0.0])) if run.failure is None else np.inf
    size = fluctuation(ivp, run)
    ratio = float(change / size) if size > 0 else np.inf
    return TriedTolerance(tolerance, drift, ratio, float(change / over), run.work.get("newton", 0) / max(1, run.steps))


def _run(ivp: ConstrainedIvp, method: str, t_end: float, precision: str, tolerance: float, h: float) -> Trajectory:
    """Return the run with one tolerance and step size."""
    request = Request(value=h, t_end=t_end, every=max(1, int(t_end / h / OUTPUTS)), precision=cast(Any, precision))
    return FixedStep(method, options={"tolerance": tolerance}).solve(ivp, request)


def _require_fluctuation(ivp: ConstrainedIvp, coarse: Trajectory, half: Callable[[], Trajectory]) -> None:
    """Accept a motion whose kinetic energy fluctuates by more than rounding, and not by the error of the step alone.

    The error e of the energy fluctuates too; what is looked at is T - e, which on the motion itself is T. Where it fluctuates little, half
    the step tells whether this is the motion or the step: an error is then a quarter.
    """
    # A run that cannot start fails with every tolerance, for a reason that a table of failures would hide.
    if coarse.failure is not None and not coarse.steps:
        raise BadInput(coarse.failure, "coarse-run-failed")
    spread, level, rounding = _own_fluctuation(ivp, coarse)
    if coarse.failure is not None or spread > LITTLE * level:
        return
    why = f"{spread:.2g}, is round-off"
    if spread > rounding:
        finer = half()
        if finer.failure is not None or _own_fluctuation(ivp, finer)[0] > spread / 2:
            return
        why = f"{spread:.2g} with h = {coarse.value:g}, falls with h"
    raise BadInput(
        f"the kinetic energy of {ivp.problem}, case {ivp.case}, does not fluctuate: its standard deviation along the motion, {why}, and no "
        "drift can be measured in parts of it; choose a motion that exchanges kinetic and potential energy.",
        "kinetic-energy-constant",
    )


def _own_fluctuation(ivp: ConstrainedIvp, run: Trajectory) -> tuple[float, float, float]:
    """Return the standard deviation of T - e along a run, the mean of its modulus, and a size that rounding explains."""
    kinetic = _kinetic(ivp, run) - energy_error(ivp, run)
    most = float(energy_scales(ivp, run).most)
    return float(np.std(kinetic)), max(float(np.mean(np.abs(kinetic))), REST * most), ROUNDED * EPS * max(1, run.steps) ** 0.5 * most


def fluctuation(ivp: ConstrainedIvp, run: Trajectory) -> float:
    """Return the standard deviation of the kinetic energy along a run."""
    return float(np.std(_kinetic(ivp, run)))


def _kinetic(ivp: ConstrainedIvp, run: Trajectory) -> Array:
    return np.asarray(kinetic_energy(ivp, run.p, run.q))
