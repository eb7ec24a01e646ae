"""The fit of an order to errors: what is dropped as pre-asymptotic or round-off, and when there is no order."""

import numpy as np
import pytest

from daebench.diagnostics.order import fit_order
from daebench.errors import BadInput

H = 0.4 / 2.0 ** np.arange(12)


def test_an_order_is_fitted_between_the_plateau_and_the_pre_asymptotic_points(random):
    error = 3 * H**4 / (1 + 30 * H**2) ** 2 + 1e-12 * (1 + random.uniform(size=12))
    error[0] = np.nan
    fit = fit_order(H, error)
    assert abs(fit.slope - 4) < max(0.2, 3 * fit.slope_error)
    assert fit.reasons[0] == "failed"
    assert fit.reasons[1:3] == ("pre-asymptotic",) * 2
    assert set(fit.reasons[-4:]) == {"round-off"}
    assert sum(fit.used) >= 3
    assert [reason == "" for reason in fit.reasons] == list(fit.used)


@pytest.mark.parametrize("order", [1, 2, 6], ids=str)
def test_the_order_of_a_clean_series_is_exact_whatever_the_arrangement_of_points(order, random):
    h = random.permutation(H[:8])
    fit = fit_order(h, 5 * h**order)
    assert abs(fit.slope - order) < 1e-12
    assert fit.slope_error < 1e-12
    assert all(fit.used)
    assert fit.note == ""


@pytest.mark.parametrize(("claimed", "true"), [(2, 1), (4, 3)], ids=["first for second", "third for fourth"])
def test_a_wrong_order_is_told_from_the_claimed_one(claimed, true, random):
    error = H[:8] ** true * (1 + 0.05 * H[:8]) * np.exp(0.02 * random.normal(size=8))
    fit = fit_order(H[:8], error)
    assert abs(fit.slope - claimed) > 10 * fit.slope_error
    assert abs(fit.slope - true) < 0.05


def test_two_regimes_are_never_averaged():
    # order 2 at every step size one would try first, order 1 in the end, as for constrained symplectic Euler
    error = 0.02 * H + H**2
    fit = fit_order(H, error)
    assert abs(fit.slope - 1) < 0.1
    assert fit.used[-3:] == (True, True, True)
    assert set(fit.reasons[:6]) == {"pre-asymptotic"}
    assert fit_order(H[:4], H[:4] ** 2).slope == pytest.approx(2)


def test_the_transition_between_two_regimes_gives_no_order():
    h = H[:8]
    fit = fit_order(h, 0.004 * h + h**2)
    assert np.isnan(fit.slope)
    assert "smaller" in fit.note


def test_a_noisy_plateau_does_not_spoil_the_order():
    for seed in range(30):
        noise = 1e-13 * np.exp(np.random.default_rng(seed).normal(size=12)) * (0.4 / H) ** 0.5
        fit = fit_order(H, 0.1 * H**4 + noise)
        assert np.isnan(fit.slope) or abs(fit.slope - 4) < 0.2


def test_an_accidental_dip_in_the_middle_is_not_taken_for_a_plateau():
    error = H**2
    error[2] *= 1e-5
    fit = fit_order(H, error)
    assert abs(fit.slope - 2) < 1e-12
    assert fit.reasons[:3] == ("pre-asymptotic",) * 3


def test_no_order_without_three_points():
    for error in [[np.nan] * 4, [0.0] * 4, [1e-3, 1e-4, np.nan, np.inf], [1e-14, 2e-14, 1e-14, 3e-14], [1.0, 1.1, 0.9, 1.0]]:
        fit = fit_order([0.1, 0.05, 0.025, 0.0125], error)
        assert np.isnan(fit.slope)
        assert np.isnan(fit.slope_error)
        assert not any(fit.used)
        assert all(fit.reasons)
        assert fit.note


def test_step_sizes_that_make_no_sense_are_refused():
    for h, error in [([0.1, 0.2], [1.0]), ([0.1, 0.1], [1, 2]), ([0.1, -0.1], [1, 2])]:
        with pytest.raises(BadInput):
            fit_order(h, error)
