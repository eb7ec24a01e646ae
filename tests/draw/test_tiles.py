"""Maps of tiles as few areas: each tile is in one rectangle, and a map of many tiles stays a small drawing."""

import numpy as np
import pytest

from daebench.draw.figures import grid_of_axes, save_drawing
from daebench.draw.tiles import edges, fill, rectangles


def covered(mask):
    """Return in how many rectangles each tile is."""
    counts = np.zeros(mask.shape, dtype=int)
    for first, last, left, right in rectangles(mask):
        counts[first:last, left:right] += 1
    return counts


@pytest.mark.parametrize("part", [0.0, 0.1, 0.5, 0.9, 1.0])
def test_each_tile_of_an_area_is_in_one_rectangle_and_no_other_tile_is(part, random):
    for shape in ((1, 1), (1, 9), (9, 1), (17, 15), (40, 60)):
        mask = random.random(shape) < part
        assert np.array_equal(covered(mask), mask)


def test_tiles_are_joined_across_and_up():
    assert list(rectangles(np.ones((256, 256), dtype=bool))) == [(0, 256, 0, 256)]
    assert len(list(rectangles(np.tri(4, dtype=bool)))) == 4


def test_edges_are_halfway_in_the_logarithm():
    assert edges(np.array([1.0, 100.0, 10000.0])) == pytest.approx([0.1, 10.0, 1000.0, 1e5])
    assert np.prod(edges(np.array([7.0]))) == pytest.approx(49.0)


def test_the_colour_of_each_tile_is_that_of_its_class(tmp_path, random):
    """The picture itself is looked at, point by point."""
    from PIL import Image

    colours = ["#ffffff", "#ff0000", "#00ff00", "#0000ff"]
    classes = random.integers(0, 4, (8, 12))
    figure, axes = grid_of_axes(1, 1, 4.8)
    axes[0, 0].set_position([0, 0, 1, 1])
    axes[0, 0].set_axis_off()
    sides = [edges(10.0 ** np.arange(n)) for n in (12, 8)]
    fill(axes[0, 0], *sides, classes, colours)
    axes[0, 0].set(xscale="log", yscale="log")
    _, png = save_drawing(figure, tmp_path, "tiles")
    with Image.open(png) as picture:
        points = np.asarray(picture.convert("RGB"))
    height, width = points.shape[:2]
    for row, column in np.ndindex(8, 12):
        y, x = int(height * (1 - (row + 0.5) / 8)), int(width * (column + 0.5) / 12)
        assert "#{:02x}{:02x}{:02x}".format(*points[y, x]) == colours[classes[row, column]]


def test_a_map_of_65536_tiles_is_a_small_drawing_of_areas(tmp_path):
    x, y = np.meshgrid(np.linspace(-1, 1, 256), np.linspace(-1, 1, 256))
    classes = np.searchsorted((0.2, 0.6, 1.1), np.hypot(x, y))
    figure, axes = grid_of_axes(1, 1, 3.0)
    fill(axes[0, 0], *(edges(np.geomspace(1, 2, 256)) for _ in range(2)), classes, ["red", "green", "blue", "black"])
    svg, _ = save_drawing(figure, tmp_path, "map")
    text = svg.read_text(encoding="utf-8")
    assert "<image" not in text
    assert len(text) < 200_000
