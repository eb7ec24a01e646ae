"""Every scheme for Poisson systems keeps its claims on every Poisson system of the catalogue, in every form that it takes."""

import numpy as np
import pytest
import sympy as sp
from measures import error_of
from poisson_runs import ivp, method, names, pairs, rate, run
from refusals import refused
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from daebench.compiler.definition import source_of
from daebench.diagnostics.poisson import poisson_defect
from daebench.errors import RunFailed
from daebench.methods.catalogue import problems
from daebench.methods.fixed_step.poisson import PoissonStep
from daebench.methods.names import POISSON, parse
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request
from daebench.systems.poisson import PoissonCase, PoissonSystem

PAIRS = pairs()


def covering():
    """Return the cases of the gate: two problems a scheme, one after another."""
    for number, name in enumerate(names()):
        taken = [problem for problem, of in PAIRS if of == name]
        yield from (f"{name}-{taken[(number + shift) % len(taken)]}" for shift in range(min(2, len(taken))))


def each_pair(test):
    test = pytest.mark.sampled(by=set(covering()).__contains__)(test)
    return pytest.mark.parametrize(("problem", "name"), PAIRS, ids=[f"{name}-{problem}" for problem, name in PAIRS])(test)


def exact(problem, T):
    """Return the state at T by SciPy, tight."""
    where = ivp(problem)
    found = solve_ivp(lambda t, y: where.value("field", y), (0.0, T), where.y0, method="DOP853", rtol=1e-13, atol=1e-14)
    return found.y[:, -1]


def structure(problem):
    return lambda y: ivp(problem).value("B", y)


def size(problem):
    """Return the round-off of the defect: that of |B|, whose entries set its scale."""
    return 2.0**-52 * (1 + np.abs(ivp(problem).value("B", ivp(problem).y0)).max())


def test_every_poisson_problem_takes_a_poisson_integrator():
    for problem in problems("poisson"):
        assert any(method(name, anyway=False).refusal(ivp(problem)) is None and method(name).is_poisson(ivp(problem)) for name in names())


@each_pair
def test_the_order_is_the_one_that_is_claimed(problem, name):
    T = 2.0 / rate(problem)
    reference = exact(problem, T)
    errors = [error_of(run(problem, name, T / n, n, every=0, watch=()).y[-1], reference) for n in (16, 32, 64)]
    slopes = np.log2(np.divide(errors[:-1], errors[1:]))
    assert slopes[-1] == pytest.approx(method(name).order, abs=0.25), (errors, slopes)


@each_pair
def test_the_adjoint_undoes_a_step_where_the_scheme_is_symmetric(problem, name):
    where, h = ivp(problem), 0.3 / rate(problem)
    there = method(name).flow(where, h, 3)(where.y0)
    back = np.real(method(name).flow(where, -h, 3)(there))
    defect = error_of(back, where.y0) / np.abs(where.y0).max()
    if method(name).member.symmetric:
        assert defect < 1e-12
    else:
        assert defect > 1e-9


@each_pair
def test_a_poisson_integrator_is_a_poisson_map_and_no_other_scheme_is(problem, name):
    where, h = ivp(problem), 0.3 / rate(problem)
    defect = poisson_defect(method(name).flow(where, h, 3), where.y0, structure(problem))
    if method(name).is_poisson(where):
        assert defect < 500 * size(problem)
    else:
        assert defect > 1e5 * size(problem)


@each_pair
def test_what_a_scheme_says_it_keeps_it_keeps(problem, name):
    where = ivp(problem)
    found = run(problem, name, 0.02 / rate(problem), 100, watch=("energy", "casimirs", "integrals"))
    kept = method(name).keeps(where)
    values = {"energy": where.value("H", where.y0), **dict(zip(where.casimirs, where.value("casimirs", where.y0), strict=True))}
    values |= dict(zip(where.integrals, where.value("integrals", where.y0), strict=True))
    for each in kept:
        assert found.maxima[each] < 2e-13 * max(1.0, abs(values[each])), each


def strang(u, v, h):
    u = u * np.exp(h / 2 * (v - 2))
    v = v * np.exp(-h * (u - 1))
    return u * np.exp(h / 2 * (v - 2)), v


def symplectic_euler(u, v, h):
    u = u / (1 - h * (v - 2))
    return u, v - h * u * v * (1 - 1 / u)


def symplectic_euler_adjoint(u, v, h):
    v = v / (1 + h * (u - 1))
    return u + h * u * v * (1 - 2 / v), v


def euler_in_logarithms(u, v, h):
    u = u * np.exp(h * (v - 2))
    return u, v * np.exp(-h * (u - 1))


BOOK = {each.__name__: each for each in (strang, symplectic_euler, symplectic_euler_adjoint)} | {
    "darboux:symplectic_euler": euler_in_logarithms
}


@pytest.mark.parametrize("name", BOOK)
def test_steps_of_lotka_volterra_are_those_of_the_book(name):
    y, h = (4.0, 2.0), 0.05
    for _ in range(3):
        y = BOOK[name](*y, h)
    assert run("lotka_volterra", name, h, 3).y[-1] == pytest.approx(y, rel=1e-14)


def test_verlet_in_logarithms_is_strang_splitting():
    (u, v), h = (4.0, 2.0), 0.25
    for _ in range(5):
        v *= np.exp(-h / 2 * (u - 1))
        u *= np.exp(h * (v - 2))
        v *= np.exp(-h / 2 * (u - 1))
    assert run("lotka_volterra", "darboux:verlet", h, 5).y[-1] == pytest.approx([u, v], rel=1e-13)
    assert run("lotka_volterra", "strang", h, 5).y[-1] != pytest.approx([u, v], rel=1e-3)


def test_the_printed_euler_form_leaves_the_domain_and_its_adjoint_does_not():
    where, request = ivp("lotka_volterra", "6,2"), Request(value=0.25, steps=1000)
    failed = method("symplectic_euler").solve(where, request)
    assert failed.steps == 0
    assert "the domain u > 0 and v > 0" in failed.failure
    with refused("run-stopped-early", RunFailed):
        failed.complete()
    for name in ("symplectic_euler_adjoint", "verlet"):
        assert method(name).solve(where, request).failure is None


def test_compositions_have_their_order():
    T = 2.0 / rate("lotka_volterra")
    reference = exact("lotka_volterra", T)
    for name, order, n in (("strang/suzuki4", 4, 8), ("strang/kahan_li8", 8, 3), ("darboux:verlet/suzuki4", 4, 8)):
        errors = [error_of(run("lotka_volterra", name, T / k, k, every=0).y[-1], reference) for k in (n, 2 * n)]
        assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.6), name


def test_the_order_of_the_factors_is_the_one_that_is_named():
    """The flow of y_i^2 / (2 I_i) is a rotation about axis i by -t y_i / I_i, as y' = y x (I^-1 y) has it."""
    where, h = ivp("free_rigid_body"), 0.3
    for splitting in ("123", "312", "213"):
        y = where.y0
        for axis in map(int, splitting):
            turn = np.eye(3)[axis - 1] * -h * y[axis - 1] / where.par[axis - 1]
            y = Rotation.from_rotvec(turn).apply(y)
        assert run("free_rigid_body", f"lie@{splitting}", h, 1).y[-1] == pytest.approx(y, abs=1e-15), splitting
    assert np.array_equal(*(run("free_rigid_body", name, h, 1).y[-1] for name in ("lie", "lie@123")))


@pytest.mark.parametrize(
    ("problem", "name", "words"),
    [
        ("lotka_volterra", "midpoint", "constant B"),
        ("ablowitz_ladik", "symplectic_euler", "linear in u_k"),
        ("free_rigid_body", "symplectic_euler", "3 coordinates"),
        ("heavy_top_lie_poisson", "darboux:verlet", "canonical coordinates"),
        ("lotka_volterra", "strang@KL", "it has LK"),
    ],
    ids=["midpoint", "bilinear", "halves", "darboux", "splitting"],
)
def test_a_scheme_refuses_what_it_is_no_poisson_integrator_for(problem, name, words):
    assert words in str(method(name, anyway=False).refusal(ivp(problem)))


X = sp.symbols("u1:3 v1:3", positive=True)


def halves(block, H):
    """Return a system of two u and two v with this diagonal block of B."""
    D = sp.diag(*block)
    B = sp.Matrix(sp.BlockMatrix([[sp.zeros(2), D], [-D, sp.zeros(2)]]))
    return make_ivp(source_of(PoissonSystem(y=X, B=B, H=H, domain=X, cases={"some": PoissonCase(y=(1, 2, 3, 1))}), "halves"), "some")


APART = sum(x - sp.log(x) for x in X)
BLOCKS = {
    "products": ((X[0] * X[2], X[1] * X[3]), APART, True),
    "shifted": (((1 + X[0]) * (5 - X[2]), X[1]), APART, True),
    "constant": ((2, 3), APART + X[0] * X[3], True),
    "coupled": ((X[0] * X[2], X[1] * X[3]), APART + X[0] * X[1] / 3 + X[2] * X[3] / 2, False),
    "sum": ((X[0] + X[2], X[1] * X[3]), APART, True),
    "no-factors": ((X[0] * X[2] + 1, X[1] * X[3]), APART, True),
    "square": ((X[0] ** 2, X[1] * X[3]), APART, False),
    "root": ((X[0], sp.sqrt(X[3])), APART, False),
}


@pytest.mark.parametrize("block", BLOCKS, ids=str)
def test_symplectic_euler_takes_just_the_blocks_for_which_it_is_a_poisson_map(block):
    d, H, bilinear = BLOCKS[block]
    where = halves(d, H)
    assert bilinear == where.facts.BILINEAR
    assert (method("symplectic_euler", anyway=False).refusal(where) is None) == bilinear
    defects = [
        poisson_defect(method(name).flow(where, 0.05, 1), where.y0, lambda y: where.value("B", y))
        for name in ("symplectic_euler", "symplectic_euler_adjoint")
    ]
    assert max(defects) < 1e-13 if bilinear else max(defects) > 1e-6


@pytest.mark.parametrize(
    ("name", "code", "names"),
    [
        ("strangg", "unknown-name", ("strang",)),
        ("rk4/suzuki4", "composition-needs-order-two", ("rk4",)),
        ("darboux:strang", "scheme-in-own-coordinates", ("strang",)),
        ("midpoint@123", "scheme-does-not-split", ("@123",)),
        ("strang+proj", "projection-unconstrained", ()),
        ("strang/", "method-part-empty", ("composition",)),
        ("strang@", "method-part-empty", ("splitting",)),
        ("local:strang", "unknown-name", ("'local'",)),
        ("darboux:", "no-scheme-named", ("verlet",)),
        ("darboux:verlett", "unknown-name", ("verlet",)),
    ],
    ids=["unknown", "composition", "darboux", "at", "projection", "slash", "no-splitting", "form", "nothing", "unknown-in-form"],
)
def test_names_that_make_no_sense_are_refused(name, code, names):
    with refused(code, says=names):
        parse(name, kind=POISSON)


def test_what_has_no_meaning_for_poisson_systems_is_refused():
    where = ivp("lotka_volterra")
    for more, code in (
        ({"multipliers": True}, "poisson-lacks-request"),
        ({"raw": True}, "poisson-lacks-request"),
        ({"watch": ("manifold",)}, "poisson-has-no-constraints"),
        ({"points": 5}, "points-of-fixed-steps"),
    ):
        with refused(code):
            method("strang").check(where, Request(value=0.1, steps=10, **more))


def test_compiled_and_uncompiled_kernels_agree():
    where = ivp("lotka_volterra_3d")
    request = Request(value=0.05, steps=20)
    compiled, plain = (PoissonStep("strang", compiled=flag).solve(where, request) for flag in (True, False))
    assert compiled.y == pytest.approx(plain.y, rel=1e-13)
    assert compiled.work == plain.work == {"field": 0, "half": 0, "flow": 100, "second": 0, "solve": 0, "newton": 0}
