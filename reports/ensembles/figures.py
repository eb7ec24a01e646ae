"""The figures of the report on ensembles."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from daebench.draw.figures import GREEN, QUIET, VERMILION, drawing, grid_of_axes, save
from daebench.draw.methods import name_of, stroke_of
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.reports.ensembles.motions import FRACTIONS, METHODS, MIDDLE

COLOR = {method: stroke_of(method).color for method in METHODS}
NAMES = [name_of(method) for method in METHODS]
ERROR = "largest energy error\nover mean kinetic energy"
VERDICTS = {"flat": ("no drift", GREEN), "undetermined": ("undetermined", "#d9d9d9"), "drifts": ("drifts", VERMILION)}
VERDICTS["failed"] = ("stopped", "#000000")
HATCHES = {"suzuki4": "////", "kahan_li8": "...."}


def draw(conclusions: SimpleNamespace, folder: Path) -> dict[str, Path]:
    """Draw all figures into a folder; return the paths of the SVG files by stem."""
    titles = conclusions.titles
    with drawing():
        paths = [
            draw_errors(conclusions.sizes, titles, folder),
            draw_winners(conclusions.winners, titles, folder),
            draw_verdicts(conclusions.trends, titles, folder),
        ]
    draw_thumbnail(folder, lambda axis: _thumbnail(axis, conclusions))
    return {path.stem: path for path in paths}


def _thumbnail(axis: Any, conclusions: SimpleNamespace) -> None:
    """Draw the errors of the first motion from all its starts."""
    sizes, (key, title) = conclusions.sizes, next(iter(conclusions.titles.items()))
    _errors(axis, sizes[(sizes["price"] == MIDDLE) & (sizes["motion"] == key)])
    axis.minorticks_off()
    axis.set_title(f"energy error, {conclusions.starts} starts: {title}", loc="right", fontsize=7)


def draw_errors(sizes: Any, titles: dict[str, str], folder: Path) -> Path:
    """Draw nine tenths of the errors and the case's own: one panel per motion, one row per method, at the middle cost."""
    rows = sizes[sizes["price"] == MIDDLE]
    figure, axes = grid_of_axes(4, 2, 7.0, sharey=True)
    for ax, (key, title) in zip(axes.flat, titles.items(), strict=False):
        _errors(ax, rows[rows["motion"] == key])
        ax.set_title(title)
    _explain(axes.flat[len(titles)])
    axes[-1, 0].set_xlabel(ERROR)
    axes[-2, 1].set_xlabel(ERROR)
    return save(figure, folder, "errors", rows)


def _errors(ax: Any, rows: Any) -> None:
    """Draw the errors of one motion, a row a method."""
    some = rows.set_index("method")
    finite = some[["low", "median", "high", "own"]].to_numpy()
    finite = finite[np.isfinite(finite)]
    ax.set(xscale="log", xlim=(0.5 * finite.min(), 3 * finite.max()))
    for k, method in enumerate(METHODS):
        _row(ax, k, some.loc[method], COLOR[method])
    ax.set(yticks=range(len(METHODS)), yticklabels=NAMES, ylim=(len(METHODS) - 0.4, -0.6))
    ax.grid(visible=False, axis="y")


def _row(ax: Any, k: int, one: Any, color: str) -> None:
    """Draw the starts of one method: a bar, to the edge if some have no error, the median, and the start of the case."""
    whole, edge = np.isfinite(one["high"]), ax.get_xlim()[1]
    ax.plot([one["low"], one["high"] if whole else edge], [k, k], color=color, linewidth=7, alpha=0.35, solid_capstyle="butt")
    if np.isfinite(one["median"]):
        ax.plot([one["median"]] * 2, [k - 0.3, k + 0.3], color=color, linewidth=2)
    if np.isfinite(one["own"]):
        ax.plot(one["own"], k, marker="D", markersize=5, markerfacecolor="white", markeredgecolor="black", linestyle="none")
    if one["stopped"]:
        share = f"{100 * one['stopped']:.0f} %" if one["stopped"] >= 0.005 else "under 1 %"
        ax.text(1.01, k, f"{share} stop", fontsize=7, va="center", transform=ax.get_yaxis_transform())


def _explain(ax: Any) -> None:
    """Turn a panel into the legend of the others."""
    ax.axis("off")
    bar = ax.plot([], [], color=QUIET, linewidth=7, alpha=0.5)[0]
    median = ax.plot([], [], color="black", linestyle="none", marker="|", markersize=11, markeredgewidth=2)[0]
    own = ax.plot([], [], marker="D", markersize=5, markerfacecolor="white", markeredgecolor="black", linestyle="none")[0]
    ax.legend([bar, median, own], ["nine tenths of the starts", "median", "start of the case"], loc="center", labelspacing=0.8)


def draw_winners(first: Any, titles: dict[str, str], folder: Path) -> Path:
    """Draw the fraction of the starts from which each method has the smallest error: one bar for each motion and cost."""
    figure, axes = grid_of_axes(1, 1, 4.6, x="fraction of the starts from which the method has the smallest energy error  [%]")
    ax, y, ticks = axes[0, 0], 0.0, {}
    for key, title in titles.items():
        ticks[y + 1] = title
        for row in first[first["motion"] == key].to_dict("records"):
            _bar(ax, y, [(100 * row[method], COLOR[method], _hatch(method)) for method in METHODS])
            if row["own"]:
                left = 100 * sum(row[method] for method in METHODS[: METHODS.index(row["own"])])
                x = min(98.8, max(1.2, left + 50 * row[row["own"]]))
                ax.plot(x, y, marker="D", markersize=5, markerfacecolor="white", markeredgecolor="black", linestyle="none")
            y += 1
        y += 0.7
    _finish(figure, ax, ticks, [(name_of(method), COLOR[method], _hatch(method)) for method in METHODS], "start of the case")
    return save(figure, folder, "winners", first)


def draw_verdicts(verdicts: Any, titles: dict[str, str], folder: Path) -> Path:
    """Draw the fraction of the starts with each verdict on the energy: one bar for each motion and method, at the middle cost."""
    rows = verdicts[verdicts["price"] == MIDDLE]
    figure, axes = grid_of_axes(4, 2, 7.0, sharey=True, sharex=True)
    for ax, (key, title) in zip(axes.flat, titles.items(), strict=False):
        for k, method in enumerate(METHODS):
            one = rows[(rows["motion"] == key) & (rows["method"] == method)].iloc[0]
            _bar(ax, k, [(100 * one[verdict], color, "") for verdict, (_, color) in VERDICTS.items()])
            own = {"bounded": "flat", "kept": "flat"}.get(one["own"], one["own"])
            left = 100 * sum(one[verdict] for verdict in list(VERDICTS)[: list(VERDICTS).index(own)])
            x = min(98.0, max(2.0, left + 50 * one[own]))
            ax.plot(x, k, marker="D", markersize=5, markerfacecolor="white", markeredgecolor="black", linestyle="none")
        ax.set(
            title=title,
            yticks=range(len(METHODS)),
            yticklabels=NAMES,
            xlim=(0, 100),
            ylim=(len(METHODS) - 0.4, -0.6),
        )
        ax.grid(visible=False)
    for ax in (axes[-1, 0], axes[-2, 1]):
        ax.set_xlabel("fraction of the starts  [%]")
        ax.tick_params(labelbottom=True)
    legend = axes.flat[len(titles)]
    legend.axis("off")
    _legend(legend, [(*verdict, "") for verdict in VERDICTS.values()], "start of the case", loc="center")
    return save(figure, folder, "verdicts", rows)


def _hatch(method: str) -> str:
    """Return the hatch by which a composition differs from its scheme, whose colour it has."""
    return HATCHES.get(method.partition("/")[2], "")


def _bar(ax: Any, y: float, parts: list[tuple[float, str, str]]) -> None:
    left = 0.0
    for part, color, hatch in parts:
        ax.barh(y, part, left=left, height=0.82, facecolor=color, edgecolor="white", hatch=hatch, linewidth=0)
        left += part


def _finish(figure: Any, ax: Any, ticks: dict[float, str], colors: list[tuple[str, str, str]], own: str) -> None:
    ax.set(yticks=list(ticks), yticklabels=ticks.values(), xlim=(0, 100))
    ax.invert_yaxis()
    ax.grid(visible=False)
    ax.tick_params(axis="y", length=0)
    _legend(figure, colors, own, loc="outside lower center", ncols=len(FRACTIONS))


def _legend(place: Any, colors: list[tuple[str, str, str]], own: str, **settings: Any) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [Patch(facecolor=color, edgecolor="white", hatch=hatch, linewidth=0, label=name) for name, color, hatch in colors]
    handles.append(Line2D([], [], marker="D", markersize=5, markerfacecolor="white", markeredgecolor="black", linestyle="none", label=own))
    place.legend(handles=handles, **settings)
