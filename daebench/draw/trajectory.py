"""The picture of a run: its motion, and beside it its errors over time."""

from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.diagnostics.along import LABELS, MOST_POINTS, errors_along, thinned
from daebench.draw.figures import BLACK, QUIET, STROKES, VERMILION, drawing, grid_of_axes
from daebench.draw.orthographic import projected
from daebench.draw.scene import Layout, layout_of, moving
from daebench.draw.springs import draw_springs
from daebench.runs.ivp import Array
from daebench.runs.trajectory import Outcome

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def figure(run: Outcome) -> "Figure":
    """Return the picture of a run: at the left the motion, or the states over time, and at the right the errors."""
    ivp = run.solved
    t, errors = thinned(run.t, {name: values for name, values in errors_along(ivp, run).items() if np.any(values > 0)})
    layout = layout_of(ivp)
    with drawing():
        drawn, axes = grid_of_axes(1, 2, 3.2)
        motion, axis = axes[0]
        _motion(motion, layout, _seen(next(iter(run.states.values())))) if layout else _states(motion, run)
        for stroke, (name, values) in zip(STROKES, errors.items(), strict=False):
            axis.plot(t, values, label=LABELS[name], **stroke.line())
        if errors:
            axis.set_yscale("log")
            drawn.legend(*axis.get_legend_handles_labels(), loc="outside lower right", ncols=len(LABELS))
        axis.set(title="errors over time" if errors else "no error above 0", xlabel="time t [s]")
        drawn.suptitle(_title(run), fontsize="medium", x=0.02, ha="left")
    return drawn


def _title(run: Outcome) -> str:
    """Return the title: the run, and how it ended."""
    end = f"stopped at t = {run.t[-1]:.4g} s" if run.failure else f"to t = {run.t[-1]:.4g} s"
    return f"{run.method} on {run.problem}, case {run.case}, {run.knob} = {run.value:g}, {end}"


def _seen(rows: Array) -> Array:
    """Return enough rows for a curve that looks smooth."""
    return rows[:: max(1, len(rows) // MOST_POINTS)]


def _motion(axis: Any, layout: Layout, states: Array) -> None:
    """Draw the paths of the masses, with rods, springs and dampers at the end of the run."""
    points = layout.at(states)
    flat = projected(points)
    for line in layout.surface:
        axis.plot(*projected(line).T, color=QUIET, linewidth=0.4)
    ends = sorted({k for rod in layout.rods for k in rod})
    for stroke, k in zip(STROKES, moving(points, layout.masses or ends), strict=False):
        axis.plot(*flat[:, k].T, color=stroke.color, linewidth=0.8)
    extent = float(np.max(np.ptp(flat.reshape(-1, 2), axis=0)))
    draw_springs(axis, layout, flat[-1], extent, color=BLACK, linewidth=0.8)
    for rod in layout.rods:
        axis.plot(*flat[-1, rod].T, color=BLACK, linewidth=1.2)
    axis.plot(*flat[-1, layout.masses].T, "o", color=VERMILION, markersize=6)
    axis.plot(*flat[-1, layout.fixed].T, "s", color=BLACK, markersize=4)
    axis.set(title="motion, and where it ends", aspect="equal")
    if layout.dimension == 3:
        axis.axis("off")


def _states(axis: Any, run: Outcome) -> None:
    """Draw the first states over time, of a problem that declares no picture."""
    name, rows = next(iter(run.states.items()))
    rows, t = _seen(rows), _seen(run.t)
    for k, stroke in zip(range(rows.shape[1]), STROKES, strict=False):
        axis.plot(t, rows[:, k], label=f"{name}{k + 1}", **stroke.line())
    axis.legend(loc="lower right")
    axis.set(title="states over time", xlabel="time t [s]")
