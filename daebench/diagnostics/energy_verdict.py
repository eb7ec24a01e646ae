"""The verdict on the energy of a run, and the size of its error."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from daebench.diagnostics.energy import DRIFTS, NAN, UNDETERMINED, Drift, energy_drift
from daebench.diagnostics.integrals import energy_error
from daebench.diagnostics.oscillations import oscillations
from daebench.runs.ivp import Array, ConstrainedIvp, InitialValueProblem
from daebench.runs.trajectory import PoissonTrajectory, Trajectory

LOST = 1.0
"""Energy error, in parts of the mean kinetic energy, above which a motion is lost."""


SWINGS = 2
"""Swings of the motion from which on a change of the energy error is told from a part of its oscillation."""


@dataclass(frozen=True)
class EnergyScales:
    """Energies along a run, in the unit of H; for several runs one entry each, shape(m,).

    Parameters
    ----------
    kinetic : float or ndarray
        Mean kinetic energy p^T H_p / 2; of a Poisson system the mean |H|.
    most : float or ndarray
        The largest of kinetic and potential energy, max(|T|, |U|), along the run; of a Poisson system the largest |H|.
    """

    kinetic: Any
    most: Any

    def resolution(self, H0: Any, eps: float) -> Any:
        """Return the round-off of one value of the energy, with its value at the start."""
        return eps * np.maximum(np.abs(H0), self.most)


def scales_along(kinetic: Array, *energies: Array) -> EnergyScales:
    """Return the mean of the kinetic energy, and the largest of it and of other energies, along runs; infinite values are left out.

    Parameters
    ----------
    kinetic, *energies : ndarray, shape(..., n)
        Energies at n times, one row for each run.
    """
    moduli = [np.abs(energy) for energy in (kinetic, *energies)]
    finite = [np.isfinite(x) for x in moduli]
    kept = [x if good.all() else np.where(good, x, 0.0) for x, good in zip(moduli, finite, strict=True)]
    mean = np.sum(kept[0], axis=-1) / np.maximum(np.count_nonzero(finite[0], axis=-1), 1)
    return EnergyScales(mean, np.maximum.reduce([np.max(x, axis=-1) for x in kept]))


def energy_scales(ivp: InitialValueProblem, run: Trajectory | PoissonTrajectory) -> EnergyScales:
    """Return the energies along a run; infinite values are left out.

    Parameters
    ----------
    ivp : InitialValueProblem
        The problem with its numbers.
    run : Trajectory or PoissonTrajectory
        A run on it.
    """
    if isinstance(run, PoissonTrajectory):
        scales = scales_along(np.asarray(ivp.along("H", run.y), dtype=float))
    else:
        assert isinstance(ivp, ConstrainedIvp)
        n = ivp.d - ivp.facts.EXTENDED  # of a system in time H is K - p_t
        products = run.p * np.asarray(ivp.along("H_p", run.p, run.q), dtype=float)
        T, received = np.sum(products[:, :n], axis=1) / 2, np.sum(run.p[:, n:], axis=1)
        scales = scales_along(T, np.asarray(ivp.along("H", run.p, run.q), dtype=float) - T - received)
    return EnergyScales(float(scales.kinetic), float(scales.most))


def swings(run: Trajectory | PoissonTrajectory) -> int:
    """Return how often that coordinate swings about its mean which does so most often, see :mod:`daebench.diagnostics.oscillations`."""
    states = np.asarray(run.y if isinstance(run, PoissonTrajectory) else run.q, dtype=float)
    return int(np.max(oscillations(np.ascontiguousarray(states.T)), initial=0))


def energy_verdict(ivp: InitialValueProblem, run: Trajectory | PoissonTrajectory) -> Drift:
    """Return the verdict on the energy error of a run, see :func:`daebench.diagnostics.energy.energy_drift`.

    The energy error of a method that bounds it oscillates with the motion, and a part of one oscillation looks like a drift. So an error
    that drifts while the motion swings fewer than twice is "undetermined", unless it exceeds the mean kinetic energy.

    Parameters
    ----------
    ivp : InitialValueProblem
        The problem with its numbers.
    run : Trajectory or PoissonTrajectory
        A run on it, with outputs that resolve its oscillations.
    """
    states = run.y if isinstance(run, PoissonTrajectory) else run.q
    eps = float(np.finfo(states.dtype).eps)
    scales = energy_scales(ivp, run)
    resolution = float(scales.resolution(float(ivp.value("H", *ivp.start)), eps))
    error, failure = energy_error(ivp, run), run.failure or ""
    drift = energy_drift(run.t, error, resolution=resolution, scale=scales.most, steps=run.steps, eps=eps, failure=failure)
    if drift.verdict != DRIFTS or size(np.max(np.abs(error)), scales) >= LOST or (seen := swings(run)) >= SWINGS:
        return drift
    reason = f"too short: the motion swings {'once' if seen else 'not once'}, and a part of an oscillation looks like a drift"
    return replace(drift, verdict=UNDETERMINED, reason=reason, law="", exponent=NAN, exponent_error=NAN)


def size(error: Any, scales: EnergyScales) -> Any:
    """Return an energy error, or several, in parts of the mean kinetic energy; above :data:`LOST` the motion is lost."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(scales.kinetic > 0, error / np.asarray(scales.kinetic), np.where(error == 0, 0.0, np.inf))[()]
