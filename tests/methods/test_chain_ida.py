"""IDA on chains whose functions are loops over nodes: the same equations as those of the system written out, in a band."""

from functools import cache

import numpy as np
import pytest
import sympy as sp
import uncompiled
from measures import error_of
from refusals import refused

from daebench.compiler.definition import source_of
from daebench.errors import BadInput, DaebenchError
from daebench.methods import names
from daebench.methods.formulations.chain import pose_banded
from daebench.methods.formulations.constrained import pose
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.problems import pendulum_chain
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request
from daebench.systems.chain import ConstrainedChain
from daebench.systems.constrained import Case

FORMULATIONS = {"index3": "plain", "index2": "derivative", "index1": "plain", "ggl": "derivative", "baumgarte": "plain"}
CHAINS = ("pendulums", "bars", "one node")


def bars(n):
    """Uniform bars between cranks, whose mass matrix joins neighbours; node k on a circle about (k length, 0), springs between."""
    x, y, x_before, y_before = sp.symbols("x y x_before y_before", real=True)
    k, gravity = sp.Symbol("k", integer=True), sp.Symbol("gravity", real=True)
    m, length = sp.symbols("mass length", positive=True)
    return ConstrainedChain(
        nodes=n + 1,
        here=(x, y),
        before=(x_before, y_before),
        node=k,
        joints=[(x - x_before) ** 2 + (y - y_before) ** 2 + k * (y - y_before) ** 2 / 10 - length**2],
        own=[(x - k * length) ** 2 + y**2 - length**2],
        mass=m / 3 * sp.eye(2),
        joint_mass=m / 6 * sp.Matrix([[2, 0, 1, 0], [0, 2, 0, 1], [1, 0, 2, 0], [0, 1, 0, 2]]),
        U=sp.Rational(3, 2) * m * gravity * y,
        joint_U=(x + x_before) ** 2 / 7,
        parameters={m: 1.3, length: 0.9, gravity: 9.81},
        cases={"swing": Case(q=(k * length, length), p=(1, 0))},
        speeds=True,
    )


def one_node():
    """Point on a rod about a point at rest, and on a saddle: first and last node at once."""
    x, y, z, *before = sp.symbols("x y z x_before y_before z_before", real=True)
    m = sp.Symbol("mass", positive=True)
    return ConstrainedChain(
        nodes=1,
        here=(x, y, z),
        before=before,
        node=sp.Symbol("k", integer=True),
        anchor=(0, 0, 1),
        joints=[sum((a - b) ** 2 for a, b in zip((x, y, z), before, strict=True)) - 2],
        own=[x * y - z],
        mass=m * sp.eye(3),
        U=m * z,
        joint_U=sum(before) * x,
        parameters={m: 1.3},
        cases={"sliding": Case(q=(1, 0, 0), p=(0, 0, 0))},
    )


@cache
def both(which):
    """Return the initial value problem of a short chain in loops over nodes, and written out."""
    chain, case = {
        "pendulums": (pendulum_chain.problem(links=5), "hanging"),
        "bars": (bars(2), "swing"),
        "one node": (one_node(), "sliding"),
    }[which]
    return tuple(make_ivp(source_of(chain, "short", algebra), case) for algebra in ("arrays", "values"))


@pytest.fixture
def few(monkeypatch):
    """Have formulations of short chains run uncompiled, in loops over nodes and written out."""
    monkeypatch.setattr("daebench.methods.formulations.constrained._module", uncompiled.kept_module)
    monkeypatch.setattr("daebench.methods.formulations.chain._module", uncompiled.kept_chain_module)


@pytest.fixture
def posed(few):
    """Return what poses a short chain in loops over nodes, and written out."""

    def both_posed(which, formulation):
        loops, values = both(which)
        multipliers = FORMULATIONS[formulation]
        return pose_banded(loops, formulation, multipliers=multipliers), pose(values, formulation, multipliers=multipliers)

    return both_posed


def jacobian(dae, y, yp, cj):
    """Return dF/dy + cj dF/dy' of the system written out."""
    J = np.empty((dae.n, dae.n))
    dae.jacobian(0.0, y, yp, np.empty(dae.n), cj, J, dae.par)
    return J


@pytest.mark.sampled(by=lambda case: case.startswith("one node") or case.endswith("ggl"))
@pytest.mark.parametrize("formulation", FORMULATIONS, ids=str)
@pytest.mark.parametrize("which", CHAINS, ids=str)
def test_residual_and_start_are_those_of_the_system_written_out(posed, which, formulation):
    loops, whole = posed(which, formulation)
    y, yp = np.random.default_rng(1).normal(size=(2, whole.n))
    expected, found = np.empty((2, whole.n))
    whole.residual(0.0, y, yp, expected, whole.par)
    health = loops.residual(0.0, y[loops.order], yp[loops.order], found, loops.par)
    assert health == 1.0
    assert found == pytest.approx(expected[loops.order], rel=1e-13, abs=1e-12)
    free = 1.0 if FORMULATIONS[formulation] == "derivative" else 0.0
    states = np.arange(whole.n) < 2 * whole.d
    assert loops.y0 == pytest.approx(np.where(states, whole.y0, whole.y0 + free), rel=1e-13, abs=1e-13)
    assert loops.yp0 == pytest.approx(whole.yp0, rel=1e-13, abs=1e-13)
    assert {name: (each.start, each.stop) for name, each in loops.blocks.items()} == {
        name: (each.start, each.stop) for name, each in whole.blocks.items()
    }


@pytest.mark.sampled(by=lambda case: case.startswith("one node") or case.endswith("ggl"))
@pytest.mark.parametrize("formulation", FORMULATIONS, ids=str)
@pytest.mark.parametrize("which", CHAINS, ids=str)
def test_the_band_is_that_of_the_jacobian_of_the_system_written_out(posed, which, formulation):
    loops, whole = posed(which, formulation)
    y, yp = np.random.default_rng(2).normal(size=(2, whole.n))
    expected = jacobian(whole, y, yp, 0.7)[np.ix_(loops.order, loops.order)]
    lower, upper = loops.band
    rows, columns = np.nonzero(expected)
    assert (lower, upper) == (max(rows - columns), max(columns - rows))
    entries, above = np.zeros((whole.n, 2 * lower + upper + 1)), lower + upper
    loops.jacobian(0.0, y[loops.order], yp[loops.order], 0.7, above, entries, loops.par)
    for column in range(whole.n):
        inside = np.arange(max(0, column - upper), min(whole.n, column + lower + 1))
        assert entries[column, inside - column + above] == pytest.approx(expected[inside, column], rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("which", ["pendulums", "bars"], ids=str)
def test_momenta_are_those_of_the_system_written_out(posed, which):
    loops, whole = posed(which, "index2")
    q, v = np.random.default_rng(3).normal(size=(2, 4, whole.d))
    assert loops.momenta(q, v) == pytest.approx(whole.momenta(q, v), rel=1e-14, abs=1e-14)


@pytest.mark.sampled(by=lambda case: case == "pendulums-index2")
@pytest.mark.parametrize("formulation", FORMULATIONS, ids=str)
@pytest.mark.parametrize("which", ["pendulums", "bars"], ids=str)
def test_trajectory_is_that_of_dense_ida(few, which, formulation):
    # where multipliers are unknowns all steps are the same, up to round-off that index 3 divides by them; where their integrals are, these
    # begin elsewhere, so that the error test differs, and both runs have errors of their own: up to thirty times the tolerance, in lam
    near = {"index3": 1e-7, "index2": 1e-5, "ggl": 1e-5}.get(formulation, 1e-9)
    request = Request(value=1e-7, t_end=0.3, points=4, multipliers=True)
    found, expected = (names.parse(f"ida:{formulation}").solve(each, request) for each in both(which))
    assert found.failure is None
    for part in ("t", "q", "p", "lam"):
        assert getattr(found, part) == pytest.approx(getattr(expected, part), rel=near, abs=near)
    if FORMULATIONS[formulation] != "derivative":
        assert found.steps == expected.steps
    assert found.work.keys() == {"residual", "steps"}


def test_index_reduced_ode_of_a_long_chain_is_refused_in_a_sentence():
    loops, values = both("pendulums")
    for solver in map(names.parse, ("ida:ode", "cvode:bdf", "scipy:DOP853")):
        assert solver.refusal(values) is None
        assert "use ida:index1" in solver.refusal(loops)
        with pytest.raises(BadInput, match="all 5 nodes"):
            solver.solve(loops, Request(value=1e-6, t_end=0.1))


def test_option_of_baumgarte_reaches_the_residual(few):
    loops, _ = both("pendulums")
    far = pose_banded(loops, "baumgarte", {"alpha": 3.0, "beta": 5.0})
    assert far.par[-2:].tolist() == [3.0, 5.0]
    with refused("unknown-name", name="gamma"):
        pose_banded(loops, "baumgarte", {"gamma": 1.0})


def test_start_without_multiplier_is_refused_in_a_sentence(few):
    flat = make_ivp(both("bars")[0].source, "swing", p0=np.zeros(6), q0=[0.9, 0.0, 1.8, 0.0, 2.7, 0.0])
    with refused("not-finite-at-start", kind=DaebenchError):
        pose_banded(flat, "index2")


@pytest.mark.exhaustive
@pytest.mark.parametrize("formulation", ["index2", "ggl"], ids=str)
def test_two_hundred_links_swing_as_rattle_has_them(formulation):
    # RATTLE of order 2: the difference of its runs with h and h / 2 is three times the error of the second
    hanging = initial_value_problem("pendulum_chain", "hanging", {"links": 200})
    coarse, fine = (names.parse("rattle").solve(hanging, Request(value=h, t_end=0.2, every=0)).q[-1] for h in (2e-3, 1e-3))
    found = names.parse(f"ida:{formulation}").solve(hanging, Request(value=1e-8, t_end=0.2, points=2))
    error = error_of(coarse, fine) / 3
    assert 1e-9 < error < 1e-4
    assert error_of(found.q[-1], (4 * fine - coarse) / 3) < 0.2 * error + 1e-7


@pytest.mark.exhaustive
def test_steps_of_a_thousand_links_are_about_those_of_a_hundred():
    # the unknowns' increments in IDA's difference quotients must not drown in round-off, which grows with the positions
    request = Request(value=1e-6, t_end=0.2, points=3)
    hundred, thousand = (
        names.parse("ida:ggl").solve(initial_value_problem("pendulum_chain", "hanging", {"links": n}), request) for n in (100, 1000)
    )
    assert hundred.failure is None
    assert thousand.failure is None
    assert thousand.steps < 3 * hundred.steps
    assert thousand.work["residual"] < 10 * thousand.steps
