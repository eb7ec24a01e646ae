"""Why, in one line: what the report says of the two-form is refused where it does not hold."""

from dataclasses import replace

import numpy as np
import pytest

from daebench.errors import DaebenchError
from daebench.reports.index_reduction.two_form import Carried, check_two_form

t = np.linspace(0.0, 3.0, 101)


def made_up(change, predicted, dg):
    """Return a run whose two-form changes like this, as predicted or not."""
    skew = np.array([[0.0, 1.0], [-1.0, 0.0]])
    return Carried(t, change[:, None, None] * skew, predicted[:, None, None] * skew, dg * np.ones(len(t)))


@pytest.fixture
def runs():
    still, late = 0 * t, 1e-4 * np.maximum(0.0, t - t[1])
    return {
        "along": made_up(still, still, 1e-14),
        "across": made_up(0.1 * t, 0.1 * t, 2.0),
        "se": made_up(late, late, 1e-4),
        "rattle": made_up(still, still, 1e-16),
    }


def test_what_holds_is_told(runs):
    facts = check_two_form(runs)
    assert facts.across == pytest.approx(0.3)
    assert (facts.kept, facts.se_gap, facts.se_dg) == (0.0, 0.0, 1e-4)


FALSE = {
    "of tangents": ("along", made_up(1e-6 * t, 0 * t, 0.0)),
    "integral": ("across", made_up(0.1 * t, -0.1 * t, 2.0)),
    "across the manifold": ("across", made_up(0 * t, 0 * t, 2.0)),
    "first step of se": ("se", made_up(1e-4 * t, 1e-4 * t, 1e-4)),
    "defect of se": ("se", made_up(1e-4 * np.maximum(0, t - t[1]), 0 * t, 1e-4)),
    "tangent": ("rattle", made_up(0 * t, 0 * t, 1e-6)),
}
"""Words of claims, and runs that refute them."""


@pytest.mark.parametrize(("claim", "changed"), FALSE.items())
def test_what_does_not_hold_is_refused(runs, claim, changed):
    with pytest.raises(DaebenchError, match=claim):
        check_two_form(runs | dict([changed]))


def test_gap_is_relative_to_the_largest_change(runs):
    across = runs["across"]
    assert replace(across, predicted=0.99 * across.change).gap == pytest.approx(0.01)
