"""The diagnostics, on series and maps whose answer is known, and on planted faults."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from daebench.diagnostics.consistency import consistency, project, projected, require_consistent
from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.integrals import energy_error, integral_errors
from daebench.diagnostics.manifold import constraint_jacobian, distance, manifold_drift
from daebench.diagnostics.metric import least_displacement
from daebench.diagnostics.order import fit_order
from daebench.diagnostics.reversibility import reversibility_defect
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis, tangent_map
from daebench.errors import BadInput, InconsistentStart
from daebench.problem import Case, ConstrainedHamiltonian, coordinates
from daebench.problems import planar_pendulum, spherical_pendulum
from daebench.scene import make_scene, source_of
from daebench.trajectory import Trajectory


@pytest.fixture
def random():
    return np.random.default_rng(20240607)


@pytest.fixture(scope="module")
def pendulum():
    return make_scene(source_of(spherical_pendulum.problem(), "spherical_pendulum"), "fig1.2")


@pytest.fixture(scope="module")
def ellipse():
    """A point of unequal masses on an ellipse: the metric and the curvature are not the identity's."""
    (x, y), p = coordinates(2)
    sheet = ConstrainedHamiltonian(
        q=(x, y), p=p, M=sp.diag(1, 4 + x**2), U=y, g=[x**2 / 4 + y**2 - 1], cases={"end": Case(q=(2, 0), p=(0, 3))}
    )
    return make_scene(source_of(sheet, "ellipse"), "end")


def trajectory_of(scene, t, p, q):
    return Trajectory(
        problem=scene.problem,
        case=scene.case,
        method="made up",
        parameters=scene.parameters,
        knob="h",
        value=0.1,
        t=t,
        q=q,
        p=p,
        steps=0,
        seconds=0.0,
    )


# ---- energy drift --------------------------------------------------------------------------------------------------------

T = np.linspace(0, 1e4, 100_001)
OSCILLATION = 1e-3 * np.sin(T + 0.3) * (1 + 0.2 * np.cos(2 * T))


@pytest.mark.parametrize("slope", [1e-8, -1e-8, 3e-7], ids=["up", "down", "steep"])
def test_a_linear_drift_is_seen_under_an_oscillation_a_hundred_thousand_times_larger(slope):
    drift = energy_drift(T, slope * T + OSCILLATION)
    assert drift.kind == "linear"
    assert abs(drift.slope - slope) < 3 * drift.slope_error < 0.1 * abs(slope)
    assert abs(drift.growth - 1) < 3 * drift.growth_error


@pytest.mark.parametrize("alpha", [0.5, 1.0, 2.0, 3.0], ids=lambda alpha: f"t^{alpha}")
@pytest.mark.parametrize("amplitude", [0.0, 1e-3], ids=["alone", "under oscillation"])
def test_the_growth_exponent_is_found(alpha, amplitude):
    drift = energy_drift(T, 2e-3 * (T / T[-1]) ** alpha + amplitude * np.sin(T))
    assert drift.kind == ("linear" if alpha == 1 else "growing")
    assert abs(drift.growth - alpha) < 0.02


@pytest.mark.parametrize("periods", [5.3, 20.0, 46.0, 340.0, 391.0, 1000.5])
@pytest.mark.parametrize("phase", [0.0, 1.0, 2.5, 4.0])
def test_an_oscillation_is_bounded_whatever_its_period_and_phase(periods, phase):
    t = np.linspace(0, 500, 12_001)
    error = np.cos(2 * np.pi * periods * t / 500 + phase) - np.cos(phase)
    drift = energy_drift(t, error)
    assert drift.kind == "bounded"
    assert abs(drift.slope) < 2 * drift.slope_error
    assert np.isnan(drift.growth)
    assert np.isnan(drift.growth_error)


def test_the_standard_error_of_the_slope_is_that_of_the_textbook_for_white_noise(random):
    t = np.linspace(0, 50, 1000)
    drifts = [energy_drift(t, random.normal(size=1000)) for _ in range(400)]
    scatter = np.std([drift.slope for drift in drifts])
    assert 0.8 < np.mean([drift.slope_error for drift in drifts]) / scatter < 1.25
    assert np.mean([drift.kind == "bounded" for drift in drifts]) > 0.97


def test_the_standard_error_of_the_slope_holds_for_autocorrelated_noise(random):
    t = np.arange(4000.0)
    drifts = []
    for _ in range(200):
        noise = random.normal(size=4000)
        for k in range(1, 4000):
            noise[k] += 0.95 * noise[k - 1]
        drifts.append(energy_drift(t, noise))
    assert 0.7 < np.mean([drift.slope_error for drift in drifts]) / np.std([drift.slope for drift in drifts]) < 1.4
    assert np.mean([drift.kind == "bounded" for drift in drifts]) > 0.95


@pytest.mark.parametrize(
    "error",
    [0 * T, 1e-3 + 0 * T, 1e-3 * (1 - np.exp(-T))],
    ids=["nothing", "an offset", "a transient"],
)
def test_what_settles_is_bounded(error):
    assert energy_drift(T, error).kind == "bounded"


@pytest.mark.parametrize("error", [1e-6 * T * np.sin(T), 1e-9 * np.exp(T / 300)], ids=["amplitude", "explosion"])
def test_what_spreads_without_a_significant_slope_is_not_called_bounded(error):
    assert energy_drift(T, error).kind == "growing"


def test_a_drift_within_the_resolution_is_bounded():
    error = 1e-19 * T
    assert energy_drift(T, error).kind == "linear"
    assert energy_drift(T, error, resolution=2e-15).kind == "bounded"


@pytest.mark.parametrize(
    ("t", "error"),
    [(T[:10], T[:10]), (T[:100], np.full(100, np.nan)), (T[:100], np.where(T[:100] == 5, np.inf, 0))],
    ids=["short", "NaN", "inf"],
)
def test_what_cannot_be_judged_is_undetermined(t, error):
    drift = energy_drift(t, error)
    assert drift.kind == "undetermined"
    assert np.all(np.isnan([drift.slope, drift.slope_error, drift.growth, drift.growth_error]))


@pytest.mark.parametrize(("t", "error"), [(T[:100], T[:99]), (T[99::-1], T[:100])], ids=["shapes", "backwards"])
def test_a_series_that_makes_no_sense_is_refused(t, error):
    with pytest.raises(BadInput):
        energy_drift(t, error)


# ---- order ---------------------------------------------------------------------------------------------------------------

H = 0.4 / 2.0 ** np.arange(12)


def test_an_order_is_fitted_between_the_plateau_and_the_pre_asymptotic_points(random):
    error = 3 * H**4 / (1 + 30 * H**2) ** 2 + 1e-12 * (1 + random.uniform(size=12))
    error[0] = np.nan
    fit = fit_order(H, error)
    assert abs(fit.slope - 4) < max(0.2, 3 * fit.slope_error)
    assert fit.reasons[0] == "failed"
    assert fit.reasons[1:3] == ("pre-asymptotic",) * 2
    assert set(fit.reasons[-4:]) == {"round-off"}
    assert sum(fit.used) >= 3
    assert [reason == "" for reason in fit.reasons] == list(fit.used)


@pytest.mark.parametrize("order", [1, 2, 6], ids=str)
def test_the_order_of_a_clean_series_is_exact_whatever_the_arrangement_of_points(order, random):
    h = random.permutation(H[:8])
    fit = fit_order(h, 5 * h**order)
    assert abs(fit.slope - order) < 1e-12
    assert fit.slope_error < 1e-12
    assert all(fit.used)
    assert fit.note == ""


@pytest.mark.parametrize(("claimed", "true"), [(2, 1), (4, 3)], ids=["first for second", "third for fourth"])
def test_a_wrong_order_is_told_from_the_claimed_one(claimed, true, random):
    error = H[:8] ** true * (1 + 0.05 * H[:8]) * np.exp(0.02 * random.normal(size=8))
    fit = fit_order(H[:8], error)
    assert abs(fit.slope - claimed) > 10 * fit.slope_error
    assert abs(fit.slope - true) < 0.05


def test_two_regimes_are_never_averaged():
    # order 2 at every step size one would try first, order 1 in the end, as for constrained symplectic Euler
    error = 0.02 * H + H**2
    fit = fit_order(H, error)
    assert abs(fit.slope - 1) < 0.1
    assert fit.used[-3:] == (True, True, True)
    assert set(fit.reasons[:6]) == {"pre-asymptotic"}
    assert fit_order(H[:4], H[:4] ** 2).slope == pytest.approx(2)


def test_the_transition_between_two_regimes_gives_no_order():
    h = H[:8]
    fit = fit_order(h, 0.004 * h + h**2)
    assert np.isnan(fit.slope)
    assert "smaller" in fit.note


def test_points_at_the_floor_of_the_reference_are_dropped():
    error = H**2
    fit = fit_order(H, np.maximum(error, 1e-5), floor=1e-5)
    assert abs(fit.slope - 2) < 1e-12
    assert all(reason == ("round-off" if e <= 1e-5 else "") for reason, e in zip(fit.reasons, error, strict=True))


@pytest.mark.parametrize("seed", range(30), ids=str)
def test_a_noisy_plateau_does_not_spoil_the_order(seed):
    noise = 1e-13 * np.exp(np.random.default_rng(seed).normal(size=12)) * (0.4 / H) ** 0.5
    fit = fit_order(H, 0.1 * H**4 + noise)
    assert np.isnan(fit.slope) or abs(fit.slope - 4) < 0.2


def test_an_accidental_dip_in_the_middle_is_not_taken_for_a_plateau():
    error = H**2
    error[2] *= 1e-5
    fit = fit_order(H, error)
    assert abs(fit.slope - 2) < 1e-12
    assert fit.reasons[:3] == ("pre-asymptotic",) * 3


@pytest.mark.parametrize(
    "error",
    [[np.nan] * 4, [0.0] * 4, [1e-3, 1e-4, np.nan, np.inf], [1e-14, 2e-14, 1e-14, 3e-14], [1.0, 1.1, 0.9, 1.0]],
    ids=["all failed", "all exact", "two left", "all plateau", "not falling"],
)
def test_no_order_without_three_points(error):
    fit = fit_order([0.1, 0.05, 0.025, 0.0125], error)
    assert np.isnan(fit.slope)
    assert np.isnan(fit.slope_error)
    assert not any(fit.used)
    assert all(fit.reasons)
    assert fit.note


@pytest.mark.parametrize(
    ("h", "error"), [([0.1, 0.2], [1.0]), ([0.1, 0.1], [1, 2]), ([0.1, -0.1], [1, 2])], ids=["shapes", "twice", "negative"]
)
def test_step_sizes_that_make_no_sense_are_refused(h, error):
    with pytest.raises(BadInput):
        fit_order(h, error)


# ---- manifold and consistency --------------------------------------------------------------------------------------------


def test_the_distance_from_a_sphere_is_that_along_the_radius(pendulum, random):
    Q = random.normal(size=(20, 3))
    Q /= np.linalg.norm(Q, axis=1, keepdims=True)
    P = np.cross(Q, random.normal(size=(20, 3)))
    assert np.max(distance(pendulum, P, Q)) < 1e-15
    # momenta are orthogonal to q wherever q lies on the ray, so moving q along it is the nearest way back
    np.testing.assert_allclose(distance(pendulum, 0 * P, 1.01 * Q), 0.01, rtol=1e-10)
    np.testing.assert_allclose(distance(pendulum, P + 1e-3 * Q, Q), 1e-3 / np.sqrt(1 + np.sum(P**2, axis=1)), rtol=1e-2)


def test_the_distance_is_the_least_in_the_metric_of_kinetic_energy(ellipse):
    # the manifold of the ellipse: an angle and a speed
    p0, q0 = np.array([0.3, 0.8]), np.array([1.2, 0.9])
    M = np.diag([1, 4 + q0[0] ** 2])
    # M depends on q: the velocity p/M at each point of the ellipse is along its tangent
    angle = np.linspace(0, 2 * np.pi, 20_001)
    q = np.stack([2 * np.cos(angle), np.sin(angle)])
    tangent = np.stack([-2 * np.sin(angle), np.cos(angle)]) * np.stack([np.ones_like(angle), 4 + q[0] ** 2])
    W = np.linalg.inv(M)
    s = (tangent.T @ W @ p0) / np.einsum("in,ij,jn->n", tangent, W, tangent)
    dp, dq = tangent * s - p0[:, None], q - q0[:, None]
    squares = np.einsum("in,ij,jn->n", dp, W, dp) + np.einsum("in,ij,jn->n", dq, M, dq)
    expected = np.sqrt(np.min(squares))
    assert distance(ellipse, p0[None], q0[None], sweeps=60)[0] == pytest.approx(expected, rel=1e-6)


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


def test_projection_of_a_pendulum_is_radial_in_q_and_orthogonal_in_p(pendulum):
    p, q, moved_q, moved_p = project(pendulum, [0.3, 0.4, 0.5], [0, 0, 2])
    np.testing.assert_allclose(q, [0, 0, 1], atol=1e-15)
    np.testing.assert_allclose(p, [0.3, 0.4, 0], atol=1e-15)
    assert moved_q == pytest.approx(1, rel=1e-14)
    assert moved_p == pytest.approx(0.5, rel=1e-14)


def test_projection_minimises_in_the_metric_of_the_mass(ellipse):
    p0, q0 = np.array([0.3, 0.8]), np.array([1.3, 0.9])
    p, q, moved_q, moved_p = project(ellipse, p0, q0)
    angle = np.linspace(0, 2 * np.pi, 200_001)
    M = np.array([1, 4 + q0[0] ** 2])
    squares = (2 * np.cos(angle) - q0[0]) ** 2 * M[0] + (np.sin(angle) - q0[1]) ** 2 * M[1]
    assert moved_q == pytest.approx(np.sqrt(np.min(squares)), rel=1e-8)
    normal = np.array([q[0] / 2, 2 * q[1]])
    M = np.array([1, 4 + q[0] ** 2])
    expected = p0 - normal * (normal @ (p0 / M)) / (normal @ (normal / M))
    np.testing.assert_allclose(p, expected, rtol=1e-13)
    assert moved_p == pytest.approx(np.sqrt(np.sum((expected - p0) ** 2 / M)), rel=1e-10)
    assert consistency(replace(ellipse, p0=p, q0=q)) < (4e-16, 4e-16)


def test_projection_from_where_the_constraint_has_no_gradient_is_an_error(pendulum):
    with pytest.raises(BadInput, match="cannot be projected"):
        project(pendulum, [1, 0, 0], [0, 0, 0])


def test_consistent_starts_pass_and_others_are_told_both_residuals(pendulum):
    require_consistent(pendulum)
    off = replace(pendulum, q0=pendulum.q0 * (1 + 1e-9), p0=pendulum.p0 + 0.25 * pendulum.q0)
    with pytest.raises(InconsistentStart, match=r"\|g\| = 2e-09 and \|G H_p\| = 0\.5; .*--project"):
        require_consistent(off)
    require_consistent(off, tolerance=0.5)
    scene, moved_q, moved_p = projected(off)
    require_consistent(scene)
    assert moved_q == pytest.approx(1e-9, rel=1e-5)
    assert moved_p == pytest.approx(0.25, rel=1e-5)


@pytest.mark.parametrize("length", [1e-6, 1.0, 1e6], ids=["micrometre", "metre", "megametre"])
def test_consistency_does_not_depend_on_units(length):
    sheet = planar_pendulum.problem(length=length)
    angle, m = 0.7, 3.0
    q0 = length * np.array([np.sin(angle), -np.cos(angle)])
    p0 = length * m * np.array([np.cos(angle), np.sin(angle)])
    scene = make_scene(source_of(sheet, "planar_pendulum"), "horizontal", {"mass": m}, p0=p0, q0=q0)
    require_consistent(scene)
    with pytest.raises(InconsistentStart):
        require_consistent(replace(scene, q0=q0 * (1 + 1e-9)))


def test_manifold_drift_gives_maxima_and_slopes(pendulum):
    t = np.linspace(0, 100, 2001)
    angle = 0.5 * t
    around = np.stack([np.cos(angle), np.sin(angle), 0 * t], axis=1)
    ahead = np.stack([-np.sin(angle), np.cos(angle), 0 * t], axis=1)
    # |q|^2 - 1 grows as 1e-6 t, and q.p oscillates
    q, p = around * np.sqrt(1 + 1e-6 * t)[:, None], 0.5 * ahead + 1e-4 * np.sin(7 * t)[:, None] * around
    found = manifold_drift(pendulum, trajectory_of(pendulum, t, p, q))
    assert found.g_max == pytest.approx(1e-4, rel=1e-9)
    assert found.g.kind == "linear"
    assert found.g.slope == pytest.approx(1e-6, rel=1e-9)
    assert found.Gv_max == pytest.approx(2e-4, rel=1e-3)
    assert found.Gv.kind == "bounded"


# ---- conserved quantities ------------------------------------------------------------------------------------------------


def test_errors_of_conserved_quantities_are_differences_from_their_start(pendulum):
    t = np.linspace(0, 1, 5)
    p, q = np.tile(pendulum.p0, (5, 1)), np.tile(pendulum.q0, (5, 1))
    q[:, 2] += t
    p[:, 1] += 2 * t
    trajectory = trajectory_of(pendulum, t, p, q)
    np.testing.assert_allclose(energy_error(pendulum, trajectory), t + 2 * t**2 + 2 * t * pendulum.p0[1], atol=1e-13)
    errors = integral_errors(pendulum, trajectory)
    assert list(errors) == ["L3"]
    np.testing.assert_allclose(errors["L3"], 2 * t * pendulum.q0[0], atol=1e-13)


def test_a_problem_without_integrals_has_no_errors_of_them():
    scene = make_scene(source_of(planar_pendulum.problem(), "planar_pendulum"), "horizontal")
    assert integral_errors(scene, trajectory_of(scene, np.zeros(1), scene.p0[None], scene.q0[None])) == {}


# ---- symplecticity and reversibility -------------------------------------------------------------------------------------


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


def twisted(p, q):
    """Return the geodesic followed by a kick of a force without a potential: not symplectic."""
    p1, q1 = geodesic(p, q)
    force = 0.1 * np.array([q1[1] * q1[1], 0 * q1[0], q1[0] * q1[1]])
    return p1 + force - q1 * np.sum(q1 * force), q1


def test_the_tangent_basis_is_orthonormal_and_tangent(pendulum):
    X = tangent_basis(pendulum, pendulum.p0, pendulum.q0)
    assert X.shape == (6, 4)
    np.testing.assert_allclose(X.T @ X, np.eye(4), atol=1e-15)
    np.testing.assert_allclose(constraint_jacobian(pendulum, pendulum.p0[None], pendulum.q0[None])[0] @ X, 0, atol=1e-14)


def test_the_tangent_map_of_a_linear_map_is_the_map(random):
    A = random.normal(size=(6, 6))

    def linear(p, q):
        x = A @ np.concatenate([p, q])
        return tuple(x[:3]), tuple(x[3:])

    X = random.normal(size=(6, 4))
    np.testing.assert_allclose(tangent_map(linear, [1, 2, 3], [4, 5, 6], X), A @ X, rtol=1e-13)


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


def test_a_force_without_potential_is_caught(pendulum):
    X = tangent_basis(pendulum, pendulum.p0, pendulum.q0)
    assert symplecticity_defect(twisted, pendulum.p0, pendulum.q0, X) > 1e-3


@pytest.mark.parametrize("factor", [1.0, 1.001, 0.9], ids=str)
def test_a_scaled_rotation_of_the_plane_has_its_known_defect(factor):
    c, s = factor * np.cos(0.4), factor * np.sin(0.4)
    found = symplecticity_defect(lambda p, q: (c * p - s * q, s * p + c * q), [0.3], [1.2], np.eye(2))
    assert found == pytest.approx(abs(factor**2 - 1), abs=1e-15)


def test_a_linear_symplectic_map_has_no_defect(random):
    S = random.normal(size=(3, 3))
    S = S + S.T

    def shear(p, q):
        q1 = q + S @ p
        return p - S @ S @ q1, q1

    assert symplecticity_defect(shear, [1, 2, 3], [4, 5, 6], np.eye(6)) < 1e-11


def test_redundant_constraints_leave_the_tangent_space_as_it_is():
    sphere = spherical_pendulum.problem()
    twice = replace(sphere, g=[sphere.g[0], 3 * sphere.g[0]], chart=None)
    scene = make_scene(source_of(twice, "twice"), "fig1.2")
    assert tangent_basis(scene, scene.p0, scene.q0).shape == (6, 4)


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


# ---- imports -------------------------------------------------------------------------------------------------------------


def test_importing_the_diagnostics_imports_neither_sympy_nor_numba_nor_pandas():
    names = ["consistency", "energy", "growth", "integrals", "manifold", "metric", "order", "reversibility", "symplecticity"]
    code = "import sys\n" + "".join(f"import daebench.diagnostics.{name}\n" for name in names)
    code += "print([name for name in ('sympy', 'numba', 'pandas', 'scipy') if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"
