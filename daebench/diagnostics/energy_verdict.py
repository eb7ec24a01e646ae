"""The verdict on the energy of a run, and the size of its error."""

from dataclasses import dataclass

import numpy as np

from daebench.diagnostics.energy import Drift, energy_drift
from daebench.diagnostics.integrals import energy_error
from daebench.runs.ivp import Array, InitialValueProblem
from daebench.runs.trajectory import PoissonTrajectory, Trajectory

LOST = 1.0
"""Energy error, in parts of the mean kinetic energy, above which a motion is lost."""


@dataclass(frozen=True)
class EnergyScales:
    """Energies along a run, in the unit of H.

    Parameters
    ----------
    kinetic : float
        Mean kinetic energy p^T H_p / 2; of a Poisson system the mean |H|.
    most : float
        The largest of kinetic and potential energy, max(|T|, |U|), along the run; of a Poisson system the largest |H|.
    """

    kinetic: float
    most: float


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
        H = np.abs(np.asarray(ivp.along("H", run.y), dtype=float))
        return EnergyScales(float(np.mean(_finite(H))), float(np.max(_finite(H))))
    T = np.sum(run.p * np.asarray(ivp.along("H_p", run.p, run.q), dtype=float), axis=1) / 2
    U = np.asarray(ivp.along("H", run.p, run.q), dtype=float) - T
    T, U = _finite(np.abs(T)), _finite(np.abs(U))
    return EnergyScales(float(np.mean(T)), float(max(np.max(T), np.max(U))))


def energy_verdict(ivp: InitialValueProblem, run: Trajectory | PoissonTrajectory) -> Drift:
    """Return the verdict on the energy error of a run, see :func:`daebench.diagnostics.energy.energy_drift`.

    Parameters
    ----------
    ivp : InitialValueProblem
        The problem with its numbers.
    run : Trajectory or PoissonTrajectory
        A run on it, with outputs that resolve its oscillations.
    """
    states = run.y if isinstance(run, PoissonTrajectory) else run.q
    eps = float(np.finfo(states.dtype).eps)
    scale = energy_scales(ivp, run).most
    resolution = eps * max(abs(float(ivp.value("H", *ivp.start))), scale)
    error, failure = energy_error(ivp, run), run.failure or ""
    return energy_drift(run.t, error, resolution=resolution, scale=scale, steps=run.steps, eps=eps, failure=failure)


def size(error: float, scales: EnergyScales) -> float:
    """Return an energy error in parts of the mean kinetic energy; above :data:`LOST` the motion is lost."""
    return error / scales.kinetic if scales.kinetic > 0 else (0.0 if error == 0 else float("inf"))


def _finite(values: Array) -> Array:
    """Return the values that are finite, or 0 where none is."""
    finite = values[np.isfinite(values)]
    return finite if len(finite) else np.zeros(1)
