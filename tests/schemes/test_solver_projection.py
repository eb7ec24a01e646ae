"""The projection that CVODE calls: the nearest position, then the nearest velocity or momentum, and errors along the tangents."""

import numpy as np
import pytest
import uncompiled
from ivps import ivp
from measures import error_of

from daebench.compiler.link import Linker, Options
from daebench.diagnostics.consistency import project

KERNEL = "schemes.kernels.solver_projection"
NEAR = 0.03
ROUNDING = 1e-13


def projected(where, w, q, error_w, error_q):
    """Return the increments and errors of the kernel run by Python; w is the velocity, or the momentum of a problem by H(p, q)."""
    kernel = "of_velocities" if where.source.derivation.mechanical else "of_momenta"
    text = Linker(where.source.derivation, Options(compiled=False)).module("Uncompiled.", [(f"daebench.{KERNEL}", kernel)])
    par = (*where.par, (float(np.abs(where.q0).max()), 0.0))
    call = getattr(uncompiled.run(text, kernel), f"solver_projection_{kernel}")
    *changes, report = call(*(tuple(x) for x in (w, q, error_w, error_q)), par)
    assert report[0] == 0
    return [np.array(x, dtype=float) for x in changes]


def beside(where, seed=3):
    """Return a momentum and a position beside the manifold, and errors of any size."""
    draw = np.random.default_rng(seed)
    size = np.abs(where.q0).max(), np.abs(where.p0).max() or 1.0
    p, q = (x + NEAR * each * draw.standard_normal(where.d) for x, each in ((where.p0, size[1]), (where.q0, size[0])))
    return p, q, draw.standard_normal(where.d), draw.standard_normal(where.d)


def off(where):
    """Return by how much the kernel misses what it is to give, by name, as NumPy has it from g, G, M and H_pp alone."""
    p, q, error_w, error_q = beside(where)
    mechanical = where.source.derivation.mechanical
    w = np.linalg.solve(where.value("mass", tuple(p), tuple(q)), p) if mechanical else p
    dw, dq, left_w, left_q = projected(where, w, q, error_w, error_q)
    q1, w1 = q + dq, w + dw
    M, G = where.value("mass", tuple(p), tuple(q1)), where.value("G", tuple(q1))
    p1 = M @ w1 if mechanical else w1
    H_pp = where.value("H_pp", tuple(p1), tuple(q1))
    nearest_p, nearest_q, *_ = project(where, M @ w if mechanical else p, q)
    tangent_w = G if mechanical else G @ H_pp
    # what is taken off an error is normal in the metric: M^-1 G^T nu of positions and velocities, G^T mu of momenta
    normals = H_pp @ G.T, H_pp @ G.T if mechanical else G.T
    rest = [x - A @ np.linalg.lstsq(A, x, rcond=None)[0] for x, A in zip((error_q - left_q, error_w - left_w), normals, strict=True)]
    # along G^T, which is nearest too where H is quadratic in p
    along = G.T @ np.linalg.lstsq(G.T, p1 - (M @ w if mechanical else p), rcond=None)[0]
    size_q, size_p = np.abs(q).max(), np.abs(p).max()
    return {
        "position": error_of(q1, nearest_q) / size_q,
        "on g": np.abs(where.value("g", tuple(q1))).max() / (np.abs(G).sum(axis=1).max() * size_q),
        "on G H_p": np.abs(where.value("Gv", tuple(p1), tuple(q1))).max() / (np.abs(G @ H_pp).sum(axis=1).max() * size_p),
        "momentum": error_of(p1, nearest_p) / size_p if where.facts.QUADRATIC else 0.0,
        "momentum along G^T": error_of(p1 - (M @ w if mechanical else p), along) / size_p,
        "error tangent": max(np.abs(G @ left_q).max(), np.abs(tangent_w @ left_w).max()) / np.abs(tangent_w).max(),
        "error normal": max(np.abs(x).max() for x in rest),
    }


@pytest.mark.sampled(left_out=("andrews_squeezer", "butane"))
def test_kernel_gives_the_nearest_state_and_errors_along_the_tangents(each_ivp):
    found = off(each_ivp)
    assert all(value < ROUNDING for value in found.values()), found


def closed_form(draws):
    """Return positions, velocities and errors near the unit sphere, and their projections in closed form."""
    draw = np.random.default_rng(draws)
    q, v, error_v, error_q = draw.standard_normal((4, 3))
    q *= 1.02 / np.linalg.norm(q)
    n = q / np.linalg.norm(q)
    P = np.eye(3) - np.outer(n, n)
    return (v, q, error_v, error_q), (P @ v - v, n - q, P @ error_v, P @ error_q)


def test_on_the_sphere_it_is_the_closed_form():
    for draws in range(3):
        given, expected = closed_form(draws)
        for found, right in zip(projected(ivp("spherical-slow"), *given), expected, strict=True):
            assert error_of(found, right) < ROUNDING
