"""Pictures with codes of one's own, long names and small ranges: curves are told apart, and numbers at ticks do not run into others."""

import itertools
from types import SimpleNamespace

import pytest

from daebench.draw.figures import drawing, grid_of_axes, part_labels
from daebench.draw.methods import STROKES_OF, stroke_of, strokes_of
from daebench.runs.result import Look
from daebench.studies.comparison import figure as comparison

OWN = [f"./{name}.py:step" for name in ("a", "b", "my_integrator", "gggl", "folder/shake", "folder/rattle", "z2")] + [
    "exec:./solver 1",
    "./x.so:step",
]
LISTED = [[], ["rattle"], ["rattle", "rk4", "ida:ggl", "strang"], list(STROKES_OF)[:20], list(STROKES_OF)]


def test_no_two_codes_share_colour_and_marker_and_those_that_are_listed_keep_theirs():
    some = ((count, own) for count in (1, 2, 5, 9) for own in itertools.islice(itertools.permutations(OWN, count), 20))
    for (count, own), listed in itertools.product(some, LISTED):
        strokes = strokes_of([*listed, *own])
        assert {name: strokes[name] for name in listed} == {name: stroke_of(name) for name in listed}
        looks = {name: (stroke.color, stroke.marker) for name, stroke in strokes.items()}
        assert len({looks[name] for name in own} - {looks[name] for name in listed}) == count
        colors = {strokes[name].color for name in listed}
        if len(colors) + count <= 10:
            assert len({strokes[name].color for name in own} - colors) == count


def numbers(axis):
    """Return the visible numbers at the ticks of an axis."""
    labels = (tick.label1 for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()))
    return [label for label in labels if label.get_visible() and label.get_text()]


def crossing(axes):
    """Return pairs of visible numbers at the ticks of an axis that run into each other."""
    found = []
    for axis in (axes.xaxis, axes.yaxis):
        boxes = [(label.get_text(), label.get_window_extent()) for label in numbers(axis)]
        found += [(one, two) for (one, a), (two, b) in itertools.combinations(boxes, 2) if a.overlaps(b)]
    return found


RANGES = [
    (1e-2, 1.05e-2),
    (1e-2, 1.4e-2),
    (1.1e-2, 2.4e-2),
    (3e-7, 9e-7),
    (0.9, 1.3),
    (1e-3, 1e-2),
    (1e-9, 1e-1),
    (1e-100, 1e100),
    (2e4, 3e4),
]


@pytest.mark.sampled(by=lambda case: case in ("0.011 to 0.024-log", "1e-100 to 1e+100-log", "20000 to 30000-linear"))
@pytest.mark.parametrize("scale", ["log", "linear"])
@pytest.mark.parametrize(("low", "high"), RANGES, ids=[f"{low:g} to {high:g}" for low, high in RANGES])
def test_numbers_at_ticks_do_not_run_into_others(low, high, scale):
    with drawing():
        figure, axes = grid_of_axes(1, 3, 2.0)
        for axis in axes.flat:
            axis.plot([low, high], [low, high])
            axis.set(xscale=scale, yscale=scale)
        part_labels(figure)
        figure.draw_without_rendering()
        assert [crossing(axis) for axis in axes.flat] == [[]] * 3
        assert all(numbers(axis.xaxis) for axis in axes.flat)


def test_numbers_do_run_into_others_without(monkeypatch):
    with drawing():
        figure, axes = grid_of_axes(1, 3, 2.0)
        axes[0, 0].loglog([1.1e-2, 2.4e-2], [1, 10])
        figure.draw_without_rendering()
        assert crossing(axes[0, 0])


TITLES = ["", "Mine", "Ten thousand swings of a pendulum, " * 5, r"costs 3 \$ and 5 \$"]


@pytest.mark.sampled(by=lambda case: case in ("none-page", "long-slide", "signs-page"))
@pytest.mark.parametrize("size", [None, (16, 9)], ids=["page", "slide"])
@pytest.mark.parametrize("title", TITLES, ids=["none", "short", "long", "signs"])
def test_the_title_of_a_comparison_is_the_one_that_is_given_and_within_the_picture(title, size):
    pd = pytest.importorskip("pandas")
    ivp = SimpleNamespace(problem="planar_pendulum", case="horizontal")
    curves = pd.DataFrame({"method": "rattle", "t": [0.0, 1.0], "energy_error": [1e-3, 2e-3]})
    figure = comparison.figure(ivp, [SimpleNamespace(method="rattle")], curves, Look(size=size, title=title))
    with drawing():
        figure.draw_without_rendering()
    text = figure._suptitle
    assert text.get_text().replace("\n", " ") == (title.strip() or "planar pendulum, case horizontal")
    assert text.get_window_extent().x1 <= figure.bbox.width
