"""Newton's iteration where derivatives are left out: slow convergence is followed to its end, and what does not converge is refused."""

import pytest
from runs import method

from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.request import Request
from daebench.schemes.kernels.newton import NOT_CONVERGED, OK


def iteration(rate, wanders=False):
    """Return the report of an iteration whose increments shrink by a rate, or go up and down; in its usual form."""
    import daebench.schemes.kernels.newton as kernel

    sizes = iter(rate**k * (1.0 if not wanders or k % 7 else 3.0) for k in range(1, 10**5))

    def update(x, data):
        return x, next(sizes), 1.0, 1e-16, 1.0

    return update, kernel


@pytest.fixture
def numbers(monkeypatch):
    import daebench.schemes.kernels.newton as kernel

    for name, value in {"EPS": 2.0**-52, "INF": float("inf"), "ROUNDINGS": 4.0, "AGAIN": 1, "TANGENTS": False}.items():
        monkeypatch.setattr(kernel, name, value)
    monkeypatch.setattr(kernel, "tally", lambda update, count: count)


@pytest.mark.usefixtures("numbers")
@pytest.mark.parametrize("rate", [0.1, 0.5, 0.77, 0.85, 0.9, 0.95])
def test_an_iteration_that_shrinks_steadily_is_followed_to_round_off(rate):
    update, kernel = iteration(rate)
    _, report = kernel.newton(update, 0.0, None)
    assert report[0] == OK
    assert rate ** report[3] <= 4 * 2.0**-52 * (1 + 1e-9)


@pytest.mark.usefixtures("numbers")
@pytest.mark.parametrize(("rate", "wanders"), [(1.01, False), (0.999, False), (0.98, True), (1.0, True)], ids=str)
def test_one_that_does_not_is_refused(rate, wanders):
    update, kernel = iteration(rate, wanders)
    _, report = kernel.newton(update, 0.0, None)
    assert report[0] == NOT_CONVERGED
    assert report[3] == (1000 if rate == 0.999 else 100)


def test_a_symmetric_projection_that_converges_slowly_goes_on():
    pendulum = initial_value_problem("double_pendulum", "horizontal")
    run = method("midpoint+symproj").solve(pendulum, Request(value=0.03, steps=712, every=0, watch=())).complete()
    assert run.steps == 712
