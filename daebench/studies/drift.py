"""When an energy error of a run is a drift: what its slope adds up to is much of it, and no mere rounding."""

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

SECULAR = 0.25
"""Part of the largest energy error from which on what its slope adds up to over the run is a drift: where it drifts, that is all of it."""

ROUNDED = 16.0
"""An error within so many roundings of its size, times the square root of the number of steps, is of round-off, and no drift."""


def secular(runs: "pd.DataFrame | dict[str, Any]") -> Any:
    """Return whether the slope of the energy error explains much of it; on a chaotic motion its scatter may grow without any drift."""
    return abs(runs["energy_slope"] * runs["t_end"]) > SECULAR * runs["energy_drift"]


def drifts(row: dict[str, Any]) -> bool:
    """Return whether the energy error of a run is a drift: a significant slope that makes up much of it, and no walk of roundings.

    A few periods of a bounded oscillation have a slope too, which is within its error then.
    """
    return bool(secular(row)) and row["energy_kind"] != "bounded" and not walked(row)


def walked(row: dict[str, Any]) -> bool:
    """Return whether a random walk of roundings explains the energy error of a run."""
    eps = float(np.finfo(row["precision"]).eps)
    return bool(row["energy_drift"] <= ROUNDED * eps * row["steps"] ** 0.5 * row["energy_size"])
