"""Names of curves at their right ends, instead of a legend: moved apart if they would overlap, each with a line to its curve."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from daebench.runs.ivp import Array

LINE = 1.25
"""Distance of two names, as a multiple of the font size."""


def label_ends(axis: Any, names: Sequence[str], x: Sequence[float], y: Sequence[float], colors: Sequence[str], size: float = 8.0) -> None:
    """Write names beside the right edge of axes with fixed limits, each in its colour and, if there is room, at the height of its point."""
    axis.set(xlim=axis.get_xlim(), ylim=axis.get_ylim())  # Matplotlib computes limits only on request
    box = axis.get_position()
    height = axis.figure.get_size_inches()[1] * box.height * 72
    ends = axis.transAxes.inverted().transform(axis.transData.transform(np.column_stack([x, y])))
    ends[:, 1] = np.clip(ends[:, 1], 0.0, 1.0)
    # By height; of ends at one height the rightmost is lowest.
    order = np.lexsort((-ends[:, 0], ends[:, 1]))
    places = apart(ends[order, 1], LINE * size / height)
    for k, place in zip(order, places, strict=True):
        axis.annotate(
            names[k],
            xy=ends[k],
            xycoords="axes fraction",
            xytext=(1.04, place),
            textcoords="axes fraction",
            color=colors[k],
            fontsize=size,
            va="center",
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": colors[k], "linewidth": 0.4, "alpha": 0.7, "shrinkA": 1, "shrinkB": 1},
        )


def apart(levels: Array, gap: float) -> Array:
    """Return ascending levels at least a gap apart, shape(n,); groups of levels are moved apart about their given means.

    Examples
    --------
    >>> apart(np.array([0.0, 0.1, 5.0]), 1.0).tolist()
    [-0.45, 0.55, 5.0]
    """
    groups: list[tuple[float, int]] = []
    for level in levels:
        groups.append((float(level), 1))
        # Groups that touch become one about their common mean: a name is moved no further than its neighbours force it.
        while len(groups) > 1 and groups[-1][0] - groups[-2][0] < gap * (groups[-1][1] + groups[-2][1]) / 2:
            (a, m), (b, n) = groups[-2:]
            groups[-2:] = [((m * a + n * b) / (m + n), m + n)]
    return np.concatenate([middle + gap * (np.arange(n) - (n - 1) / 2) for middle, n in groups] or [np.empty(0)])
