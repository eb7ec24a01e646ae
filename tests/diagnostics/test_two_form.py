"""The defects of the two-form and of reversal, on maps that keep them and on planted faults."""

from dataclasses import replace

import numpy as np
import pytest

from daebench.compiler.definition import source_of
from daebench.diagnostics.manifold import constraint_jacobian
from daebench.diagnostics.reversibility import reversibility_defect
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis
from daebench.problems import spherical_pendulum
from daebench.runs.make_ivp import make_ivp


def geodesic(p, q):
    """Return the state after time 0.7 of free motion on the unit sphere: rotation in the plane of q and p; symplectic on the manifold."""
    p, q = np.asarray(p), np.asarray(q)
    size = np.sqrt(np.sum(q * q))
    x, speed = q / size, np.sqrt(np.sum(p * p))
    c, s = np.cos(0.7 * speed), np.sin(0.7 * speed)
    return p * c - x * speed * s, x * c + p * s / speed


def kicked(p, q):
    """Return the state after a kick, projected onto the tangent plane, and the geodesic: one step of a splitting (1.45)."""
    p, q = np.asarray(p), np.asarray(q)
    force = np.array([0, 0, -0.3])
    return geodesic(p + force - q * np.sum(q * force), q)


def swollen(p, q):
    """Return the kicked geodesic with momenta scaled: the two-form is scaled by 1.01."""
    p1, q1 = kicked(p, q)
    return 1.01 * p1, q1


def test_the_tangent_basis_is_orthonormal_and_tangent(pendulum):
    X = tangent_basis(pendulum, pendulum.p0, pendulum.q0)
    assert X.shape == (6, 4)
    np.testing.assert_allclose(X.T @ X, np.eye(4), atol=1e-15)
    np.testing.assert_allclose(constraint_jacobian(pendulum, pendulum.p0[None], pendulum.q0[None])[0] @ X, 0, atol=1e-14)


@pytest.mark.parametrize("flow", [geodesic, kicked], ids=["geodesic", "splitting"])
def test_a_symplectic_map_of_the_manifold_has_no_defect(pendulum, flow):
    X = tangent_basis(pendulum, pendulum.p0, pendulum.q0)
    assert symplecticity_defect(flow, pendulum.p0, pendulum.q0, X) < 1e-13 * np.linalg.norm(pendulum.p0) ** 2


def test_off_the_tangent_space_the_same_map_is_not_symplectic(pendulum):
    assert symplecticity_defect(geodesic, pendulum.p0, pendulum.q0, np.eye(6)) > 1e-2


def test_a_scaled_two_form_has_the_defect_that_was_planted(pendulum):
    X = tangent_basis(pendulum, pendulum.p0, pendulum.q0)
    J = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.eye(3), np.zeros((3, 3))]])
    expected = 0.01 * np.linalg.norm(X.T @ J @ X, 2)
    assert symplecticity_defect(swollen, pendulum.p0, pendulum.q0, X) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("factor", [1.0, 1.001, 0.9])
def test_a_scaled_rotation_of_the_plane_has_its_known_defect(factor):
    c, s = factor * np.cos(0.4), factor * np.sin(0.4)
    found = symplecticity_defect(lambda p, q: (c * p - s * q, s * p + c * q), [0.3], [1.2], np.eye(2))
    assert found == pytest.approx(abs(factor**2 - 1), abs=1e-15)


def test_redundant_constraints_leave_the_tangent_space_as_it_is():
    sphere = spherical_pendulum.problem()
    twice = replace(sphere, g=[sphere.g[0], 3 * sphere.g[0]], chart=None)
    ivp = make_ivp(source_of(twice, "twice"), "fig1.2")
    assert tangent_basis(ivp, ivp.p0, ivp.q0).shape == (6, 4)


def test_free_motion_is_reversible_and_a_one_sided_kick_is_not(pendulum):
    p, q = pendulum.p0, pendulum.q0
    assert reversibility_defect(geodesic, p, q) < 1e-14
    assert reversibility_defect(kicked, p, q) > 1e-2

    def strang(p, q):
        p1, q1 = kicked(p, q)
        force = np.array([0, 0, -0.3])
        return p1 + force - q1 * (q1 @ force), q1

    assert reversibility_defect(strang, p, q) < 1e-14


def test_the_reversibility_defect_of_a_shift_is_what_was_planted():
    # q -> q + p + 0.01 comes back 0.02 ahead
    assert reversibility_defect(lambda p, q: (p, q + p + 0.01), [0.5], [1.0]) == pytest.approx(0.02, rel=1e-12)


def test_a_map_that_fails_gives_nan():
    assert np.isnan(reversibility_defect(lambda p, q: (p * np.nan, q), [0.5], [1.0]))
