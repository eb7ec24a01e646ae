"""The picture of a search for a step size: differences between each step and its half, with their intervals, and the margin."""

from typing import TYPE_CHECKING

import numpy as np

from daebench.diagnostics.equivalence import EQUIVALENT, QUANTILES
from daebench.draw.figures import BLUE, GREEN, QUIET, VERMILION, drawing, grid_of_axes
from daebench.studies.step_for.result import StepFor

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = ("black", BLUE, GREEN, VERMILION)
"""Colours of the mean and of the quantiles."""

APART = 0.06
"""Distance of the intervals at one step, in parts of it."""


def figure(result: StepFor) -> "Figure":
    """Return the picture of a search for a step size."""
    with drawing():
        drawn, axes = grid_of_axes(1, 1, 3.6, x="step size $h$ [s]", y=f"difference in {result.statistic}")
        axis = axes[0, 0]
        axis.axhspan(-result.margin, result.margin, color=QUIET, alpha=0.2, linewidth=0, label="within the margin")
        shown = set()
        for row in result.tried:
            for k, difference in enumerate(row.test.differences if row.test else ()):
                place = row.h * (1 + APART * (k - len(QUANTILES) / 2))
                label = difference.name if difference.name not in shown else None
                shown.add(difference.name)
                ends = np.array([[difference.value - difference.low], [difference.high - difference.value]])
                ends[~np.isfinite(ends)] = np.nan
                filled = COLOURS[k] if row.verdict == EQUIVALENT else "white"
                axis.errorbar([place], [difference.value], ends, fmt="o", color=COLOURS[k], markerfacecolor=filled, capsize=2, label=label)
        axis.set_xscale("log")
        axis.set_yscale("symlog", linthresh=result.margin)
        axis.set_xticks([row.h for row in result.tried], [f"{row.h:g}" for row in result.tried])
        axis.minorticks_off()
        axis.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), frameon=False)
        drawn.suptitle(_title(result), fontsize="medium")
    return drawn


def _title(result: StepFor) -> str:
    """Return the answer first."""
    answer = "no step size tried passes" if result.h is None else f"h = {result.h:g} s agrees with its half"
    return f"{result.method} on {result.ivp.problem}, case {result.ivp.case}, to t = {result.t:g} s:\n{answer} (filled)"
