"""Chains of nodes with vectors as arrays: the same schemes as loops over nodes, against the system written out as values."""

import dataclasses
from itertools import product

import numpy as np
import pytest
import scipy.linalg
import sympy as sp
import uncompiled
from measures import error_of
from refusals import refused, unsaid
from uncompiled import named

from daebench.compiler.chain.band import of_width
from daebench.compiler.chain.blocks import Blocks, pairs
from daebench.compiler.chain.derivation import WRITTEN_OUT
from daebench.compiler.definition import source_of
from daebench.errors import InvalidProblem
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request
from daebench.systems.chain import ConstrainedChain
from daebench.systems.constrained import Case

EPS = np.finfo(float).eps
ALGEBRAS = ("arrays", "values")
PLACES = {"pendulum_chain": ("hanging", {"links": 3}), "four_bar": ("swing", {"bars": 2})}
KNOWN = (
    "rattle",
    "lobatto2",
    "lobatto3",
    "lobatto4",
    "symplectic_euler",
    "symplectic_euler_adjoint",
    "shake",
    "rattle_ilves",
    "rk4",
    "midpoint",
    "gauss2",
    "rattle/suzuki4",
)


GATE = ("four_bar-rattle", *(f"pendulum_chain-{name}" for name in ("rattle/suzuki4", "shake", "lobatto3", "rk4")))


def place(problem, algebra):
    case, parameters = PLACES[problem]
    return initial_value_problem(problem, case, parameters, algebra=algebra)


def both(problem):
    """Return a chain of the catalogue with arrays, and written out as values."""
    return [place(problem, algebra) for algebra in ALGEBRAS]


def posed(chain):
    """Return a chain of a test with arrays, and written out as values."""
    return [make_ivp(source_of(chain, algebra=algebra), next(iter(chain.cases))) for algebra in ALGEBRAS]


def moved(ivp):
    """Return a state off the manifold near an initial value problem's start."""
    wave = np.cos(1.0 + np.arange(ivp.d))
    return ivp.p0 + 0.3 * wave, ivp.q0 + 0.01 * wave[::-1]


@pytest.fixture(params=PLACES)
def problem(request):
    return request.param


# ---- schemes -------------------------------------------------------------------------------------------------------------


@pytest.mark.sampled(by=GATE.__contains__)
@pytest.mark.parametrize("name", KNOWN)
def test_steps_and_work_are_those_of_the_system_written_out(problem, name):
    method = parse(name)
    method = FixedStep(method.scheme, composition=method.composition, compiled=False)
    request = Request(value=0.01, steps=6, raw=bool(method.member.multipliers()) and not method.composition)
    arrays, values = (method.solve(each, request).complete() for each in both(problem))
    assert error_of(arrays.q, values.q) < 40 * EPS
    assert error_of(arrays.p, values.p) < (1e4 if name == "shake" else 100) * EPS
    if name not in ("midpoint", "gauss2"):  # whose iterations end by chance at a rounding
        assert arrays.work == values.work
    for kind, (_, lam) in values.raw.items():
        assert error_of(arrays.raw[kind][1], lam) < 1e-9 * np.abs(lam).max()


@pytest.mark.sampled(by=lambda case: case.startswith("pendulum_chain"))
@pytest.mark.parametrize("options", [{"differences": 1}, {"projected": 0}], ids=lambda options: next(iter(options)))
def test_options_of_a_scheme_have_the_same_effect(problem, options):
    one, other = (FixedStep("rattle_ilves", options=chosen, compiled=False) for chosen in (options, {}))
    request = Request(value=0.01, steps=5)
    arrays, values, without = (
        method.solve(place(problem, algebra), request) for method, algebra in ((one, "arrays"), (one, "values"), (other, "arrays"))
    )
    assert error_of(arrays.p, values.p) < 1e3 * EPS
    assert error_of(arrays.p, without.p) > 1e-16


def test_the_iteration_of_ilves_on_many_links_is_that_of_rattle():
    ivp = initial_value_problem("pendulum_chain", "hanging", {"links": 60})
    one, other = (
        FixedStep(name, options=options, compiled=False).solve(ivp, Request(value=0.01, steps=3))
        for name, options in (("rattle_ilves", {"tolerance": 1e-6}), ("rattle", {}))
    )
    assert 0 < error_of(one.q, other.q) < 1e-6
    assert one.work["newton"] < other.work["newton"]


@pytest.mark.sampled(left_out=("four_bar",))
def test_sums_are_compensated_alike(problem):
    method = FixedStep("rattle", compensated=True, compiled=False)
    arrays, values = (method.solve(each, Request(value=0.01, steps=5)) for each in both(problem))
    assert error_of(arrays.q, values.q) < 20 * EPS


@pytest.mark.sampled(by=("pendulum_chain-rattle", "pendulum_chain-rk4").__contains__)
@pytest.mark.parametrize("name", ["rattle", "lobatto3", "symplectic_euler", "rattle_ilves", "rk4"])
def test_derivatives_carried_in_imaginary_parts_are_the_same(problem, random, name):
    method, ivps = FixedStep(name, compiled=False), both(problem)
    dp, dq = 1e-30j * random.normal(size=(2, ivps[0].d))
    one, other = (np.concatenate(method.flow(each, 0.05, 2)(each.p0 + dp, each.q0 + dq)) for each in ivps)
    assert error_of(one.real, other.real) < 100 * EPS
    assert error_of(one.imag, other.imag) < 1e-12 * np.abs(other.imag).max()


@pytest.mark.sampled(left_out=("four_bar",))
def test_what_is_watched_is_the_same(problem):
    method, request = FixedStep("symplectic_euler", compiled=False), Request(value=0.02, steps=5, watch=("energy", "manifold"))
    one, other = (method.solve(each, request) for each in both(problem))
    assert one.maxima.keys() == other.maxima.keys()
    for key, value in other.maxima.items():
        assert one.maxima[key] == pytest.approx(value, rel=1e-9, abs=1e-13)


@pytest.mark.sampled(left_out=("four_bar",))
def test_single_precision_stays_single(problem):
    ivp = place(problem, "arrays")
    kernel = uncompiled.kernel(FixedStep("rattle"), ivp, "float32", (), count=False)
    p, q = (np.float32(x) for x in (ivp.p0, ivp.q0))
    par = (*map(np.float32, ivp.par), (np.float32(1), np.float32(0)))
    (p1, q1), _, _, report = named(kernel, "one_step")((p, q), (), np.float32(0.01), par)
    assert p1.dtype == q1.dtype == np.asarray(report[1]).dtype == np.float32
    assert report[0] == 0


@pytest.mark.sampled(by=lambda case: case.startswith("pendulum_chain"))
@pytest.mark.parametrize(
    "name",
    ["se", "radau2_ggl", "implicit_euler", "generalized_alpha", "energy_momentum", "rattle_gauss_seidel", "rk4+proj"],
)
def test_what_loops_cannot_do_is_refused_with_a_sentence_that_names_the_scheme(problem, name):
    arrays, values = both(problem)
    assert parse(name).refusal(arrays).startswith(name)
    assert parse(name).refusal(values) is None


def uneven(nodes):
    """Return a chain whose masses, joints and constraints change from node to node."""
    x, y, before, below = sp.symbols("x y before below", real=True)
    k, gravity = sp.Symbol("k", integer=True), sp.Symbol("gravity", real=True)
    share = sp.Rational(1, 10)
    return ConstrainedChain(
        nodes=nodes,
        here=(x, y),
        before=(before, below),
        node=k,
        anchor=(0, 1),
        joints=[(x - before) ** 2 + (y - below) ** 2 - (1 + k * share) ** 2],
        mass=(1 + k * share) * sp.eye(2),
        joint_mass=(2 + k) * share * sp.kronecker_product(sp.Matrix([[2, 1], [1, 2]]), sp.eye(2)),
        U=gravity * (1 + k * share) * y,
        joint_U=gravity * (below + y) * k * share,
        parameters={gravity: 9.81},
        cases={"down": Case(q=(0, 1 - (k + 1) - share * k * (k + 1) / 2), p=(k * share, 0))},
        speeds=True,
    )


@pytest.mark.sampled(left_out=("2", "5"))
@pytest.mark.parametrize("nodes", [1, 2, 3, 5])
def test_nodes_need_not_be_alike(nodes):
    arrays, values = posed(uneven(nodes))
    assert error_of(arrays.p0, values.p0) < 4 * EPS
    method, request = FixedStep("rattle", compiled=False), Request(value=0.01, steps=5, on_singular="continue")
    one, other = (method.solve(each, request).complete() for each in (arrays, values))
    assert error_of(one.q, other.q) < 100 * EPS
    assert error_of(one.p, other.p) < 1000 * EPS
    assert error_of(np.array(list(one.maxima.values())), list(other.maxima.values())) < 1e-12


def dumbbells(nodes):
    """Return a chain of free masses, none of them tied to anything but its neighbours."""
    x, y, before, below = sp.symbols("x y before below", real=True)
    k = sp.Symbol("k", integer=True)
    return ConstrainedChain(
        nodes=nodes,
        here=(x, y),
        before=(before, below),
        node=k,
        joints=[(x - before) ** 2 + (y - below) ** 2 - 1],
        mass=(1 + k) * sp.eye(2),
        U=sp.Integer(0),
        cases={"turning": Case(q=(k, 0), p=((1 + k) * sp.Rational(1, 5), (1 + k) * k * sp.Rational(1, 3)))},
    )


@pytest.mark.sampled(left_out=("lobatto3",))
@pytest.mark.parametrize("name", ["rattle", "lobatto3"])
def test_a_chain_may_be_free_at_both_ends(name):
    arrays, values = posed(dumbbells(3))
    one, other = (FixedStep(name, compiled=False).solve(each, Request(value=0.02, steps=5)).complete() for each in (arrays, values))
    assert error_of(one.q, other.q) < 100 * EPS
    assert error_of(one.p, other.p) < 1000 * EPS


def test_what_arrays_do_not_have_is_refused_with_a_sentence(daebench):
    many = ("--param", "links=20")
    for words in (
        ("run", "pendulum_chain", *many, "--case", "hanging", "--method", "rattle", "--h", "0.01", "--steps", "2", "--project"),
        ("run", "pendulum_chain", *many, "--method", "rattle", "--h", "0.01", "--steps", "2", "--on-singular", "least-squares"),
        ("order", "pendulum_chain", *many, "--case", "hanging", "--methods", "rattle", "--t-end", "1"),
    ):
        status, _, told = daebench(*words)
        assert status == 2
        assert "20 nodes" in told


def test_a_chain_is_shown_at_one_node(daebench):
    status, told, _ = daebench("show", "four_bar")
    assert (status, unsaid(["at each joint", "3 nodes, 6 positions, 5 constraints"], told)) == (0, [])


def test_bars_are_seen_to_lose_rank_where_they_do():
    ivp = initial_value_problem("four_bar", "iftomm", algebra="arrays")
    through, stopped = (
        FixedStep("symplectic_euler", compiled=False).solve(ivp, Request(value=0.004, t_end=0.8, watch=(), **more))
        for more in ({}, {"on_singular": "stop"})
    )
    (passage,) = through.complete().passages
    assert passage.t == pytest.approx(0.714356, abs=2e-3)
    assert passage.branch == "through"
    assert "t = 0.71" in stopped.failure


# ---- functions -----------------------------------------------------------------------------------------------------------


@pytest.mark.sampled(left_out=("four_bar",))
@pytest.mark.slow
def test_functions_are_those_of_the_system_written_out(problem):
    names = ("H", "H_p", "H_q", "g", "Gv", "lam", "independence")
    arrays, values = both(problem)
    p, q = moved(values)
    loops, straight = arrays.functions(*names), values.functions(*names)
    for name in names:
        own, other = ((q,) if name == "g" else (p, q)), ((tuple(q),) if name == "g" else (tuple(p), tuple(q)))
        one, two = np.array(getattr(loops, name)(*own, arrays.par)), np.array(getattr(straight, name)(*other, values.par))
        assert one.shape == two.shape
        if name != "independence" or problem != "four_bar":  # whose pivots are those of another matrix, and vanish with these
            assert error_of(one, two) <= 1e-11 * max(1.0, np.abs(two).max())


# ---- which algebra -------------------------------------------------------------------------------------------------------


def test_size_decides_how_vectors_are_held():
    most = WRITTEN_OUT // 2
    assert not initial_value_problem("pendulum_chain", "hanging", {"links": most}).arrays
    assert initial_value_problem("pendulum_chain", "hanging", {"links": most + 1}).arrays


def test_arrays_of_no_chain_and_an_unknown_algebra_are_refused():
    with refused("not-a-chain-of-nodes"):
        initial_value_problem("spherical_pendulum", algebra="arrays")
    with refused("unknown-name", name="lists", says=["arrays, values"]):
        initial_value_problem("pendulum_chain", algebra="lists")


x, y, before, below, k, other = sp.symbols("x y before below k other")
NO_CHAINS = {
    "no nodes": ({"nodes": 0, "here": (x,), "before": (before,), "joints": (x - before,), "mass": sp.eye(1)}, "chain-without-nodes", ["0"]),
    "a foreign symbol": ({"joints": (x - before - other,)}, "chain-symbol-undeclared", ["joints", "other"]),
    "sizes that do not fit": ({"before": (before,)}, "chain-vector-sizes", ["2"]),
}


@pytest.mark.parametrize(("parts", "code", "names"), NO_CHAINS.values(), ids=NO_CHAINS)
def test_what_is_no_chain_is_refused(parts, code, names):
    usual = {"nodes": 3, "here": (x, y), "before": (before, below), "node": k, "joints": (x - before,), "mass": sp.eye(2), "U": x}
    with refused(code, InvalidProblem, names):
        ConstrainedChain(**usual | parts)


# ---- the solver ----------------------------------------------------------------------------------------------------------


def solved(A, b, w):
    """Return the solution of a banded system by the elimination that chains use, and the smallest relative pivot."""
    n, functions = len(b), {"numpy": np, "absolute": np.absolute, "empty": np.empty, "zeros": np.zeros, "INF": np.inf}
    exec("\n".join(of_width(w).values()), functions)
    rows = np.zeros((n, 2 * w + 2))
    for r, j in product(range(n), range(-w, w + 1)):
        rows[r, w + j] = A[r, r + j] if 0 <= r + j < n else 0.0
    rows[:, -1] = b
    x, pivot = functions[f"band{w}_solve"](rows)
    return x[:n], pivot


@pytest.mark.parametrize(("n", "w"), [*product((1, 2, 5, 12), (1, 2, 4))], ids=lambda each: str(each))
def test_banded_elimination_solves_what_scipy_solves(random, n, w):
    A = np.triu(np.tril(random.normal(size=(n, n)), w), -w)
    np.fill_diagonal(A, 1e-9)  # nothing without exchanges of rows
    A += np.diag(random.normal(size=n) * (n == 1))
    if n > 1 and abs(np.linalg.det(A)) < 1e-6:
        A += np.triu(np.tril(np.ones((n, n)), w), -w)
    b = random.normal(size=n)
    x, pivot = solved(A, b, w)
    expected = scipy.linalg.solve(A, b)
    assert error_of(x, expected) < 1e-12 * np.linalg.cond(A) * np.abs(expected).max()
    assert 0 < pivot <= 1


def eliminated(A, b, u, order):
    """Return the solution of a banded system by the elimination in blocks, node by node, and the smallest relative pivot."""
    n = len(b) // u
    places = list(product(range(u), (-1, 0, 1), range(u)))
    blocks = Blocks(name="s", u=u, places=places, order=order)
    entries = [{(place, j): f"A[k, {i}, {u * (place + 1) + j}]" for row, place, j in places if row == i} for i in range(u)]
    up = [*blocks.elimination(entries, [f"b[k, {i}]" for i in range(u)]), *blocks.keep("kept[k, {i}]")]
    down = [blocks.substitution("kept[k, {i}]")[0], f"x[k] = {', '.join(blocks.unknowns)}"]
    lines = [*blocks.begin, f"for k in range({n}):", *(f"    {line}" for line in up), f"{' = '.join(blocks.unknowns)} = ZERO"]
    lines += [f"for k in range({n - 1}, -1, -1):", *(f"    {line}" for line in down)]
    padded = np.pad(A, ((0, 0), (u, u)))
    rows = np.array([[padded[u * k + i, u * k : u * (k + 3)] for i in range(u)] for k in range(n)])
    scope = {"A": rows, "b": b.reshape(n, u), "x": np.zeros((n, u)), "kept": np.zeros((n, u * u + u)), "ZERO": 0.0, "INF": np.inf}
    exec("\n".join(lines), scope)
    return scope["x"].ravel(), scope["s_pivot"]


ORDERS = {1: [(0,)], 2: [(1,), (0,)], 3: [(1, 2), (0,)], 4: pairs([1, 2, 0, 3]), 5: pairs([4, 2, 0, 3, 1])}


@pytest.mark.parametrize(("n", "u"), [*product((1, 2, 7), ORDERS)], ids=lambda each: str(each))
def test_elimination_in_blocks_solves_what_scipy_solves(random, n, u):
    near = np.abs(np.subtract.outer(np.arange(n * u) // u, np.arange(n * u) // u)) <= 1
    A, b = random.normal(size=(n * u, n * u)) * near + 3 * u * np.eye(n * u), random.normal(size=n * u)
    x, pivot = eliminated(A, b, u, ORDERS[u])
    assert error_of(x, scipy.linalg.solve(A, b)) < 1e-14 * np.linalg.cond(A)
    assert 0.1 < pivot <= 1


@pytest.mark.parametrize("small", [0.0, 1e-9, 1e-5])
def test_elimination_in_blocks_sees_a_pivot_that_cancellation_has_left(small):
    A = np.array([[2.0, 1.0, 1.0, 0.0], [1.0, 2.0, 0.0, 1.0], [1.0, 0.0, 5 / 3, -1 / 3], [0.0, 1.0, -1 / 3, 2 / 3 + small]])
    with np.errstate(all="ignore"):
        pivot = eliminated(A, np.ones(4), 2, pairs([0, 1]))[1]
    assert not pivot > small + 4 * EPS
    assert pivot > small / 10 or not small


@pytest.mark.parametrize("away", [1e-1, 3e-2, 1e-2, 1e-3])
def test_bars_next_to_a_loss_of_rank_move_as_those_written_out(away):
    angle, speed = np.pi / 2 - away, 3.0
    q, v = (np.array([np.sin(angle), -np.cos(angle)]), speed * np.array([np.cos(angle), np.sin(angle)]))
    start = {"q0": np.ravel([q + np.array([i, 0]) for i in range(3)]), "p0": np.outer(np.array([5, 8, 5]) / 6, v).ravel()}
    request = Request(value=1e-3 * away, steps=3, watch=(), on_singular="continue")
    one, other = (
        FixedStep("rattle", compiled=False)
        .solve(dataclasses.replace(initial_value_problem("four_bar", "iftomm", algebra=algebra), **start), request)
        .complete()
        for algebra in ALGEBRAS
    )
    assert error_of(one.q, other.q) < 10 * EPS / away
    assert error_of(one.p, other.p) < 10 * EPS / away**2


# ---- large -----------------------------------------------------------------------------------------------------------------


@pytest.mark.exhaustive
def test_a_hundred_thousand_links_take_their_steps():
    ivp = initial_value_problem("pendulum_chain", "hanging", {"links": 100_000})
    found = parse("rattle").solve(ivp, Request(value=1e-3, steps=3, every=0, watch=("energy", "manifold"))).complete()
    assert found.maxima["g"] < 1e-9
    assert found.maxima["energy"] < 1e-9 * abs(float(ivp.value("H", ivp.p0, ivp.q0)))


@pytest.mark.slow
def test_compiled_loops_follow_another_scheme_on_the_system_written_out():
    many, few = both("pendulum_chain")
    request = Request(value=1e-3, steps=500)
    one = parse("rattle").solve(many, request)
    other = FixedStep("lobatto3", compiled=False).solve(few, Request(value=0.01, steps=50))
    assert error_of(one.q[-1], other.q[-1]) < 1e-5
    assert error_of(one.q[-1], other.q[-1]) > 1e-10
