"""Claims of the report on tolerances about projected steps, tested on the numbers."""

from types import SimpleNamespace

import numpy as np
import pandas as pd

from daebench.pages.report.claims import require
from daebench.reports.tolerances.projection import FIXED, PLAIN, PROJECTED
from daebench.reports.tolerances.runs import FAST, IVPS

SMALL = 0.1
"""Errors from this on, in lengths of a rod, are of the size of the motion."""

HELPED = "double_pendulum-horizontal"
"""The system on which projection helps most."""

TURNS_WITH = 0.5
"""Bound on the error of the angular velocity without projection, as a fraction of the error of the speed."""

NEAR = 0.3
"""Relative difference of errors that count as equal."""


def check_projected(rows: pd.DataFrame) -> SimpleNamespace:
    """Test where projection helps and where it harms, why, and how accurate fixed steps are for the same time."""
    table = rows.pivot(index=["scene", "start", "tol"], columns="method", values="error")
    medians = table.groupby(["scene", "tol"]).median()
    ratio = (table[PROJECTED] / table[PLAIN]).groupby(["scene", "tol"]).median()
    gain = ratio[medians[PLAIN] < SMALL].unstack().reindex(list(IVPS))
    require(bool((gain.loc[HELPED].dropna() < 1).all()), "projection helps on the double pendulum", gain.loc[HELPED].to_dict())
    worse = gain.loc[FAST].dropna()
    require(bool((worse > 1).all()), "projection harms on the fast spherical pendulum", worse.to_dict())
    composed = table[FIXED[1]] / table[PROJECTED]
    require(
        composed.median() < 1e-3, "composed to order 8, RATTLE is over a thousand times more accurate for the same time", composed.median()
    )
    better = float(np.mean(composed < 1))
    require(better > 0.95, "nearly always so", better)
    plain = (table[FIXED[0]] / table[PROJECTED]).groupby("tol").median()
    require(
        plain.iloc[-1] < 1 < plain.iloc[0], "RATTLE itself is better at the loosest tolerance, and worse at the tightest", plain.to_dict()
    )
    return SimpleNamespace(
        gain=gain,
        helped=gain.loc[HELPED].dropna(),
        worse=worse,
        cause=check_cause(rows[rows["scene"] == FAST]),
        composed=composed.median(),
        better=better,
        plain=plain,
        starts=rows["start"].nunique(),
    )


def check_cause(rows: pd.DataFrame) -> SimpleNamespace:
    """Test that speed and radius shrink alike without projection, and that only the speed shrinks with it; return the numbers at 1e-6."""
    off = rows.assign(speed=rows["speed"].abs(), turning=rows["turning"].abs()).groupby(["method", "tol"])[["speed", "turning"]].median()
    plain, projected = off.loc[PLAIN], off.loc[PROJECTED]
    share = (plain["turning"] / plain["speed"])[plain["speed"] < 1e-3]
    require(
        bool((share < TURNS_WITH).all()), "without projection the angular velocity is much more accurate than the speed", share.to_dict()
    )
    same = projected["turning"] / projected["speed"]
    require(bool(np.allclose(same, 1, atol=1e-3)), "with projection the angular velocity has the error of the speed", same.to_dict())
    return SimpleNamespace(tol=1e-6, plain=plain.loc[1e-6], projected=projected.loc[1e-6], share=share)


def check_example(rows: pd.DataFrame) -> SimpleNamespace:
    """Test that projected steps agree with the output of SUNDIALS except for the right side; return both."""
    projected, plain = (rows[rows["method"] == method].set_index("tol") for method in (PROJECTED, PLAIN))
    ratio = projected["error"] / projected["printed_error"]
    tight = ratio[ratio.index < 1e-5]
    require(bool(np.all(np.abs(tight - 1) < NEAR)), "projected, both right sides give the same error", ratio.to_dict())
    unlike = (plain["printed_error"] / plain["error"]).sort_values()
    require(unlike.iloc[-1] > 100, "without projection they differ by over a hundred times", unlike.to_dict())
    require(bool((unlike[unlike.index < 1e-5] > 1).all()), "without projection (1.18) is more accurate from 1e-6 on", unlike.to_dict())
    require(plain["g"][1e-5] > SMALL, "at 1e-5 (1.18) leaves the circle", plain["g"].to_dict())
    return SimpleNamespace(off=np.abs(tight - 1).max(), unlike=unlike.iloc[-1], at=unlike.index[-1], g=plain["g"][1e-5])
