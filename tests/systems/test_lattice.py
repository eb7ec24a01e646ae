"""A Poisson lattice is the same system whether its kernels loop over sites or are written out, and its cost is linear in them."""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from measures import error_of
from poisson_runs import method
from refusals import refused

from daebench.compiler.definition import source_of
from daebench.errors import InvalidProblem
from daebench.methods.fixed_step.poisson import coordinates
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import POISSON, parse
from daebench.problems.ablowitz_ladik import problem
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request
from daebench.systems.lattice import PoissonLattice

SITES, LARGE = 3, 5000
NAMES = ("strang", "strang@UVD", "lie", "lie_adjoint", "rk4", "midpoint", "symplectic_euler", "darboux:verlet", "darboux:midpoint")


@pytest.fixture(scope="module")
def lattice(good):
    return make_ivp(source_of(good, "ablowitz_ladik"), "hlw16")


@pytest.fixture(scope="module")
def good():
    """Return a lattice as it is, to be altered."""
    return problem(sites=SITES)


@pytest.fixture(scope="module")
def written_out(good):
    """The same lattice with a symbol for each coordinate, in straight-line code."""
    return make_ivp(source_of(good.expanded(SITES), "written_out"), "hlw16")


def by_hand(y):
    """Right side, H and the three sums of PROBLEMS, in complex numbers."""
    N = len(y) // 2
    z, dx = y[:N] + 1j * y[N:], 1 / N
    right, left = np.roll(z, -1), np.roll(z, 1)
    rate = 1j * ((right - 2 * z + left) / dx**2 + abs(z) ** 2 * (right + left))
    coupling = np.real(z * np.conj(left)).sum()
    logarithms = np.log1p(dx**2 * abs(z) ** 2).sum()
    momentum = (z.real * right.imag - z.imag * right.real).sum()
    return np.concatenate([rate.real, rate.imag]), coupling / dx**2 - logarithms / dx**4, [logarithms / dx**2, coupling, momentum]


def test_the_field_and_the_integrals_are_those_of_the_book(lattice, random):
    y = random.normal(size=2 * SITES)
    field, H, integrals = by_hand(y)
    assert lattice.value("field", y) == pytest.approx(field, rel=1e-13, abs=1e-12)
    assert lattice.value("H", y) == pytest.approx(H, rel=1e-13)
    assert lattice.value("integrals", y) == pytest.approx(integrals, rel=1e-13)


def test_the_start_of_the_case_is_the_published_one():
    start = initial_value_problem("ablowitz_ladik").y0
    k = np.arange(1, 17)
    u = 0.6 + 0.2 * np.cos(2 * np.pi * k / 16)
    v = 0.3 * np.sin(4 * np.pi * k / 16) + 0.1 * np.sin(2 * np.pi * k / 16)
    assert start == pytest.approx(np.concatenate([u, v]), abs=1e-15)


@pytest.mark.parametrize("name", ["field", "H", "integrals", "B"])
def test_loops_and_straight_lines_are_the_same_functions(name, lattice, written_out, random):
    y = random.normal(size=2 * SITES)
    assert lattice.value(name, y) == pytest.approx(written_out.value(name, y), rel=1e-13, abs=1e-13)


@pytest.mark.sampled(
    left_out=(
        "darboux:midpoint",
        "darboux:verlet",
        "strang@UVD",
    )
)
@pytest.mark.parametrize("name", NAMES, ids=str)
def test_a_step_is_the_same_by_loops_and_by_straight_lines(name, lattice, written_out):
    request = Request(value=2e-3, steps=5, watch=("energy", "integrals"))
    loops, lines = (method(name).solve(where, request).complete() for where in (lattice, written_out))
    assert loops.y == pytest.approx(lines.y, rel=1e-11)
    assert loops.maxima == pytest.approx(lines.maxima, rel=1e-6, abs=1e-11)


@pytest.mark.exhaustive
def test_float32_stays_float32(lattice):
    found = replace(method("strang"), compiled=True).solve(lattice, Request(value=1e-3, steps=50, precision="float32")).complete()
    exact = method("strang").solve(lattice, Request(value=1e-3, steps=50)).complete()
    error = error_of(found.y[-1], exact.y[-1])
    assert 1e-8 < error < 1e-4


@pytest.mark.parametrize("sites", [1, 2])
def test_a_lattice_without_two_neighbours_is_refused(sites):
    with refused("lattice-too-small", InvalidProblem, ["3"]):
        problem(sites=sites)
    with refused("parameter-not-whole", says=["sites"]):
        initial_value_problem("ablowitz_ladik", None, {"sites": sites + 2.5})


def test_functions_along_many_states_of_a_large_lattice_are_loops_too():
    where = initial_value_problem("ablowitz_ladik", None, {"sites": LARGE})
    Y = np.array([where.y0, 0.5 * where.y0])
    rounding = LARGE**2 * np.sum(Y[0] ** 2) * np.finfo(float).eps  # of either sum in H, which nearly cancel
    assert where.along("H", Y) == pytest.approx([by_hand(y)[1] for y in Y], abs=4 * rounding)


def test_solvers_with_the_whole_jacobian_refuse_a_large_lattice():
    large = initial_value_problem("ablowitz_ladik", None, {"sites": LARGE})
    refusals = {name: parse(name, kind=POISSON).refusal(large) for name in ("ida:ode", "cvode:bdf", "scipy:Radau", "scipy:DOP853")}
    assert refusals.pop("scipy:DOP853") is None
    assert all("10000 coordinates" in each for each in refusals.values())


def test_canonical_coordinates_of_a_large_lattice_lose_no_digits():
    where = initial_value_problem("ablowitz_ladik", None, {"sites": LARGE})
    enter, leave = coordinates(where)
    assert error_of(leave(enter(where.y0)), where.y0) < 1e-15


@pytest.mark.parametrize(("name", "h"), [("strang", 0.2), ("strang", 0.4), ("strang", 0.5), ("lie@UVD", 1.6)], ids=str)
def test_a_flow_that_passes_infinity_however_often_says_so(lattice, name, h):
    assert "finite" in method(name).solve(lattice, Request(value=h, steps=3)).failure


WRONG_SYMBOLS = {
    "h": (lambda good: {"h": good.h + good.right[0]}, "lattice-symbol-undeclared", ["h", "u_right"]),
    "integral": (lambda good: {"integrals": {"norm": good.site * good.here[0]}}, "lattice-symbol-undeclared", ["the density of norm", "k"]),
    "b": (lambda good: {"b": good.b * good.left[0]}, "lattice-symbol-undeclared", ["b", "u_left"]),
    "flow": (
        lambda good: {"parts": good.parts | {"D": replace(good.parts["D"], t=sp.Symbol("s"))}},
        "lattice-symbol-undeclared",
        ["the flow of part D", "t"],
    ),
}


@pytest.mark.parametrize("fault", WRONG_SYMBOLS, ids=str)
def test_what_a_site_may_not_depend_on_is_refused(fault, good):
    change, code, names = WRONG_SYMBOLS[fault]
    with refused(code, InvalidProblem, names):
        replace(good, **change(good))


def test_a_site_at_rest_has_canonical_coordinates_too():
    where = initial_value_problem("ablowitz_ladik", None, {"sites": 3}, y0=[0, 0.5, 0.1, 0, 0.2, 0.3])
    found = method("darboux:verlet").solve(where, Request(value=1e-4, steps=10)).complete()
    assert found.y[-1] == pytest.approx(method("strang").solve(where, Request(value=1e-4, steps=10)).complete().y[-1], abs=1e-6)


FAULTS = {
    "bracket": (lambda good: {"b": sp.Matrix([[0, 1], [1, 0]])}, "not-skew-symmetric", []),
    "integral": (lambda good: {"integrals": {"norm": good.here[0] ** 2}}, "not-a-first-integral", ["norm"]),
    "flow": (lambda good: {"parts": good.parts | {"D": replace(good.parts["D"], here=good.here)}}, "flow-of-another-field", ["'D'"]),
    "sum": (lambda good: {"splittings": {"UV": ("U", "V")}}, "splitting-does-not-add-up", ["'UV'"]),
    "canonical": (lambda good: {"darboux": replace(good.darboux, Q=good.darboux.P, P=good.darboux.Q)}, "coordinates-not-canonical", []),
}


@pytest.mark.parametrize("fault", FAULTS, ids=str)
def test_a_lattice_that_is_no_poisson_system_is_refused(fault, good):
    change, code, names = FAULTS[fault]
    with refused(code, InvalidProblem, names):
        replace(good, **change(good))


def test_a_lattice_with_a_casimir_function_keeps_it():
    """Three fields a site, b = hat(y): rigid bodies side by side, coupled by h = y . y_left."""
    here, left, right = (sp.symbols(f"x{side} y{side} z{side}", real=True) for side in ("", "_l", "_r"))
    x, y, z = here
    k = sp.Symbol("k", integer=True)
    chain = PoissonLattice(
        sites=4,
        here=here,
        left=left,
        right=right,
        b=sp.Matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]]),
        h=sum(a * b for a, b in zip(here, left, strict=True)) + z**2,
        casimirs={"length": x**2 + y**2 + z**2},
        site=k,
    )
    start = np.random.default_rng(3).normal(size=12)
    where = make_ivp(source_of(chain, "spins"), "", y0=start)
    request = Request(value=0.05, steps=100, watch=("energy", "casimirs"))
    kept, lost = (method(name).solve(where, request).complete().maxima for name in ("midpoint", "rk4"))
    assert max(kept.values()) < 1e-12
    assert min(lost.values()) > 1e-7
    assert error_of(where.value("field", start), where.value("B", start) @ _gradient(where, start)) < 1e-13


def _gradient(where, y):
    return np.array([np.imag(where.value("H", y + 1e-30j * e)) / 1e-30 for e in np.eye(len(y))])
