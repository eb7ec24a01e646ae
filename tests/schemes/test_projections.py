"""Projection after each step, plain and symmetric: the manifold is kept, and the definition is met."""

import numpy as np
import pytest
from ivps import ivp
from runs import PLACES, PROJECTED, defects, method, run
from scipy.optimize import root

ON_EACH = {f"{name}-{PLACES[number % len(PLACES)]}" for number, name in enumerate(PROJECTED)}


@pytest.mark.sampled(by=ON_EACH.__contains__)
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", PROJECTED)
def test_projected_schemes_stay_on_the_manifold(name, place):
    assert method(name).claims.on_manifold
    maxima = run(name, place, 0.02, 30).maxima
    assert maxima["g"] < 1e-14
    assert maxima["Gv"] < 1e-14


@pytest.mark.parametrize(("name", "symmetric"), [("midpoint+symproj", True), ("midpoint+proj", False)])
def test_a_projection_is_symmetric_where_it_is_made_at_both_ends(name, symmetric):
    assert method(name).claims.symmetric == symmetric
    assert (defects(name, "spherical-fast")[1] < 1e-12) == symmetric


def test_symmetric_projection_is_that_of_its_definition():
    where, h = ivp("spherical-fast"), 0.02
    plain = method("midpoint").flow(where, h, 1)

    def normal(p, q, w):
        return 2 * q * w[1], 2 * q * w[0] + 2 * p * w[1]

    def off(z):
        p1, q1, w = z[:3], z[3:6], z[6:]
        up = normal(where.p0, where.q0, w)
        p, q = (np.real(x) for x in plain(where.p0 + up[0], where.q0 + up[1]))
        back = normal(p1, q1, w)
        return np.concatenate([p1 - p - back[0], q1 - q - back[1], [q1 @ q1 - 1, 2 * q1 @ p1]])

    start = np.concatenate([*(np.real(x) for x in plain(where.p0, where.q0)), np.zeros(2)])
    expected = root(off, start, tol=1e-14).x
    found = run("midpoint+symproj", where, h, 1)
    assert np.abs(off(np.concatenate([found.p[-1], found.q[-1], expected[6:]]))).max() < 1e-12
    assert np.abs(np.concatenate([found.p[-1], found.q[-1]]) - expected[:6]).max() < 1e-12
    assert np.abs(expected[6:]).max() > 1e-8
