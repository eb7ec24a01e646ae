"""Names at the ends of curves: apart, in order, and as near to their curves as there is room."""

import numpy as np
import pytest

from daebench.draw.end_labels import apart, label_ends
from daebench.draw.figures import drawing, grid_of_axes


@pytest.mark.parametrize("levels", [[0.0, 0.0, 0.0], [0.0, 0.1, 5.0], [0.0, 0.4, 0.9, 1.0, 1.01], [2.0], []], ids=str)
def test_names_are_a_gap_apart_in_their_order_and_their_mean_stays(levels):
    places = apart(np.array(levels), 0.5)
    assert np.all(np.diff(places) >= 0.5 - 1e-12)
    assert places.sum() == pytest.approx(sum(levels))


def test_levels_that_are_apart_stay():
    assert apart(np.array([0.0, 1.0, 3.0]), 0.5).tolist() == [0.0, 1.0, 3.0]


def test_each_name_has_its_colour_and_ends_at_its_curve():
    with drawing():
        _, axes = grid_of_axes(1, 1, 3.0)
        axes[0, 0].set(xlim=(0, 10), ylim=(0, 10))
        label_ends(axes[0, 0], ["low", "high"], [10.0, 5.0], [2.0, 9.0], ["red", "blue"])
    texts = {text.get_text(): text for text in axes[0, 0].texts}
    assert texts["low"].get_color() == "red"
    assert texts["high"].xy == pytest.approx((0.5, 0.9))
    assert texts["high"].xyann[1] > texts["low"].xyann[1]
