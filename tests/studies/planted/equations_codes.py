"""Codes that solve other equations than their problem's: a wrong mass, inertia or force, in a right integrator of four kinds."""

import sys
from importlib import import_module
from pathlib import Path

import numpy as np
from numpy.linalg import solve

sys.path.insert(0, str(Path(__file__).parent))
try:
    basis_codes, beads, crank, spring = (
        import_module(name) for name in ("basis_codes", "beads_codes", "slider_crank_codes", "spring_pendulum_codes")
    )
finally:
    del sys.path[0]

MODELS = {
    "spring_pendulum": (np.diag(spring.M), spring.U_q, spring.g, spring.G, np.array([0, 9.81, 0, 2.5 * 9.81])),
    "beads": (np.diag(beads.M), beads.grad, beads.cons, beads.jac, np.array([0, 0, 9.81, 0, 0, 4 * 9.81])),
    "slider_crank": (crank.M, crank.U_q, crank.g, crank.G, np.array([0, 9.81, 0])),
}
"""The mass matrix, U_q, g, G and the weight in U_q."""


def rattle(M, U_q, g, G):
    """Kick, drift, kick in momenta, with multipliers by Newton's iteration."""
    W = np.linalg.inv(M)

    def step(p, q, h):
        J = G(q)
        half = p - h / 2 * U_q(q)
        for _ in range(60):
            q1 = q + h * W @ half
            change = solve(h * G(q1) @ W @ J.T, g(q1))
            half = half - J.T @ change
            if np.abs(h * change).max() < 1e-16:
                break
        q1 = q + h * W @ half
        p1, J = half - h / 2 * U_q(q1), G(q1)
        return p1 - J.T @ solve(J @ W @ J.T, J @ W @ p1), q1

    return step


def tangent_basis(M, U_q, g, G):
    """Multipliers by least squares, momenta in a basis of the tangent space; masses alone."""
    return basis_codes.make(U_q, g, G, np.diag(M))


def reduced(M, U_q, g, G):
    """The classical Runge-Kutta method on the equations of index 1, curvature by differences."""
    W = np.linalg.inv(M)

    def rate(p, q):
        v, J = W @ p, G(q)
        d = 1e-4
        bend = (G(q + d * v) - G(q - d * v)) @ v / (2 * d)
        lam = solve(J @ W @ J.T, bend - J @ W @ U_q(q))
        return -U_q(q) - J.T @ lam, v

    def step(p, q, h):
        a = rate(p, q)
        b = rate(p + h / 2 * a[0], q + h / 2 * a[1])
        c = rate(p + h / 2 * b[0], q + h / 2 * b[1])
        d = rate(p + h * c[0], q + h * c[1])
        return tuple(x + h / 6 * (k + 2 * m + 2 * n + s) for x, k, m, n, s in zip((p, q), a, b, c, d, strict=True))

    return step


def velocities(M, U_q, g, G):
    """Steps in velocities, positions put back along the old gradients, as molecular codes do."""
    W = np.linalg.inv(M)

    def step(p, q, h):
        v = W @ p - h / 2 * W @ U_q(q)
        x, J = q + h * v, G(q)
        for _ in range(60):
            r = g(x)
            if np.abs(r).max() < 1e-15:
                break
            x = x - W @ J.T @ solve(G(x) @ W @ J.T, r)
        v = (x - q) / h - h / 2 * W @ U_q(x)
        J = G(x)
        v = v - W @ J.T @ solve(J @ W @ J.T, J @ v)
        return M @ v, x

    return step


STYLES = {"rattle": rattle, "tangent_basis": tangent_basis, "reduced": reduced, "velocities": velocities}


def scaled(M, body, factor):
    return np.diag(np.where(np.isin(np.arange(len(M)), body), factor, 1.0)) @ M


LAST = {"spring_pendulum": [2, 3], "beads": [3, 4, 5]}
"""The positions of the second body."""


def changed(name, change):
    """Return the model of a problem with a change, and words that name it."""
    M, U_q, g, G, weight = MODELS[name]
    last = LAST.get(name, [])
    of_last = np.isin(np.arange(len(M)), last)
    number = weight[1] if name != "beads" else weight[2]
    where = 2 if name != "beads" else 3
    changes = {
        "": (M, U_q, ""),
        "mass_of_last": (scaled(M, last, 1.5), U_q, f"M[{last[0] + 1},{last[0] + 1}] = " if last else ""),
        "mass_of_last_small": (scaled(M, last, 0.97), U_q, f"M[{last[0] + 1},{last[0] + 1}] = " if last else ""),
        "one_component": (scaled(M, [1], 2.0), U_q, "M[2,2] = "),
        "all_masses": (3.0 * M, U_q, "q' is 0.3333 times M^-1 p"),
        "inertia": (np.array([[2 / 3, 0, 1 / 6], [0, 2 / 3, 0], [1 / 6, 0, 1]]), U_q, "M[3,3] = 1 in place of 1.333"),
        "coupling": (np.array([[2 / 3, 0, 0], [0, 2 / 3, 0], [0, 0, 4 / 3]]), U_q, "M[1,3] = 0 in place of 0.1667"),
        "gravity_sign": (M, lambda q: U_q(q) - 2 * weight, "p' is that of"),
        "gravity_missing": (M, lambda q: U_q(q) - weight, "p' is that of"),
        "gravity_half": (M, lambda q: U_q(q) - weight / 2, "p' is that of"),
        "weight_of_first": (M, lambda q: U_q(q) + np.eye(len(M))[where - 1] * number, f"in component {where}"),
        "force_sign": (M, lambda q: -U_q(q), "p' is that of -1 times the problem's force"),
        "force_missing": (M, lambda q: 0 * q, "p' is that of no force"),
        "force_of_last_missing": (
            M,
            lambda q: np.where(of_last, 0, U_q(q)),
            "p' is that of no force in component",
        ),
        "mass_and_force": (scaled(M, last, 2.0), lambda q: U_q(q) + weight, "p' is that of"),
    }
    M, force, words = changes[change]
    return (M, force, g, G), words


CHANGES = {
    "spring_pendulum": (
        "",
        "mass_of_last",
        "mass_of_last_small",
        "one_component",
        "all_masses",
        "gravity_sign",
        "gravity_missing",
        "gravity_half",
        "weight_of_first",
        "force_sign",
        "force_missing",
        "force_of_last_missing",
        "mass_and_force",
    ),
    "slider_crank": ("", "inertia", "coupling", "one_component", "all_masses", "gravity_sign", "gravity_missing", "gravity_half"),
}
CHANGES["beads"] = CHANGES["spring_pendulum"]


def codes():
    """Yield a problem, a style and a change, of all codes."""
    for name, changes in CHANGES.items():
        for style in STYLES:
            if style != "tangent_basis" or name != "slider_crank":
                yield from ((name, style, change) for change in changes)


def code(name, style, change):
    """Return the step of a code, and words that name the change."""
    model, words = changed(name, change)
    return STYLES[style](*model), words
