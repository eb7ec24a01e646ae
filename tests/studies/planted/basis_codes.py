"""Steps with one mistake, written with a basis of the tangent space and least squares: no matrix G M^-1 G^T anywhere.

``make(U_q, g, G, M, mistake)`` returns a step; momenta are projected in that basis, multipliers found by Gauss-Newton with QR.
"""

import numpy as np
from scipy.linalg import lstsq, null_space, qr


def tangent_momentum(G, M, p):
    """The momentum M Z c whose velocity Z c is in the null space of G, with the same generalised momenta Z^T p."""
    Z = null_space(G)
    c = lstsq(Z.T @ (M[:, None] * Z), Z.T @ p, lapack_driver="gelsy")[0]
    for _ in range(2):  # the components of the velocity off the null space are rounding; take them away
        v = Z @ c
        Q = qr(G.T, mode="economic")[0]
        v = v - Q @ (Q.T @ v)
        c = Z.T @ v
    return M * v


def reach(g, G, start, directions, most=60, stop=0.0, scale=1.0):
    """Multipliers mu with g(start - directions mu) = 0, by Newton until the residual no longer falls."""
    mu, best = np.zeros(directions.shape[1]), np.inf
    for count in range(most):
        x = start - directions @ mu
        r = g(x)
        size = np.abs(r).max()
        if size <= stop or (count > 2 and size >= best and size < 1e-12):
            break
        best = min(best, size)
        mu = mu + lstsq(G(x) @ directions, r)[0]
    return scale * mu


def fixed(x, new):
    """The limit of x -> new(x)."""
    for _ in range(300):
        y = new(x)
        if np.abs(y - x).max() <= 2e-16 * np.abs(x).max():
            return y
        x = y
    return x


def make(U_q, g, G, M, mistake=""):
    W = 1 / M

    def directions_at(x, power=1.0):
        return (W**power)[:, None] * G(x).T

    def reference(q, free, end):
        places = {
            "reference_gradient_after_drift": free,
            "reference_gradient_at_midpoint": (q + end) / 2,
            "reference_gradient_at_q1": end,
            "reference_gradient_at_half_drift": (q + free) / 2,
        }
        return places.get(mistake, q)

    def constrained(q, free):
        """q1 and the displacement from free, in units of M^-1 times an impulse times h."""

        def attempt(end):
            D = directions_at(reference(q, free, end), 0.0 if mistake == "mass_missing_in_position" else 1.0)
            kwargs = {"one_sweep": {"most": 1}, "newton_to_1e-5": {"stop": 1e-5}, "newton_to_1e-2": {"stop": 1e-2}}.get(mistake, {})
            return free - D @ reach(g, G, free, D, **kwargs)

        return fixed(q, attempt) if mistake in ("reference_gradient_at_midpoint", "reference_gradient_at_q1") else attempt(q)

    def kick(p, x, size):
        factor = {"gravity_twice": 2.0, "sign_of_force": -1.0}.get(mistake, 1.0)
        return p - factor * size * U_q(x)

    def rattle(p, q, h):
        sizes = {"full_kick": (1, 1), "first_kick_only": (0.5, 0), "kick_at_end_only": (0, 1), "momentum_at_half_step": (1, 0)}
        first, second = sizes.get(mistake, (0.5, 0.5))
        half = kick(p, q, first * h)
        free = q + h * W * (p if mistake == "position_without_force" else half)
        end = constrained(q, free)
        impulse = M * (free - end) / h
        if mistake == "multiplier_along_G_of_q0" or mistake == "mass_missing_in_position":
            impulse = G(q).T @ lstsq(G(q).T * (1.0 if mistake == "mass_missing_in_position" else W[:, None]), (free - end) / h)[0]
        factors = {"momentum_not_corrected": 0.0, "multiplier_sign": -1.0, "half_of_it": 0.5, "multiplier_times_h": h, "lam_over_h": 1 / h}
        p1 = half - factors.get(mistake, 1.0) * impulse
        if mistake == "velocity_projected_before_kick":
            return kick(tangent_momentum(G(end), M, p1), end, h / 2), end
        where = {"old_force": q, "force_before_correction": free}.get(mistake, end)
        p1 = kick(p1, where, second * h)
        if mistake in ("velocity_not_projected", "momentum_at_half_step"):
            return p1, end
        if mistake == "mass_missing_in_velocity":
            return tangent_momentum(G(end), np.ones_like(M), p1), end
        p1 = tangent_momentum(G(q if mistake == "velocity_projected_at_q0" else end), M, p1)
        return (0.97 * p1 if mistake == "momentum_damped" else p1), end

    def game(p, q, h):
        free = q + h * W * kick(p, q, h)
        end = fixed(free, lambda x: x - directions_at(x) @ lstsq(G(x) @ directions_at(x), g(x))[0])
        return M * (end - q) / h, end

    def step(p, q, h):
        if mistake == "step_size_ignored":
            return rattle(p, q, 0.01)
        if mistake == "step_off_by_one":
            return rattle(*rattle(p, q, h), h)
        if mistake == "velocity_for_momentum":
            p1, q1 = rattle(M * p, q, h)
            return W * p1, q1
        return (game if mistake == "position_based" else rattle)(p, q, h)

    return step


MISTAKES = {
    "": "correct",
    "reference_gradient_after_drift": "reference_gradient_after_drift",
    "reference_gradient_at_half_drift": "reference_gradient_after_drift",
    "reference_gradient_at_midpoint": "reference_gradient_at_midpoint",
    "reference_gradient_at_q1": "reference_gradient_at_q1",
    "mass_missing_in_position": "mass_missing_in_position",
    "one_sweep": "one_sweep",
    "newton_to_1e-5": "loose_tolerance",
    "newton_to_1e-2": "loose_tolerance",
    "gravity_twice": "full_kick",
    "sign_of_force": "force_scaled",
    "full_kick": "full_kick",
    "first_kick_only": "kick_missing",
    "kick_at_end_only": "kick_missing",
    "momentum_at_half_step": "momentum_at_half_step",
    "position_without_force": "position_without_force",
    "momentum_not_corrected": "momentum_not_corrected",
    "multiplier_sign": "multiplier_sign",
    "half_of_it": "multiplier_half",
    "multiplier_times_h": "multiplier_times_h",
    "lam_over_h": "multiplier_times_h",
    "velocity_projected_before_kick": "velocity_projected_before_kick",
    "old_force": "old_force",
    "force_before_correction": "force_before_correction",
    "velocity_not_projected": "velocity_not_projected",
    "mass_missing_in_velocity": "mass_missing_in_velocity",
    "velocity_projected_at_q0": "velocity_projected_at_q0",
    "momentum_damped": "momentum_damped",
    "position_based": "position_based",
    "step_size_ignored": "step_size_ignored",
    "step_off_by_one": "step_off_by_one",
    "velocity_for_momentum": "velocity_for_momentum",
}
"""The mistakes and their names in the dictionary."""
