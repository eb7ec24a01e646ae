"""The tolerance of a solver of constraints that a drift asks for: what is chosen, what is named apart, what is refused."""

import pytest

import daebench
from daebench.diagnostics.energy import Drift
from daebench.errors import BadInput
from daebench.studies.tolerance_for import ToleranceFor, TriedTolerance


def found(*rows):
    tried = (TriedTolerance(10.0**-k, Drift(verdict), ratio, 0.0, 0.0) for k, (verdict, ratio) in enumerate(rows, start=3))
    return ToleranceFor(None, "rattle_gauss_seidel", 0.01, 1.0, 1e-3, tuple(tried))


def test_the_loosest_tolerance_is_chosen_from_which_on_all_do():
    assert found(("drifts", 0.1), ("bounded", 9e-4), ("kept", 1.0)).tolerance == 1e-4
    assert found(("drifts", 0.1), ("bounded", 2e-3)).tolerance is None


def test_a_tolerance_that_does_where_a_tighter_one_does_not_is_named_and_not_chosen():
    some = found(("drifts", 5e-4), ("drifts", 5e-3), ("bounded", 1e-5))
    assert (some.tolerance, some.fortuitous) == (1e-5, (1e-3,))


def test_what_is_not_known_is_no_small_drift():
    assert found(("undetermined", 1e-9)).tolerance is None
    assert found(("failed", float("inf"))).tolerance is None


@pytest.mark.parametrize(
    ("settings", "words"),
    {
        "method": ({"method": "rattle"}, "has no tolerance of its own"),
        "precision": ({"precision": "float32", "tolerances": [1e-9]}, "none of these tolerances is reached in float32"),
        "drift": ({"drift": -1.0}, "drift = -1"),
        "poisson": ({"problem": "lotka_volterra"}, "is a Poisson system"),
    }.values(),
    ids=["method", "precision", "drift", "poisson"],
)
def test_what_cannot_be_met_is_refused(settings, words):
    with pytest.raises(BadInput, match=words):
        daebench.tolerance_for(**{"problem": "rigid_water", "drift": 1e-3, "h": 0.01, "t_end": 1.0} | settings)


@pytest.mark.slow
def test_the_drift_of_a_molecule_falls_with_the_tolerance_and_decides():
    water = daebench.tolerance_for("rigid_water", case="tumbling", drift=1e-3, h=0.01, t_end=40, tolerances=[1e-3, 1e-4, 1e-5, 1e-9])
    ratios = [row.ratio for row in water.tried]
    assert ratios[0] > 10 * ratios[1] > 20 * ratios[2]
    assert (water.tolerance, water.fortuitous) == (1e-5, ())
