"""Distance from the manifold, projection onto it, and consistency of starts."""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from refusals import refused

from daebench.compiler.definition import source_of
from daebench.diagnostics.consistency import consistency, project, projected, require_consistent
from daebench.diagnostics.manifold import distance
from daebench.diagnostics.metric import least_displacement
from daebench.errors import InconsistentStart
from daebench.problems import planar_pendulum
from daebench.runs.make_ivp import make_ivp
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates


@pytest.fixture(scope="module")
def ellipse():
    """A point of unequal masses on an ellipse: the metric and the curvature are not the identity's."""
    (x, y), p = coordinates(2)
    definition = ConstrainedHamiltonian(
        q=(x, y), p=p, M=sp.diag(1, 4 + x**2), U=y, g=[x**2 / 4 + y**2 - 1], cases={"end": Case(q=(2, 0), p=(0, 3))}
    )
    return make_ivp(source_of(definition, "ellipse"), "end")


def test_the_distance_from_a_sphere_is_that_along_the_radius(pendulum, random):
    Q = random.normal(size=(20, 3))
    Q /= np.linalg.norm(Q, axis=1, keepdims=True)
    P = np.cross(Q, random.normal(size=(20, 3)))
    assert np.max(distance(pendulum, P, Q)) < 1e-15
    # momenta are orthogonal to q wherever q lies on the ray, so moving q along it is the nearest way back
    np.testing.assert_allclose(distance(pendulum, 0 * P, 1.01 * Q), 0.01, rtol=1e-10)
    np.testing.assert_allclose(distance(pendulum, P + 1e-3 * Q, Q), 1e-3 / np.sqrt(1 + np.sum(P**2, axis=1)), rtol=1e-2)


def around(n):
    """Return points of the ellipse, and directions along it."""
    angle = np.linspace(0, 2 * np.pi, n)
    return np.stack([2 * np.cos(angle), np.sin(angle)]), np.stack([-2 * np.sin(angle), np.cos(angle)])


def test_the_distance_is_the_least_in_the_metric_of_kinetic_energy(ellipse):
    p0, q0 = np.array([0.3, 0.8]), np.array([1.2, 0.9])
    M, W = (np.array([1, 4 + q0[0] ** 2]) ** power for power in (1.0, -1.0))
    # M depends on q: the velocity p/M at each point of the ellipse is along its tangent
    q, along = around(20_001)
    tangent = along * np.stack([np.ones_like(q[0]), 4 + q[0] ** 2])
    dp, dq = tangent * ((W * p0) @ tangent) / (W @ tangent**2) - p0[:, None], q - q0[:, None]
    assert distance(ellipse, p0[None], q0[None], sweeps=60)[0] == pytest.approx(np.sqrt(np.min(W @ dp**2 + M @ dq**2)), rel=1e-6)


def test_the_distance_of_a_lost_state_is_nan_and_spoils_no_other(pendulum):
    P, Q = np.tile(pendulum.p0, (3, 1)), np.tile(pendulum.q0, (3, 1))
    Q[1] = np.nan
    found = distance(pendulum, P, Q)
    assert np.isnan(found[1])
    assert found[[0, 2]].max() < 1e-15


def test_redundant_conditions_do_not_change_the_least_displacement(random):
    C, b = random.normal(size=(5, 2, 4)), random.normal(size=(5, 2))
    A = random.normal(size=(5, 4, 4))
    W = A @ np.swapaxes(A, 1, 2) + np.eye(4)
    twice = least_displacement(np.concatenate([C, 1e3 * C[:, :1]], axis=1), W, np.concatenate([b, 1e3 * b[:, :1]], axis=1))
    once = least_displacement(C, W, b)
    np.testing.assert_allclose(twice, once, rtol=1e-8)
    np.testing.assert_allclose((C @ once[:, :, None])[:, :, 0], b, rtol=1e-9)


def test_projection_minimises_in_the_metric_of_the_mass(ellipse):
    p0, q0 = np.array([0.3, 0.8]), np.array([1.3, 0.9])
    p, q, moved_q, moved_p = project(ellipse, p0, q0)
    squares = np.array([1, 4 + q0[0] ** 2]) @ (around(200_001)[0] - q0[:, None]) ** 2
    assert moved_q == pytest.approx(np.sqrt(np.min(squares)), rel=1e-8)
    normal, M = np.array([q[0] / 2, 2 * q[1]]), np.array([1, 4 + q[0] ** 2])
    expected = p0 - normal * (normal @ (p0 / M)) / (normal @ (normal / M))
    np.testing.assert_allclose(p, expected, rtol=1e-13)
    assert moved_p == pytest.approx(np.sqrt(np.sum((expected - p0) ** 2 / M)), rel=1e-10)
    assert consistency(replace(ellipse, p0=p, q0=q)) < (4e-16, 4e-16)


def test_projection_from_where_the_constraint_has_no_gradient_is_an_error(pendulum):
    with refused("projection-did-not-converge"):
        project(pendulum, [1, 0, 0], [0, 0, 0])


def test_consistent_starts_pass_and_others_are_told_both_residuals(pendulum):
    require_consistent(pendulum)
    off = replace(pendulum, q0=pendulum.q0 * (1 + 1e-9), p0=pendulum.p0 + 0.25 * pendulum.q0)
    with refused("off-the-manifold", InconsistentStart, says=("2e-09", "0.5")):
        require_consistent(off)
    require_consistent(off, tolerance=0.5)
    ivp, moved_q, moved_p = projected(off)
    require_consistent(ivp)
    assert moved_q == pytest.approx(1e-9, rel=1e-5)
    assert moved_p == pytest.approx(0.25, rel=1e-5)


@pytest.mark.parametrize("length", [1e-6, 1.0, 1e6], ids=["micrometre", "metre", "megametre"])
def test_consistency_does_not_depend_on_units(length):
    definition = planar_pendulum.problem(length=length)
    angle, m = 0.7, 3.0
    q0 = length * np.array([np.sin(angle), -np.cos(angle)])
    p0 = length * m * np.array([np.cos(angle), np.sin(angle)])
    ivp = make_ivp(source_of(definition, "planar_pendulum"), "horizontal", {"mass": m}, p0=p0, q0=q0)
    require_consistent(ivp)
    with pytest.raises(InconsistentStart):
        require_consistent(replace(ivp, q0=q0 * (1 + 1e-9)))
