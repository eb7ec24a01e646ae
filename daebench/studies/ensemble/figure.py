"""The picture of an ensemble: bands of quantiles of what should be kept, the spread of the members, and who stopped."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.draw.bands import column, fill
from daebench.draw.figures import BLUE, VERMILION, drawing, grid_of_axes, legend_below, save
from daebench.studies.ensemble.result import Ensemble

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

TITLES = {"g": ("constraints", "largest $|g|$"), "casimirs": ("Casimirs", "largest change")}
"""Title and label of the panel of what the structure keeps."""

MOST_REASONS = 3
"""Reasons of failures that the title names."""


def draw(out: Path, stem: str, ensemble: Ensemble) -> Path:
    """Write ``STEM.svg``, PNG and CSV of the bands into a folder; return the path of the SVG."""
    return save(figure(ensemble), out, stem, ensemble.bands)


def figure(ensemble: Ensemble) -> "Figure":
    """Return the picture of an ensemble."""
    bands, conserved = ensemble.bands, ensemble.kept
    with drawing():
        drawn, axes = grid_of_axes(1, 2 + bool(conserved), 3.3, sharex=True, x="time $t$ [s]")
        _bands(axes[0, 0], bands, "energy", VERMILION)
        axes[0, 0].set(title="energy error", ylabel="$H - H_0$ [unit of $H$]")
        if conserved:
            _bands(axes[0, 1], bands, conserved, BLUE)
            axes[0, 1].set(title=TITLES[conserved][0], ylabel=TITLES[conserved][1])
            if (bands[column(0.05, conserved)][1:] > 0).all():
                axes[0, 1].set_yscale("log")
        _line(axes[0, -1], bands["t"], bands["spread"])
        axes[0, -1].set(title="spread", ylabel="rms distance from the mean")
        legend_below(drawn, axes[0, 0], 3)
        drawn.suptitle(_title(ensemble), fontsize="medium")
    return drawn


def _title(ensemble: Ensemble) -> str:
    """Return the title, the answer first: how many of the members came to their end."""
    run, total = ensemble.run, len(ensemble.run.members)
    reasons = list(ensemble.reasons.items())
    named = ", ".join(f"{count} {reason}" for reason, count in reasons[:MOST_REASONS])
    failed = f"{len(run.failed)} of {total} members stopped early: {named}" if reasons else f"all {total} members came to their end"
    return f"{run.method} on {ensemble.ivp.problem}, case {ensemble.ivp.case}: {failed}"


def _bands(axis: Any, bands: "pd.DataFrame", name: str, color: str) -> None:
    """Draw bands of quantiles, and the median."""
    fill(axis, bands["t"], lambda level: bands[column(level, name)], color, of="members")
    axis.plot(bands["t"], bands[column(0.5, name)], color=color, linewidth=1.2, label="median")


def _line(axis: Any, t: Any, spread: Any) -> None:
    axis.plot(t, spread, color="black")
    if np.nanmax(spread) > 0:
        axis.set_yscale("log")
