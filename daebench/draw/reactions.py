"""The picture of the reactions of a run: the sizes of forces and torques over time."""

from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.draw.figures import STROKES, drawing, grid_of_axes
from daebench.runs.ivp import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def figure(result: Any) -> "Figure":
    """Return a figure of the forces of joints, and of their torques where there are any: of those that are largest."""
    quantities = {"force": "force $|F|$  [N]", "torque": "torque $|T|$  [N m]"} if result.mechanism else {"force": "force in $q$"}
    panels = {name: curves for name in quantities if (curves := _largest(result.loads, name)) or name == "force"}
    with drawing():
        drawn, axes = grid_of_axes(len(panels), 1, 0.7 + 2.6 * len(panels), x="time $t$  [s]", sharex=True)
        for ax, (name, curves) in zip(axes[:, 0], panels.items(), strict=True):
            for stroke, (label, sizes) in zip(STROKES, curves.items(), strict=False):
                ax.plot(result.t, sizes, label=label, **(stroke.line() if len(result.t) > 1 else stroke.points()))
            ax.set_ylabel(quantities[name])
            if curves:
                ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        axes[0, 0].set_title(f"reactions of {result.ivp.problem}, case {result.ivp.case}, by {result.method}")
    return drawn


def _largest(loads: Any, name: str) -> dict[str, Array]:
    """Return the sizes of a quantity by joint and body, the largest ones first, without those that are 0 or not determined."""
    sizes = {f"{load.joint} on {load.on}" if load.on != "q" else load.joint: np.linalg.norm(getattr(load, name), axis=1) for load in loads}
    above = {label: size for label, size in sizes.items() if np.any(size > 0)}
    largest = max((float(np.nanmax(size)) for size in above.values()), default=0.0)
    seen = {label: size for label, size in above.items() if np.nanmax(size) > 1e-9 * largest}
    order = sorted(seen, key=lambda label: -float(np.nanmax(seen[label])))
    return {label: seen[label] for label in order[: len(STROKES)]}
