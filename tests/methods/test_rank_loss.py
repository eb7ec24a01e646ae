"""Where G loses rank: runs stop in time or say which branch they took; redundant constraints are named, or solved by least squares."""

import dataclasses
import math
import re
from itertools import pairwise

import definitions
import numpy as np
import pytest
import uncompiled
from measures import error_of
from refusals import refused
from runs import method
from scipy.integrate import solve_ivp

from daebench.compiler.definition import source_of
from daebench.compiler.linear.kernels import array_solver
from daebench.compiler.link import Linker, Options
from daebench.diagnostics.passage import Crossing, extrapolated
from daebench.diagnostics.rank import zero_of
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.methods.plan import plan
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request


@pytest.fixture(scope="module")
def reference():
    """Return the angle of the slider crank with equal unit bars of mass 1 from rest at 0, x2 = 2 cos phi, by SciPy, and its time at -pi/2.

    2 T / phi'^2 is, with v = (-s, c) and w = (-2 s, 0), of the crank v.v/3, the rod (v.v + v.w + w.w)/3, the slider w.w: 2/3 + 6 s^2.
    """

    def lagrange(t, x):
        s, c = math.sin(x[0]), math.cos(x[0])
        return [x[1], (-9.81 * c - 6 * s * c * x[1] ** 2) / (2 / 3 + 6 * s * s)]

    def perpendicular(t, x):
        return x[0] + math.pi / 2

    found = solve_ivp(lagrange, (0, 1.2), [0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-12, dense_output=True, events=perpendicular)
    return found, float(found.t_events[0][0])


@pytest.fixture(scope="module")
def lock_up():
    return initial_value_problem("slider_crank", "lock_up")


def doubled(extra, **more):
    """Double pendulum of ``definitions`` with further constraints that depend on its two."""
    base = definitions.double_pendulum()
    return make_ivp(source_of(dataclasses.replace(base, g=[*base.g, *extra(*base.g)], **more), "doubled"), "bent")


def plain():
    return make_ivp(source_of(definitions.double_pendulum(), "plain"), "bent")


def told(run):
    """Return the time at which a run says that G loses rank."""
    return float(re.search(r"G loses rank at about t = ([\d.]+\d)", run.failure)[1])


@pytest.mark.parametrize("name", ["rattle", "lobatto3", "rk4", "rattle/suzuki4", "energy_momentum", "radau3_ggl"], ids=lambda name: name)
def test_a_run_stops_in_the_steps_before_the_lock_up_and_keeps_what_there_is(name, lock_up, reference):
    h = 0.01
    run = method(name).solve(lock_up, Request(value=h, t_end=1.2))
    assert reference[1] - 2.5 * h < run.t[-1] < reference[1]
    assert told(run) == pytest.approx(reference[1], abs=1e-5 if name == "rattle/suzuki4" else 1e-2)
    assert "--on-singular continue" in run.failure
    assert len(run.q) == run.steps + 1
    assert np.all(np.isfinite(run.q))
    phi = reference[0].sol(run.t[-1])[0]
    assert error_of(run.q[-1], [math.cos(phi), math.sin(phi), 2 * math.cos(phi)]) < 2e-3


def test_going_on_follows_the_smooth_branch_and_says_so(lock_up, reference):
    run = method("rattle").solve(lock_up, Request(value=0.002, t_end=1.1, on_singular="continue", every=50)).complete()
    (passage,) = run.passages
    assert passage.branch == "through"
    assert passage.turn < 0.1
    assert passage.t == pytest.approx(reference[1], abs=1e-4)
    assert passage.pivot < 1e-5
    phi = reference[0].sol(run.t)[0]
    assert error_of(run.q[:, 2], 2 * np.cos(phi)) < 1e-3
    assert run.q[-1, 2] < -0.5


def test_the_case_decides_where_nothing_is_asked_and_the_request_decides_over_it():
    where = initial_value_problem("four_bar", "iftomm")
    assert where.on_singular == "continue"
    run = method("rattle").solve(where, Request(value=0.005, t_end=0.8)).complete()
    assert [each.branch for each in run.passages] == ["through"]
    assert run.passages[0].t == pytest.approx(0.71436, abs=2e-4)
    assert told(method("rattle").solve(where, Request(value=0.005, t_end=0.8, on_singular="stop"))) == pytest.approx(0.71436, abs=1e-3)


def test_pieces_of_a_run_do_not_forget_the_steps_before(lock_up, monkeypatch):
    whole = method("rattle").solve(lock_up, Request(value=0.01, t_end=1.2))
    monkeypatch.setattr("daebench.methods.fixed_step.stepping.CHUNK_SECONDS", 1e-9)
    assert method("rattle").solve(lock_up, Request(value=0.01, t_end=1.2)).failure == whole.failure


@pytest.mark.parametrize("branch", ["through", "other branch", "reflected"])
def test_the_branch_is_told_by_the_velocity_after(branch, lock_up):
    h, rate = 0.01, 2.0
    M = lock_up.value("mass", lock_up.p0, lock_up.q0)

    def state(t):
        turned = abs(t) if branch == "reflected" else t
        phi = -math.pi / 2 + (-1 if branch == "reflected" else 1) * rate * turned
        along = rate * (1 if branch != "reflected" else math.copysign(1, -t))
        s, c = math.sin(phi), math.cos(phi)
        straight = branch == "other branch" and t > 0
        q, v = (np.array([c, s, 0]), np.array([-s, c, 0])) if straight else (np.array([c, s, 2 * c]), np.array([-s, c, -2 * s]))
        return M @ v * along, q

    p, q = state(-0.4 * h)
    crossing = Crossing(lock_up, 0.0, -0.4 * h, p, q, 1e-4)
    for k in range(3):
        assert not crossing.over
        crossing.add((k + 0.6) * h, *state((k + 0.6) * h), 1e-4 * (k + 1))
    assert crossing.over
    assert crossing.passage.branch == branch
    v, w = np.array([1, 0, 2.0]), np.array([1, 0, 0.0])
    between = math.degrees(math.acos(v @ M @ w / math.sqrt((v @ M @ v) * (w @ M @ w))))
    expected = {"through": 0.0, "other branch": between, "reflected": 180.0}[branch]
    assert crossing.passage.turn == pytest.approx(expected, abs=0.5)


def test_extrapolation_is_exact_for_parabolas_and_squares():
    points = [(t, np.array([1 - t, t * t])) for t in (0.5, 1.0, 2.5)]
    assert extrapolated(points, -1.0) == pytest.approx([2.0, 1.0], abs=1e-14)
    assert zero_of((1.0, 3.0), (16.0, 4.0)) == pytest.approx(5.0)


@pytest.mark.parametrize("dtype", ["float64", "float32", "complex128"])
@pytest.mark.parametrize(("n", "rank"), [(4, 4), (5, 3), (6, 1)], ids=["regular", "deficient", "rank one"])
def test_the_least_squares_solver_agrees_with_the_pseudoinverse(dtype, n, rank, random):
    B = random.normal(size=(n, rank))
    A, b = B @ B.T, B @ B.T @ random.normal(size=n)
    names = {"numpy": np, **vars(np), "abs": abs, "max": max}
    exec(array_solver("least_squares", "solve", n, dtype), names)
    x, pivot = names["solve"](A.tolist(), b.tolist())
    eps = 1e-4 if dtype == "float32" else 1e-12
    assert error_of(A @ np.real(x), b) < eps * np.abs(b).max()
    assert 1e-6 < pivot <= 1
    rows = np.abs(A).max(axis=1)
    columns = np.abs(A / rows[:, None]).max(axis=0)
    least = np.linalg.pinv(A / rows[:, None] / columns, rcond=1e-9) @ (b / rows) / columns
    assert error_of(np.real(x), least) < 100 * eps * np.abs(least).max()


def test_the_least_squares_solver_carries_a_derivative_and_refuses_what_is_not_finite(random):
    B, dB = random.normal(size=(5, 2)), random.normal(size=(5, 2))
    names = {"numpy": np, **vars(np), "abs": abs, "max": max}
    exec(array_solver("least_squares", "solve", 5, "complex128"), names)

    def force(e):
        C = B + e * dB
        return C.T @ np.array(names["solve"]((C @ C.T).tolist(), (C @ [1 + 2 * e, 1 - e]).tolist())[0])

    assert force(0) == pytest.approx([1, 1], abs=1e-12)
    assert force(1e-30j).imag / 1e-30 == pytest.approx([2, -1], abs=1e-11)
    assert math.isnan(names["solve"]([[math.nan] * 5] * 5, [1.0] * 5)[1])
    assert names["solve"]([[0.0] * 5] * 5, [1.0] * 5)[1] == 0


def test_formulations_with_multipliers_refuse_least_squares():
    for name in ("ida:index2", "ida:ggl"):
        with refused("multipliers-redundant"):
            parse(name).check(plain(), Request(value=1e-6, t_end=1, on_singular="least-squares"))


def test_the_reduced_equation_by_least_squares_moves_as_without_the_redundant_constraint(monkeypatch):
    monkeypatch.setattr("daebench.methods.solvers.least_squares.COMPILED", False)
    request = Request(value=1e-9, t_end=0.3, points=2, on_singular="least-squares")
    without = parse("ida:ode").solve(plain(), request).complete()
    twice = parse("ida:ode").solve(doubled(lambda g1, g2: [g1 - 2 * g2]), request).complete()
    assert error_of(twice.q[-1], without.q[-1]) < 1e-11
    assert twice.q[-1] == pytest.approx(method("lobatto4").solve(plain(), Request(value=0.01, t_end=0.3)).q[-1], abs=1e-7)


@pytest.mark.parametrize("name", ["ida:index2", "cvode:bdf", "scipy:Radau"])
@pytest.mark.usefixtures("plain_functions")
def test_tolerance_driven_runs_stop_before_the_lock_up(name, lock_up, reference):
    run = parse(name).solve(lock_up, Request(value=1e-6, t_end=1.2))
    assert reference[1] - 0.12 < run.t[-1] < reference[1]
    assert told(run) == pytest.approx(reference[1], abs=5e-3)


@pytest.mark.usefixtures("plain_functions")
def test_steps_that_leap_over_a_loss_of_rank_are_searched_inside():
    run = parse("scipy:DOP853").solve(initial_value_problem("four_bar", "iftomm"), Request(value=1e-6, t_end=1, on_singular="stop"))
    assert run.t[-1] < 0.714
    assert told(run) == pytest.approx(0.71436, abs=2e-4)


@pytest.mark.usefixtures("plain_functions")
def test_tolerance_driven_runs_that_go_on_say_which_branch(lock_up, reference):
    run = parse("cvode:bdf").solve(lock_up, Request(value=1e-8, t_end=1.2, on_singular="continue")).complete()
    assert [each.branch for each in run.passages] == ["through"]
    assert error_of(run.q[:, 2], 2 * np.cos(reference[0].sol(run.t)[0])) < 1e-5


def test_a_poisson_system_has_no_rank_to_lose():
    with refused("constraints-needed"):
        plan("lotka_volterra", method="strang", h=0.1, steps=1, on_singular="continue")


@pytest.mark.usefixtures("plain_functions")
def test_no_alarm_where_the_rank_is_kept():
    regular = initial_value_problem("slider_crank", "turning")
    for name, value in (("rattle", 0.02), ("rk4", 0.02), ("ida:index1", 1e-5), ("scipy:DOP853", 1e-5)):
        chosen = parse(name) if ":" in name else method(name)
        assert chosen.solve(regular, Request(value=value, t_end=2, on_singular="stop")).failure is None


def test_a_loss_of_rank_in_the_first_steps_is_noticed_too(lock_up, reference):
    t, h = reference[1] - 0.015, 0.01
    phi, rate = reference[0].sol(t)
    s, c = math.sin(phi), math.cos(phi)
    M = lock_up.value("mass", lock_up.p0, lock_up.q0)
    close = dataclasses.replace(lock_up, q0=np.array([c, s, 2 * c]), p0=M @ [-s, c, -2 * s] * rate)
    run = method("rattle").solve(close, Request(value=h, steps=20))
    assert run.steps == 0
    assert told(run) == pytest.approx(0.015, abs=1e-4)
    gone_on = method("rattle").solve(close, Request(value=h, steps=20, on_singular="continue")).complete()
    assert [each.branch for each in gone_on.passages] == ["through"]


def test_the_alarm_is_for_steps_that_do_not_resolve_a_minimum():
    source = source_of(definitions.bowed(0.0), "bowed")
    text = Linker(source.derivation, Options(compiled=False, singular="watch")).module(
        "Rank.", [("daebench.schemes.kernels.rank", "lost")], False
    )
    lost = uncompiled.run(text, "lost").lost

    def alarms(h, delta, shift):
        pivots = [delta**2 + (k * h + shift) ** 2 for k in range(-40, 41)]
        states = [(0.0, b, a) for a, b in pairwise(pivots)]
        return any(lost(a, b, ()) for a, b in pairwise(states))

    shifts = np.linspace(0, 1, 23)[:-1]
    assert all(alarms(1.0, 0.0, shift) for shift in shifts)
    assert not any(alarms(1.0, 0.7, shift) for shift in shifts)
    assert not any(alarms(1.0, 5.0, shift) for shift in shifts)
    rough = [1.0, 1.0, 0.01, 1.0, 1.0]
    states = [(0.0, b, a) for a, b in pairwise(rough)]
    assert not any(lost(a, b, ()) for a, b in pairwise(states))


@pytest.mark.parametrize("name", ["rattle", "lobatto3"], ids=lambda name: name)
def test_least_squares_give_the_force_of_constraint_and_share_it(name):
    settings = {"value": 0.02, "steps": 5, "raw": True, "multipliers": True}
    one, two = plain(), doubled(lambda g1, g2: [g1])
    without = method(name).solve(one, Request(**settings)).complete()
    twice = method(name).solve(two, Request(**settings, on_singular="least-squares")).complete()
    assert error_of(twice.lam[:, 0], twice.lam[:, 2]) < 1e-12
    assert error_of(twice.lam[:, 0] + twice.lam[:, 2], without.lam[:, 0]) < 1e-12
    for each in without.raw:
        (_, alone), (_, shared) = without.raw[each], twice.raw[each]
        assert error_of(shared[:, 0] + shared[:, 2], alone[:, 0]) < 1e-9
        assert error_of(shared[:, 1], alone[:, 1]) < 1e-9
