"""The figures of the report on work against precision: one of all motions, and one of each motion."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from daebench.draw.figures import BLUE, STROKES, grid_of_axes, save
from daebench.draw.methods import name_of
from daebench.reports.work_precision.conclusions import MIDDLE
from daebench.reports.work_precision.works import Work
from daebench.studies.work_precision.study import costs_at

FEW = 6
"""Methods in the thumbnail."""


def ratios(works: Sequence[Work], runs: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Return the CPU time of each method over that of the cheapest, at one accuracy: columns key, method, ratio."""
    rows = []
    for work in works:
        costs = costs_at(runs[work.key], work.error, "seconds", MIDDLE)
        least = min((price for price, _ in costs.values()), default=1.0)
        rows += [(work.key, method, price / least) for method, (price, _) in costs.items()]
    return pd.DataFrame(rows, columns=["key", "method", "ratio"])


def draw_overview(works: Sequence[Work], frame: pd.DataFrame, folder: Path) -> Path:
    """Draw the time of each method over that of the cheapest: one row per method, the cheapest at the top, and one mark per motion."""
    order = list(frame.groupby("method")["ratio"].median().sort_values(ascending=False).index)
    figure, axes = grid_of_axes(1, 1, 0.9 + 0.19 * max(4, len(order)) + 0.2 * len(works) / 2)
    axis = axes[0, 0]
    for k, work in enumerate(works):
        motion_ratios, stroke = frame[frame["key"] == work.key], STROKES[k % len(STROKES)]
        rows = [order.index(name) for name in motion_ratios["method"]]
        look = {"markerfacecolor": "white", "markeredgecolor": stroke.color, "markersize": 5.5}
        label = f"{work.title}, $t$ = {work.t_end:g} s"
        axis.plot(motion_ratios["ratio"], rows, linestyle="none", marker=stroke.marker, label=label, **look)
    axis.set(xscale="log", xlabel="CPU time over that of the cheapest", xlim=(0.8, None), ylim=(-0.6, len(order) - 0.4))
    axis.set_yticks(range(len(order)), [name_of(name) for name in order])
    figure.legend(loc="outside lower center", ncols=2)
    return save(figure, folder, "overview", frame)


def thumbnail(axis: Any, frame: pd.DataFrame) -> None:
    """Draw the median factors of the cheapest methods as bars."""
    medians = frame.groupby("method")["ratio"].median().sort_values().iloc[:FEW][::-1]
    axis.barh(range(len(medians)), medians, color=BLUE, height=0.65)
    axis.set_yticks(range(len(medians)), [name_of(str(name)) for name in medians.index])
    axis.set_title("CPU time for one accuracy", loc="right")
    axis.set_xlabel("over that of the cheapest", loc="right")
    axis.grid(visible=False, axis="y")
