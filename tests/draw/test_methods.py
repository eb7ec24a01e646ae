"""How methods look: one stroke and one name each, and a contrast of 3 for every line, on a light page and on a dark one."""

import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from daebench.draw import figures
from daebench.draw.methods import NAMES, STROKES_OF, name_of, stroke_of
from daebench.methods.catalogue import schemes
from daebench.methods.fixed_step.compositions import COMPOSITIONS
from daebench.studies.grid.claimed import ON_VELOCITIES
from daebench.studies.stability.penalty import LIMITS as PENALISED
from daebench.studies.work_precision.study import ON_MANIFOLD, ON_POISSON

CSS = (Path(figures.__file__).parents[1] / "pages" / "report" / "page.css").read_text(encoding="utf-8")
LEAST = 3.0
"""WCAG 2.2, success criterion 1.4.11: graphical objects."""

COLORS = {name: value for name, value in vars(figures).items() if isinstance(value, str) and re.fullmatch("#[0-9a-f]{6}", value)}
HUE_ROTATED = np.array([[-0.574, 1.43, 0.144], [0.426, 0.43, 0.144], [0.426, 1.43, -0.856]])
"""Matrix of hue-rotate(180deg), Filter Effects Module, section 8.4."""


def rgb(color):
    return np.array([int(color[k : k + 2], 16) / 255 for k in (1, 3, 5)])


def luminance(color):
    linear = np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


def contrast(one, other):
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def paper(scheme):
    """Return the page's background as its style sheet has it."""
    light, dark = re.findall(r"--paper: (#[0-9a-f]{6})", CSS)[:2]
    return rgb({"light": light, "dark": dark}[scheme])


def filtered(color):
    """Return a colour of a drawing as a dark page shows it: inverted by the share that the style sheet has, with its hue turned back."""
    (share,) = set(re.findall(r"invert\((\.\d)\) hue-rotate\(180deg\)", CSS))
    return np.clip(HUE_ROTATED @ (float(share) + (1 - 2 * float(share)) * color), 0, 1)


def test_contrast_is_that_of_the_standard():
    assert contrast(rgb("#000000"), rgb("#ffffff")) == pytest.approx(21.0)
    assert contrast(rgb("#767676"), rgb("#ffffff")) == pytest.approx(4.54, abs=5e-3)
    assert contrast(rgb("#e69f00"), rgb("#ffffff")) < LEAST  # the orange of Okabe and Ito as it was


def test_a_line_of_any_colour_is_seen_on_light_and_on_dark():
    for name, color in COLORS.items():
        assert contrast(rgb(color), rgb("#ffffff")) >= LEAST, name
        assert contrast(rgb(color), paper("light")) >= LEAST, name
        assert contrast(filtered(rgb(color)), paper("dark")) >= LEAST, name
        if color != figures.BLACK:  # panels are not filtered, and black is the colour of the page's text there
            assert contrast(rgb(color), paper("dark")) >= LEAST, name


@pytest.mark.parametrize("methods", [(*ON_MANIFOLD, *ON_POISSON, *PENALISED), ON_VELOCITIES], ids=["positions", "velocities"])
def test_no_two_methods_look_the_same_or_have_the_same_name(methods):
    listed = STROKES_OF if methods != ON_VELOCITIES else ()
    for one, other in combinations(sorted({*methods, *listed, "scipy:DOP853"} - {"scipy"}), 2):
        if {one, other} not in ({"cvode", "cvode:adams"}, {"heyoka", "heyoka:taylor"}, {"solve_dae", "solve_dae:Radau"}):
            assert stroke_of(one) != stroke_of(other), (one, other)
            assert name_of(one) != name_of(other), (one, other)


def test_what_is_added_to_a_scheme_keeps_its_colour():
    for method in ("rattle/suzuki4", "rattle/kahan_li8", "rattle+proj", "local:rattle"):
        assert stroke_of(method).color == stroke_of("rattle").color
        assert stroke_of(method) != stroke_of("rattle")


def test_each_composition_projection_and_form_has_a_mark_of_its_own():
    names = [f"rattle/{name}" for name in COMPOSITIONS] + ["rattle+proj", "rattle+symproj"]
    names += [f"{form}:rattle" for form in ("local", "canonical", "stiff", "baumgarte", "darboux")]
    strokes = [stroke_of(name) for name in ("rattle", *names)]
    assert len({(str(stroke.dashes), stroke.marker) for stroke in strokes}) == len(strokes)


def test_every_scheme_has_a_stroke_and_a_name_of_its_own():
    for name in schemes():
        assert name in STROKES_OF, name
        assert name in NAMES or re.match(r"(lobatto|gauss|radau)\d", name), name
