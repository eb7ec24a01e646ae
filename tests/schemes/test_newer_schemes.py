"""Variational integrators of the GGL principle, and Livens' scheme: numbers of metis, and what published claims amount to."""

from functools import cache

import numpy as np
import pytest
import sympy as sp
from ivps import ivp
from measures import error_of
from runs import method, run

from daebench.compiler.definition import source_of
from daebench.diagnostics.symplecticity import linearisation, tangent_basis, two_form_change
from daebench.runs.make_ivp import make_ivp
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates

METIS = {
    "ggl_vi": (
        0.18899191587855446,
        0.27418049344641027,
        -0.9429247651568159,
        -4.236340636240133,
        -0.7201501640698501,
        -1.0584993600538135,
    ),
    "ggl_vi_mod": (
        0.1889919158785544,
        0.2741804934464102,
        -0.9429247651568159,
        -4.13132481017006,
        -0.7022981613939238,
        -1.0322599250707587,
    ),
    "livens": (
        0.31296694197813846,
        0.30083777034190234,
        -0.9008597721979628,
        -3.967927473754718,
        -0.6189230493752196,
        -1.5960434055810029,
    ),
}
"""q and p after 10 steps of 0.05 s: published pendulum of metis (github.com/plkinon/metis, commit 127b1aa, input for Nonlinear Dyn. 2023),
by its classes GGL_VI, GGL_VI_mod and EML, run in Octave 7.3 with Newton's iteration ended at round-off."""

METIS_FOUR_PARTICLES = (
    0.002374576895802437,
    6.214064226295975e-05,
    1.7466772569159433e-06,
    0.9991372689306638,
    0.08041733753792286,
    0.002680944183198349,
    0.0030200688545677407,
    1.0000354556865798,
    4.460331125563904e-05,
    0.996039681145118,
    1.0344731168616672,
    0.11285460773956474,
)
"""The same of its four particles after 10 steps of 0.01 s by GGL_VI: q."""


@cache
def metis_pendulum():
    q, p = coordinates(3)
    U = sp.Rational(981, 100) * q[2]
    return _ivp(
        ConstrainedHamiltonian(q=q, p=p, M=sp.eye(3), U=U, g=[sum(x**2 for x in q) - 1], cases={"a": Case(q=(1, 0, 0), p=(0, 1, 0))})
    )


@cache
def metis_four_particles():
    q, p = coordinates(12)
    x = [sp.Matrix(q[3 * k : 3 * k + 3]) for k in range(4)]
    between = {(a, b): (x[a] - x[b]).dot(x[a] - x[b]) - 1 for a, b in ((1, 0), (3, 2), (2, 0), (3, 1))}
    M = sp.diag(*(mass for mass in (1, 3, sp.Rational(23, 10), sp.Rational(17, 10)) for _ in range(3)))
    U = 25 * between[2, 0] ** 2 + 250 * between[3, 1] ** 2
    case = Case(q=(0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0), p=(0,) * 10 + (3, 2))
    return _ivp(ConstrainedHamiltonian(q=q, p=p, M=M, U=U, g=[between[1, 0], between[3, 2]], cases={"a": case}))


def _ivp(problem):
    return make_ivp(source_of(problem, "metis"), "a")


@pytest.mark.parametrize("name", METIS)
def test_the_pendulum_of_metis_is_met_to_round_off(name):
    trajectory = run(name, metis_pendulum(), 0.05, 10)
    assert error_of(np.concatenate([trajectory.q[-1], trajectory.p[-1]]), METIS[name]) < 1e-13


@pytest.mark.exhaustive
def test_four_particles_of_metis_are_met_to_round_off():
    assert error_of(run("ggl_vi", metis_four_particles(), 0.01, 10).q[-1], METIS_FOUR_PARTICLES) < 1e-14


def test_ggl_vi_keeps_the_two_form_of_p_and_the_position_before():
    where = ivp("spherical-fast")
    X = tangent_basis(where, where.p0, where.q0)
    defects = []
    for n in (2, 10, 30):
        before, after = (linearisation(method("ggl_vi").flow(where, 0.01, k), where.p0, where.q0, X).value for k in (n - 1, n))
        assert two_form_change(np.concatenate([after[: where.d], before[where.d :]]), X) < 1e-13
        defects.append(two_form_change(after, X))
    assert min(defects) > 1e-5
    assert max(defects) < 3 * min(defects)  # that of a state does not grow with the steps


def test_ggl_vi_mod_has_tangent_momenta_on_spheres_alone():
    off = {name: run("ggl_vi_mod", name, 0.01, 60).maxima["Gv"] for name in ("spherical-fast", "double-pendulum")}
    assert off["spherical-fast"] < 1e-13
    assert off["double-pendulum"] > 1e-5


def lost(where, h, steps):
    """Return how far E = p.v - L(q, v), with the velocities of the scheme, and H(p, q) are off along a run."""
    path = run("livens", where, h, steps)
    v = [where.along("H_p", path.p[:1], path.q[:1])[0]]
    for dq in np.diff(path.q, axis=0):
        v.append(2 / h * dq - v[-1])
    H, v_of_p = where.along("H", path.p, path.q), where.along("H_p", path.p, path.q)
    U = H - np.sum(path.p * v_of_p, axis=1) / 2
    E = np.sum(path.p * v, axis=1) - np.einsum("ni,nij,nj->n", v, where.along("mass", path.p, path.q), v) / 2 + U
    return error_of(E, E[0]), error_of(H, H[0])


def test_livens_keeps_the_energy_of_its_three_fields_and_h_to_fourth_order():
    E, H = zip(*(lost(ivp("stretched-M"), 0.1 / k, 30 * k) for k in (1, 2)), strict=True)
    assert max(E) < 1e-14
    assert 14 < H[0] / H[1] < 18


@pytest.mark.exhaustive
def test_livens_is_the_scheme_of_gonzalez_where_the_mass_is_constant():
    livens, gonzalez = (run(name, "double-pendulum", 0.02, 40) for name in ("livens", "energy_momentum"))
    assert error_of(livens.q, gonzalez.q) < 1e-13
