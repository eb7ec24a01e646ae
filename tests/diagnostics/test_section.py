"""Orbit closure by a section, on orbits made up so that one knows whether they close; and errors of what Poisson systems conserve."""

from functools import cache

import numpy as np
import pytest
import sympy as sp
from measures import error_of
from poisson_runs import ivp as ivp_of
from poisson_runs import run
from refusals import refused

from daebench.compiler.definition import source_of
from daebench.diagnostics.energy_verdict import energy_error
from daebench.diagnostics.integrals import casimir_errors, integral_errors
from daebench.diagnostics.order import fit_order
from daebench.diagnostics.section import closure, section
from daebench.runs.make_ivp import make_ivp
from daebench.runs.trajectory import PoissonTrajectory
from daebench.systems.poisson import PoissonCase, PoissonSystem

CENTER, PERIOD = np.array([0.3, -0.2]), 2 * np.pi


@cache
def oscillator():
    """Return the initial value problem of even motion on circles about CENTER: u' = -(v - c2), v' = u - c1."""
    u, v = sp.symbols("u v", real=True)
    a, b = (sp.Rational(str(c)) for c in CENTER)
    H = ((u - a) ** 2 + (v - b) ** 2) / 2
    definition = PoissonSystem(y=(u, v), B=sp.Matrix([[0, -1], [1, 0]]), H=H, cases={"one": PoissonCase(y=(a + 1, b))})
    return make_ivp(source_of(definition, "oscillator"), "one")


def made_up(where, t, y):
    names = {"problem": where.problem, "case": where.case, "method": "made up", "parameters": where.parameters}
    return PoissonTrajectory(**names, knob="h", value=0.1, t=t, y=y, steps=0, seconds=0.0)


def circle(t, radius=1.0, phase=0.1):
    angle = t + phase
    return made_up(oscillator(), t, CENTER + (radius * np.array([np.cos(angle), np.sin(angle)])).T)


def test_an_orbit_that_closes_is_seen_to_close_with_its_period_and_its_crossings_where_they_are():
    t = 0.02 * np.arange(20_000)
    found = section(oscillator(), circle(t), center=CENTER, direction=(3, 4))
    at = np.arctan2(4, 3) - 0.1 + PERIOD * np.arange(64)
    assert error_of(found.t, at[at < t[-1]]) < 1e-9
    assert error_of(found.y - CENTER, [0.6, 0.8]) < 1e-9
    assert error_of(found.distance, 1) < 1e-9
    closed = closure(found)
    assert closed.revolutions == len(found.t) - 1 == 63
    assert closed.period == pytest.approx(PERIOD, rel=1e-10)
    assert closed.spread < 1e-9
    assert closed.drift.brief == "bounded"


def test_a_crossing_is_found_with_order_four_in_the_distance_of_outputs():
    steps = 0.4 * 0.5 ** np.arange(5)
    spreads = []
    for h in steps:
        t = h * np.arange(int(400 / h))
        spreads.append(error_of(section(oscillator(), circle(t), center=CENTER, direction=(1, 0)).distance, 1))
    assert abs(fit_order(steps, spreads).slope - 4) < 0.1


@pytest.mark.parametrize("slope", [1e-6, -1e-6, 1e-4], ids=["out", "in", "fast"])
def test_a_planted_spiral_is_seen_with_its_slope(slope):
    t = 0.05 * np.arange(40_000)
    found = closure(section(oscillator(), circle(t, 1 + slope * t), center=CENTER, direction=(0, 1)), resolution=1e-8)
    assert found.drift.brief == "linear"
    assert found.drift.slope == pytest.approx(slope, rel=1e-3)
    assert found.spread == pytest.approx(abs(slope) * t[-1], rel=0.01)


def test_a_band_that_an_orbit_stays_in_is_no_drift():
    t = 0.05 * np.arange(40_000)
    found = closure(section(oscillator(), circle(t, 1 + 1e-3 * np.sin(0.37 * t)), center=CENTER, direction=(0, 1)))
    assert found.drift.brief == "bounded"
    assert found.spread == pytest.approx(2e-3, rel=0.05)


@pytest.mark.parametrize(("n", "direction"), [(32, (1, 0)), (64, (3, 4)), (64, (0, 1))], ids=str)
def test_an_orbit_that_hits_the_ray_with_outputs_crosses_it_once_a_revolution(n, direction):
    """By rounding, such a crossing may be a root of both interpolants that meet there."""
    for k in range(1, n - 1):
        start = np.arctan2(direction[1], direction[0]) - PERIOD * k / n
        found = section(oscillator(), circle(PERIOD / n * np.arange(8 * n), phase=start), center=CENTER, direction=direction)
        assert error_of(found.t, PERIOD * (np.arange(8) + k / n)) < 1e-9


@pytest.mark.parametrize(("phase", "distance"), [(0.1, 2.5), (3.3, 0.5)], ids=["far-side-first", "near-side-first"])
def test_crossings_are_of_the_ray_alone_and_in_the_sense_of_the_first(phase, distance):
    """The ray begins outside of the circle and leads through it, so that each revolution crosses it twice, in opposite senses."""
    t = 0.02 * np.arange(2000)
    found = section(oscillator(), circle(t, phase=phase), center=CENTER + np.array([1.5, 0.0]), direction=(-2, 0))
    assert error_of(found.distance, distance) < 1e-7
    assert error_of(np.diff(found.t), PERIOD) < 1e-7
    assert len(found.t) == 6


@pytest.mark.parametrize(("n", "radius"), [(0, 1), (1, 1), (2, 1), (40, 1), (50, 0)], ids=str)
def test_a_trajectory_that_crosses_less_than_twice_has_no_closure(n, radius):
    with refused("too-few-ray-crossings"):
        closure(section(oscillator(), circle(0.02 * np.arange(n), radius), center=CENTER, direction=(0, -1)))


def test_a_ray_is_two_numbers_and_two_numbers_in_the_plane():
    whirl = circle(0.1 * np.arange(9))
    for center, direction in (((0, 0, 0), (1, 0)), ((0, 0), (0, 0)), ((np.nan, 0), (1, 0)), ((0, 0), (1,))):
        with refused("ray-malformed"):
            section(oscillator(), whirl, center=center, direction=direction)
    where = ivp_of("lotka_volterra_3d")
    with refused("ray-not-planar"):
        section(where, made_up(where, np.zeros(1), where.y0[None]), center=(0, 0), direction=(1, 0))


@pytest.mark.parametrize(
    ("name", "kind"), [("strang", "bounded"), ("verlet", "bounded"), ("midpoint", "linear"), ("rk4", "linear")], ids=lambda x: x
)
def test_of_lotka_volterra_only_poisson_integrators_close_their_orbits(name, kind):
    """Fig. 4.1 with a smaller step: crossings of the line v = 2 on the right of the equilibrium (1, 2)."""
    found = closure(section(ivp_of("lotka_volterra"), run("lotka_volterra", name, 0.1, 2500), center=(1, 2), direction=(1, 0)))
    assert found.drift.brief == kind
    assert found.revolutions >= 32


# ---- what is conserved ---------------------------------------------------------------------------------------------------


def test_errors_of_energy_and_casimir_functions_are_differences_from_the_start():
    where = ivp_of("free_rigid_body")
    y = np.array([[0.4, 0.2, 0.9], [0.5, 0.1, 0.7], [-0.3, 0.0, 1.2]])
    found = made_up(where, np.arange(3.0), y)
    H, C = (y**2 / [0.6, 0.8, 1.0]).sum(axis=1) / 2, (y**2).sum(axis=1) / 2
    assert error_of(energy_error(where, found), H - H[0]) < 1e-15
    assert list(casimir_errors(where, found)) == ["C"]
    assert error_of(casimir_errors(where, found)["C"], C - C[0]) < 1e-15
    assert integral_errors(where, found) == {}
    assert casimir_errors(oscillator(), circle(0.1 * np.arange(3))) == {}


def test_errors_of_first_integrals_of_a_poisson_system_are_differences_from_the_start():
    u, v, w, z = y = sp.symbols("u v w z", real=True)
    B = sp.Matrix(np.kron([[0, 1], [-1, 0]], np.eye(2, dtype=int)))
    H = sum(x**2 for x in y) / 2
    definition = PoissonSystem(y=y, B=B, H=H, integrals={"L": u * z - v * w}, cases={"one": PoissonCase(y=(1, 0, 0, 1))})
    where = make_ivp(source_of(definition, "pair"), "one")
    y = np.array([[1.0, 0.0, 0.0, 1.0], [0.5, 0.25, 2.0, 3.0]])
    assert integral_errors(where, made_up(where, np.arange(2.0), y))["L"].tolist() == [0.0, 0.5 * 3 - 0.25 * 2 - 1]
