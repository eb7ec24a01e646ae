"""Lobatto IIIA-IIIB and Radau IIA for constrained systems: orders, multipliers apart, structure, and how far they can be solved."""

from functools import cache

import numpy as np
import pytest
import uncompiled
from ivps import ivp
from measures import error_of
from runs import defects, method, run, state_error
from scipy.optimize import fsolve
from tallied import tally

from daebench.diagnostics.order import fit_order
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
        last = run(name, "spherical-fast", T / n, n, raw=True, watch=())
        q, p, _ = exact(T)
        each = {"q": error_of(last.q[-1], q), "p": error_of(last.p[-1], p)}
        for kind, (t, value) in last.raw.items():
            each[kind] = abs(value[-1, 0] - (0.0 if kind.startswith("mu_") and name in RADAU else exact(t[-1])[2]))
        for kind, error in each.items():
            found.setdefault(kind, []).append(error)
    return found


def slope(name, kind):
    return fit_order([T / n for n in COUNTS[name]], errors(name)[kind]).slope


@pytest.mark.parametrize("name", LOBATTO + RADAU, ids=str)
def test_q_and_p_are_each_of_the_order_that_is_claimed(name):
    order = method(name).claims.order
    assert order == (2 * int(name[-1]) - 2 if name in LOBATTO else 2 * int(name[5]) - 1)
    assert abs(slope(name, "q") - order) < 0.1, errors(name)
    assert abs(slope(name, "p") - order) < 0.1, errors(name)


GENERAL = ("stretched-M", "stretched-H", "relativistic")


@pytest.mark.sampled(left_out=("lobatto4-relativistic", "lobatto5-stretched-M", "radau2_index2-stretched-H", "radau3_ggl-stretched-H"))
@pytest.mark.parametrize(("name", "place"), [(name, GENERAL[number % 3]) for number, name in enumerate(LOBATTO[:4] + RADAU)], ids=str)
def test_the_order_is_the_same_for_any_hamiltonian(name, place):
    counts = (16, 24, 32, 48) if name in ("lobatto2", *RADAU[:2]) else (3, 4, 6, 8)
    fit = fit_order([1 / n for n in counts], [state_error(name, place, n, T=1.0) for n in counts])
    assert abs(fit.slope - method(name).claims.order) < 0.25, fit


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
    by_two, by_rattle = (run(name, place, 0.01, 50, raw=True) for name in ("lobatto2", "rattle"))
    assert error_of(by_two.q, by_rattle.q) < 2e-15
    assert error_of(by_two.p, by_rattle.p) < 1e-14
    assert by_two.raw.keys() == by_rattle.raw.keys() == {"lam_n", "mu_n", "mean"}
    for kind, (t, values) in by_two.raw.items():
        assert np.array_equal(t, by_rattle.raw[kind][0])
        assert error_of(values, by_rattle.raw[kind][1]) < 2e-11


LARGE = {"spherical-fast": 0.1, "stretched-M": 0.4, "relativistic": 0.4, "double-pendulum": 0.15, "coupled-rods": 0.1}
AT_LARGE = [*zip(LOBATTO, LARGE, strict=True), ("lobatto6", "spherical-fast"), ("lobatto3", "coupled-rods")]


@pytest.mark.sampled(by=("lobatto3-stretched-M", "lobatto4-relativistic", "lobatto3-coupled-rods").__contains__)
@pytest.mark.parametrize(("name", "place"), AT_LARGE, ids=str)
def test_lobatto_is_symplectic_reversible_and_on_the_manifold_at_large_steps(name, place):
    maxima = run(name, place, LARGE[place], 5).maxima
    assert max(*defects(name, place, LARGE[place], 2), maxima["g"], maxima["Gv"]) < 2e-14


# ---- how far the equations can be solved ---------------------------------------------------------------------------------

REACH = {"rattle": 0.13, "lobatto2": 0.13, "lobatto3": 0.30, "lobatto4": 0.42, "lobatto5": 0.50, "lobatto6": 0.64}
"""Steps of fig1.2 that are solved; the solution ends at 0.139, 0.380, 0.459, 0.733 and 0.778 by continuation of the equations."""


@pytest.mark.parametrize("name", REACH, ids=str)
def test_a_step_is_solved_far_up_to_where_the_equations_lose_their_solution(name):
    assert run(name, initial_value_problem("spherical_pendulum", "fig1.2"), REACH[name], 1).maxima["g"] < 1e-14


# ---- work ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["lobatto3", "radau3_ggl"])
def test_work_is_what_an_independent_tally_counts_for_any_hamiltonian(name, monkeypatch):
    where, scheme, request = ivp("stretched-H"), method(name), Request(value=0.01, steps=5, watch=())
    assert scheme.solve(where, request).work == tally(monkeypatch, scheme, where, request)


def test_no_second_derivatives_are_derived_where_h_is_separable():
    kernel = uncompiled.kernel(method("lobatto4"), ivp("spherical-fast"), "float64", (), count=False)
    assert not {"H_qp", "H_qq", "curvature", "Gv_q", "a_p"} & set(vars(kernel))


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
    done = method(name).solve(initial_value_problem("spherical_pendulum", "fig1.2"), Request(value=h, t_end=20.0, watch=()))
    assert done.failure is not None
    assert ("limit of the iteration" in done.failure) == own


@pytest.mark.sampled(by=lambda case: case == "3-relativistic")
@pytest.mark.parametrize("place", ["spherical-fast", "relativistic", "coupled-rods"])
@pytest.mark.parametrize("s", [2, 3])
def test_lobatto_is_the_discontinuous_collocation_of_the_book(place, s):
    """Polynomials u of degree s, v of degree s - 2 and w of degree s - 1 as in (1.27)-(1.30), solved for by SciPy."""
    where, h = ivp(place), 0.05
    (p0, q0), (b, c) = where.start, (np.array(part) for part in (lobatto_iiia(s).b, lobatto_iiia(s).c))
    d, m, power = len(q0), where.m, np.arange(s)
    H_p, H_q, G = (lambda *x, name=name: where.value(name, *x) for name in ("H_p", "H_q", "G"))
    to_u = np.linalg.inv(np.vander(c, s, increasing=True))
    integral = c[:, None] ** (power + 1) / (power + 1)
    v_slopes = power[:-1] * c[:, None] ** np.maximum(power[:-1] - 1, 0)

    def equations(x):
        U, V, W = (part.reshape(-1, n) for part, n in zip(np.split(x, [s * d, (2 * s - 1) * d]), (d, d, m), strict=True))
        u, v, dv = q0 + h * integral @ to_u @ U, np.vander(c, s - 1, increasing=True) @ V, v_slopes @ V / h
        delta = np.array([dv[i] + H_q(v[i], u[i]) + G(u[i]).T @ W[i] for i in range(s)])
        p1 = v[-1] - h * b[-1] * delta[-1]
        rows = [*(U[i] - H_p(v[i], u[i]) for i in range(s)), v[0] - p0 + h * b[0] * delta[0], *delta[1:-1]]
        rows += [*(where.value("g", u[i]) / h for i in range(1, s)), G(u[-1]) @ H_p(p1, u[-1])]
        return np.concatenate(rows), np.concatenate([p1, u[-1]])

    start = np.concatenate([np.tile(H_p(p0, q0), s), p0, np.zeros((s - 2) * d + s * m)])
    residual, end = equations(fsolve(lambda x: equations(x)[0], start, xtol=1e-13))
    assert np.abs(residual).max() < 1e-10
    found = np.concatenate(method(f"lobatto{s}").flow(where, h, 1)(p0, q0))
    assert error_of(end, found) < 1e-10 * max(1.0, np.abs(p0).max())
