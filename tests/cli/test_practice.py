"""What practitioners use: generalized-alpha, the energy-momentum scheme, and RATTLE one constraint at a time."""

from functools import cache

import numpy as np
import pytest
import sympy as sp
from ivps import IVPS, ivp, swept
from refusals import refused
from scipy.integrate import solve_ivp

from daebench.compiler.definition import source_of
from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.energy_verdict import energy_error
from daebench.diagnostics.order import fit_order
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates

EPS = 2.0**-52
UP = np.array([0.0, 0.0, 1.0])
TIED = ("spherical-fast", "planar", "double-pendulum", "coupled-rods")


def run(name, where, h, steps, *, compiled=False, options=None, **more):
    method = FixedStep(name, options=options or {}, compiled=compiled)
    return method.solve(where, Request(value=h, steps=steps, **more)).complete()


@cache
def on_bowl(case):
    """Bead on a quartic surface of revolution in a potential that is no polynomial, so that both discrete derivatives are corrected."""
    q, p = coordinates(3)
    x, y, z = q
    bowl = ConstrainedHamiltonian(
        q=q,
        p=p,
        M=sp.eye(3),
        U=sp.cos(2 * z) + 3 * (x**2 + y**2) ** 2,
        g=[x**2 + y**2 + z**4 - 1],
        cases={"rest": Case(q=(0.6, 0, -sp.sqrt(0.8)), p=(0, 0, 0)), "go": Case(q=(0.6, 0, -sp.sqrt(0.8)), p=(0, 1, 0))},
        integrals={"L3": x * p[1] - y * p[0]},
    )
    return make_ivp(source_of(bowl, "bowl"), case)


# ---- generalized-alpha ---------------------------------------------------------------------------------------------------


def acceleration(q, v):
    """Acceleration of a unit pendulum off the sphere too: -up - lam q with lam from q.q'' = -v.v."""
    return -UP - q * (v @ v - UP @ q) / (q @ q)


def generalized_alpha_on_the_sphere(q, v, h, steps, rho):
    """The scheme of Chung and Hulbert on the unit sphere in closed form: q1 is u/|u| for what q1 would be if lam were zero."""
    alpha_m, alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
    gamma = 0.5 + alpha_f - alpha_m
    beta = (gamma + 0.5) ** 2 / 4
    rate = acceleration(q, v)
    jump = acceleration(q + h * v, v + h * rate) - rate
    a = rate + (alpha_m - alpha_f) * jump
    v = v + (1 / 6 - beta - (alpha_m - alpha_f) / 2) * h * q * (q @ jump)
    lam = []
    for _ in range(steps):
        known = (alpha_f * rate - alpha_m * a) / (1 - alpha_m)
        w = h * h * beta * (1 - alpha_f) / (1 - alpha_m)
        u = q + h * v + h * h * ((0.5 - beta) * a + beta * known) - w * UP
        q = u / np.linalg.norm(u)
        lam.append((np.linalg.norm(u) - 1) / (2 * w))
        rate = -UP - 2 * lam[-1] * q
        a, before = known + (1 - alpha_f) / (1 - alpha_m) * rate, a
        v = v + h * ((1 - gamma) * before + gamma * a)
    return q, v, lam


def energy_momentum_on_the_sphere(q, p, h, steps):
    """The energy-momentum scheme on the unit sphere, where all is quadratic and lam solves a linear equation."""
    lam = []
    for _ in range(steps):
        free = q + h * p - h * h / 2 * UP
        k = (free @ free - 1) / (2 * (1 + free @ q))  # h^2 lam / 2
        q, before = (free - k * q) / (1 + k), q
        p = 2 * (q - before) / h - p
        lam.append(2 * k / h**2)
    return q, p, lam


CLOSED = {
    "generalized_alpha": (generalized_alpha_on_the_sphere, {}, (0.8,), "lam_n", 1.0),
    **{f"rho={rho}": (generalized_alpha_on_the_sphere, {"rho_inf": rho}, (rho,), "lam_n", 1.0) for rho in (0.0, 0.6, 0.9)},
    "energy_momentum": (energy_momentum_on_the_sphere, {}, (), "lam_mid", 0.5),
}
"""Schemes with a closed form on the sphere, their options, those of the form, and where in the step their multiplier belongs."""


@pytest.mark.parametrize(("form", "options", "numbers", "multiplier", "part"), CLOSED.values(), ids=CLOSED)
def test_a_scheme_is_its_closed_form_on_the_sphere(form, options, numbers, multiplier, part):
    where = ivp("spherical-fast")
    found = run(form.__name__.removesuffix("_on_the_sphere"), where, 0.02, 50, options=options, raw=True)
    q, p, lam = form(where.q0, where.p0, 0.02, 50, *numbers)
    assert np.abs(found.q[-1] - q).max() < 1e-12
    assert np.abs(found.p[-1] - p).max() < 1e-11
    times, values = found.raw[multiplier]
    assert np.allclose(times, 0.02 * (np.arange(50) + part), rtol=1e-14)
    assert np.abs(values[:, 0] - lam).max() < 1e-9  # g is rounded by eps, lam by eps/h^2


@pytest.mark.parametrize("rho", [0.0, 0.6, 0.8, 1.0])
def test_the_numbers_of_chung_and_hulbert_are_those_of_order_2_that_damp_the_stiffest_spring_by_rho_a_step(rho):
    """It ties q to 0: h v, h^2 a and h^2 v' of a step then follow from those before by a matrix, of which each eigenvalue is -rho."""
    alpha_m, alpha_f, beta, gamma = FixedStep("generalized_alpha", options={"rho_inf": rho}).data[0]
    a = np.array([-1, beta - 0.5, 0]) / beta
    rate = ((1 - alpha_m) * a + [0, alpha_m, -alpha_f]) / (1 - alpha_f)
    assert np.poly(np.array([gamma * a + [1, 1 - gamma, 0], a, rate])) == pytest.approx(np.poly([-rho] * 3), abs=1e-13)
    assert gamma == pytest.approx(0.5 + alpha_f - alpha_m, abs=1e-15)


def multiplier_errors(name, options, n):
    """Return the errors of the multipliers of n steps to t = 0.5, the motion being that of SciPy."""
    where = ivp("spherical-fast")
    ((t, lam),) = run(name, where, 0.5 / n, n, options=options, raw=True).raw.values()
    settings = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14, "t_eval": t}
    x = solve_ivp(lambda _, x: [*x[3:], *acceleration(x[:3], x[3:])], (0, 0.5), [*where.q0, *where.p0], **settings).y
    return lam[:, 0] - (np.sum(x[3:] ** 2, axis=0) - x[2]) / 2


MULTIPLIERS = {
    **{f"rho={rho}": ("generalized_alpha", {"rho_inf": rho}, slice(None), 2) for rho in (0.0, 0.6, 0.8)},
    **{f"rho={rho}, first steps": ("generalized_alpha", {"rho_inf": rho}, slice(8), 2) for rho in (0.0, 0.6, 0.8)},
    "no damping": ("generalized_alpha", {"rho_inf": 1.0}, slice(None), 1),
    "energy-momentum": ("energy_momentum", {}, slice(None), 1),
    "energy-momentum, means of two": ("energy_momentum", {}, None, 2),
}


@pytest.mark.parametrize(("name", "options", "part", "order"), MULTIPLIERS.values(), ids=MULTIPLIERS)
def test_a_multiplier_has_the_order_that_is_said(name, options, part, order):
    counts = np.array([64, 128, 256, 512])
    found = [multiplier_errors(name, options, n) for n in counts]
    errors = [np.abs(e[part] if part else (e[1:] + e[:-1]) / 2).max() for e in found]
    assert fit_order(1 / counts, errors).slope == pytest.approx(order, abs=0.15)


def test_generalized_alpha_damps_and_the_less_the_larger_rho_is():
    where = ivp("planar")
    runs = [run("generalized_alpha", where, 0.02, 2500, options={"rho_inf": rho}) for rho in (0.2, 0.5)]
    drifts = [energy_drift(found.t, energy_error(where, found)) for found in runs]
    assert drifts[0].slope < 4 * drifts[1].slope < 0
    assert all(drift.slope < -8 * drift.slope_error for drift in drifts)


# ---- the energy-momentum scheme ------------------------------------------------------------------------------------------


def test_energy_momentum_solves_its_equations_where_both_derivatives_are_corrected():
    h = 0.1
    found = run("energy_momentum", on_bowl("go"), h, 5, raw=True)
    (q0, q1), (p0, p1), lam = found.q[-2:], found.p[-2:], found.raw["lam_mid"][1][-1, 0]

    def U(q):
        return np.cos(2 * q[2]) + 3 * (q[0] ** 2 + q[1] ** 2) ** 2

    def g(q):
        return q[0] ** 2 + q[1] ** 2 + q[2] ** 4 - 1

    x, y, z = (q0 + q1) / 2
    dq = q1 - q0
    U_q = np.array([12 * x * (x * x + y * y), 12 * y * (x * x + y * y), -2 * np.sin(2 * z)])
    G = np.array([2 * x, 2 * y, 4 * z**3])
    extra = [U(q1) - U(q0) - U_q @ dq, g(q1) - g(q0) - G @ dq]
    D_U, DG = (gradient + e * dq / (dq @ dq) for gradient, e in zip((U_q, G), extra, strict=True))
    assert min(map(abs, extra)) > 1e-7
    assert np.abs(dq - h * (p0 + p1) / 2).max() < 2e-15
    assert np.abs(p1 - p0 + h * (D_U + lam * DG)).max() < 1e-13
    assert abs(g(q1)) < 4 * EPS


@pytest.mark.parametrize("case", ["go", "rest"])
@pytest.mark.parametrize("h", [0.1, 1e-2, 1e-4, 1e-6], ids=str)
def test_energy_is_kept_to_round_off_whatever_h_is_and_from_rest(case, h):
    where = on_bowl(case)
    found = run("energy_momentum", where, h, 300)
    assert found.maxima["energy"] < 1e-13
    assert found.maxima["g"] < 1e-14
    exact = run("rattle", where, h, 300)
    assert np.abs(found.q[-1] - exact.q[-1]).max() < 1e-12 + 40 * h**2


KEPT = {"quadratic": ("energy_momentum", "spherical-fast"), "corrected": ("energy_momentum", "go"), "rattle": ("rattle", "go")}


@pytest.mark.parametrize(("name", "place"), KEPT.values(), ids=KEPT)
def test_angular_momentum_is_kept_where_all_is_quadratic_and_not_otherwise(name, place):
    where = on_bowl(place) if place == "go" else ivp(place)
    off = run(name, where, 0.01, 300, watch=("integrals",)).maxima["L3"]
    assert off > 1e-7 if (name, place) == KEPT["corrected"] else off < 1e-13


# ---- RATTLE one constraint at a time -------------------------------------------------------------------------------------


RATTLES = (("rattle_gauss_seidel", {"tolerance": 1e-15}), ("rattle", {}))


@pytest.mark.parametrize("place", TIED)
def test_with_the_smallest_tolerance_one_at_a_time_agrees_with_rattle(place):
    loose, newton = (run(name, ivp(place), 0.01, 50, options=options, raw=True) for name, options in RATTLES)
    assert np.abs(loose.q - newton.q).max() < 1e-14 * 50
    assert np.abs(loose.p - newton.p).max() < 4e-14 * 50
    for kind in ("lam_n", "mu_n"):
        assert np.abs(loose.raw[kind][1] - newton.raw[kind][1]).max() < 64 * EPS / 0.01**2


@pytest.mark.sampled(left_out=("andrews_squeezer", "butane"))
@pytest.mark.parametrize("place", swept([name for name in IVPS if not name.startswith(("stretched", "relativistic", "double_wishbone"))]))
def test_what_the_tolerance_adds_to_the_error_of_rattle_is_of_its_size(place):
    if why := FixedStep("rattle_gauss_seidel").refusal(ivp(place)):
        pytest.skip(why)
    rattle = run("rattle", ivp(place), 0.002, 250)
    for tolerance in (1e-6, 1e-12):
        found = run("rattle_gauss_seidel", ivp(place), 0.002, 250, options={"tolerance": tolerance})
        assert max(np.abs(found.q[-1] - rattle.q[-1]).max(), np.abs(found.p[-1] - rattle.p[-1]).max()) < 40 * tolerance


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9], ids=str)
def test_the_tolerance_is_met_and_not_more_than_that(tolerance):
    where = ivp("double-pendulum")
    found = run("rattle_gauss_seidel", where, 0.01, 100, options={"tolerance": tolerance})
    q, v = found.q, found.p / np.array([1, 1, 2, 2])
    r, w = q[:, 2:] - q[:, :2], v[:, 2:] - v[:, :2]
    g = np.abs([np.sum(q[:, :2] ** 2, axis=1) - 1, np.sum(r**2, axis=1) - 1])
    Gv = np.abs(2 * np.array([np.sum(q[:, :2] * v[:, :2], axis=1), np.sum(r * w, axis=1)]))
    sizes = [2 * np.sum(q[:, :2] ** 2, axis=1), 2 * np.sum(np.abs(r) * (np.abs(q[:, :2]) + np.abs(q[:, 2:])), axis=1)]
    assert np.all(g <= 1.2 * tolerance * np.array(sizes))  # sizes are taken before the correction, which moves q a little
    assert tolerance / 10 < max(g.max(), Gv.max()) < 40 * tolerance


@pytest.mark.parametrize(("h", "why"), [(1.0, "rounds"), (1e200, "finite")], ids=["no solution", "overflow"])
def test_constraints_that_cannot_be_met_are_said(h, why):
    found = FixedStep("rattle_gauss_seidel", compiled=False).solve(ivp("double-pendulum"), Request(value=h, steps=3))
    assert why in found.failure
    assert np.all(np.isfinite(found.q))


# ---- all three -----------------------------------------------------------------------------------------------------------


REFUSALS = {"generalized_alpha": "relativistic", "energy_momentum": "relativistic", "rattle_gauss_seidel": "stretched-M"}


@pytest.mark.parametrize(("name", "place"), REFUSALS.items(), ids=REFUSALS)
def test_a_problem_that_does_not_fit_is_refused_with_a_sentence(name, place):
    with refused("method-refuses-problem"):
        run(name, ivp(place), 0.01, 1)


def test_a_state_at_rest_in_equilibrium_stays_there():
    q, p = coordinates(2)
    hanging = ConstrainedHamiltonian(
        q=q, p=p, M=sp.eye(2), U=q[1] + q[1] ** 4, g=[q[0] ** 2 + q[1] ** 2 - 1], cases={"still": Case(q=(0, -1), p=(0, 0))}
    )
    for name in ("energy_momentum", "generalized_alpha"):
        found = run(name, make_ivp(source_of(hanging, "hanging"), "still"), 0.1, 5)
        assert np.array_equal(found.q[-1], [0, -1])
        assert np.abs(found.p[-1]).max() < 1e-14
