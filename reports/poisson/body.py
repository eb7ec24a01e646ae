"""The free rigid body: runs on and off the sphere of constant angular momentum, and the exact curves of constant energy on it."""

import numpy as np
import pandas as pd

from daebench.reports.poisson.runs import defect, errors, ivp_of, kind, method, solve
from daebench.runs.ivp import Array

PROBLEM, CASE = "free_rigid_body", "hlw"
ORDERS = ("strang@123", "strang@132", "strang@213", "strang@231", "strang@312", "strang@321")
METHODS = (*ORDERS, "strang@top", "darboux:verlet", "midpoint", "rk4", "lifted:rattle")
H, STEPS = 0.4, 2500

SHOWN = ("midpoint", "strang@123", "strang@top", "rk4")
H_SHOWN, STEPS_SHOWN = 2.0, 400
STARTS = ((np.cos(1.1), 0.0, np.sin(1.1)), (np.cos(0.45), 0.0, np.sin(0.45)), (np.sin(0.12), np.cos(0.12), 0.0))
"""Starts about axis 3, as in the book; about axis 1; and close to the middle axis, which is unstable."""

ENERGIES = (0.12, 0.35, 0.65, 0.88)
"""Energies of the curves in the background: 0 is the smallest energy on the sphere, 1 the largest."""

AROUND = 181
DEFECT_STEPS = 3


def body(name: str) -> dict[str, object]:
    """Return the errors of the conserved quantities, and the Poisson defect, from the book's start."""
    ivp = ivp_of(PROBLEM, CASE)
    run = solve(ivp, name, H, STEPS).complete()
    deviations = errors(ivp, run)
    numbers: dict[str, object] = {"method": name, "claimed_poisson": method(name).is_poisson(ivp)}
    for quantity in ("energy", "C"):
        numbers |= {quantity: np.max(np.abs(deviations[quantity])), f"{quantity}_kind": kind(run.t, deviations[quantity])}
    return numbers | {"defect": defect(ivp, name, H, DEFECT_STEPS)}


def trajectories(name: str) -> pd.DataFrame:
    """Return the states of the runs with a large step: start, t, y1, y2, y3, and the errors of the energy and of C."""
    frames = []
    for k, y0 in enumerate(STARTS):
        ivp = ivp_of(PROBLEM, CASE, y0=y0)
        run = solve(ivp, name, H_SHOWN, STEPS_SHOWN).complete()
        deviations = errors(ivp, run)
        columns = {"method": name, "start": k, "t": run.t} | {f"y{i + 1}": run.y[:, i] for i in range(3)}
        frames.append(pd.DataFrame(columns | {"energy": deviations["energy"], "C": deviations["C"]}))
    return pd.concat(frames, ignore_index=True)


def polhodes() -> pd.DataFrame:
    """Return the curves in which ellipsoids of constant energy meet the unit sphere: energy, curve, y1, y2, y3.

    About axis 3 for 2 E I2 < 1, about axis 1 for 2 E I2 > 1, on either side; two great circles, the separatrices, between them.
    """
    ivp = ivp_of(PROBLEM, CASE)
    e1, e2, e3 = (1 / moment for moment in ivp.parameters.values())
    levels = [(e3 + share * (e1 - e3)) / 2 for share in ENERGIES]
    starts = [float(ivp.value("H", y0)) for y0 in STARTS]
    frames = []
    for energy in (*levels, e2 / 2, *starts):
        for side, curve in zip(("+", "-"), polhode(energy, (e1, e2, e3)), strict=True):
            drawn = "start" if energy in starts else "separatrix" if energy == e2 / 2 else "level"
            columns = {"drawn": drawn, "energy": energy, "side": side} | {f"y{i + 1}": curve[i] for i in range(3)}
            frames.append(pd.DataFrame(columns))
    return pd.concat(frames, ignore_index=True)


def polhode(energy: float, e: tuple[float, float, float]) -> tuple[Array, Array]:
    """Return both curves of an energy on the unit sphere, shape(3, n) each; e has the inverse moments of inertia, falling."""
    phi = np.linspace(0, 2 * np.pi, AROUND)
    near, far = (2, 0) if 2 * energy <= e[1] else (0, 2)
    y = np.empty((3, AROUND))
    y[far] = np.sqrt((2 * energy - e[near]) / (e[far] - e[near])) * np.cos(phi)
    y[1] = np.sqrt((2 * energy - e[near]) / (e[1] - e[near])) * np.sin(phi)
    y[near] = np.sqrt(np.maximum(0, 1 - y[far] ** 2 - y[1] ** 2))
    other = y.copy()
    other[near] *= -1
    return y, other
