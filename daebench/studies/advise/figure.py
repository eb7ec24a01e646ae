"""The picture of advice: cost against accuracy of all runs, their Pareto front, and the choice."""

from pathlib import Path
from typing import TYPE_CHECKING

from daebench.draw.figures import BLACK, QUIET, drawing, grid_of_axes, save
from daebench.draw.methods import curve_of
from daebench.errors import DaebenchError
from daebench.studies.advise.advice import Advice
from daebench.studies.work_precision.study import front

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HIGHEST = 10.0
"""Errors up to this are drawn."""

BELOW = 1e-3
"""The error of the reference is drawn where it is more than this part of the least error."""

NAMED = 5
"""Methods that are drawn in colours: the choice, and those whose cost is nearest to its cost."""


def draw(out: Path, advice: Advice) -> Path:
    """Write ``advise.svg``, PNG and CSV into a folder; return the path of the SVG."""
    return save(figure(advice), out, "advise", advice.table)


def figure(advice: Advice) -> "Figure":
    """Return the picture of advice."""
    asked = advice.question
    error = f"error_{asked.part}"
    table = advice.table
    shown = table[(table["failure"] == "") & table["seconds"].notna() & (table[error] < HIGHEST)]
    if shown.empty:
        raise DaebenchError("there is nothing to draw: no run of the search has an error and a time.")
    named = _named(advice)
    with drawing():
        drawn, axes = grid_of_axes(1, 1, 4.2, x="CPU time of a run [s]", y=f"largest error of {asked.part}")
        axis = axes[0, 0]
        axis.set(xscale="log", yscale="log")
        for method, rows in shown.groupby("method", sort=False):
            if method not in named:
                in_order = rows.sort_values("value", ascending=False)
                axis.plot(in_order["seconds"], in_order[error], color="#c4c4c4", linewidth=0.7, zorder=1)
        for method in named:
            rows = shown[shown["method"] == method].sort_values("value", ascending=False)
            axis.plot(rows["seconds"], rows[error], zorder=3, **curve_of(str(method)) | {"linestyle": "-", "linewidth": 1.1})
        best = front(shown, error, "seconds")
        axis.plot(best["seconds"], best[error], color=BLACK, linewidth=0.8, zorder=2, label="front of all runs")
        axis.axhline(asked.accuracy, color=QUIET, linewidth=1.0, linestyle="--", label=f"accuracy asked for, {asked.accuracy:g}")
        if advice.bound > BELOW * float(shown[error].min()):
            axis.axhline(advice.bound, color=QUIET, linewidth=1.0, linestyle=":", label="error of the reference")
        if advice.choice:
            axis.plot([advice.choice.seconds], [advice.choice.error], "o", markersize=11, markerfacecolor="none", color=BLACK, zorder=4)
        axis.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), frameon=False, fontsize=8)
        drawn.suptitle(title(advice), fontsize="medium", x=0.02, ha="left")
    return drawn


def title(advice: Advice) -> str:
    """Return the answer in two lines."""
    asked, choice = advice.question, advice.choice
    where = (
        f"{asked.problem}, case {asked.case}, to t = {asked.t_end:g} s, error at most {asked.accuracy:g} {advice.holds.partition(' (')[0]}"
    )
    if choice is None:
        return f"{where}:\nno run meets this"
    answer = f"Take {choice.method} with {choice.knob} = {choice.value:.3g} (circle)"
    return f"{answer}: error {choice.error:.1e} in {choice.seconds:.2g} s\n{where}"


def _named(advice: Advice) -> list[str]:
    """Return the methods that have colours: the choice, and the others in the order of their cost."""
    chosen = [choice.method for choice in (advice.choice, *advice.runners_up) if choice]
    reaching = [some for some in advice.found if some.row]
    others = sorted(reaching, key=lambda some: float(some.row["seconds"]) if some.row else 0.0)
    return list(dict.fromkeys([*chosen, *(some.method for some in others)]))[:NAMED]
