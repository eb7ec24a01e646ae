"""A figure that a notebook shows by itself, without pyplot and without a backend that has been chosen before."""

from matplotlib.figure import Figure

from daebench.runs.shown import image


class Canvas(Figure):
    """A figure of Matplotlib whose picture a notebook shows where the figure is the result of a cell."""

    def _repr_html_(self) -> str:
        """Return the picture as an element of a page."""
        return image(self)
