"""The verdict on the energy of a run, and the size of its error."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.drift import DRIFTS, Drift
from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.oscillations import oscillations
from daebench.runs.ivp import Array, Ivp
from daebench.runs.trajectory import Outcome

LOST = 1.0
"""Energy error, relative to the mean kinetic energy, above which a motion is lost."""

AT_REST = 1e4 * 2.0**-52
"""Least kinetic energy, relative to the largest energy along a run, that sizes are measured by: below it a body is at rest."""

SWINGS = 2
"""Fewest swings of a motion with which a drift of its energy error is distinguished from a part of an oscillation."""

PART = f"too short: the motion swings fewer than {SWINGS} times, and a part of an oscillation looks like a drift"
"""Reason for an undetermined verdict."""


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
    sizes = [x if good.all() else np.where(good, x, 0.0) for x, good in zip(moduli, finite, strict=True)]
    mean = np.sum(sizes[0], axis=-1) / np.maximum(np.count_nonzero(finite[0], axis=-1), 1)
    return EnergyScales(mean, np.maximum.reduce([np.max(x, axis=-1) for x in sizes]))


def energy_error(ivp: Ivp, trajectory: Outcome) -> Array:
    """Return H(x(t)) - H(x0), or H(y(t)) - H(y0), at the outputs, shape(n,), in the unit of H.

    Parameters
    ----------
    ivp : InitialValueProblem
        The problem with its numbers.
    trajectory : Outcome
        A run on it.
    """
    H = ivp.along("H", *trajectory.vectors)
    return np.asarray(H - H[0], dtype=float)


def kinetic_energy(ivp: Ivp, *vectors: Array) -> Array | None:
    """Return T = p^T H_p / 2 along states, shape(n,), without the time; None on a Poisson system, which has no momenta."""
    if not ivp.on_manifold:
        return None
    products = vectors[0] * np.asarray(ivp.along("H_p", *vectors), dtype=float)
    return np.asarray(np.sum(products[:, : ivp.moving], axis=1) / 2)


def energy_scales(ivp: Ivp, run: Outcome) -> EnergyScales:
    """Return the energies along a run; infinite values are left out.

    Parameters
    ----------
    ivp : InitialValueProblem
        The problem with its numbers.
    run : Outcome
        A run on it.
    """
    H = np.asarray(ivp.along("H", *run.vectors), dtype=float)
    if ivp.on_manifold:
        T = np.asarray(kinetic_energy(ivp, *run.vectors))
        received = np.sum(run.vectors[0][:, ivp.moving :], axis=1)  # of a system in time H is K - p_t
        scales = scales_along(T, H - T - received)
    else:
        scales = scales_along(H)
    return EnergyScales(float(scales.kinetic), float(scales.most))


def may_be_a_part(states: Array, sizes: Any) -> NDArray[np.bool_]:
    """Return for which motions a drift of the energy error may be a part of an oscillation, shape(m,).

    The energy error of a method that bounds it oscillates with the motion. The motion therefore has to swing
    at least :data:`SWINGS` times, in the coordinate that swings most often about its mean. An error above :data:`LOST` is no part of an
    oscillation.

    Parameters
    ----------
    states : ndarray, shape(n, m, c)
        Positions of m motions at n times, or all of their coordinates.
    sizes : float or ndarray, shape(m,)
        Their largest energy errors, relative to the mean kinetic energy.
    """
    n, m, c = states.shape
    # The energy error of a good method swings with the motion, so that the motion shows what the error cannot: its own period.
    swings = oscillations(np.ascontiguousarray(states.reshape(n, m * c).T, dtype=float)).reshape(m, c)
    return np.asarray((np.max(swings, axis=1) < SWINGS) & (np.asarray(sizes) < LOST))


def energy_verdict(ivp: Ivp, run: Outcome) -> Drift:
    """Return the verdict on the energy error of a run, see :func:`daebench.diagnostics.energy.energy_drift`.

    A drift that may be a part of an oscillation is "undetermined", see :func:`may_be_a_part`.

    Parameters
    ----------
    ivp : InitialValueProblem
        The problem with its numbers.
    run : Outcome
        A run on it, with outputs that resolve its oscillations.
    """
    states = run.position
    eps = float(np.finfo(states.dtype).eps)
    scales = energy_scales(ivp, run)
    resolution = float(scales.resolution(float(ivp.value("H", *ivp.start)), eps))
    error, failure = energy_error(ivp, run), run.failure or ""
    drift = energy_drift(run.t, error, resolution=resolution, scale=scales.most, steps=run.steps, eps=eps, failure=failure)
    if drift.verdict == DRIFTS and may_be_a_part(states[:, None], size(np.max(np.abs(error)), scales))[0]:
        return drift.undecided(PART)
    return drift


def size(error: Any, scales: EnergyScales) -> Any:
    """Return an energy error, or several, relative to the mean kinetic energy; above :data:`LOST` the motion is lost.

    An error that is not a number has no size: nothing was measured.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        # A body at rest has no kinetic energy to compare with, and rounding would count as a motion that is lost.
        kinetic = np.maximum(scales.kinetic, AT_REST * np.asarray(scales.most))
        return np.where(kinetic > 0, error / kinetic, np.where(error == 0, 0.0, np.abs(error) * np.inf))[()]
