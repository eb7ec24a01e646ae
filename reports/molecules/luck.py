"""Tolerances whose order a single start gets wrong: a looser one changes the energy less by chance."""

from types import SimpleNamespace

import numpy as np
import pandas as pd

from daebench.reports.molecules.laws import CLEAR, clear
from daebench.reports.molecules.motions import GAUSS_SEIDEL, double

KEYS = ["molecule", "h", "tolerance"]


def luck(starts: pd.DataFrame, runs: pd.DataFrame) -> SimpleNamespace:
    """Return from how many starts a looser tolerance changes the energy less than the next tighter one, whose change is clear.

    Of the Gauss-Seidel iteration in double precision; ``worst`` is the pair of tolerances in which that is most frequent.
    """
    table = pairs(double(starts, GAUSS_SEIDEL), clear(double(runs, GAUSS_SEIDEL)))
    worst = table.iloc[int(table["part"].to_numpy().argmax())]
    rows = double(runs, GAUSS_SEIDEL)
    rows = rows[(rows["molecule"] == worst["molecule"]) & (rows["h"] == worst["h"])]
    loose, tight = (rows[rows["tolerance"] == worst[which]].iloc[0] for which in ("loose", "tight"))
    early = loose["mean"] - loose["slope"]
    cancels = early < -CLEAR * loose["error"] and loose["slope"] > CLEAR * loose["slope_error"]
    return SimpleNamespace(
        pairs=len(table),
        some=int((table["part"] > 0).sum()),
        worst=worst,
        loose=loose,
        tight=tight,
        worst_ordered=abs(loose["mean"]) > abs(tight["mean"]),
        cancels=bool(cancels),
    )


def pairs(starts: pd.DataFrame, chosen: pd.DataFrame) -> pd.DataFrame:
    """Return each pair of neighbouring tolerances, and the fraction of the starts from which the looser one changes the energy less.

    Parameters
    ----------
    starts : DataFrame
        Changes of all starts: columns molecule, h, tolerance, start, change.
    chosen : DataFrame
        The tighter ones of the pairs.
    """
    sizes = starts.assign(size=starts["change"].abs()).pivot(index=[*KEYS[:2], "start"], columns="tolerance", values="size")
    tolerances = sorted(sizes.columns, reverse=True)
    rows = []
    for molecule, h, tight in chosen[KEYS].itertuples(index=False):
        k = tolerances.index(tight)
        if k:
            pair = sizes.loc[(molecule, h)][[tolerances[k - 1], tight]].dropna()
            part = float(np.mean(pair.iloc[:, 0] < pair.iloc[:, 1]))
            rows.append({"molecule": molecule, "h": h, "loose": tolerances[k - 1], "tight": tight, "part": part})
    return pd.DataFrame(rows)
