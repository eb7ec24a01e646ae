"""The picture of a comparison: errors of the energy and of constraints or Casimir functions against time."""

from collections.abc import Sequence
from textwrap import fill
from typing import TYPE_CHECKING, Any

from daebench.diagnostics.along import LABELS, errors_along, thinned
from daebench.draw.figures import WIDTH, drawing, grid_of_axes, legend_below
from daebench.draw.methods import name_of, strokes_of
from daebench.errors import BadInput
from daebench.runs.ivp import Ivp
from daebench.runs.result import Look
from daebench.runs.trajectory import Outcome
from daebench.systems.lazily import pandas as pd

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FEW = 7
"""Curves that are told apart by colours and dashes; more have markers too."""

WORDS = {
    "energy_error": "energy error $|H - H_0|$",
    "g": "constraint $|g(q)|$",
    "Gv": "velocities $|G H_p|$",
    "casimir_error": "largest Casimir error",
    "integral_error": "largest error of an integral",
}
"""Labels of axes, by column."""

LETTERS = 85
"""Letters of a line of the title of a picture of the width of a page."""

NARROW = 1.5
"""Width over height above which panels stand side by side."""


def figure(ivp: Ivp, runs: Sequence[Outcome], curves: "pd.DataFrame", look: Look) -> "Figure":
    """Return the picture: a panel for each error, below each other or, where the picture is wide, side by side."""
    panels = [column for column in look.panels or LABELS if column in curves.columns]
    if not panels:
        raise BadInput(
            f"{ivp.problem} has no {' and no '.join(look.panels)}; leave out --panels, which shows what there is.", "panels-unavailable"
        )
    width, height = look.size or (WIDTH, 1.0 + 2.0 * len(panels))
    wide = width > NARROW * height
    with drawing(width / WIDTH if not wide else min(width / WIDTH, height / (0.5 * WIDTH))):
        drawn, axes = grid_of_axes(*((1, len(panels)) if wide else (len(panels), 1)), height, x="time $t$ [s]", sharex=True)
        drawn.set_size_inches(width, height)
        for axis, column in zip(axes.flat, panels, strict=True):
            _panel(axis, runs, curves, column, look)
        title = look.title or f"{ivp.problem.replace('_', ' ')}, case {ivp.case}"
        drawn.suptitle(fill(title, LETTERS), x=0.02, ha="left", fontsize="medium")
        legend_below(drawn, axes.flat[0], 4)
    return drawn


def curves_of(ivp: Ivp, runs: Sequence[Outcome]) -> "pd.DataFrame":
    """Return the errors along all runs, the curves of the picture."""
    return pd.concat([_curves(ivp, run) for run in runs], ignore_index=True)


def _curves(ivp: Ivp, run: Outcome) -> "pd.DataFrame":
    """Return the curves of one run, thinned by keeping the largest error of each group of neighbours."""
    t, errors = thinned(run.t, errors_along(ivp, run))
    return pd.DataFrame({"method": run.method, "t": t, **errors})


def _panel(axis: Any, runs: Sequence[Outcome], curves: "pd.DataFrame", column: str, look: Look) -> None:
    strokes = strokes_of(run.method for run in runs)
    for k, run in enumerate(runs):
        curve = curves[(curves["method"] == run.method) & (curves[column] > 0)]
        stroke = strokes[run.method]
        style = (stroke.line() if len(runs) <= FEW else stroke.points() | {"markevery": 0.08}) | (
            {"color": look.colors[k]} if look.colors else {}
        )
        axis.plot(curve["t"], curve[column], label=look.labels[k] if look.labels else name_of(run.method), **style)
    axis.set_yscale("log")
    axis.set_title(WORDS[column])
