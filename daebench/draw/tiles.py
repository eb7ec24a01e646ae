"""Maps of classes over a grid, drawn as few areas: tiles of one class are joined, so that a map of many tiles is a small drawing."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.systems.lazily import matplotlib as mpl

Array = NDArray[np.float64]


def edges(centres: Array) -> Array:
    """Return the edges of tiles with these centres, midway between neighbours in the logarithm, shape(n + 1,)."""
    logs = np.log(centres)
    if len(logs) == 1:
        return np.asarray(np.exp([logs[0] - 0.5, logs[0] + 0.5]))
    middle = (logs[1:] + logs[:-1]) / 2
    return np.asarray(np.exp([2 * logs[0] - middle[0], *middle, 2 * logs[-1] - middle[-1]]))


def fill(axis: Any, across: Array, up: Array, classes: NDArray[np.int64], colours: Sequence[str]) -> None:
    """Colour the tiles of a grid by their class.

    Each colour fills an area that includes the tiles of all later classes, so that no gaps are visible between neighbours.

    The edges ``across`` are of shape(columns + 1,), ``up`` of shape(rows + 1,), and the classes of shape(rows, columns).
    """
    for k in np.unique(classes).tolist():
        # ">=" and not "==": areas of later classes are painted over this one, so that seams between tiles do not show.
        _add(axis, across, up, classes >= k, facecolor=colours[k], edgecolor="none")
    axis.set(xlim=(across[0], across[-1]), ylim=(up[0], up[-1]))


def hatch(axis: Any, across: Array, up: Array, mask: NDArray[np.bool_], pattern: str, colour: str) -> None:
    """Hatch the tiles of a grid at which a mask, shape(rows, columns), is true, with a pattern of Matplotlib."""
    if mask.any():
        _add(axis, across, up, mask, facecolor="none", edgecolor=colour, hatch=pattern)


def _add(axis: Any, across: Array, up: Array, mask: NDArray[np.bool_], **look: Any) -> None:
    """Draw the tiles of a mask as one area."""
    path = mpl.path.Path
    # One path for all rectangles: a patch for each would make a large file and a slow drawing.
    boxes = np.array(list(rectangles(mask)))
    x, y = across[boxes[:, 2:]], up[boxes[:, :2]]
    corners = np.stack([x[:, [0, 1, 1, 0, 0]], y[:, [0, 0, 1, 1, 0]]], axis=2)
    codes = [path.MOVETO, path.LINETO, path.LINETO, path.LINETO, path.CLOSEPOLY]
    area = path(corners.reshape(-1, 2), np.tile(np.array(codes, dtype=np.uint8), len(boxes)))
    axis.add_patch(mpl.patches.PathPatch(area, linewidth=0, **look))


def rectangles(mask: NDArray[np.bool_]) -> Iterator[tuple[int, int, int, int]]:
    """Yield rectangles that make up an area of tiles: first row, row after the last, first column, column after the last.

    Adjacent tiles in a row are joined, and then runs with the same columns in adjacent rows.
    """
    sides = np.diff(np.pad(mask, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    begun: dict[tuple[int, int], int] = {}
    for row, line in enumerate(sides):
        runs = set(zip(np.flatnonzero(line > 0).tolist(), np.flatnonzero(line < 0).tolist(), strict=True))
        # A run that the next row does not continue is complete; sorted, so that the drawing has the same bytes every time.
        for run in sorted(begun.keys() - runs):
            yield begun.pop(run), row, *run
        for run in runs - begun.keys():
            begun[run] = row
    for run, row in sorted(begun.items()):
        yield row, len(mask), *run
