"""Pictures of a run and its parallelogram: path, area, energy error, constraint residuals, and the parallelogram in three planes."""

import numpy as np
from markupsafe import Markup

from daebench.draw.figures import BLACK, BLUE, GREEN, VERMILION, Stroke
from daebench.draw.svg.axis import Axis, around
from daebench.draw.svg.marks import Area, Curve, Mark
from daebench.draw.svg.panels import Panel, draw_panels
from daebench.reports.lessons._panels import path, view
from daebench.reports.lessons._why_symplectic_run import Carried
from daebench.runs.ivp import Array

RUN, START, LEVEL, VELOCITY = (
    Stroke(BLUE, "-", ""),
    Stroke(GREEN, "-", ""),
    Stroke(BLACK, (0, (4, 3)), ""),
    Stroke(VERMILION, (0, (6, 2)), ""),
)
SMALLEST, FLOOR, CEILING = 0.05, -2.0, 4.0
"""Smallest and largest half width of the axis of areas, because an area may diverge."""

INDEX = "\N{SUBSCRIPT ONE}\N{SUBSCRIPT TWO}\N{SUBSCRIPT THREE}"


def picture(run: Carried) -> Markup:
    """Return all panels of a run."""
    upper = [view(path(run.q, RUN), "the path on the sphere"), area_panel(run), energy_panel(run), constraint_panel(run)]
    words = f"{run.method}: path on the sphere, symplectic area, energy error and residuals of the constraints against time"
    shapes = f"The parallelogram at the start and after {run.t[-1]:g} s, projected onto the planes of each position and its momentum"
    planes = draw_panels([plane_panel(run, i) for i in range(3)], alt=shapes, columns=3, height=250)
    return draw_panels(upper, alt=words, columns=2, height=235) + planes


def area_panel(run: Carried) -> Panel:
    """Return the symplectic area against time."""
    low, high = (float(np.clip(end, FLOOR, CEILING)) for end in (run.area.min(), run.area.max()))
    axis = around("area dq \N{LOGICAL AND} dp", [min(low, 1 - SMALLEST), max(high, 1 + SMALLEST)])
    marks = [level(run, 1.0), Curve(run.t, run.area, RUN)]
    return Panel(time(run), axis, marks, "symplectic area of the parallelogram")


def energy_panel(run: Carried) -> Panel:
    """Return the energy error against time."""
    return Panel(
        time(run),
        around("H \N{MINUS SIGN} H\N{SUBSCRIPT ZERO} [J]", run.energy, [0.0]),
        [level(run, 0.0), Curve(run.t, run.energy, RUN)],
        "energy error",
    )


def constraint_panel(run: Carried) -> Panel:
    """Return the residuals of both constraints against time; values below 10^-17 are drawn at 10^-17."""
    g, Gv = np.maximum(run.g, 1e-17), np.maximum(run.Gv, 1e-17)
    axis = around("|g|, |G H\N{LATIN SUBSCRIPT SMALL LETTER P}|", g, Gv, [1e-17, 1e-1], log=True)
    return Panel(
        time(run),
        axis,
        [Curve(run.t, g, RUN, "|g|"), Curve(run.t, Gv, VELOCITY, "|G H\N{LATIN SUBSCRIPT SMALL LETTER P}|")],
        "distance from the manifold",
    )


def plane_panel(run: Carried, i: int) -> Panel:
    """Return the projections of the parallelogram onto the plane of q_i and p_i, at the start and at the end."""
    first, last = corners(run.X[0], i), corners(run.X[-1], i)
    title = f"plane {i + 1}: area {run.planes[0, i]:.3g} \N{RIGHTWARDS ARROW} {run.planes[-1, i]:.4g}".replace("-", "\N{MINUS SIGN}")
    x, y = (around(f"d{name}{INDEX[i]}", first[:, k], last[:, k], [-1.0, 1.0]) for k, name in enumerate("qp"))
    marks = [Area(first[:, 0], first[:, 1], START, "at the start"), Area(last[:, 0], last[:, 1], VELOCITY, "at the end")]
    return Panel(x, y, marks, title)


def corners(X: Array, i: int) -> Array:
    """Return the corners of a projected parallelogram, shape(4, 2): q_i and p_i."""
    a, b = X[[i + 3, i]].T
    return np.array([0 * a, a, a + b, b])


def time(run: Carried) -> Axis:
    """Return the axis of time."""
    return Axis("t [s]", 0.0, max(float(run.t[-1]), 1e-6))


def level(run: Carried, value: float) -> Mark:
    """Return the label for a kept area."""
    return Curve([0.0, float(run.t[-1])], [value, value], LEVEL, width=0.9, faint=True)
