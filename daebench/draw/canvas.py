"""A figure that a notebook displays by itself, without pyplot and without a backend selected before."""

from matplotlib.figure import Figure

from daebench.runs.result import image


class Canvas(Figure):
    """A Matplotlib figure that a notebook displays if it is the result of a cell."""

    def _repr_html_(self) -> str:
        """Return the picture as an element of a page."""
        return image(self)
