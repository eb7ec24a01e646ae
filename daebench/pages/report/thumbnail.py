"""The picture of a report in the index: one message, drawn for the size in which it is shown."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from daebench.draw.figures import drawing, save_drawing
from daebench.pages.report.index import THUMBNAIL
from daebench.systems.lazily import matplotlib as mpl

SIZE = (3.0, 1.8)
"""Width and height, inches: 300 pixels across at the letters' nominal size."""

LETTERS: Any = {"font.size": 8.0, "ytick.labelsize": 7.5, "xtick.labelsize": 7.5, "axes.labelsize": 8.0, "axes.titlesize": 8.5}
"""Sizes of letters, points."""


def draw_thumbnail(folder: Path, draw: Callable[[Any], None]) -> Path:
    """Draw a picture for the index into the folder of a report's figures; return the path of its PNG."""
    with drawing(), mpl.rc_context(LETTERS):
        figure = mpl.figure.Figure(figsize=SIZE)
        draw(figure.subplots())
        return save_drawing(figure, folder, THUMBNAIL)[1]
