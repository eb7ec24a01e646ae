"""IDA on the constraint itself (index 2) and on its derivative (index 1): how far the velocities leave it, and the energy."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.energy_verdict import energy_error, energy_scales, size
from daebench.draw.figures import grid_of_axes, save
from daebench.draw.methods import name_of, stroke_of
from daebench.pages.report import number, power_of_ten
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Table, code, part, tiny
from daebench.reports.nonholonomic.motions import SOLVERS, TRANSMISSION, ivp_of, solved

CASE, T_LEVELS = "even", 2000.0
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10)
DRAWN = TOLERANCES[1:]
WINDOWS = 100


def by_level(method: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return one row a tolerance, and the largest |A v| in windows of time."""
    ivp, rows, series = ivp_of(TRANSMISSION, CASE), [], []
    for tol in TOLERANCES:
        run = solved(ivp, method, tol, T_LEVELS).complete()
        off = np.abs(ivp.along("Gv", *run.vectors)).max(axis=1)
        most = float(size(np.max(np.abs(energy_error(ivp, run))), energy_scales(ivp, run)))
        rows.append({"method": method, "tol": tol, "Gv": off.max(), "energy": most, "steps": run.steps})
        windows = np.array_split(np.arange(len(off)), WINDOWS)
        frame = {"method": method, "tol": tol, "t": [run.t[w[-1]] for w in windows], "Gv": [off[w].max() for w in windows]}
        series.append(pd.DataFrame(frame))
    return pd.DataFrame(rows), pd.concat(series, ignore_index=True)


def check_levels(frame: pd.DataFrame, series: pd.DataFrame) -> SimpleNamespace:
    """Test that index 2 keeps the constraint to a few tolerances, and that index 1 leaves it the more the longer."""
    level, away = (part(frame, method=name).set_index("tol") for name in SOLVERS)
    ratio, more = level["Gv"] / level.index, away["Gv"] / level["Gv"]
    require(ratio.max() < 20, "index 2 keeps the constraint to a few tolerances", ratio.tolist())
    require(more.min() > 10, "index 1 is more than ten times as far away", more.tolist())
    tight = part(series, method=SOLVERS[1], tol=TOLERANCES[-1])["Gv"].to_numpy()
    grown = tight[-1] / tight[len(tight) // 10]
    require(grown > 5, "index 1 leaves the constraint the more the longer", grown)
    return SimpleNamespace(ratio=ratio.max(), more=more, grown=grown, energy=(away["energy"] / level["energy"]))


def draw_levels(series: pd.DataFrame, folder: Path) -> Path:
    """Draw the distance from the constraint over time, for some tolerances."""
    figure, axes = grid_of_axes(1, 1, 3.4, x="time", y="largest $|A v|$")
    for tol in DRAWN:
        for name in SOLVERS:
            rows, stroke = part(series, method=name, tol=tol), stroke_of(name)
            axes[0, 0].plot(rows["t"], rows["Gv"].clip(lower=1e-16), color=stroke.color, linewidth=1.1)
            last, label = rows.iloc[-1], f"{name_of(name)}, {tol:.0e}"
            axes[0, 0].text(1.01 * last["t"], last["Gv"], label, color=stroke.color, fontsize=7.5, va="center")
    axes[0, 0].set(yscale="log", xlim=(0, 1.25 * T_LEVELS))
    return save(figure, folder, "levels", series)


def table(frame: pd.DataFrame) -> Table:
    """Return the distances and energy errors by tolerance."""
    columns: dict[str, Any] = {
        "method": (code, "method"),
        "tol": (power_of_ten, "tolerance"),
        "Gv": (tiny, "|<i>A v</i>|<small>largest</small>"),
    }
    columns |= {"energy": (number, "energy error<small>over mean kinetic energy</small>"), "steps": "steps"}
    return Table(frame, columns)
