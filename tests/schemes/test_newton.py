"""Reports of linear solves and iterations, on floats: what failed, the least pivot, and the work."""

import math

import pytest

import daebench.schemes.kernels.newton as kernel

EPS = 2.0**-52


@pytest.fixture(autouse=True)
def numbers(monkeypatch):
    for name, value in {"EPS": EPS, "INF": math.inf, "ROUNDINGS": 4.0, "AGAIN": 1, "TANGENTS": False}.items():
        monkeypatch.setattr(kernel, name, value)
    monkeypatch.setattr(kernel, "tally", lambda update, count: count)
    monkeypatch.setattr(kernel, "plus_work", lambda one, other: one + other)


@pytest.mark.parametrize(
    ("residual", "pivot", "size", "status"),
    [
        (1.0, 1.0, 1.0, kernel.OK),
        (1.0, 5 * EPS, 1.0, kernel.OK),
        (1.0, 4 * EPS, 1.0, kernel.SINGULAR),
        (1.0, 0.0, math.inf, kernel.SINGULAR),
        (1.0, math.nan, math.nan, kernel.SINGULAR),
        (math.inf, 1.0, 1.0, kernel.NOT_FINITE),
        (math.nan, math.nan, math.nan, kernel.NOT_FINITE),
        (1.0, 1.0, math.inf, kernel.NOT_FINITE),
        (1.0, 1.0, math.nan, kernel.NOT_FINITE),
    ],
    ids=str,
)
def test_a_linear_solve_is_singular_or_not_finite_by_its_numbers(residual, pivot, size, status):
    assert kernel.judge(residual, pivot, size) == status


def test_two_solutions_in_a_row_have_the_first_failure_the_least_pivot_and_the_work_of_both():
    good, better, bad = (kernel.OK, 1e-3, 0.2, 5), (kernel.OK, 1e-4, 0.7, 3), (kernel.SINGULAR, 1e-5, 0.0, 2)
    assert kernel.both(good, better) == (kernel.OK, 1e-4, 0.2, 8)
    assert kernel.both(better, good) == (kernel.OK, 1e-3, 0.2, 8)
    assert kernel.both(bad, good) == (kernel.SINGULAR, 1e-5, 0.0, 7)
    assert kernel.both(good, bad) == (kernel.SINGULAR, 1e-5, 0.0, 7)


def test_the_iteration_for_a_square_root_ends_where_its_increment_is_round_off():
    def update(x, a):
        new = (x + a / x) / 2
        return new, abs(new - x), abs(new), abs(x * x - a), 1.0

    for a in (2.0, 10.0, 1e6):
        x, report = kernel.newton(update, a, a)
        assert report[0] == kernel.OK
        assert abs(x - math.sqrt(a)) <= 2 * EPS * x


def test_an_iteration_of_linear_convergence_ends_within_four_roundings_of_its_limit():
    def update(x, rate):
        return rate * x + (1 - rate), abs(1 - rate) * abs(1 - x), 1.0, abs(1 - x), 1.0

    for rate in (0.5, 0.8, 0.9):
        x, report = kernel.newton(update, 0.0, rate)
        assert report[0] == kernel.OK
        assert abs(x - 1) <= 4 * EPS * rate / (1 - rate) + 4 * EPS
