"""The references that come with daebench: one for every problem, whole, of today's definitions, and not too large."""

import numpy as np
import pytest

from daebench.catalogue import problems
from daebench.reference.certified.definition import define
from daebench.reference.certified.store import DATA, load, names
from daebench.reference.certified.verify import verify

EXPECTED = {
    "planar_pendulum-horizontal": 100.0,
    "planar_pendulum-near_top": 100.0,
    "planar_pendulum-iftomm_a01": 100.0,
    "planar_pendulum-rotating": 100.0,
    "spherical_pendulum-fig1.1": 100.0,
    "spherical_pendulum-fig1.2": 100.0,
    "spherical_pendulum-fig1.2b": 100.0,
    "double_pendulum-horizontal": 32.0,
    "double_pendulum-swing": 50.0,
    "pendulum_chain-horizontal5": 20.0,
    "pendulum_chain-hanging": 20.0,
}
"""Names, and a time that each reaches, s."""


def test_every_problem_has_one_and_none_is_missing():
    assert {load(name).problem for name in names()} == set(problems())
    assert set(EXPECTED) <= set(names())


def test_they_are_below_20_megabytes():
    assert sum(path.stat().st_size for path in DATA.rglob("*") if path.is_file()) < 20e6


@pytest.mark.parametrize("name", EXPECTED, ids=str)
def test_each_is_whole_and_of_the_definition_of_today(name):
    found = load(name)
    assert found.horizon >= EXPECTED[name]
    assert found.certificate["definition"]["sha256"] == define(found.problem, found.case).hash
    assert set(np.arange(1, EXPECTED[name] + 1)) <= set(found.t)
    scene = found.scene()
    np.testing.assert_allclose(found.q[0], scene.q0, rtol=2e-16, atol=1e-16)
    np.testing.assert_allclose(found.p[0], scene.p0, rtol=2e-16, atol=1e-16)


@pytest.mark.parametrize("name", EXPECTED, ids=str)
def test_each_bound_has_all_digits_of_a_double(name):
    found = load(name)
    for part in ("q", "p", "lam"):
        assert np.all(found.bound[part] > 0)
        assert np.all(found.bound[part] <= 1e-17 * np.abs(getattr(found, part)).max())


@pytest.mark.slow
@pytest.mark.parametrize("name", EXPECTED, ids=str)
def test_each_is_verified(name):
    assert verify(name).ok
