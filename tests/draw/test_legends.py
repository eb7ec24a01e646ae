"""A legend below a figure has as many columns as have room."""

import pytest

from daebench.draw.figures import drawing, grid_of_axes, legend_below

LABELS = {"short": 4, "./a_folder_with_a_long_name/integrator.py:step": 2, "endless " * 20: 1}


@pytest.mark.parametrize(("words", "columns"), LABELS.items())
def test_a_legend_has_as_many_columns_as_fit_into_the_figure(words, columns):
    with drawing():
        figure, axes = grid_of_axes(1, 1, 3.0)
        for k in range(8):
            axes[0, 0].plot([0, 1], [k, k], label=f"{words} {k}")
        legend_below(figure, axes[0, 0], 4)
    (legend,) = figure.legends
    box = legend.get_window_extent()
    assert legend._ncols == columns
    assert columns == 1 or 0 <= box.x0 < box.x1 <= figure.bbox.width


def test_a_figure_without_named_curves_has_no_legend():
    with drawing():
        figure, axes = grid_of_axes(1, 1, 3.0)
        legend_below(figure, axes[0, 0], 4)
    assert not figure.legends
