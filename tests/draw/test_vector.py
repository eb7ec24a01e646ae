"""Panels of curves as SVG: axes, ticks, thinning, broken lines, escaping, and the scales that a panel carries along."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from markupsafe import Markup
from refusals import refused

from daebench.draw.figures import STROKES
from daebench.draw.svg.axis import Axis, around
from daebench.draw.svg.marks import Area, Curve, Dots, Note, Tiles, path_of, thinned
from daebench.draw.svg.panels import Panel, draw_panels

SVG = "{http://www.w3.org/2000/svg}"
STROKE = STROKES[0]


def parsed(panels, **settings):
    return ET.fromstring(draw_panels(panels, alt="what it shows", **settings))


def drawn(*marks, x=None, y=None, **settings):
    return Panel(x or Axis("x", 0.0, 1.0), y or Axis("y", 0.0, 1.0), marks, **settings)


def marks_of(root):
    return [child for group in root.iter(f"{SVG}g") if group.get("class") == "marks" for child in group]


def points(path):
    return [(pen, float(a), float(b)) for pen, a, b in re.findall(r"([ML])(-?[\d.]+) (-?[\d.]+)", path)]


# ---- axes ------------------------------------------------------------------------------------------------------------------


def test_shares_go_from_0_to_1_evenly_or_evenly_in_decades():
    assert Axis("x", -2.0, 6.0).share([-2, 0, 6, 8]).tolist() == [0, 0.25, 1, 1.25]
    assert Axis("x", 1e-4, 1.0, log=True).share([1e-4, 1e-3, 1e-2, 1]) == pytest.approx([0, 0.25, 0.5, 1], abs=1e-15)


NO_SCALE = {
    "empty": (1.0, 1.0, False),
    "backwards": (2.0, 1.0, False),
    "nan": (np.nan, 1.0, False),
    "endless": (0.0, np.inf, False),
    "overflowing": (-1.7e308, 1.7e308, False),
    "denormal": (0.0, 5e-324, False),
    "log from 0": (0.0, 1.0, True),
    "log from -1": (-1.0, 1.0, True),
}


@pytest.mark.parametrize(("low", "high", "log"), NO_SCALE.values(), ids=NO_SCALE)
def test_an_axis_that_no_scale_has_is_refused(low, high, log):
    with refused("axis-ends-invalid"):
        Axis("t", low, high, log)


EXTENTS = [(0.0, 1.0), (-3.0, 17.0), (1e-7, 3e-7), (-1e-280, 2e-280), (-1e250, 1e250), (1e6, 1e6 + 3), (0.0, 86400.0), (0.12, 0.131)]


@pytest.mark.parametrize(("low", "high"), EXTENTS, ids=[f"{a:g} to {b:g}" for a, b in EXTENTS])
def test_ticks_are_on_the_axis_evenly_and_their_labels_are_their_values(low, high):
    ticks, exponent = Axis("x", low, high).ticks()
    values = np.array([value for value, _ in ticks])
    steps = np.diff(values)
    assert 2 <= len(ticks) <= 6
    assert low <= values[0] < values[-1] <= high + 1e-9 * (high - low)
    assert steps == pytest.approx(steps.mean(), rel=1e-6)
    written = [float(text.replace("\N{MINUS SIGN}", "-")) * 10.0**exponent for _, text in ticks]
    assert written == pytest.approx(values, rel=1e-12, abs=1e-6 * steps[0])


@pytest.mark.parametrize(
    ("low", "high"), [(1e-16, 1.0), (1e-300, 1e299), (0.5, 200.0), (1e-3, 1e-2)], ids=["16 decades", "all", "odd ends", "one"]
)
def test_ticks_of_a_logarithmic_axis_are_powers_of_ten(low, high):
    ticks, exponent = Axis("x", low, high, log=True).ticks()
    assert exponent == 0
    assert 2 <= len(ticks) <= 6
    for value, text in ticks:
        k = int(text.striptags().removeprefix("10").replace("\N{MINUS SIGN}", "-"))
        assert value == pytest.approx(10.0**k, rel=1e-12)
        assert low * (1 - 1e-8) <= value <= high * (1 + 1e-8)


@pytest.mark.parametrize("value", [0.0, 5.0, -5.0, 1e-320, 1e-298, 1.7e308, 1e300], ids="{:g}".format)
@pytest.mark.parametrize("log", [False, True], ids=["linear", "log"])
def test_an_axis_around_one_value_has_an_extent_and_ticks(value, log):
    axis = around("x", [value, value], log=log)
    assert axis.low < axis.high
    assert len(axis.ticks()[0]) >= 2
    if 1e-297 < abs(value) < 1e298 and (value > 0 or not log):
        assert 0 <= axis.share([value])[0] <= 1


@pytest.mark.parametrize(
    ("values", "settings", "ends"),
    [
        ([1.0, np.nan, 3.0, np.inf, -2.0], {"margin": 0.1}, (-2.5, 3.5)),
        ([], {}, (-0.06, 1.06)),
        ([3e-7, 2e-2, 0.0, -1.0], {"log": True}, (1e-7, 0.1)),
        ([1e-30, 1.0], {"log": True, "floor": 1e-16}, (1e-17, 10.0)),
    ],
    ids=["not finite", "none", "decades", "floor"],
)
def test_an_axis_around_values_holds_them_and_logarithmic_ones_end_at_decades_and_at_the_floor(values, settings, ends):
    axis = around("x", values, **settings)
    assert (axis.low, axis.high) == pytest.approx(ends)


# ---- curves ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [601, 9_999, 100_003], ids=str)
def test_thinning_keeps_ends_and_extremes_and_few_points(n):
    y = np.random.default_rng(8).normal(size=n)
    y[n // 3], y[n - 2] = 50.0, -50.0
    a, b = thinned(np.arange(float(n)), y, 600)
    assert len(a) <= 950
    assert (a[0], a[-1], b.max(), b.min()) == (0, n - 1, 50.0, -50.0)
    assert (np.diff(a) > 0).all()
    assert np.array_equal(b, y[a.astype(int)])


def test_a_line_is_broken_where_it_is_not_finite_thinned_or_not():
    y = np.sin(np.arange(5000.0))
    y[2003] = np.nan
    for most in (600, 10_000):
        pens, x, _ = zip(*points(path_of(*thinned(np.arange(5000.0), y, most))), strict=True)
        begins = pens.index("M", 1)
        assert (pens.count("M"), x[begins - 1] <= 2002, x[begins] >= 2004) == (2, True, True)
    assert path_of(np.array([np.nan, 1.0]), np.array([1.0, np.inf])) == ""


# ---- panels ----------------------------------------------------------------------------------------------------------------


def inverse(panel, x, y):
    """Return data of pixels, by nothing but the attributes of a panel."""
    left, top, width, height = map(float, panel.get("data-frame").split())
    found = []
    for name, share in (("data-x", (x - left) / width), ("data-y", 1 - (y - top) / height)):
        low, high, log = panel.get(name).split()
        low, high = float(low), float(high)
        found.append(low * (high / low) ** share if int(log) else low + share * (high - low))
    return found


@pytest.mark.parametrize("settings", [{}, {"equal": True}, {"equal": True, "bare": True}], ids=["axes", "equal", "bare"])
def test_the_scales_of_a_panel_take_pixels_back_to_data(settings):
    x, y = np.array([0.2, 0.5, 0.9]), np.array([3.0, -1.0, 2.0])
    panel = drawn(Curve(x, y, STROKE), y=Axis("y", -2.0, 4.0), **settings)
    root = parsed([drawn(), panel])
    group = [each for each in root.iter(f"{SVG}g") if each.get("class") == "panel"][1]
    pixels = points(next(iter(group.iter(f"{SVG}g"))).find(f"{SVG}g/{SVG}path").get("d"))
    low, high, _ = map(float, group.get("data-y").split())
    assert high - low >= 6
    for (_, a, b), *data in zip(pixels, x, y, strict=True):
        assert inverse(group, a, b) == pytest.approx(data, abs=0.002 * (high - low))


def test_a_unit_is_equally_long_both_ways_where_it_is_asked_for():
    for low, high in ((0.0, 10.0), (0.0, 0.1)):
        frame = drawn(x=Axis("x", low, high), equal=True).frame(0, 0, 400, 300)
        (a, b), (c, d) = frame([0, 1], [0, 1])
        assert b - a == pytest.approx(c - d)
        assert frame.x.low <= low < high <= frame.x.high
        assert frame.y.low <= 0 < 1 <= frame.y.high


def test_what_is_written_is_escaped_and_markup_is_not():
    bad = "<b>&\"'"
    marks = [Curve([0, 1], [0, 1], STROKE, name=bad), Note(0.5, 0.5, bad), Note(0, 0, Markup("<tspan/>"))]
    root = ET.fromstring(draw_panels([Panel(Axis(bad, 0, 1), Axis(bad, 0, 1), marks, title=bad)], alt=bad))
    written = ["".join(each.itertext()) for each in root.iter(f"{SVG}text")]
    assert (written.count(bad), root.get("aria-label")) == (5, bad)
    assert root.find(f".//{SVG}tspan") is not None


def test_a_sheet_is_well_formed_and_the_same_bytes_again_and_shows_nothing_that_is_nowhere():
    t = np.linspace(0, 1, 3000)
    marks = [
        Curve(t, np.sin(9 * t), STROKES[1], name="thick", width=3, faint=True),
        Dots(t[::300], t[::300], STROKES[2], name="hollow", hollow=True),
        Dots(t[::300], t[::300], STROKES[3], name="full"),
        Area([0, 1, 1], [0, 0, 1], STROKES[4], name="area"),
        Note(np.nan, 0.0, "nowhere"),
    ]
    panels = [drawn(*marks, title="one"), drawn(), drawn(x=Axis("t", 1e-9, 2e-9))]
    text = draw_panels(panels, alt="a & b")
    assert text == draw_panels(panels, alt="a & b")
    root = ET.fromstring(text)
    names = {each.text for each in root.iter(f"{SVG}text")}
    assert names & {"thick", "hollow", "full", "area", "nowhere"} == {"thick", "hollow", "full", "area"}
    assert "nan" not in text
    ids = sorted(each.get("id") for each in root.iter() if each.get("id"))
    assert (len({*ids}), sorted(re.findall(r"url\(#([^)]+)\)", text))) == (3, ids)


def test_tiles_cover_what_is_chosen_and_nothing_else():
    chosen = np.array([[True, True, False], [False, True, False]])
    across, up = np.array([0.0, 0.25, 0.5, 1.0]), np.array([0.0, 0.5, 1.0])
    root = parsed([drawn(Tiles(across, up, chosen, STROKE, "some"))])
    (path,) = marks_of(root)
    left, top, width, height = map(float, next(root.iter(f"{SVG}g")).get("data-frame").split())
    boxes = np.array(re.findall(r"M([\d.]+) ([\d.]+)H([\d.]+)V([\d.]+)H", path.get("d")), dtype=float)
    shares = np.abs([0, 1, 0, 1] - (boxes - [left, top, left, top]) / [width, height, width, height])
    assert sorted(shares.round(2).tolist()) == [[0.0, 0.0, 0.5, 0.5], [0.25, 0.5, 0.5, 1.0]]
    assert path.get("fill") == STROKE.color
    assert marks_of(parsed([drawn(Tiles(across, up, ~chosen & chosen, STROKE))]))[0].get("d") == ""
