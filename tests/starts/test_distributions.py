"""Distributions of starts on the manifold, held against closed forms, quadrature, other ways to draw them, and their invariance."""

import numpy as np
import pytest
from scipy.special import ellipk, ellipkinc
from scipy.stats import ks_2samp, kstest

from daebench.methods.ensemble.run import run_members
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.runs.request import Request
from daebench.starts.draw import draw_starts
from daebench.starts.mechanics import Mechanics

CHANCE = 1e-4
"""Probability of what is found to be equal below which it is not; seeds are fixed, and planted faults are far below."""

N = 2500


@pytest.fixture
def fewer_pilots(monkeypatch):
    """Have fewer chains decide how long a walk is."""
    monkeypatch.setattr("daebench.starts.convergence.PILOTS", 256)


def uniform(x, lo, hi):
    return kstest(x, lambda u: np.clip((u - lo) / (hi - lo), 0, 1)).pvalue


def ends(ivp, *names, members=N, seed=1, **settings):
    """Return momenta and positions of an ensemble, which says what it is in one sentence."""
    starts = draw_starts(ivp, *names, members=members, h=0.01, seed=seed, **settings)
    assert starts.about.count(". ") == 0
    assert starts.about.endswith(".")
    assert f"{ivp.problem}, case {ivp.case}" in starts.about
    return starts.members.start


# ---- closed forms ----------------------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("fewer_pilots")
def test_above_the_top_of_a_sphere_heights_of_one_energy_are_uniform_and_so_are_directions():
    """Archimedes; k = 2, so that the speed does not matter."""
    ivp = initial_value_problem("spherical_pendulum", "fig1.2", {"length": 2.0}, p0=[0, 9, 0], q0=[0, 0, -2.0])
    p, q = ends(ivp, "energy")
    assert uniform(q[:, 2], -2, 2) > CHANCE
    assert uniform(np.arctan2(q[:, 1], q[:, 0]), -np.pi, np.pi) > CHANCE
    east = np.stack([-q[:, 1], q[:, 0], 0 * q[:, 0]], axis=1)
    north = np.cross(q, east)
    along = [np.sum(p * x, axis=1) / np.linalg.norm(x, axis=1) for x in (east, north)]
    assert uniform(np.arctan2(*along), -np.pi, np.pi) > CHANCE
    np.testing.assert_allclose(ivp.along("H", p, q), ivp.value("H", *ivp.start), rtol=1e-13)
    assert np.max(np.abs(ivp.along("g", q))) < 1e-14
    assert np.max(np.abs(ivp.along("Gv", p, q))) < 1e-13


@pytest.mark.usefixtures("fewer_pilots")
def test_points_of_one_energy_on_a_torus_are_rarer_inside():
    _, q = ends(initial_value_problem("torus", "through_hole"), "energy")
    angle = np.arctan2(q[:, 2], np.hypot(q[:, 0], q[:, 1]) - 2.0)
    assert kstest(angle, lambda u: (2 * (u + np.pi) + np.sin(u)) / (4 * np.pi)).pvalue > CHANCE
    assert uniform(angle, -np.pi, np.pi) < 1e-12


def in_time(angle, energy):
    """Return what part of its motion from left to right, or of a turn, a pendulum of that energy has done at an angle from below."""
    m = (energy + 1) / 2
    if m < 1:
        return (ellipkinc(np.arcsin(np.clip(np.sin(angle / 2) / np.sqrt(m), -1, 1)), m) / ellipk(m) + 1) / 2
    return (ellipkinc(angle / 2, 1 / m) / ellipk(1 / m) + 1) / 2


@pytest.mark.usefixtures("fewer_pilots")
@pytest.mark.sampled(by=lambda case: case == "rotating")
@pytest.mark.parametrize("energy", [-0.9, 0.0, 0.98, 2.125], ids=["small", "horizontal", "nearly-over", "rotating"])
def test_angles_of_one_energy_are_those_of_a_pendulum_seen_at_random_times(energy):
    """The density 1/sqrt(E - U) has no bound at the ends of a swing."""
    ivp = initial_value_problem("planar_pendulum", "horizontal")
    p, q = ends(ivp, "energy", E=energy)
    angle = np.arctan2(q[:, 0], -q[:, 1])
    assert kstest(angle, lambda u: in_time(u, energy)).pvalue > CHANCE
    assert abs(np.mean(q[:, 0] * p[:, 1] > q[:, 1] * p[:, 0]) - 0.5) < 4 / np.sqrt(4 * N)


# ---- quadrature, and another way to draw ---------------------------------------------------------------------------------------

MASSES, LENGTHS = (1.0, 3.0), (1.0, 0.7)
UNEQUAL = {"mass1": 1.0, "mass2": 3.0, "length1": 1.0, "length2": 0.7, "gravity": 1.0}


def unequal(momenta=(0, 0, 0, 0)):
    """Return a double pendulum whose masses and lengths differ."""
    return initial_value_problem("double_pendulum", "horizontal", UNEQUAL, p0=momenta, q0=[1.0, 0, 1.7, 0])


def angles(q):
    rods = q[:, :2], q[:, 2:] - q[:, :2]
    return [np.arctan2(rod[:, 0], -rod[:, 1]) for rod in rods]


def reduced_mass(t1, t2):
    """Return the mass matrix of the double pendulum in angles."""
    (m1, m2), (a, b) = MASSES, LENGTHS
    coupling = m2 * a * b * np.cos(t1 - t2)
    return np.array([[(m1 + m2) * a * a + 0 * t1, coupling], [coupling, m2 * b * b + 0 * t1]])


def quadrature(energy, cells=1500):
    """Return the cumulated distributions of the angles of a double pendulum of an energy, the edges of cells, and the density."""
    edges = np.linspace(-np.pi, np.pi, cells + 1)
    middle = (edges[1:] + edges[:-1]) / 2
    t1, t2 = np.meshgrid(middle, middle, indexing="ij")
    M = reduced_mass(t1, t2)
    (m1, m2), (a, b) = MASSES, LENGTHS
    U = -(m1 + m2) * a * np.cos(t1) - m2 * b * np.cos(t2)
    density = np.sqrt(M[0, 0] * M[1, 1] - M[0, 1] ** 2) * (energy > U)
    return [np.concatenate([[0], np.cumsum(x)]) / np.sum(x) for x in (density.sum(1), density.sum(0))], edges, density


def of_quadrature(q, energy):
    """Return the least p-value of the angles, and of their difference, against quadrature."""
    cumulated, edges, density = quadrature(energy)
    values = [kstest(t, lambda u, c=c: np.interp(u, edges, c)).pvalue for t, c in zip(angles(q), cumulated, strict=True)]
    middle = (edges[1:] + edges[:-1]) / 2
    t1, t2 = np.meshgrid(middle, middle, indexing="ij")
    expected = np.sum(density * np.sin(t1 - t2) ** 2) / np.sum(density)
    found = np.sin(np.subtract(*angles(q))) ** 2
    return min(values), (np.mean(found) - expected) / (np.std(found) / np.sqrt(len(found)))


@pytest.mark.usefixtures("fewer_pilots")
@pytest.mark.slow
def test_angles_of_a_double_pendulum_of_one_energy_are_those_of_quadrature():
    _, q = ends(unequal(), "energy")
    p_value, deviation = of_quadrature(q, 0.0)
    assert p_value > CHANCE
    assert abs(deviation) < 4


def least(a, b):
    return min(ks_2samp(x, y).pvalue for x, y in zip(a.T, b.T, strict=True))


def test_the_start_may_be_outside_of_the_box_and_the_box_far_from_zero():
    """In a box of momenta so narrow that it cuts little out of any plane; the pendulum is at the top, where the start is not."""
    box = {"p1": (2, 3), "p2": (-2, 2), "p3": (-2, 2), "q3": (0.5, 1)}
    ivp = initial_value_problem("spherical_pendulum", "fig1.1")
    p, q = ends(ivp, "liouville", box=box, members=2000)
    random = np.random.default_rng(2)
    x = random.normal(size=(400_000, 3))
    x /= np.linalg.norm(x, axis=1)[:, None]
    east = np.cross(x, [0.0, 0.0, 1.0])
    east /= np.linalg.norm(east, axis=1)[:, None]
    plane = random.uniform(-5, 5, (2, 400_000, 1))
    y = plane[0] * east + plane[1] * np.cross(x, east)
    inside = (x[:, 2] >= 0.5) & np.all((y >= [2, -2, -2]) & (y <= [3, 2, 2]), axis=1)
    assert np.sum(inside) > 2000
    assert least(np.concatenate([p, q], axis=1), np.concatenate([y, x], axis=1)[inside]) > CHANCE


# ---- invariance -------------------------------------------------------------------------------------------------------------------


def after(ivp, starts, steps):
    run = run_members(method_of(ivp, "rattle"), starts.members, Request(value=1.0, steps=steps), threads=1)
    assert not len(run.failed)
    return run.ends


@pytest.mark.exhaustive
def test_an_ensemble_of_one_energy_has_the_same_distribution_after_a_run_and_one_of_another_measure_has_not(monkeypatch):
    ivp = unequal()
    first = draw_starts(ivp, "energy", members=N, h=0.01, seed=1)
    other = np.concatenate(draw_starts(ivp, "energy", members=N, h=0.01, seed=2).members.start, axis=1)
    assert least(after(ivp, first, 150), other) > CHANCE
    monkeypatch.setattr(Mechanics, "volume", lambda self, q, G, rows=None: q[1])
    wrong = [draw_starts(ivp, "energy", members=N, h=0.01, seed=seed) for seed in (1, 2)]
    assert least(after(ivp, wrong[0], 150), np.concatenate(wrong[1].members.start, axis=1)) < 1e-6


# ---- the walk ---------------------------------------------------------------------------------------------------------------------------


DRAWN = {
    "energy": {},
    "liouville": {"box": {"p1": (-1, 1), "p2": (-1, 2)}},
    "neighbourhood": {"size": 0.1, "vary": {"gravity": (1, 2), "length": (0.9, 1.1)}},
}


@pytest.mark.sampled(left_out=("energy",), slow=("liouville",))
@pytest.mark.parametrize("name", DRAWN)
def test_a_member_is_the_same_however_many_there_are(name):
    ivp = initial_value_problem("planar_pendulum", "rotating")
    few, many, again, other = (ends(ivp, name, members=n, seed=seed, **DRAWN[name]) for n, seed in ((5, 1), (700, 1), (20, 1), (5, 2)))
    for x, y, z, other_x in zip(few, many, again, other, strict=True):
        assert np.array_equal(x, y[:5])
        assert np.array_equal(z, y[:20])
        assert len(np.unique(y, axis=0)) == 700
        assert not np.any(np.all(x == other_x, axis=1))
