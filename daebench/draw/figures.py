"""Style and files of all figures: a drawing as SVG and PNG, and its numbers as CSV."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daebench.runs.csv_files import write_frame
from daebench.runs.files import atomic
from daebench.runs.outputs import described
from daebench.systems.lazily import matplotlib as mpl

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

WIDTH = 7.2
"""Width of a figure in inches: the text width of a printed page, so that 9 pt letters are printed at 9 pt."""

DPI = 180

BLACK, ORANGE, SKY, GREEN, BLUE, VERMILION, PURPLE = ("#000000", "#c27c00", "#3f97d4", "#008f68", "#0072b2", "#c24e00", "#bf6598")
"""The colours of Okabe and Ito, with a lightness that gives lines a contrast of 3 on light and on dark pages."""

BROWN, OLIVE, INDIGO = "#8f5b3e", "#7d8400", "#7565c8"
"""More colours of that contrast, for pictures of many methods; dashes and markers distinguish them from those above."""

QUIET = "#767676"
"""Grey of auxiliary elements: zero lines, diagonals, notes."""


@dataclass(frozen=True)
class Stroke:
    """How a curve is drawn: colour, dashes and marker differ together, so that a print in grey can be read.

    Parameters
    ----------
    color : str
        Colour.
    dashes : str or tuple
        Line style of Matplotlib.
    marker : str
        Marker of Matplotlib.
    """

    color: str
    dashes: Any
    marker: str

    def line(self) -> dict[str, Any]:
        """Return keyword arguments for a curve without markers."""
        return {"color": self.color, "linestyle": self.dashes}

    def points(self) -> dict[str, Any]:
        """Return keyword arguments for a curve with open markers, so that those beneath are visible."""
        return self.line() | {"marker": self.marker, "markerfacecolor": "white", "markeredgecolor": self.color}


STROKES = (
    Stroke(VERMILION, "-", "o"),
    Stroke(ORANGE, (0, (6, 1.5)), "s"),
    Stroke(PURPLE, (0, (4, 1.5, 1, 1.5)), "D"),
    Stroke(BLUE, "-", "^"),
    Stroke(SKY, (0, (1, 1)), "v"),
    Stroke(GREEN, (0, (3, 1, 1, 1, 1, 1)), "P"),
    Stroke(BLACK, (0, (8, 2)), "X"),
)
"""Strokes in the order of use; no two share a colour, dashes with a neighbour in lightness, or a marker."""


def curve(k: int) -> dict[str, Any]:
    """Return keyword arguments for the k-th of many curves with markers: the strokes in order, then again with filled markers.

    Parameters
    ----------
    k : int
        Number of the curve, from 0.

    Returns
    -------
    dict
        For Matplotlib's ``plot``, ``loglog``, ...
    """
    stroke = STROKES[k % len(STROKES)]
    return stroke.points() if k < len(STROKES) else stroke.points() | {"markerfacecolor": stroke.color, "linewidth": 0.8}


def legend_below(figure: "Figure", axis: Any, columns: int, *, handles: Sequence[Any] = (), **settings: Any) -> None:
    """Put one legend for the labelled curves of an axis, or for given handles, below a figure; nothing if there are none.

    Parameters
    ----------
    figure : Figure
        The figure.
    axis : Axes
        Axes whose labelled curves are named.
    columns : int
        Entries side by side, at most: as many as have room.
    handles : sequence of artists
        Entries in place of the curves of the axis.
    **settings
        For Matplotlib's ``legend``, for example ``columnspacing=1.3``.

    Examples
    --------
    >>> figure, axes = grid_of_axes(1, 1, 2.0)
    >>> line = axes[0, 0].plot([0, 1], [0, 1], label="RATTLE")
    >>> legend_below(figure, axes[0, 0], 2)
    >>> [text.get_text() for text in figure.legends[0].get_texts()]
    ['RATTLE']
    """
    shown = list(handles) or axis.get_legend_handles_labels()[0]
    # Widths are known only when the entries are laid out, so that fewer columns are tried until they fit.
    for wide in range(min(columns, len(shown)), 0, -1):
        legend = figure.legend(handles=shown, loc="outside lower center", ncols=wide, **settings)
        if wide == 1 or legend.get_window_extent().width <= figure.bbox.width:
            return
        legend.remove()


_STYLE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.use_mathtext": True,
    "axes.formatter.limits": (-3, 4),
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.6,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "legend.handlelength": 3.2,
    "lines.linewidth": 1.4,
    "lines.markersize": 4.5,
    "mathtext.fontset": "dejavusans",
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "figure.constrained_layout.use": True,
    "path.simplify": True,
    # Letters as paths: a figure looks the same where its fonts are missing.
    "svg.fonttype": "path",
    # The identifiers in a file are otherwise drawn at random.
    "svg.hashsalt": "daebench",
}


SCALED = (
    *("font.size", "axes.titlesize", "axes.labelsize", "xtick.labelsize", "ytick.labelsize", "legend.fontsize", "axes.linewidth"),
    *("lines.linewidth", "lines.markersize", "grid.linewidth", "xtick.major.width", "ytick.major.width"),
)
"""Settings that grow with a figure."""


@contextmanager
def drawing(scale: float = 1.0) -> Iterator[None]:
    """Yield a context with the style of daebench, and restore the settings of Matplotlib.

    ``scale`` enlarges letters and lines, for figures that are wider than the text of a page.

    Examples
    --------
    >>> with drawing():
    ...     figure, axes = grid_of_axes(1, 2, 2.0, x="time", y="error")
    >>> axes.shape
    (1, 2)
    """
    with mpl.rc_context(_STYLE | {name: scale * _STYLE[name] for name in SCALED}):
        yield


def grid_of_axes(rows: int, columns: int, height: float, *, x: str = "", y: str = "", **settings: Any) -> tuple["Figure", Any]:
    """Return a figure of the text's width and its axes, shape(rows, columns).

    The figure belongs only to the caller: pyplot does not store it, and no window can open.

    Parameters
    ----------
    rows, columns : int
        Numbers of axes.
    height : float
        Height of the figure, inches; its width is :data:`WIDTH`.
    x, y : str
        Labels of the lowest axes (below), and of the leftmost axes (at the left).
    **settings
        For Matplotlib's ``subplots``, for example ``sharex=True``.

    Returns
    -------
    figure : Figure
        The figure.
    axes : ndarray of Axes, shape(rows, columns)
        Its axes, also if there is only one.

    Examples
    --------
    >>> figure, axes = grid_of_axes(2, 1, 3.0, x="time $t$ [s]")
    >>> axes.shape
    (2, 1)
    """
    from daebench.draw.canvas import Canvas

    # Not pyplot, which keeps every figure in memory and may open windows.
    figure = Canvas(figsize=(WIDTH, height))
    axes = figure.subplots(rows, columns, squeeze=False, **settings)
    for labelled, label in ((axes[-1], {"xlabel": x}), (axes[:, 0], {"ylabel": y})):
        for ax in labelled:
            ax.set(**label)
    return figure, axes


def save(figure: "Figure", directory: Path, stem: str, data: "pd.DataFrame | Mapping[str, Any]") -> Path:
    """Write ``stem.svg``, ``stem.png`` and ``stem.csv`` into a folder, each whole or not at all; return the path of the SVG.

    The SVG needs no fonts, contains no date and has the same bytes for the same drawing.

    Parameters
    ----------
    figure : Figure
        The drawing.
    directory : Path
        Folder; made if it does not exist.
    stem : str
        Name of the files without extension.
    data : DataFrame or mapping of str to array_like
        The numbers in the figure, by column.

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> figure, axes = grid_of_axes(1, 1, 2.0)
    >>> folder = save(figure, Path(mkdtemp()), "line", {"x": [0.0, 1.0], "y": [0.0, 1.0]}).parent
    >>> sorted(path.name for path in folder.iterdir())
    ['line.csv', 'line.csv.txt', 'line.png', 'line.svg']
    """
    directory.mkdir(parents=True, exist_ok=True)
    table, *pictures = (directory / f"{stem}{ending}" for ending in (".csv", ".svg", ".png"))
    with described([table], _columns(data), pictures), atomic(pictures[0]) as svg, atomic(pictures[1]) as png, atomic(table) as scratch:
        _draw_both(figure, svg, png)
        write_frame(scratch, data, float_format="%.12g")
    return pictures[0]


def save_drawing(figure: "Figure", directory: Path, stem: str) -> tuple[Path, Path]:
    """Write ``stem.svg`` and ``stem.png`` into an existing folder, each whole or not at all; return their paths."""
    paths = (directory / f"{stem}.svg", directory / f"{stem}.png")
    with atomic(paths[0]) as svg, atomic(paths[1]) as png:
        _draw_both(figure, svg, png)
    return paths


def _draw_both(figure: "Figure", svg: Path, png: Path) -> None:
    layout = figure.get_layout_engine()
    part_labels(figure)
    _draw(figure, svg)
    figure.set_layout_engine("none")  # the layout of the first drawing serves for both
    _draw(figure, png)
    figure.set_layout_engine(layout)


def save_picture(figure: "Figure", path: Path) -> None:
    """Write a figure to one file, whole or not at all, in a format of :data:`PICTURES`. A vector drawing contains no date.

    Examples
    --------
    >>> from tempfile import mkdtemp
    >>> figure, axes = grid_of_axes(1, 1, 2.0)
    >>> file = Path(mkdtemp()) / "line.svg"
    >>> save_picture(figure, file)
    >>> file.stat().st_size > 1000
    True
    """
    part_labels(figure)
    with atomic(path) as scratch:
        _draw(figure, scratch)


def part_labels(figure: "Figure") -> None:
    """Hide numbers at ticks that would run into others, as on logarithmic axes of less than a decade; powers of ten go first."""
    with drawing():
        figure.draw_without_rendering()
    for axis in (axis for axes in figure.axes if axes.get_visible() for axis in (axes.xaxis, axes.yaxis)):
        taken: list[Any] = []
        # Major ticks first: where there is no room for all, minor ones give way.
        for tick in [*axis.get_major_ticks(), *axis.get_minor_ticks()]:
            box = tick.label1.get_window_extent()
            if not tick.label1.get_visible() or not tick.label1.get_text() or not box.width:
                continue
            if any(box.padded(GAP * figure.dpi / 72).overlaps(other) for other in taken):
                tick.label1.set_visible(False)
            else:
                taken.append(box)


GAP = 2.0
"""Least distance of two numbers at ticks, points."""


def _draw(figure: "Figure", path: Path) -> None:
    undated: Any = {".svg": {"Date": None, "Creator": None, "Source": figure.get_label() or _drawn_by()}, ".pdf": {"CreationDate": None}}
    ending = path.suffix.lower()
    with drawing():
        figure.savefig(path, format=ending[1:], dpi=DPI, metadata=undated.get(ending))


PICTURES = (".pdf", ".svg", ".png")
"""Extensions of picture files."""


def _drawn_by() -> str | None:
    """Return the module that draws a figure: the first one up the call stack other than this one."""
    # By the call stack: a drawing need not say where it comes from, and cannot say it wrongly.
    frame = sys._getframe(1)
    while frame.f_back and frame.f_globals.get("__name__") == __name__:
        frame = frame.f_back
    return str(frame.f_globals.get("__name__", "")) or None


def save_table(path: Path, data: "pd.DataFrame | Mapping[str, Any]") -> None:
    """Write columns as CSV, whole or not at all, with 12 significant digits, and beside it a text on how it was made.

    Parameters
    ----------
    path : Path
        The file; its folder is made if it does not exist.
    data : DataFrame or mapping of str to array_like
        The columns.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with described([path], _columns(data)), atomic(path) as scratch:
        write_frame(scratch, data, float_format="%.12g")


def _columns(data: "pd.DataFrame | Mapping[str, Any]") -> dict[str, str]:
    """Return the descriptions of the columns of a table."""
    names = {"problem": "Problems", "case": "Cases", "method": "Methods", "t_end": "Ends of runs [s]"}
    described_by = {words: ", ".join(dict.fromkeys(map(str, data[name]))) for name, words in names.items() if name in data}
    return {"Columns": ", ".join(map(str, data)), **described_by}
