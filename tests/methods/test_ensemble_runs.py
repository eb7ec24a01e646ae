"""Members of an ensemble in lanes: each to the bit a run of its own, whatever becomes of the others."""

import itertools
from dataclasses import replace

import definitions
import numpy as np
import pytest
from ivps import IVPS, ivp
from memberwise import differences, moving, request
from refusals import refused

from daebench.compiler.definition import source_of
from daebench.errors import BadInput
from daebench.methods.ensemble.run import run_members
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.methods.registry import poisson_registry, registry
from daebench.runs.make_ivp import make_ivp
from daebench.runs.members import members

LANES = 4
FEW = {"lanes": LANES, "threads": 1}


def swung(n, h=0.01):
    """Return a method and n members on one pendulum, each with its step size and gravity; the tests here share their kernel."""
    where = ivp("planar")
    return method_of(where, "rattle"), members(where, moving(where, n), np.broadcast_to(h, n), {"gravity": np.linspace(0.5, 2.0, n)})


def test_members_with_parameters_and_steps_of_their_own_have_the_bits_of_runs_of_their_own():
    sizes = 0.01 * (1 + np.random.default_rng(3).random(11))
    method, some = swung(11, h=sizes)
    asked = request(60, every=7)
    run = run_members(method, some, asked, **FEW)
    assert run.lanes == LANES
    assert run.states.shape == (10, 11, 4)
    assert run.t.shape == (10, 11)
    assert run.index.tolist() == [0, 7, 14, 21, 28, 35, 42, 49, 56, 60]
    assert len(np.unique(run.ends[:, 0])) == 11
    assert differences(method, some, asked, run) == []


@pytest.mark.slow
def test_of_three_equal_weights_at_the_ends_those_of_order_4_are_the_most_accurate():
    """2 a^3 + (1 - 2 a)^3 = 0, HLW II.(4.2), at fixed h against a run with steps a twentieth as long."""
    where = ivp("planar")
    first = 1 / (2 - 2 ** (1 / 3)) + np.linspace(-0.2, 0.2, 21)
    start = tuple(np.repeat(vector[None], 21, axis=0) for vector in where.start)
    weighted = members(where, start, 0.02, {}).weighted(np.stack([first, 1 - 2 * first, first], axis=1))
    method = method_of(where, "rattle/triple_jump4")
    run = run_members(method, weighted, request(50), **FEW)
    exact = method.solve(where, replace(request(1000), value=0.001, every=0)).complete()
    errors = np.max(np.abs(run.ends - np.concatenate([exact.p[-1], exact.q[-1]])), axis=1)
    assert errors.argmin() == 10
    assert errors[10] < 0.1 * np.delete(errors, 10).min()


@pytest.mark.parametrize(
    ("method", "weights", "sentence"),
    [
        ("rattle/triple_jump4", np.full((4, 5), 0.2), "members have 5 weights each, and rattle/triple_jump4 takes 3 in a step"),
        ("rattle", np.full((4, 5), 0.2), "and rattle is not a composition"),
        ("rattle/triple_jump4", np.full((3, 3), 1 / 3), r"shape \(4, s\), s of each member; this one is of shape \(3, 3\)"),
        ("rattle/triple_jump4", np.full((4, 3), 0.3), "must sum to 1, so that a step has length h; those of member 0 sum to 0.9"),
        ("rattle/triple_jump4", np.full((4, 3), np.nan), "those of member 0 sum to nan"),
    ],
)
def test_weights_that_are_none_are_refused(method, weights, sentence):
    where = ivp("planar")
    with pytest.raises(BadInput, match=sentence):
        run_members(method_of(where, method), members(where, moving(where, 4), 0.1, {}).weighted(weights), request(2), **FEW)


def test_members_that_fail_keep_their_last_state_and_their_reason_and_the_others_go_on():
    method, some = swung(10, h=np.where(np.arange(10) % 3 == 1, 5.0, 0.01))
    some.start[0][6] = [np.nan, 0.0]
    asked = request(60, every=20)
    run = run_members(method, some, asked, **FEW)
    assert run.failed.tolist() == [1, 4, 6, 7]
    assert run.steps[6] == 0
    assert np.all(np.isnan(run.states[1:, 6]))
    assert differences(method, some, asked, run) == []
    assert run.failure(0) is None


def test_vectors_of_failures_end_early():
    """Each would take years otherwise."""
    method, some = swung(2 * LANES, h=50.0)
    run = run_members(method, some, request(10**13), **FEW)
    assert run.failed.tolist() == list(range(2 * LANES))
    assert run.steps.max() < 1000


def test_results_do_not_depend_on_lanes_and_threads():
    method, some = swung(13, h=np.where(np.arange(13) == 5, 5.0, 0.01))
    asked = request(300, every=50)
    for lanes, threads in ((4, 3), (8, 2), (1, 1)):
        assert differences(method, some, asked, run_members(method, some, asked, lanes=lanes, threads=threads)) == [], (lanes, threads)


@pytest.mark.sampled(left_out=("stop",))
@pytest.mark.parametrize("mode", ["stop", "continue"])
def test_a_member_whose_G_loses_rank_goes_on_as_its_own_run_does(mode):
    """Beads on x y = delta: G loses rank where delta is 0, sooner or later by their speed, and one bead is about to lose it."""
    where = make_ivp(source_of(definitions.bowed(0.0), "bowed"), "in")
    method = method_of(where, "rattle")
    delta = np.array([0.0, 0.02, 0.0, 0.0, 0.05])
    x, speed = np.array([-1.0, -1.0, -1.0, -0.05, -1.0]), np.array([1.0, 1.0, 1.3, 1.0, 0.9])
    q = np.stack([x, delta / x], axis=1)
    start = (speed[:, None] * np.stack([np.ones(5), -delta / x**2], axis=1), q)
    some = members(where, start, 0.0303, {"delta": delta})
    asked = request(45, every=10, on_singular=mode)
    run = run_members(method, some, asked, **FEW)
    assert differences(method, some, asked, run) == []
    assert run.failed.tolist() == ([0, 2, 3] if mode == "stop" else [])
    assert all("G loses rank at about t" in run.failure(i) for i in run.failed)


def test_a_member_that_leaves_its_domain_says_so():
    where = initial_value_problem("lotka_volterra", None, None)
    method = method_of(where, "rk4", anyway=True)
    some = members(where, moving(where, 5), np.array([0.01, 3.0, 0.02, 5.0, 0.1]), {})
    asked = request(40)
    run = run_members(method, some, asked, **FEW)
    assert {1, 3} <= set(run.failed.tolist())
    assert 0 not in run.failed
    assert differences(method, some, asked, run) == []


def test_starts_that_do_not_fit_are_refused_in_one_sentence():
    where = ivp("planar")
    start = moving(where, 3)
    with refused("member-starts-shape"):
        members(where, (start[0], start[1][:2]), 0.01, {})
    with refused("member-step-not-positive"):
        members(where, start, np.array([0.1, -0.1, 0.1]), {})
    with refused("member-values-malformed"):
        members(where, start, 0.1, {"mass": [1.0, np.inf, 1.0]})
    with refused("member-parameter-unknown"):
        members(where, start, 0.1, {"weight": [1.0, 2.0, 1.0]})


def test_states_that_do_not_fit_into_memory_are_refused():
    method, some = swung(1000)
    with refused("states-exceed-memory"):
        run_members(method, some, request(10**9, every=1), **FEW)


FORMS = ("rattle/suzuki4", "se+proj", "rk4+symproj", "midpoint/suzuki4+proj", "baumgarte:rk4", "stiff:midpoint", "local:gauss2")
PLACES = ("slider_crank", "andrews_squeezer", "torus", "butane", "relativistic", "stretched-M")
PAIRS = [
    *itertools.product(registry(), ["double_pendulum"]),
    *itertools.product(FORMS, ["spherical_pendulum"]),
    *itertools.product([*poisson_registry(), "strang/suzuki4"], ["lotka_volterra", "free_rigid_body"]),
    *itertools.product(["rattle"], PLACES),
]
GATE = ("rattle/suzuki4-spherical_pendulum", "symplectic_euler-lotka_volterra")


@pytest.mark.sampled(by=lambda case: case in GATE)
@pytest.mark.slow
@pytest.mark.parametrize(("name", "place"), PAIRS)
def test_every_scheme_has_the_bits_of_its_own_run(name, place):
    where = ivp(place) if place in IVPS else initial_value_problem(place)
    method = method_of(where, name, anyway=len(where.start) == 1)
    if why := method.refusal(where):
        pytest.skip(why)
    some = members(where, moving(where, 5), 0.001 if place in PLACES else 0.01, {})
    asked = request(60, every=20)
    assert differences(method, some, asked, run_members(method, some, asked, **FEW)) == []
