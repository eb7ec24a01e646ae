"""The picture of the report on extremes for the index: the largest usable steps of a few methods."""

from typing import Any

import pandas as pd

from daebench.draw.figures import BLUE, ORANGE
from daebench.draw.methods import name_of
from daebench.reports.extremes.ivps import MAPPED


def thumbnail(axis: Any, limits: pd.DataFrame) -> None:
    """Draw two bars a method: to the largest step that reaches the end, and to the largest that holds the energy.

    Parameters
    ----------
    axis : Axes
        Of Matplotlib.
    limits : DataFrame
        A row for each method and verdict, with the largest step, h.
    """
    steps = limits.pivot_table(index="method", columns="verdict", values="h")
    methods = [name for name in MAPPED if name in steps.index]
    held = next(name for name in steps.columns if name != "completes")
    for column, color, words in (("completes", ORANGE, "reaches the end"), (held, BLUE, "holds the energy")):
        axis.barh(range(len(methods)), steps.loc[methods, column], color=color, height=0.6, label=words)
    axis.set_yticks(range(len(methods)), [name_of(name) for name in methods])
    axis.invert_yaxis()
    axis.grid(visible=False, axis="y")
    axis.set_title("largest usable step, pendulum", loc="right")
    axis.set_xlabel("$h$ [s]", loc="right")
    axis.legend(fontsize=6.5, loc="upper right", handlelength=1.0)
