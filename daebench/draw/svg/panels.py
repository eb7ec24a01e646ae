"""Panels with axes, side by side with one legend."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy.typing as npt
from markupsafe import Markup

from daebench.draw.svg.axis import Axis, power
from daebench.draw.svg.marks import Area, Curve, Dots, Mark, Tiles, color_of, dashes_of
from daebench.runs.ivp import Array

WIDTH = 760.0
"""Width of all panels together, in units of the drawing; in the page it fills the available width."""

LEFT, RIGHT, TOP, BOTTOM = 62.0, 12.0, 26.0, 44.0
"""Pixels around the frame of a panel, for labels and title."""

LINE = 20.0
"""Height of a line of the legend, pixels."""


@dataclass(frozen=True)
class Frame:
    """Position of a panel's axes in the drawing, in pixels, and the map from data to pixels."""

    left: float
    top: float
    width: float
    height: float
    x: Axis
    y: Axis

    def __call__(self, x: npt.ArrayLike, y: npt.ArrayLike) -> tuple[Array, Array]:
        """Return pixels of points."""
        return self.left + self.width * self.x.share(x), self.top + self.height * (1 - self.y.share(y))


@dataclass(frozen=True)
class Panel:
    """Axes with marks in them.

    Parameters
    ----------
    x, y : Axis
        The axes.
    marks : sequence of Mark
        Contents, the last on top; named curves, dots, areas and tiles are in the legend.
    title : str
        Title; text of an SVG if it is ``Markup``.
    equal : bool
        Whether x and y have the same scale; the shorter axis is then widened. For linear axes.
    bare : bool
        Whether ticks, labels and grid are left out, for a view of space.
    """

    x: Axis
    y: Axis
    marks: Sequence[Mark] = field(default_factory=tuple)
    title: str = ""
    equal: bool = False
    bare: bool = False

    def frame(self, left: float, top: float, width: float, height: float) -> Frame:
        """Return the position of its axes, within a rectangle that also contains labels and title."""
        inside = (LEFT if not self.bare else RIGHT, BOTTOM if not self.bare else RIGHT)
        frame = Frame(left + inside[0], top + TOP, width - inside[0] - RIGHT, height - TOP - inside[1], self.x, self.y)
        if not self.equal:
            return frame
        by = ((self.x.high - self.x.low) / frame.width) / ((self.y.high - self.y.low) / frame.height)
        return replace(frame, x=self.x.widened(max(1.0, 1 / by)), y=self.y.widened(max(1.0, by)))


def draw_panels(panels: Sequence[Panel], *, alt: str, columns: int = 2, height: float = 250.0, width: float = WIDTH) -> Markup:
    """Return panels as one SVG.

    Parameters
    ----------
    panels : sequence of Panel
        The panels, row by row.
    alt : str
        Description of the picture for screen readers.
    columns : int
        Panels in a row.
    height : float
        Height of a panel with its labels, pixels.
    width : float
        Width of the drawing, pixels.

    Examples
    --------
    >>> import numpy as np
    >>> from daebench.draw.methods import stroke_of
    >>> from daebench.draw.svg.axis import around
    >>> from daebench.draw.svg.marks import Curve
    >>> t = np.linspace(0, 1, 5)
    >>> curve = Curve(t, t**2, stroke_of("rattle"), name="RATTLE")
    >>> svg = draw_panels([Panel(around("time [s]", t), around("error", t), [curve])], alt="An error that grows.")
    >>> svg.startswith("<svg"), "RATTLE" in svg
    (True, True)
    """
    rows, wide = -(-len(panels) // columns), width / columns
    places = [panel.frame(wide * (k % columns), height * (k // columns), wide, height) for k, panel in enumerate(panels)]
    shown = Markup("").join(panel_svg(panel, frame) for panel, frame in zip(panels, places, strict=True))
    below, lines = legend(panels, height * rows, width)
    whole = Markup('<svg class="panels" xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {:g} {:g}" role="img" aria-label="{}">{}{}</svg>')
    return whole.format(width, height * rows + lines * LINE + 4, alt, shown, below)


def panel_svg(panel: Panel, frame: Frame) -> Markup:
    """Return a panel as a group. It contains its frame and its scales, for scripts that move its contents.

    Its clip path is named after the frame, so two clip paths of the same name in a page are equal.
    """
    # Named by its numbers and not by a counter, so that a panel that is drawn again has the same text.
    name = "clip" + "-".join(f"{length:.0f}" for length in (frame.left, frame.top, frame.width, frame.height))
    box = Markup('x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"').format(frame.left, frame.top, frame.width, frame.height)
    title = Markup('<text class="title" x="{:.1f}" y="{:.1f}">{}</text>').format(frame.left, frame.top - 9, panel.title)
    marks = Markup("").join(mark.svg(frame) for mark in panel.marks)
    return Markup(
        '<g class="panel" data-frame="{:.1f} {:.1f} {:.1f} {:.1f}" data-x="{!r} {!r} {:d}" data-y="{!r} {!r} {:d}">'
        '<clipPath id="{}"><rect {}/></clipPath>{}{}<g class="marks" clip-path="url(#{})">{}</g></g>'
    ).format(
        frame.left, frame.top, frame.width, frame.height,
        float(frame.x.low), float(frame.x.high), frame.x.log, float(frame.y.low), float(frame.y.high), frame.y.log,
        name, box, Markup("") if panel.bare else axes_svg(frame), title, name, marks,
    )  # fmt: skip


def axes_svg(frame: Frame) -> Markup:
    """Return grid, axes, ticks with their numbers, and labels."""
    bottom, right = frame.top + frame.height, frame.left + frame.width
    parts = []
    across, x_exponent = frame.x.ticks()
    up, y_exponent = frame.y.ticks()
    for value, text in across:
        (x,), _ = frame([value], [frame.y.low])
        parts.append(Markup('<path class="grid" d="M{:.1f} {:.1f}V{:.1f}"/>').format(x, frame.top, bottom))
        parts.append(Markup('<text x="{:.1f}" y="{:.1f}" text-anchor="middle">{}</text>').format(x, bottom + 15, text))
    for value, text in up:
        _, (y,) = frame([frame.x.low], [value])
        parts.append(Markup('<path class="grid" d="M{:.1f} {:.1f}H{:.1f}"/>').format(frame.left, y, right))
        parts.append(Markup('<text x="{:.1f}" y="{:.1f}" text-anchor="end">{}</text>').format(frame.left - 5, y + 4, text))
    parts.append(Markup('<path class="axis" d="M{:.1f} {:.1f}V{:.1f}H{:.1f}"/>').format(frame.left, frame.top, bottom, right))
    middle = (frame.left + frame.width / 2, frame.top + frame.height / 2)
    parts.append(Markup('<text x="{:.1f}" y="{:.1f}" text-anchor="middle">{}</text>').format(middle[0], bottom + 33, frame.x.label))
    turned = Markup('<text transform="translate({:.1f} {:.1f}) rotate(-90)" text-anchor="middle">{}</text>')
    parts.append(turned.format(frame.left - LEFT + 13, middle[1], frame.y.label))
    for exponent, x, y in ((x_exponent, right, bottom + 33), (y_exponent, frame.left - 5, frame.top - 9)):
        if exponent:
            factor = Markup("\N{MULTIPLICATION SIGN}") + power(exponent)
            parts.append(Markup('<text x="{:.1f}" y="{:.1f}" text-anchor="end">{}</text>').format(x, y, factor))
    return Markup("").join(parts)


def legend(panels: Sequence[Panel], top: float, width: float) -> tuple[Markup, int]:
    """Return the legend of all named marks, with each name once, and its number of lines."""
    named = {mark.name: mark for panel in panels for mark in panel.marks if isinstance(mark, Curve | Dots | Area | Tiles) and mark.name}
    parts, x, line = [], 10.0, 0
    for name, mark in named.items():
        # 7.2 pixels a letter: the width of text is known only to the browser.
        entry_width = 48 + 7.2 * len(Markup(name).striptags())
        if x + entry_width > width and x > 10.0:
            x, line = 10.0, line + 1
        y = top + LINE * line + 10
        parts.append(sample(mark, x, y) + Markup('<text x="{:.1f}" y="{:.1f}">{}</text>').format(x + 34, y + 4, name))
        x += entry_width
    return Markup("").join(parts), line + 1 if named else 0


def sample(mark: Curve | Dots | Area | Tiles, x: float, y: float) -> Markup:
    """Return a short piece of a mark for the legend."""
    if isinstance(mark, Curve):
        line = Markup('<path d="M{:.1f} {:.1f}h28" fill="none" stroke="{}" stroke-width="{}"{}/>')
        return line.format(x, y, color_of(mark.stroke), mark.width, dashes_of(mark.stroke, mark.width))
    if isinstance(mark, Dots):
        filling = "none" if mark.hollow else color_of(mark.stroke)
        return Markup('<circle cx="{:.1f}" cy="{:.1f}" r="3.2" fill="{}" stroke="{}"/>').format(x + 14, y, filling, color_of(mark.stroke))
    swatch = Markup('<rect x="{:.1f}" y="{:.1f}" width="22" height="10" fill="{}" fill-opacity="{}" stroke="{}"/>')
    return swatch.format(x + 3, y - 5, color_of(mark.stroke), 1 if isinstance(mark, Tiles) else 0.22, color_of(mark.stroke))
