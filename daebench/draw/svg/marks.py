"""Marks in a panel: curves, dots, areas, tiles, levels and notes, each as SVG in the pixels of its panel."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt
from markupsafe import Markup

from daebench.draw.figures import BLACK, Stroke
from daebench.draw.tiles import rectangles
from daebench.runs.ivp import Array

INK = "currentColor"
"""The colour of the page's text, light or dark."""

PER_PIXEL = 2.0
"""Number of points of a curve per pixel of its panel's width above which only the lowest and the highest of each bin are drawn."""


class Place(Protocol):
    """Maps data to pixels."""

    @property
    def width(self) -> float:
        """Width of the panel's frame, pixels."""
        ...

    def __call__(self, x: npt.ArrayLike, y: npt.ArrayLike) -> tuple[Array, Array]:
        """Return pixels of points."""
        ...


class Mark(Protocol):
    """Anything that can be drawn in a panel."""

    def svg(self, place: Place) -> Markup:
        """Return it as SVG."""
        ...


def color_of(stroke: Stroke) -> str:
    """Return the colour of a stroke; black follows the page."""
    return INK if stroke.color == BLACK else stroke.color


@dataclass(frozen=True)
class Curve:
    """A line through points; it is broken at points that are not finite or cannot be placed on the axes.

    Parameters
    ----------
    x, y : array_like, shape(n,)
        The points.
    stroke : Stroke
        Colour and dashes.
    name : str
        Name in the legend; no entry if empty.
    width : float
        Width of the line, pixels.
    faint : bool
        Whether it is only a guide to the eye.
    """

    x: npt.ArrayLike
    y: npt.ArrayLike
    stroke: Stroke
    name: str = ""
    width: float = 1.6
    faint: bool = False

    def svg(self, place: Place) -> Markup:
        """Return it as a path."""
        path = path_of(*thinned(*place(self.x, self.y), round(PER_PIXEL * place.width)))
        opacity = Markup(' opacity=".35"') if self.faint else Markup("")
        return Markup('<path d="{}" fill="none" stroke="{}" stroke-width="{}"{}{}/>').format(
            path, color_of(self.stroke), self.width, dashes_of(self.stroke, self.width), opacity
        )


@dataclass(frozen=True)
class Dots:
    """Points as discs.

    Parameters
    ----------
    x, y : array_like, shape(n,)
        The points.
    stroke : Stroke
        Their colour is that of the stroke.
    name : str
        Name in the legend; no entry if empty.
    radius : float
        Radius of a disc, pixels.
    hollow : bool
        Whether only the outline is drawn.
    """

    x: npt.ArrayLike
    y: npt.ArrayLike
    stroke: Stroke
    name: str = ""
    radius: float = 2.2
    hollow: bool = False

    def svg(self, place: Place) -> Markup:
        """Return them as one path of round caps, or as circles if they are hollow."""
        x, y = place(self.x, self.y)
        finite = np.isfinite(x) & np.isfinite(y)
        color = color_of(self.stroke)
        if self.hollow:
            circle = Markup('<circle cx="{:.1f}" cy="{:.1f}" r="{}"/>')
            circles = Markup("").join(circle.format(a, b, self.radius) for a, b in zip(x[finite], y[finite], strict=True))
            return Markup('<g fill="none" stroke="{}" stroke-width="1.4">{}</g>').format(color, circles)
        # Strokes of length zero with round caps: far less text than as many circles.
        path = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(x[finite].tolist(), y[finite].tolist(), strict=True))
        return Markup('<path d="{}" fill="none" stroke="{}" stroke-width="{}" stroke-linecap="round"/>').format(
            path, color, 2 * self.radius
        )


@dataclass(frozen=True)
class Area:
    """A filled polygon.

    Parameters
    ----------
    x, y : array_like, shape(n,)
        Its corners.
    stroke : Stroke
        Its outline; the fill has the same colour, pale.
    name : str
        Name in the legend; no entry if empty.
    """

    x: npt.ArrayLike
    y: npt.ArrayLike
    stroke: Stroke
    name: str = ""

    def svg(self, place: Place) -> Markup:
        """Return it as a closed path."""
        path = path_of(*place(self.x, self.y)) + "Z"
        return Markup('<path d="{}" fill="{}" fill-opacity=".22" stroke="{}" stroke-width="1.4" stroke-linejoin="round"/>').format(
            path, color_of(self.stroke), color_of(self.stroke)
        )


@dataclass(frozen=True)
class Tiles:
    """Tiles of a grid in one colour.

    Parameters
    ----------
    across, up : ndarray, shape(columns + 1,) and shape(rows + 1,)
        Edges of the tiles of the grid.
    chosen : ndarray of bool, shape(rows, columns)
        Tiles that are drawn.
    stroke : Stroke
        Their colour is that of the stroke.
    name : str
        Name in the legend; no entry if empty.
    """

    across: Array
    up: Array
    chosen: npt.NDArray[np.bool_]
    stroke: Stroke
    name: str = ""

    def svg(self, place: Place) -> Markup:
        """Return them as one path of rectangles; neighbours are joined."""
        boxes = np.array(list(rectangles(self.chosen)), dtype=int).reshape(-1, 4)
        (x, y), (right, top) = (place(self.across[boxes[:, 2 + k]], self.up[boxes[:, k]]) for k in (0, 1))
        corners = zip(x.tolist(), y.tolist(), right.tolist(), top.tolist(), strict=True)
        path = "".join(f"M{a:.1f} {b:.1f}H{c:.1f}V{d:.1f}H{a:.1f}Z" for a, b, c, d in corners)
        return Markup('<path d="{}" fill="{}"/>').format(path, color_of(self.stroke))


@dataclass(frozen=True)
class Note:
    """A few words at a point.

    Parameters
    ----------
    x, y : float
        Position, in the units of the axes.
    text : str
        The words; text of an SVG if it is ``Markup``.
    anchor : str
        Part of the text that is at the point: "start", "middle" or "end".
    """

    x: float
    y: float
    text: str
    anchor: str = "start"

    def svg(self, place: Place) -> Markup:
        """Return it as text; nothing if it cannot be placed on the axes."""
        (x,), (y,) = place([self.x], [self.y])
        if not (np.isfinite(x) and np.isfinite(y)):
            return Markup("")
        return Markup('<text class="note" x="{:.1f}" y="{:.1f}" text-anchor="{}">{}</text>').format(x, y, self.anchor, self.text)


def thinned(x: Array, y: Array, most: int) -> tuple[Array, Array]:
    """Return a curve with about ``most`` points at most, up to three for each bin. Lowest and highest points and gaps are not lost."""
    n = len(x)
    if n <= most:
        return x, y
    size = -(-n // max(1, most // 2))
    bins = -(-n // size)
    padded = np.full(bins * size, y[-1])
    padded[:n] = y
    whole = padded.reshape(bins, size)
    finite = np.isfinite(whole)
    # The first gap of a bin is kept, too: a curve must not be drawn across values that are missing.
    places = (np.where(finite, whole, np.inf).argmin(axis=1), np.where(finite, whole, -np.inf).argmax(axis=1), finite.argmin(axis=1))
    indices = np.unique(np.concatenate([[0, n - 1], *(size * np.arange(bins) + place for place in places)]))
    indices = indices[indices < n]
    return x[indices], y[indices]


def path_of(x: Array, y: Array) -> str:
    """Return points in pixels as the data of a path, with a gap at points that are not finite."""
    finite = np.isfinite(x) & np.isfinite(y)
    pens = np.where(np.concatenate([[False], finite[:-1]]), "L", "M")[finite].tolist()
    # Points far outside of the picture are moved nearer: browsers compute paths in single precision.
    pixels = np.clip(np.stack([x[finite], y[finite]], axis=1), -1e5, 1e5).tolist()
    return "".join(f"{pen}{a:.1f} {b:.1f}" for pen, (a, b) in zip(pens, pixels, strict=True))


def dashes_of(stroke: Stroke, width: float) -> Markup:
    """Return the dashes of a stroke as an attribute: Matplotlib's, in widths of the line."""
    if isinstance(stroke.dashes, str):
        return Markup("")
    lengths: Sequence[float] = stroke.dashes[1]
    return Markup(' stroke-dasharray="{}"').format(" ".join(f"{width * length:g}" for length in lengths))
