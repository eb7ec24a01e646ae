"""Bands between quantiles, darker towards the median: the names of their columns in tables, and how they are drawn."""

from collections.abc import Callable
from typing import Any

LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Quantiles in tables and pictures of many runs."""

SHADES = ((0.05, 0.95, 0.18), (0.25, 0.75, 0.35))
"""Bands: the levels of their quantiles, and their opacity."""


def column(level: float, of: str = "") -> str:
    """Return the name of the column of a quantile, such as q05, or energy_q05 for a quantity."""
    return f"{of}_q{100 * level:02.0f}" if of else f"q{100 * level:02.0f}"


def fill(axis: Any, x: Any, quantile: Callable[[float], Any], color: str, *, of: str = "", **style: Any) -> None:
    """Fill the bands along x, from a function that returns the quantile of a level; ``of`` names the members in the legend."""
    for low, high, alpha in SHADES:
        label = f"{100 * (high - low):.0f} % of {of}" if of else None
        axis.fill_between(x, quantile(low), quantile(high), color=color, alpha=alpha, linewidth=0, label=label, **style)
