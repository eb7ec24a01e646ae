"""The change of the energy by the solver of constraints, for every setting: its size, its growth with time, and the verdict on it."""

from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.drift import KEPT, UNDETERMINED
from daebench.diagnostics.freedom import freedom
from daebench.diagnostics.random_walk import random_walk
from daebench.methods.fixed_step.constraint_structure import spectral_radius
from daebench.methods.names import method_of
from daebench.reports.molecules.motions import (
    LINCS,
    MIDDLE,
    STEPS,
    Energies,
    Setting,
    change,
    converged,
    energies,
    fluctuation,
    ivp_of,
    settings,
    starts,
)
from daebench.runs.ivp import Array

LAST = 8
"""The change of a run is the mean of its energy over the last eighth of its time, from its start."""

EPS = 2.0**-52

UNJUDGED = {"verdict": "", "law": "", "reason": "", "alpha": np.nan, "alpha_error": np.nan}
"""Columns of a verdict where none is asked for."""


def described(molecule: str) -> tuple[dict[str, Any], pd.DataFrame]:
    """Return the description of a molecule, and the energies of its converged runs."""
    ivp = ivp_of(molecule)
    free = freedom(ivp)
    about = {"molecule": molecule, "positions": ivp.d, "constraints": ivp.m, "degrees": free.degrees if free else ivp.d - ivp.m}
    about |= {"radius": spectral_radius(ivp), "refused": method_of(ivp, LINCS).refusal(ivp) or ""}
    about["loose"] = looseness(molecule)
    rows = []
    for h in STEPS[molecule]:
        runs, size = converged(molecule, h), fluctuation(molecule, h)
        error = (runs.total - runs.total[:, :1]) / size
        walk = random_walk(runs.t, error, resolution=EPS * float(np.max(np.abs(runs.total))) / size)
        row = {
            "molecule": molecule,
            "h": h,
            "fluctuation": size,
            "kinetic": float(np.mean(runs.kinetic)),
            "oscillation": float(np.std(error)),
        }
        rows.append(row | {"rounds": runs.rounds, "verdict": walk.verdict, "reason": walk.reason, "bound": walk.change_bound})
    return about, pd.DataFrame(rows)


def looseness(molecule: str) -> float:
    """Return how many times as large an error of a distance a tolerance allows here as in programs of molecular dynamics, in the mean.

    ::

        sum_i |G_ki q_i| / |sum_i G_ki q_i|,        |sum_i G_ki q_i| = 2 d^2 for |r|^2 = d^2
    """
    ivp, q = ivp_of(molecule), np.array([start.q0 for start in starts(molecule)], dtype=float)
    terms = np.asarray(ivp.along("G", q), dtype=float) * q[:, None, :]
    return float(np.mean(np.sum(np.abs(terms), axis=2) / np.abs(np.sum(terms, axis=2))))


def measured(molecule: str, scheme: str, precision: str) -> tuple[pd.DataFrame, pd.DataFrame, pd.DataFrame]:
    """Return the rows of all settings of one kernel: of runs, of starts, and of the growth with time."""
    rows, ends, growth = [], [], []
    for setting in settings(molecule, scheme, precision):
        runs = energies(setting)
        off = change(setting, runs)
        rows.append(row(setting, runs, off))
        ends.append(pd.DataFrame(vars(setting) | {"start": np.arange(len(off)), "change": final(off)}))
        if setting.h == MIDDLE:
            t, mean, spread = windows(runs.t, off)
            growth.append(pd.DataFrame(vars(setting) | {"t": t, "mean": mean, "spread": spread}))
    return pd.DataFrame(rows), pd.concat(ends, ignore_index=True), pd.concat(growth, ignore_index=True)


def row(setting: Setting, runs: Energies, off: Array) -> dict[str, Any]:
    """Return the setting, the change of the energy over the starts, and with the middle step the verdict.

    The moduli of the changes from all starts are between ``low`` and ``high``. The slope is that of the last seven eighths of the time, by
    the whole time, so that it is the change of that straight line.
    """
    ends = final(off)
    low, median, high = np.quantile(np.abs(ends), (0.0, 0.5, 1.0))
    later = slice(off.shape[1] // LAST, None)
    slopes = np.polyfit(runs.t[later], off[:, later].T, 1)[0] * runs.t[-1]
    n = np.sqrt(len(ends))
    columns = vars(setting) | {"rounds": runs.rounds, "nanoseconds": runs.nanoseconds}
    columns |= {"mean": float(np.mean(ends)), "error": float(np.std(ends, ddof=1) / n), "spread": float(np.std(ends, ddof=1))}
    columns |= {"low": float(low), "median": float(median), "high": float(high)}
    columns |= {"slope": float(np.mean(slopes)), "slope_error": float(np.std(slopes, ddof=1) / n)}
    return columns | (judged(setting, runs, off) if setting.h == MIDDLE else UNJUDGED)


def judged(setting: Setting, runs: Energies, off: Array) -> dict[str, Any]:
    """Return the verdict on the change of the energy, and the exponent of time by which the starts spread."""
    eps = EPS if setting.numbers == "float64" else 2.0**-23
    size = float(np.max(np.abs(runs.total))) / fluctuation(setting.molecule, setting.h)
    if np.max(np.abs(off)) <= eps * size:
        return UNJUDGED | {"verdict": KEPT}
    if len(np.unique(off, axis=0)) < len(off):
        return UNJUDGED | {"verdict": UNDETERMINED, "reason": "some runs are the converged ones to the last bit"}
    walk = random_walk(runs.t, off, resolution=eps * size)
    return {"verdict": walk.verdict, "law": walk.law, "reason": walk.reason, "alpha": walk.exponent, "alpha_error": walk.exponent_error}


def final(off: Array) -> Array:
    """Return the change of each run: the mean over the last eighth of its time, shape(starts,)."""
    return np.asarray(np.mean(off[:, -(off.shape[1] // LAST) :], axis=1))


def windows(t: Array, off: Array) -> tuple[Array, Array, Array]:
    """Return the middles of windows half an octave long, and the mean and the standard deviation over the starts of their means there."""
    edges = np.unique(np.searchsorted(t, t[-1] * 2.0 ** (np.arange(-10, 1) / 2)))
    edges[-1] = len(t)
    parts = [slice(a, b) for a, b in pairwise(edges) if b > a]
    means = np.array([np.mean(off[:, part], axis=1) for part in parts])
    return np.array([np.mean(t[part]) for part in parts]), np.mean(means, axis=1), np.std(means, axis=1, ddof=1)
