"""The picture of what a solver thinks of its steps shows what there is."""

import numpy as np
import pytest

from daebench.draw.solver_steps import WINDOWS, draw
from daebench.runs.solver_steps import SolverSteps


def made(k, accepted=True, untested=("lam",)):
    """Return made-up steps: k of them, of three unknowns."""
    draws = np.random.default_rng(1)
    h = np.full(k, 0.01)
    return SolverSteps(
        t=np.cumsum(h),
        h=h,
        order=np.full(k, 3),
        iterations=np.full(k, 2),
        error_failures=np.ones(k, int),
        newton_failures=np.zeros(k, int),
        accepted=np.full(k, accepted),
        y=np.ones((k, 3)),
        estimate=draws.uniform(1e-7, 1e-6, (k, 3)),
        weight=np.full((k, 3), 1e6),
        blocks={"q": slice(0, 1), "v": slice(1, 2), "lam": slice(2, 3)},
        untested=untested,
        tol=1e-6,
    )


def shares(steps):
    """Return what is drawn of shares of the error test, by label."""
    return {line.get_label(): line.get_ydata() for line in draw(steps).axes[3].get_lines() if not line.get_label().startswith("_")}


def test_each_block_is_drawn_and_what_is_not_tested_says_so():
    steps = made(40)
    curves = shares(steps)
    assert [name.endswith("not tested") for name in curves] == [False, False, True]
    for curve, share in zip(curves.values(), steps.shares.values(), strict=True):
        assert np.array_equal(curve, share)


def test_of_many_steps_the_largest_of_each_window_is_drawn():
    steps = made(30 * WINDOWS)
    drawn, share = next(iter(shares(steps).values())), steps.shares["q"]
    assert np.array_equal(drawn, share.reshape(WINDOWS, 30).max(axis=1))


@pytest.mark.parametrize(("k", "accepted"), [(0, True), (1, True), (7, False)])
def test_few_steps_and_attempts_are_drawn(k, accepted):
    figure = draw(made(k, accepted))
    figure.canvas.draw()
    assert len(figure.axes[0].texts) == (k == 0)
