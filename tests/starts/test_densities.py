"""Densities and momenta that starts are drawn with, against their formulas in NumPy and against sampled momenta."""

import numpy as np
import pytest
from measures import error_of

from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.members import members
from daebench.starts.box import Vary
from daebench.starts.energy import Reachable
from daebench.starts.liouville import StatesInBox
from daebench.starts.mechanics import Mechanics
from daebench.starts.members import Neighbourhood, neighbour

N = 40
FAR = (np.full(4, -np.inf), np.full(4, np.inf))


@pytest.fixture(scope="module")
def pendulums():
    """Members of a double pendulum with masses 1 and 2, at any angles."""
    ivp = initial_value_problem("double_pendulum", None, {"mass2": 2.0})
    a, b = np.random.default_rng(7).uniform(0, 2 * np.pi, (2, N))
    q = np.array([np.sin(a), -np.cos(a), np.sin(a) + np.sin(b), -np.cos(a) - np.cos(b)]).T
    return ivp, Mechanics(members(ivp, (0 * q, q), 0.1, {}))


def by_numpy(ivp, q):
    """Return M and G at positions, each on its own."""
    return [(ivp.value("mass", np.zeros(len(x)), x).astype(float), ivp.value("G", x).astype(float)) for x in q.T]


def test_the_volume_of_a_position_is_that_of_masses_and_constraints(pendulums):
    ivp, mechanics = pendulums
    q = mechanics.members.start[1].T
    G = mechanics.value("G", q)
    expected = [np.log(np.linalg.det(M) * np.linalg.det(J @ np.linalg.solve(M, J.T))) / 2 for M, J in by_numpy(ivp, q)]
    assert mechanics.volume(q, G) == pytest.approx(expected, rel=1e-10)


def test_momenta_of_an_energy_have_it_and_are_tangent(pendulums, random):
    ivp, mechanics = pendulums
    q, kinetic = mechanics.members.start[1].T, random.uniform(0.1, 2, N)
    p = mechanics.with_energy(q, kinetic, random.standard_normal(q.shape))
    for x, y, T, (M, G) in zip(p.T, q.T, kinetic, by_numpy(ivp, q), strict=True):
        v = np.linalg.solve(M, x)
        assert x @ v / 2 == pytest.approx(T, rel=1e-12)
        assert np.abs(G @ v).max() < 1e-13
        rest = float(ivp.value("H", 0 * x, y))
        assert float(ivp.value("H", x, y)) - rest == pytest.approx(T)


def test_the_density_of_positions_on_an_energy_surface_is_that_of_its_momenta(pendulums):
    ivp, mechanics = pendulums
    q, rows = mechanics.members.start[1].T, np.arange(N)
    E = float(np.max(mechanics.U(q))) + 1.0
    C = mechanics.value("G", q)
    density, _ = Reachable(mechanics, E, FAR).weighed(q, C, np.empty((0, N)), rows)
    expected = []
    for (M, G), U in zip(by_numpy(ivp, q), mechanics.U(q), strict=True):
        surface = np.linalg.det(M) * np.linalg.det(G @ np.linalg.solve(M, G.T)) / np.linalg.det(G @ G.T)
        expected.append(np.log(surface) / 2 + (mechanics.k / 2 - 1) * np.log(E - U))
    assert density - density[0] == pytest.approx(np.array(expected) - expected[0], abs=1e-10)


def test_the_liouville_weight_of_a_position_is_the_volume_of_its_momenta_in_the_box(random):
    """Their mean over proposed momenta is the area of the plane of momenta in the box, times sqrt(det G M^-1 G^T / det G G^T)."""
    ivp = initial_value_problem("spherical_pendulum", "fig1.1")
    n, box = 40_000, (np.full(3, -1.0), np.full(3, 1.0))
    for q0, area in (((0.0, 0.0, 1.0), 4.0), ((0.6, 0.0, 0.8), 2 * 2 / 0.8)):
        q = np.repeat(np.array(q0)[:, None], n, axis=1)
        states = StatesInBox(Mechanics(Neighbourhood(1e-9).draw(ivp, n, 0.1).members), box, (np.full(3, -np.inf), np.full(3, np.inf)))
        C, rows = 2 * q[None], np.arange(n)
        weight, p = states.weighed(q, C, random.standard_normal((3, n)), rows)
        values = np.where(np.isfinite(weight), np.exp(weight), 0.0)
        assert np.abs(np.sum(p * q, axis=0)).max() < 1e-12
        if q0[0] == 0:
            first = np.mean(values) / area
        else:
            assert np.mean(values) / area == pytest.approx(first, rel=0.03)


def test_a_seed_draws_its_own_neighbours_and_parameters_that_vary_are_independent():
    ivp = initial_value_problem("double_pendulum")
    one, other = (Neighbourhood(0.1).draw(ivp, 5, 0.1, seed=seed).members.start for seed in (1, 2))
    assert error_of(one[1], other[1]) > 1e-3
    assert error_of(neighbour(ivp, 0.1, 1).q0, neighbour(ivp, 0.1, 2).q0) > 1e-3
    names = list(ivp.parameters)[:2]
    values = Vary(dict.fromkeys(names, (1.0, 2.0))).parameters(ivp, 400, 3)
    assert abs(np.corrcoef(values[names[0]], values[names[1]])[0, 1]) < 0.25
