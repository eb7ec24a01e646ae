"""Bands between quantiles, the darker the nearer to the median: how they are called in tables, and drawn."""

from collections.abc import Callable
from typing import Any

LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Quantiles that tables and pictures of many runs have."""

SHADES = ((0.05, 0.95, 0.18), (0.25, 0.75, 0.35))
"""Bands: the levels of their quantiles, and how dark they are."""


def column(level: float, of: str = "") -> str:
    """Return the name of the column of a quantile, as q05, or energy_q05 of something."""
    return f"{of}_q{100 * level:02.0f}" if of else f"q{100 * level:02.0f}"


def fill(axis: Any, x: Any, quantile: Callable[[float], Any], color: str, *, of: str = "", **style: Any) -> None:
    """Fill the bands along x, from a function that returns the quantile of a level; ``of`` names the members in the legend."""
    for low, high, alpha in SHADES:
        label = f"{100 * (high - low):.0f} % of {of}" if of else None
        axis.fill_between(x, quantile(low), quantile(high), color=color, alpha=alpha, linewidth=0, label=label, **style)
