"""Constraints that no positions satisfy: the least residual that is reached from several starts."""

import numpy as np

from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.systems.lazily import scipy

LARGEST = 60
"""Largest number of positions with which contradictions are sought."""

MET = 1e-12
"""Residual, relative to the change of a constraint with the size of positions, that counts as zero; searches end at 1e-16 where it is."""

DIGITS = 1e-6
"""Least residual, relative as well, below which parameters may have too few digits."""

STARTS = (0.0, 0.01, 0.1, 0.3, 0.3, 1.0, 1.0, 1.0) * 4
"""Distances of the starts from the given positions, relative to these."""

TIED = 1e-6
"""Part of the largest residual within which others are equal to it: the first of them is named, whatever their rounding."""

EVALUATIONS = 300
"""Evaluations of the constraints from each start, at most."""


def contradiction(ivp: ConstrainedIvp) -> str:
    """Return a sentence that no positions satisfy all constraints, with the least residual that was reached; "" if some do.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers, off the manifold.
    """
    n = ivp.moving
    if ivp.arrays or ivp.d > LARGEST:
        return ""
    scale = _scales(ivp, n)
    size = float(np.max(np.abs(ivp.q0[:n]))) or 1.0
    # A fixed seed: the same file gives the same sentence.
    draw, least = np.random.default_rng(1), np.full(ivp.m, np.inf)
    for distance in STARTS:
        residual = np.abs(_least_squares(ivp, ivp.q0[:n] + distance * size * draw.standard_normal(n), scale, size))
        if not np.all(np.isfinite(residual)):
            return ""
        if np.max(residual) <= MET:
            return ""
        least = min(least, residual, key=np.linalg.norm)
    # The first of residuals that are equal but for rounding, so that the message does not depend on the machine.
    k = int(np.argmax(least > (1 - TIED) * np.max(least)))
    value, words = f"{least[k] * scale[k]:.3g}", ivp.words(k)
    one = f"{value}, of {words}" if words else f"|{ivp.named(k) if ivp.m > 1 else 'g'}| = {value}"
    digits = ", perhaps to more digits" if np.max(least) < DIGITS else ""
    return (
        f"the constraints of {ivp.problem}, case {ivp.case}, contradict each other: no configuration exists; the least that their "
        f"residuals come to, from {len(STARTS)} starts, is {one}; correct the parameters{digits}, or leave out a constraint."
    )


def _scales(ivp: ConstrainedIvp, n: int) -> Array:
    """Return the change of each constraint under a relative change of the positions by one; 1 if it does not change."""
    G = np.abs(np.asarray(ivp.value("G", tuple(ivp.q0)), dtype=float)[:, :n])
    scale = np.sum(G, axis=1) * float(np.max(np.abs(ivp.q0[:n])))
    return np.asarray(np.where(np.isfinite(scale) & (scale > 0), scale, 1.0))


def _least_squares(ivp: ConstrainedIvp, x0: Array, scale: Array, size: float) -> Array:
    """Return the residuals, relative to their scales, at the least sum of their squares near x0; NaN if they are not defined."""
    rest = tuple(ivp.q0[len(x0) :])

    def residual(x: Array) -> Array:
        return np.asarray(ivp.value("g", (*size * x, *rest)), dtype=float) / scale

    def jacobian(x: Array) -> Array:
        return np.asarray(ivp.value("G", (*size * x, *rest)), dtype=float)[:, : len(x0)] * size / scale[:, None]

    try:
        with np.errstate(all="ignore"):
            # Without a bound on the gradient, which is small before the residual is where constraints are tangential.
            minimum = scipy.optimize.least_squares(residual, x0 / size, jacobian, xtol=1e-15, ftol=1e-12, gtol=None, max_nfev=EVALUATIONS)
    except (ValueError, np.linalg.LinAlgError):
        # NaN withdraws the claim: constraints that are not defined everywhere cannot be called contradictory.
        return np.full(len(scale), np.nan)
    return np.asarray(minimum.fun, dtype=float)
