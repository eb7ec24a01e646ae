"""A picture of the steps of IDA or CVODE: size, order, Newton iterations, and the estimated errors relative to their tolerances."""

from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.draw.figures import BLACK, BLUE, GREEN, PURPLE, QUIET, VERMILION, drawing, grid_of_axes
from daebench.runs.solver_steps import Array, SolverSteps

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEIGHT = 7.4
"""Height of the picture, inches."""

WINDOWS = 300
"""Number of windows. With more than twice as many steps, the largest value in each window is drawn, above a band down to the smallest."""

NAMES = {"q": "positions $q$", "v": "velocities $v$", "p": "momenta $p$", "lam": r"multipliers $\lambda$", "mu": r"multipliers $\mu$"}
NAMES |= {"Lam": r"$\Lambda$, with $\Lambda' = \lambda$", "Mu": r"$M$, with $M' = \mu$", "y": "states $y$"}
"""Blocks of unknowns, for legends."""

COLORS = {"q": BLUE, "y": BLUE, "v": GREEN, "p": GREEN, "lam": VERMILION, "Lam": VERMILION, "mu": PURPLE, "Mu": PURPLE}

DEPTH = 1e-9
"""Fraction of the largest share in the error test; shares below it are not drawn."""


def draw(steps: SolverSteps, title: str = "") -> "Figure":
    """Return the picture.

    Parameters
    ----------
    steps : SolverSteps
        The steps. If no step was taken, the attempts at the first are drawn side by side, by the number of error test failures.
    title : str
        Title of the picture.

    Returns
    -------
    Figure
        Four panels above one another.
    """
    taken = bool(steps.accepted.any())
    x = steps.t if taken else np.cumsum(steps.error_failures).astype(float)
    with drawing():
        label = "time $t$  [s]" if taken else "failures of the error test at the first step"
        figure, axes = grid_of_axes(4, 1, HEIGHT, x=label, sharex=True, height_ratios=(2, 1, 1, 3))
        _sizes(axes[0, 0], x, steps)
        _orders(axes[1, 0], x, steps)
        _iterations(axes[2, 0], x, steps)
        _shares(axes[3, 0], x, steps)
        axes[0, 0].set_title(title)
        if len(x) > 2 * WINDOWS:
            words = f"lines: the largest of {len(x) // WINDOWS} steps or more; bands: down to the smallest"
            axes[0, 0].text(0.99, 0.05, words, transform=axes[0, 0].transAxes, ha="right", color=QUIET)
        if not taken:
            axes[-1, 0].set_xticks(x)
        figure.align_ylabels(axes[:, 0])
        handles, labels = axes[3, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), columnspacing=1.4)
    return figure


def _sizes(ax: Any, x: Array, steps: SolverSteps) -> None:
    refused = ~steps.accepted
    _curve(ax, x[~refused], steps.h[~refused], color=BLACK)
    if refused.any():
        ax.plot(x[refused], steps.h[refused], linestyle="none", marker="x", color=VERMILION, label="failed in the error test")
        ax.legend(loc="lower left")
    if not len(x):
        ax.text(0.5, 0.5, "no step was taken, and no attempt reached the error test", transform=ax.transAxes, ha="center", color=QUIET)
    ax.set(yscale="log", ylabel="step size $h$  [s]")
    ax.minorticks_off()


def _orders(ax: Any, x: Array, steps: SolverSteps) -> None:
    # "pre", because an order belongs to the step that ends at its time.
    _curve(ax, x, steps.order, color=BLACK, drawstyle="steps-pre")
    top = int(max(5, steps.order.max(initial=1)))
    ax.set(ylabel="order", ylim=(0.5, top + 0.5), yticks=range(1, top + 1, 1 if top <= 5 else 3))


def _iterations(ax: Any, x: Array, steps: SolverSteps) -> None:
    _curve(ax, x, steps.iterations, color=BLACK, linewidth=0.9)
    top = 1.2 * max(2, int(steps.iterations.max(initial=0)))
    fails = (steps.error_failures, 0.0, VERMILION, "error test failed"), (steps.newton_failures, -0.18, BLUE, "Newton failed")
    for failures, height, color, label in fails:
        where = failures > 0
        ax.plot(x[where], np.full(where.sum(), height * top), "|", color=color, label=f"{label}, {failures.sum()} times", markersize=5)
    ax.set(ylabel="iterations", ylim=(-0.3 * top, top))
    ax.yaxis.get_major_locator().set_params(integer=True)
    ax.legend(loc="lower left", ncols=2, bbox_to_anchor=(0, 0.92), borderaxespad=0, handlelength=1)


def _shares(ax: Any, x: Array, steps: SolverSteps) -> None:
    shares = steps.shares
    for name, share in shares.items():
        out = name in steps.untested
        label = f"{NAMES[name]}{', not tested' if out else ''}"
        _curve(ax, x, share, color=COLORS[name], linestyle=(0, (2, 1)) if out else "-", linewidth=1.1, label=label)
    ax.axhline(1.0, color=QUIET, linewidth=1.2)
    largest = max((float(share.max(initial=0.0)) for share in shares.values()), default=0.0)
    visible = [share[share > DEPTH * max(largest, 1.0)] for share in shares.values()]
    least = min((float(share.min()) for share in visible if len(share)), default=1.0)
    ax.set(yscale="log", ylabel="estimate / tolerance", ylim=(0.5 * min(least, 1.0), 3.0 * max(largest, 1.0)))
    ax.minorticks_off()


def _curve(ax: Any, x: Array, y: Any, **settings: Any) -> None:
    """Draw values. Of many values, draw the largest of each window above a band down to the smallest."""
    if len(x) > 2 * WINDOWS:
        # The largest of each window, because failures and spikes last one step and would vanish among many.
        edges = np.linspace(0, len(x), WINDOWS + 1).astype(int)[:-1]
        x, least, y = x[edges], np.minimum.reduceat(y, edges), np.maximum.reduceat(y, edges)
        step = {"step": "pre"} if "drawstyle" in settings else {}
        ax.fill_between(x, least, y, color=settings["color"], alpha=0.25, linewidth=0, **step)
    ax.plot(x, y, **settings, marker="" if len(x) > 1 else "o")
