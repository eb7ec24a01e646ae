"""When the energy of a run drifts, by its row in a study."""

from typing import TYPE_CHECKING, Any

from daebench.diagnostics.energy import DRIFTS

if TYPE_CHECKING:
    import pandas as pd

SECULAR = 0.25
"""Part of the largest energy error from which on what its slope adds up to over the run is a drift: where it drifts, that is all of it."""


def secular(runs: "pd.DataFrame | dict[str, Any]") -> Any:
    """Return whether the slope of the energy error explains much of it; on a chaotic motion its scatter may grow without any drift."""
    return abs(runs["energy_slope"] * runs["t_end"]) > SECULAR * runs["energy_error"]


def drifts(row: dict[str, Any]) -> bool:
    """Return whether the energy of a run drifts, by its verdict."""
    return bool(row["energy_verdict"] == DRIFTS)
