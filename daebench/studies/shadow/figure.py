"""The picture of shadow Hamiltonians: the range of each by its order, a curve a scheme."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

from daebench.draw.figures import drawing, grid_of_axes, legend_below, save
from daebench.draw.methods import curve_of
from daebench.studies.shadow.run import Shadow

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def figure(run: Shadow) -> "Figure":
    """Return the picture of one scheme."""
    with drawing():
        return _drawn([run])


def draw(out: Path, energies: Sequence[Shadow]) -> Path:
    """Write ``shadow.svg``, PNG and CSV into a folder; return the path of the SVG."""
    with drawing():
        return save(_drawn(energies), out, "shadow", table(energies))


def _drawn(energies: Sequence[Shadow]) -> "Figure":
    figure, axes = grid_of_axes(1, 1, 4.2, x="order of the shadow Hamiltonian; 0 is the energy itself", y="largest less smallest value")
    for run in energies:
        ranges = {order: value for order, value in run.ranges.items() if value > 0}
        axes[0, 0].plot(list(ranges), list(ranges.values()), **curve_of(run.method))
    first = energies[0]
    axes[0, 0].set(yscale="log", title=f"{first.ivp.problem}, h = {first.h:g}, to t = {first.t[-1]:g}")
    legend_below(figure, axes[0, 0], 3)
    return figure


def table(energies: Sequence[Shadow]) -> pd.DataFrame:
    """Return the ranges, a row a scheme and order."""
    return pd.DataFrame(
        [{"method": run.method, "h": run.h, "order": order, "range": value} for run in energies for order, value in run.ranges.items()]
    )
