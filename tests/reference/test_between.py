"""A reference between its stored times: within its bound, from either side, never beyond the horizon."""

import mpmath as mp
import numpy as np
import pytest
from measures import error_of
from refusals import refused
from rotating import NAME, exact

from daebench.reference.keep.dense_evaluation import states_at
from daebench.reference.keep.store import load
from daebench.reference.solution import ReferenceSolution


@pytest.fixture
def rotating(references):
    return load(NAME, references)


@pytest.mark.usefixtures("plain_functions")
def test_states_between_lie_within_their_bounds_and_bounds_are_not_wasteful(rotating, random):
    times = np.concatenate([random.uniform(0, 4, 25), [1.0625, 0.06, 0.07, 3.99]])
    found = states_at(rotating, times)
    assert not found.stored.any()
    for k, t in enumerate(times):
        with mp.workdps(40):
            exact_parts = exact(t)
            errors = [np.abs(found.states[part][k] - np.array(x)).astype(float) for part, x in zip(found.bound, exact_parts, strict=True)]
        assert all(np.all(error <= found.bound[part][k]) for part, error in zip(found.bound, errors, strict=True)), t
    assert max(rows.max() for rows in found.bound.values()) < 1e-12


def test_stored_times_give_stored_digits(rotating):
    found = states_at(rotating, [2.5, 0.0, 4.0])
    assert found.row.tolist() == [20, 0, 32]
    np.testing.assert_array_equal(found.states["q"], rotating.q[[20, 0, 32]])
    assert np.all(found.bound["q"] <= 2.0**-52)
    assert np.all(found.bound["q"] >= rotating.bound["q"][[20, 0, 32]])


@pytest.mark.usefixtures("plain_functions")
def test_times_keep_their_order_and_may_come_twice(rotating):
    times = [1.03, 0.5, 1.03, 0.97, 1.0]
    found = states_at(rotating, times)
    assert error_of(found.states["q"], [states_at(rotating, [t]).states["q"][0] for t in times]) < 1e-15
    assert found.stored.tolist() == [False, True, False, False, True]


def test_the_nearest_stored_state_is_where_it_starts_on_either_side(rotating, monkeypatch):
    begun = []

    def travelled(ivp, reference, k, t):
        begun.append((k, t.tolist()))
        rows = {"q": np.zeros((len(t), 2)), "p": np.zeros((len(t), 2)), "lam": np.zeros((len(t), 1))}
        return ReferenceSolution("none", t, rows, dict.fromkeys(rows, 0.0)), dict.fromkeys(rows, 0.0)

    monkeypatch.setattr("daebench.reference.keep.dense_evaluation._travelled", travelled)
    states_at(rotating, [0.9, 0.95, 1.05, 1.1])
    assert begun == [(7, [0.9]), (8, [0.95]), (8, [1.05]), (9, [1.1])]


@pytest.mark.parametrize("t", [-0.1, 4.1, float("nan")], ids=str)
def test_times_outside_are_refused_with_the_horizon(rotating, t):
    with refused("time-outside-reference"):
        states_at(rotating, [1.0, t])
