"""Lobatto IIIA-IIIB and Radau IIA for constrained systems: orders, multipliers apart, structure, and how far they can be solved."""

from functools import cache

import numpy as np
import pytest
import uncompiled
from ivps import ivp
from oracles import solution
from refusals import refused
from scipy.optimize import fsolve
from tallied import tally

from daebench.diagnostics.order import fit_order
from daebench.diagnostics.reversibility import reversibility_defect
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis
from daebench.errors import RunFailed
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.problems.spherical_pendulum import closed_form
from daebench.runs.request import Request
from daebench.schemes.kernels.tableaux import lobatto_iiia

T = 0.5
LOBATTO = [f"lobatto{s}" for s in range(2, 7)]
RADAU = ["radau2_index2", "radau2_ggl", "radau3_index2", "radau3_ggl"]
COUNTS = {
    "lobatto2": (64, 128, 256, 512),
    "lobatto3": (16, 24, 32, 48),
    "lobatto4": (8, 12, 16, 24),
    "lobatto5": (6, 8, 12, 16),
    "lobatto6": (4, 5, 6, 8),
} | dict.fromkeys(RADAU, (24, 32, 48, 64))
GENERAL = ["stretched-M", "stretched-H", "relativistic"]


def run(name, where, h, steps, **more):
    return FixedStep(name, compiled=False).solve(where, Request(value=h, steps=steps, **more)).complete()


@cache
def exact(t):
    """State of the fast spherical pendulum by elliptic functions, and its multiplier from q.q'' = -v.v with q'' = -e3 - 2 lam q."""
    where = ivp("spherical-fast")
    q, p = (np.array(part, dtype=float) for part in closed_form(t, list(where.q0), list(where.p0), where.parameters))
    return q, p, (p @ p - q[2]) / 2


@cache
def errors(name):
    """Errors on the fast spherical pendulum after T, by the number of steps: of q and p, and of each stage multiplier of the last step."""
    found = {}
    for n in COUNTS[name]:
        last = run(name, ivp("spherical-fast"), T / n, n, raw=True, watch=())
        q, p, _ = exact(T)
        each = {"q": np.abs(last.q[-1] - q).max(), "p": np.abs(last.p[-1] - p).max()}
        for kind, (t, value) in last.raw.items():
            each[kind] = abs(value[-1, 0] - (0.0 if kind.startswith("mu_") and name in RADAU else exact(t[-1])[2]))
        for kind, error in each.items():
            found.setdefault(kind, []).append(error)
    return found


def slope(name, kind):
    return fit_order([T / n for n in COUNTS[name]], errors(name)[kind]).slope


@pytest.mark.parametrize("name", LOBATTO + RADAU, ids=str)
def test_q_and_p_are_each_of_the_order_that_is_claimed(name):
    order = FixedStep(name, compiled=False).claims.order
    assert order == (2 * int(name[-1]) - 2 if name in LOBATTO else 2 * int(name[5]) - 1)
    assert abs(slope(name, "q") - order) < 0.1, errors(name)
    assert abs(slope(name, "p") - order) < 0.1, errors(name)


@pytest.mark.sampled(left_out=("lobatto4-relativistic", "lobatto5-stretched-M", "radau2_index2-stretched-H", "radau3_ggl-stretched-H"))
@pytest.mark.parametrize(("name", "place"), [(name, GENERAL[number % 3]) for number, name in enumerate(LOBATTO[:4] + RADAU)], ids=str)
def test_the_order_is_the_same_for_any_hamiltonian(name, place):
    counts = (16, 24, 32, 48) if name in ("lobatto2", *RADAU[:2]) else (3, 4, 6, 8)
    q, p = solution(place, 1.0)
    runs = [run(name, ivp(place), 1.0 / n, n, watch=()) for n in counts]
    fit = fit_order([1.0 / n for n in counts], [max(np.abs(r.q[-1] - q).max(), np.abs(r.p[-1] - p).max()) for r in runs])
    assert abs(fit.slope - FixedStep(name, compiled=False).claims.order) < 0.25, fit


def test_the_stages_multipliers_of_lobatto_are_of_order_s_minus_1():
    for s, name in zip((3, 4, 5), LOBATTO[1:4], strict=True):
        for i in range(s):
            assert abs(slope(name, f"Lam_{i + 1}") - (s - 1)) < 0.15, (name, i, errors(name))


def test_the_mean_of_the_multipliers_that_meet_is_of_the_next_even_order():
    assert abs(slope("lobatto2", "mean") - 2) < 0.05
    assert abs(slope("lobatto3", "mean") - 2) < 0.05
    assert slope("lobatto4", "mean") > 3.9
    assert abs(slope("lobatto5", "mean") - 4) < 0.15


def test_the_multipliers_of_radau_are_of_order_s():
    for kind in ("Lam_1", "Lam_2", "Lam_3"):
        assert abs(slope("radau3_index2", kind) - 3) < 0.05
    for kind in ("mu_1", "mu_2", "mu_3"):
        assert abs(slope("radau3_ggl", kind) - 3) < 0.05


@pytest.mark.parametrize("place", ["spherical-fast", "stretched-H", "coupled-rods"])
def test_two_stages_are_rattle(place):
    """Multipliers that follow from g = 0 are uncertain by eps/h^2 = 2e-12."""
    by_two, by_rattle = (run(name, ivp(place), 0.01, 50, raw=True) for name in ("lobatto2", "rattle"))
    assert np.abs(by_two.q - by_rattle.q).max() < 2e-15
    assert np.abs(by_two.p - by_rattle.p).max() < 1e-14
    assert by_two.raw.keys() == by_rattle.raw.keys() == {"lam_n", "mu_n", "mean"}
    for kind, (t, values) in by_two.raw.items():
        assert np.array_equal(t, by_rattle.raw[kind][0])
        assert np.abs(values - by_rattle.raw[kind][1]).max() < 2e-11


LARGE = {"spherical-fast": 0.1, "stretched-M": 0.4, "relativistic": 0.4, "double-pendulum": 0.15, "coupled-rods": 0.1}


AT_LARGE = [*zip(LOBATTO, LARGE, strict=True), ("lobatto6", "spherical-fast"), ("lobatto3", "coupled-rods")]


@pytest.mark.sampled(by=("lobatto3-stretched-M", "lobatto4-relativistic", "lobatto3-coupled-rods").__contains__)
@pytest.mark.parametrize(("name", "place"), AT_LARGE, ids=str)
def test_lobatto_is_symplectic_reversible_and_on_the_manifold_at_large_steps(name, place):
    where, h = ivp(place), LARGE[place]
    flow = FixedStep(name, compiled=False).flow(where, h, 2)
    assert symplecticity_defect(flow, where.p0, where.q0, tangent_basis(where, where.p0, where.q0)) < 2e-14
    assert reversibility_defect(flow, where.p0, where.q0) < 2e-14
    maxima = run(name, where, h, 5).maxima
    assert max(maxima["g"], maxima["Gv"]) < 2e-14


# ---- how far the equations can be solved ---------------------------------------------------------------------------------

REACH = {"rattle": 0.13, "lobatto2": 0.13, "lobatto3": 0.30, "lobatto4": 0.42, "lobatto5": 0.50, "lobatto6": 0.64}
"""Steps of fig1.2 that are solved; the solution ends at 0.139, 0.380, 0.459, 0.733 and 0.778 by continuation of the equations."""


@pytest.mark.parametrize("name", REACH, ids=str)
def test_a_step_is_solved_far_up_to_where_the_equations_lose_their_solution(name):
    assert run(name, initial_value_problem("spherical_pendulum", "fig1.2"), REACH[name], 1).maxima["g"] < 1e-14


def test_a_step_without_a_solution_is_an_error_that_says_so():
    with refused("run-stopped-early", RunFailed):
        run("lobatto3", initial_value_problem("spherical_pendulum", "fig1.2"), 0.5, 3)


# ---- work ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["lobatto3", "radau3_ggl"])
def test_work_is_what_an_independent_tally_counts_for_any_hamiltonian(name, monkeypatch):
    where, method, request = ivp("stretched-H"), FixedStep(name, compiled=False), Request(value=0.01, steps=5, watch=())
    counted = method.solve(where, request).work
    assert counted == tally(monkeypatch, method, where, request)


def test_no_second_derivatives_are_derived_where_h_is_separable():
    kernel = uncompiled.kernel(FixedStep("lobatto4"), ivp("spherical-fast"), "float64", (), count=False)
    assert not {"H_qp", "H_qq", "curvature", "Gv_q", "a_p"} & set(vars(kernel))


@pytest.mark.sampled(left_out=("radau2_ggl",))
@pytest.mark.slow
@pytest.mark.parametrize("name", ["lobatto3", "radau2_ggl"])
def test_machine_code_does_what_the_files_say_where_the_mass_depends_on_q(name, monkeypatch):
    place = "stretched-M"
    request = Request(value=0.02, steps=20)
    fast = FixedStep(name).solve(ivp(place), request).complete()
    monkeypatch.setattr(FixedStep, "kernel", uncompiled.kernel)
    slow = FixedStep(name).solve(ivp(place), request).complete()
    assert fast.work == slow.work
    assert np.abs(fast.q - slow.q).max() < 1e-14
    assert np.abs(fast.p - slow.p).max() < 1e-14


@pytest.mark.parametrize(
    ("name", "h", "own"),
    [
        ("lobatto3", 0.4, True),
        ("lobatto4", 0.5, True),
        ("radau2_ggl", 0.3, True),
        ("radau3_index2", 0.34, True),
        ("gauss2", 0.34, True),
        ("midpoint", 0.25, True),
        ("lobatto2", 0.15, False),
        ("rattle", 0.15, False),
    ],
)
def test_a_failure_says_whether_it_is_the_iteration_that_ends(name, h, own):
    """Steps are so large that the iteration does not contract: one that contracts slowly goes on for up to a thousand rounds."""
    done = FixedStep(name, compiled=False).solve(
        initial_value_problem("spherical_pendulum", "fig1.2"), Request(value=h, t_end=20.0, watch=())
    )
    assert done.failure is not None
    assert ("this is the limit of the iteration, which omits derivatives" in done.failure) == own


@pytest.mark.sampled(by=lambda case: case == "3-relativistic")
@pytest.mark.parametrize("place", ["spherical-fast", "relativistic", "coupled-rods"])
@pytest.mark.parametrize("s", [2, 3])
def test_lobatto_is_the_discontinuous_collocation_of_the_book(place, s):
    """Polynomials u of degree s, v of degree s - 2 and w of degree s - 1 as in (1.27)-(1.30), solved for by SciPy."""
    where, h = ivp(place), 0.05
    p0, q0 = where.p0, where.q0
    d, m = len(q0), len(where.value("g", q0))
    b, c = np.array(lobatto_iiia(s).b), np.array(lobatto_iiia(s).c)
    powers = np.vander(c, s, increasing=True)
    to_u = np.linalg.inv(powers)
    v_nodes = np.vander(c, s - 1, increasing=True)
    v_slopes = np.array([[k * x ** max(k - 1, 0) for k in range(s - 1)] for x in c])

    def unpacked(x):
        return x[: s * d].reshape(s, d), x[s * d : (2 * s - 1) * d].reshape(s - 1, d), x[(2 * s - 1) * d :].reshape(s, m)

    def equations(x):
        U, V, W = unpacked(x)
        slope = to_u @ U
        u = np.array([q0 + h * sum(slope[k] * t ** (k + 1) / (k + 1) for k in range(s)) for t in c])
        v, dv = v_nodes @ V, v_slopes @ V / h
        delta = np.array([dv[i] + where.value("H_q", v[i], u[i]) + where.value("G", u[i]).T @ W[i] for i in range(s)])
        p1 = v[-1] - h * b[-1] * delta[-1]
        rows = [U[i] - where.value("H_p", v[i], u[i]) for i in range(s)]
        rows += [v[0] - p0 + h * b[0] * delta[0], *delta[1:-1]]
        rows += [where.value("g", u[i]) / h for i in range(1, s)]
        rows += [where.value("G", u[-1]) @ where.value("H_p", p1, u[-1])]
        return np.concatenate(rows), u[-1], p1

    v0 = where.value("H_p", p0, q0)
    start = np.concatenate([np.tile(v0, s), p0, np.zeros((s - 2) * d), np.zeros(s * m)])
    x = fsolve(lambda x: equations(x)[0], start, xtol=1e-13)
    residual, q1, p1 = equations(x)
    assert np.abs(residual).max() < 1e-10
    found = np.concatenate(FixedStep(f"lobatto{s}", compiled=False).flow(where, h, 1)(p0, q0))
    assert np.abs(np.concatenate([p1, q1]) - found).max() < 1e-10 * max(1.0, np.abs(p0).max())
