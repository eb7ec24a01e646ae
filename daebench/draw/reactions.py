"""The picture of the reactions of a run: the sizes of forces and torques over time."""

from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.draw.figures import STROKES, drawing, grid_of_axes

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def figure(result: Any) -> "Figure":
    """Return a figure of the forces of joints, and of their torques where there are any: of those that are largest."""
    curves = {name: _largest(result.loads, name) for name in ("force", "torque")}
    units = (
        {"force": "force $|F|$  [N]", "torque": "torque $|T|$  [N m]"} if result.mechanism else {"force": "force in the coordinates $q$"}
    )
    shown = [name for name in units if curves[name] or name == "force"]
    with drawing():
        drawn, axes = grid_of_axes(len(shown), 1, 0.8 + 2.5 * len(shown), x="time $t$  [s]", sharex=True)
        for ax, name in zip(axes[:, 0], shown, strict=True):
            for stroke, (label, sizes) in zip(STROKES, curves[name], strict=False):
                ax.plot(result.t, sizes, label=label, **stroke.line())
            ax.set(
                ylabel=units[name], title=f"the largest {len(STROKES)} of {len(curves[name])}" if len(curves[name]) > len(STROKES) else ""
            )
            if curves[name]:
                ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        drawn.suptitle(
            f"reactions of {result.ivp.problem}, case {result.ivp.case}, by {result.method}", x=0.02, ha="left", fontsize="medium"
        )
    return drawn


def _largest(loads: Any, name: str) -> list[tuple[str, Any]]:
    """Return names and sizes of the loads that are determined and not 0, from the largest: of a joint of two bodies, those on one."""
    sizes: dict[str, Any] = {}
    for load in loads:
        size, label = np.linalg.norm(getattr(load, name), axis=1), load.joint if load.on == "q" else f"{load.joint} on {load.on}"
        twins = [x for x, other in sizes.items() if x.startswith(load.joint) and np.allclose(other, size, rtol=1e-9)]
        if np.any(size > 0) and not twins:
            sizes[label] = size
    return sorted(sizes.items(), key=lambda pair: -float(np.nanmax(pair[1])))
