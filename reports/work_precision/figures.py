"""The figures of the report on work against precision: one of all motions, and one each."""

from pathlib import Path

import pandas as pd

from daebench.draw.figures import STROKES, drawing, grid_of_axes, save
from daebench.reports.work_precision.claims import MIDDLE
from daebench.reports.work_precision.numbers import Numbers
from daebench.studies.work_precision.figure import draw
from daebench.studies.work_precision.study import costs_at


def draw_all(numbers: Numbers, folder: Path) -> dict[str, Path]:
    """Draw all figures into a folder; return the paths of the SVG files by stem."""
    paths = [draw_overview(numbers, folder)]
    for work in numbers.works:
        label = f"largest error of ${work.letter}$"
        paths.append(draw(folder, numbers.runs[work.key], work.error, label, stem=work.key))
    return {path.stem: path for path in paths}


def ratios(numbers: Numbers) -> pd.DataFrame:
    """Return by what factor each method is dearer than the cheapest, at one accuracy: columns key, method, ratio."""
    rows = []
    for work in numbers.works:
        costs = costs_at(numbers.runs[work.key], work.error, "seconds", MIDDLE)
        least = min((price for price, _ in costs.values()), default=1.0)
        rows += [(work.key, method, price / least) for method, (price, _) in costs.items()]
    return pd.DataFrame(rows, columns=["key", "method", "ratio"])


def draw_overview(numbers: Numbers, folder: Path) -> Path:
    """Draw how many times dearer than the cheapest each method is, a row a method and a mark a motion."""
    frame = ratios(numbers)
    order = list(frame.groupby("method")["ratio"].median().sort_values(ascending=False).index)
    with drawing():
        figure, axes = grid_of_axes(1, 1, 0.9 + 0.2 * max(4, len(order)) + 0.2 * len(numbers.works) / 2)
        axis = axes[0, 0]
        for k, work in enumerate(numbers.works):
            motion_ratios, stroke = frame[frame["key"] == work.key], STROKES[k % len(STROKES)]
            rows = [order.index(name) for name in motion_ratios["method"]]
            look = {"markerfacecolor": "white", "markeredgecolor": stroke.color, "markersize": 5.5}
            axis.plot(
                motion_ratios["ratio"], rows, linestyle="none", marker=stroke.marker, label=f"{work.title}, $t$ = {work.t_end:g}", **look
            )
        axis.set(xscale="log", xlabel="CPU time over that of the cheapest", xlim=(0.8, None), ylim=(-0.6, len(order) - 0.4))
        axis.set_yticks(range(len(order)), order)
        figure.legend(loc="outside lower center", ncols=2)
        return save(figure, folder, "overview", frame)
