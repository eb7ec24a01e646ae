"""Where G loses rank: runs stop in time or say which branch they took; redundant constraints are named, or solved by least squares."""

import dataclasses
import json
import math
from itertools import pairwise

import definitions
import numpy as np
import pytest
import uncompiled
from runs import method

from daebench.compiler.definition import source_of
from daebench.compiler.linear.kernels import array_solver
from daebench.diagnostics.consistency import require_consistent
from daebench.diagnostics.freedom import dependence
from daebench.diagnostics.passage import Crossing, extrapolated
from daebench.diagnostics.problem.check import held
from daebench.diagnostics.rank import zero_of
from daebench.errors import BadInput, DaebenchError, InconsistentStart
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.methods.plan import plan
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request

FIXED = ("rattle", "symplectic_euler", "shake", "lobatto3", "radau2_index2", "radau3_ggl", "se", "rk4", "energy_momentum", "rk4+proj")


def angle_of_lock_up():
    """Angle of the slider crank with equal unit bars of mass 1 from rest at 0, through the lock-up with x2 = 2 cos phi, by SciPy."""
    from scipy.integrate import solve_ivp

    def lagrange(t, x):
        phi, rate = x
        s, c = math.sin(phi), math.cos(phi)
        inertia, slope = _inertia(s), _inertia_slope(s, c)
        return [rate, (-9.81 * c - 0.5 * slope * rate * rate) / inertia]

    def perpendicular(t, x):
        return x[0] + math.pi / 2

    return solve_ivp(lagrange, (0, 1.2), [0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-12, dense_output=True, events=perpendicular)


def _inertia(s):
    """2 T / phi'^2: with v = (-s, c) and w = (-2 s, 0), crank v.v/3, rod (v.v + v.w + w.w)/3, slider w.w."""
    return 1 / 3 + (1 + 2 * s * s + 4 * s * s) / 3 + 4 * s * s


def _inertia_slope(s, c):
    return 2 * s * c * (6 / 3 + 4)


@pytest.fixture(scope="module")
def reference():
    found = angle_of_lock_up()
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


REDUNDANT = {"a multiple": lambda g1, g2: [3 * g1], "a combination": lambda g1, g2: [g1 - 2 * g2]}


@pytest.mark.parametrize("name", ["rattle", "lobatto3", "rk4", "rattle/suzuki4", "energy_momentum", "radau3_ggl"], ids=lambda name: name)
def test_a_run_stops_in_the_steps_before_the_lock_up_and_keeps_what_there_is(name, lock_up, reference):
    h = 0.01
    run = method(name).solve(lock_up, Request(value=h, t_end=1.2))
    assert reference[1] - 2.5 * h < run.t[-1] < reference[1]
    assert "slider_crank, case lock_up, stopped at t" in run.failure
    assert "G loses rank at about t = 0.8" in run.failure
    assert "--on-singular continue" in run.failure
    assert len(run.q) == run.steps + 1
    assert np.all(np.isfinite(run.q))
    phi = reference[0].sol(run.t[-1])[0]
    assert np.abs(run.q[-1] - [math.cos(phi), math.sin(phi), 2 * math.cos(phi)]).max() < 2e-3


def test_the_extrapolated_time_is_the_true_one(lock_up, reference):
    run = method("rattle/suzuki4").solve(lock_up, Request(value=0.005, t_end=1.2))
    said = float(run.failure.split("about t = ")[1].split(",")[0])
    assert said == pytest.approx(reference[1], abs=1e-5)


def test_going_on_follows_the_smooth_branch_and_says_so(lock_up, reference):
    run = method("rattle").solve(lock_up, Request(value=0.002, t_end=1.1, on_singular="continue", every=50)).complete()
    (passage,) = run.passages
    assert passage.branch == "through"
    assert passage.turn < 0.1
    assert passage.t == pytest.approx(reference[1], abs=1e-4)
    assert passage.pivot < 1e-5
    phi = reference[0].sol(run.t)[0]
    assert np.abs(run.q[:, 2] - 2 * np.cos(phi)).max() < 1e-3
    assert run.q[-1, 2] < -0.5


def test_the_case_decides_where_nothing_is_asked_and_the_request_decides_over_it():
    where = initial_value_problem("four_bar", "iftomm")
    assert where.on_singular == "continue"
    run = method("rattle").solve(where, Request(value=0.005, t_end=0.8)).complete()
    assert [each.branch for each in run.passages] == ["through"]
    assert run.passages[0].t == pytest.approx(0.71436, abs=2e-4)
    stopped = method("rattle").solve(where, Request(value=0.005, t_end=0.8, on_singular="stop"))
    assert "G loses rank" in stopped.failure


def test_pieces_of_a_run_do_not_forget_the_steps_before(lock_up, monkeypatch):
    whole = method("rattle").solve(lock_up, Request(value=0.01, t_end=1.2))
    monkeypatch.setattr("daebench.methods.fixed_step.stepping.CHUNK_SECONDS", 1e-9)
    assert method("rattle").solve(lock_up, Request(value=0.01, t_end=1.2)).failure == whole.failure


def test_a_loss_of_rank_in_the_first_steps_is_noticed_too(lock_up, reference):
    t, h = reference[1] - 0.015, 0.01
    phi, rate = reference[0].sol(t)
    s, c = math.sin(phi), math.cos(phi)
    v = np.array([-s, c, -2 * s]) * rate
    M = lock_up.value("mass", lock_up.p0, lock_up.q0)
    close = dataclasses.replace(lock_up, q0=np.array([c, s, 2 * c]), p0=M @ v)
    run = method("rattle").solve(close, Request(value=h, steps=20))
    assert run.steps == 0
    assert float(run.failure.split("about t = ")[1].split(",")[0]) == pytest.approx(0.015, abs=1e-4)
    gone_on = method("rattle").solve(close, Request(value=h, steps=20, on_singular="continue")).complete()
    assert [each.branch for each in gone_on.passages] == ["through"]


def bowed(d):
    return make_ivp(source_of(definitions.bowed(d), "bowed"), "in")


@pytest.mark.parametrize(("delta", "lost"), [(0.0, True), (0.02, False)], ids=["crossing", "resolved"])
def test_one_constraint_is_watched_though_its_relative_pivot_is_always_one(delta, lost):
    run = method("rattle").solve(bowed(delta), Request(value=0.0303, t_end=1.5))
    assert (run.failure is not None) == lost
    if lost:
        assert run.t[-1] < 1.0
        assert "G loses rank at about t = 1," in run.failure
        gone_on = method("rattle").solve(bowed(delta), Request(value=0.0303, t_end=1.5, on_singular="continue")).complete()
        assert [each.branch for each in gone_on.passages] == ["through"]


def test_the_alarm_is_for_steps_that_do_not_resolve_a_minimum():
    from daebench.compiler.link import Linker, Options

    source = bowed(0.0).source
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


def test_steps_that_are_too_large_to_tell_a_branch_say_that_it_is_unknown(lock_up):
    M = lock_up.value("mass", lock_up.p0, lock_up.q0)
    crossing = Crossing(lock_up, 0.0, -0.4, lock_up.p0 + M @ [1, 0, 2], lock_up.q0, 1e-4)
    for t in (0.6, 1.6, 2.6):
        crossing.add(t, M @ [math.cos(t), math.sin(t), 2 * math.cos(2 * t)], lock_up.q0, t * 1e-4)
    assert crossing.passage.branch == "unknown"


def test_extrapolation_is_exact_for_parabolas_and_squares():
    points = [(t, np.array([1 - t, t * t])) for t in (0.5, 1.0, 2.5)]
    assert extrapolated(points, -1.0) == pytest.approx([2.0, 1.0], abs=1e-14)
    assert zero_of((1.0, 3.0), (16.0, 4.0)) == pytest.approx(5.0)


@pytest.mark.parametrize("case", REDUNDANT, ids=list(REDUNDANT))
@pytest.mark.parametrize("name", FIXED, ids=FIXED)
def test_least_squares_give_the_motion_without_the_redundant_constraints(name, case):
    settings = {"value": 0.02, "steps": 8, "every": 0}
    without = method(name).solve(plain(), Request(**settings)).complete()
    twice = method(name).solve(doubled(REDUNDANT[case]), Request(**settings, on_singular="least-squares")).complete()
    assert np.abs(twice.q - without.q).max() < 1e-13
    assert np.abs(twice.p - without.p).max() < 1e-12
    assert not twice.passages


@pytest.mark.parametrize("name", ["rattle", "lobatto3"], ids=lambda name: name)
def test_least_squares_give_the_force_of_constraint_and_share_it(name):
    settings = {"value": 0.02, "steps": 5, "raw": True, "multipliers": True}
    one, two = plain(), doubled(lambda g1, g2: [g1])
    without = method(name).solve(one, Request(**settings)).complete()
    twice = method(name).solve(two, Request(**settings, on_singular="least-squares")).complete()
    assert np.abs(twice.lam[:, 0] - twice.lam[:, 2]).max() < 1e-12
    assert np.abs(twice.lam[:, 0] + twice.lam[:, 2] - without.lam[:, 0]).max() < 1e-12
    for each in without.raw:
        (_, alone), (_, shared) = without.raw[each], twice.raw[each]
        assert np.abs(shared[:, 0] + shared[:, 2] - alone[:, 0]).max() < 1e-9
        assert np.abs(shared[:, 1] - alone[:, 1]).max() < 1e-9


def test_least_squares_do_not_change_a_run_whose_constraints_are_independent():
    settings = {"value": 0.01, "steps": 50}
    usual = method("rattle").solve(plain(), Request(**settings)).complete()
    other = method("rattle").solve(plain(), Request(**settings, on_singular="least-squares")).complete()
    assert np.abs(other.q - usual.q).max() < 1e-13


@pytest.mark.parametrize("dtype", ["float64", "float32", "complex128"])
@pytest.mark.parametrize(("n", "rank"), [(4, 4), (5, 3), (6, 1)], ids=["regular", "deficient", "rank one"])
def test_the_least_squares_solver_agrees_with_the_pseudoinverse(dtype, n, rank, random):
    B = random.normal(size=(n, rank))
    A, b = B @ B.T, B @ B.T @ random.normal(size=n)
    names = {"numpy": np, **vars(np), "abs": abs, "max": max}
    exec(array_solver("least_squares", "solve", n, dtype), names)
    x, pivot = names["solve"](A.tolist(), b.tolist())
    eps = 1e-4 if dtype == "float32" else 1e-12
    assert np.abs(A @ np.real(x) - b).max() < eps * np.abs(b).max()
    assert 1e-6 < pivot <= 1
    rows = np.abs(A).max(axis=1)
    columns = np.abs(A / rows[:, None]).max(axis=0)
    least = np.linalg.pinv(A / rows[:, None] / columns, rcond=1e-9) @ (b / rows) / columns
    assert np.abs(np.real(x) - least).max() < 100 * eps * np.abs(least).max()


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


def test_dependent_constraints_are_named():
    assert dependence(plain()) is None
    assert "rank 2 of 3: g3 is a combination of g1, also nearby, so the constraints are redundant" in dependence(
        doubled(REDUNDANT["a multiple"])
    )
    assert "g3 is a combination of g1 and g2, also nearby" in dependence(doubled(REDUNDANT["a combination"]))


def test_a_check_of_the_problem_names_dependent_constraints_unless_the_case_asks_for_least_squares():
    what = "constraints independent at the start"
    assert [each.fault for each in held(plain()) if each.what == what] == [""]
    twice = doubled(REDUNDANT["a multiple"])
    (fault,) = (each.fault for each in held(twice) if each.what == what)
    assert "G has rank 2 of 3: g3 is a combination of g1" in fault
    assert fault.endswith("which finds multipliers of least norm.")
    bent = {"bent": dataclasses.replace(twice.source.define().cases["bent"], on_singular="least-squares")}
    assert [each.fault for each in held(doubled(REDUNDANT["a multiple"], cases=bent)) if each.what == what] == [""]


def test_a_start_off_the_manifold_is_said_with_the_constraint():
    off = dataclasses.replace(plain(), q0=plain().q0 + np.array([0, 0, 0.1, 0]))
    with pytest.raises(InconsistentStart, match=r"\|g\| = \S+ \(g2\) and \|G H_p\| = "):
        require_consistent(off)


def test_a_start_in_a_singular_configuration_is_told_from_redundancy(lock_up):
    there = dataclasses.replace(lock_up, q0=np.array([0.0, -1.0, 0.0]), p0=np.zeros(3))
    assert "rank 1 of 2: g2 is a combination of g1, there, though not nearby" in dependence(there)


@pytest.mark.parametrize("name", ["rattle", "ida:index1", "ida:index3", "ida:ode", "scipy:DOP853"], ids=lambda name: name)
@pytest.mark.usefixtures("plain_functions")
def test_redundant_constraints_are_told_at_the_start_in_one_sentence(name):
    where, fixed = doubled(REDUNDANT["a multiple"]), name == "rattle"
    says = r"G M\^-1 G\^T is singular .*g3 is a combination of g1, .* redundant; remove .*--on-singular least-squares"
    if fixed:
        with pytest.raises(DaebenchError, match=says):
            method(name).solve(where, Request(value=0.01, steps=5)).complete()
    else:
        with pytest.raises(DaebenchError, match=says):
            parse(name).solve(where, Request(value=1e-6, t_end=0.1))


@pytest.mark.parametrize("name", ["ida:index2", "ida:ggl"], ids=lambda name: name)
def test_formulations_with_multipliers_refuse_least_squares(name):
    with pytest.raises(BadInput, match=r"multipliers among its unknowns.* use ida:ode or a fixed-step method"):
        parse(name).check(plain(), Request(value=1e-6, t_end=1, on_singular="least-squares"))


@pytest.mark.parametrize("name", ["ida:ode", "cvode:adams", "scipy:DOP853"], ids=lambda name: name)
def test_the_reduced_equation_by_least_squares_moves_as_without_the_redundant_constraint(name, monkeypatch):
    monkeypatch.setattr("daebench.methods.solvers.least_squares.COMPILED", False)
    request = Request(value=1e-9, t_end=0.3, points=2, on_singular="least-squares")
    without = parse(name).solve(plain(), request).complete()
    twice = parse(name).solve(doubled(REDUNDANT["a multiple"]), request).complete()
    assert np.abs(twice.q[-1] - without.q[-1]).max() < 1e-11
    assert twice.q[-1] == pytest.approx(method("lobatto4").solve(plain(), Request(value=0.01, t_end=0.3)).q[-1], abs=1e-7)


@pytest.mark.parametrize("name", ["ida:index1", "ida:index2", "ida:index3", "ida:ggl", "cvode:bdf", "scipy:Radau"], ids=lambda name: name)
@pytest.mark.usefixtures("plain_functions")
def test_tolerance_driven_runs_stop_before_the_lock_up(name, lock_up, reference):
    run = parse(name).solve(lock_up, Request(value=1e-6, t_end=1.2))
    assert reference[1] - 0.12 < run.t[-1] < reference[1]
    said = float(run.failure.split("about t = ")[1].split(" ")[0])
    assert said == pytest.approx(reference[1], abs=5e-3)
    assert "--on-singular continue" in run.failure


@pytest.mark.usefixtures("plain_functions")
def test_steps_that_leap_over_a_loss_of_rank_are_searched_inside():
    run = parse("scipy:DOP853").solve(initial_value_problem("four_bar", "iftomm"), Request(value=1e-6, t_end=1, on_singular="stop"))
    assert run.t[-1] < 0.714
    assert float(run.failure.split("about t = ")[1].split(" ")[0]) == pytest.approx(0.71436, abs=2e-4)


@pytest.mark.usefixtures("plain_functions")
def test_tolerance_driven_runs_that_go_on_say_which_branch(lock_up, reference):
    run = parse("cvode:bdf").solve(lock_up, Request(value=1e-8, t_end=1.2, on_singular="continue")).complete()
    assert [each.branch for each in run.passages] == ["through"]
    assert np.abs(run.q[:, 2] - 2 * np.cos(reference[0].sol(run.t)[0])).max() < 1e-5


@pytest.mark.slow
def test_ida_on_index_2_says_which_branch_it_took_at_the_lock_up(lock_up):
    run = parse("ida:index2").solve(lock_up, Request(value=1e-10, t_end=1.2, on_singular="continue")).complete()
    (passage,) = run.passages
    on_slide = abs(run.q[-1, 2]) > 1e-3
    assert passage.branch == ("through" if on_slide else "other branch")
    assert passage.pivot < 1e-6


@pytest.mark.usefixtures("plain_functions")
def test_no_alarm_where_the_rank_is_kept():
    regular = initial_value_problem("slider_crank", "turning")
    for name, resolution in (("rattle", 0.02), ("rk4", 0.02)):
        assert method(name).solve(regular, Request(value=resolution, t_end=2)).failure is None
    for name in ("ida:index1", "scipy:DOP853"):
        run = parse(name).solve(regular, Request(value=1e-5, t_end=2, on_singular="stop"))
        assert run.failure is None


def test_what_to_do_is_checked():
    with pytest.raises(BadInput, match="unknown on_singular 'contnue'; did you mean continue"):
        plan("slider_crank", method="rattle", h=0.1, steps=1, on_singular="contnue")
    with pytest.raises(BadInput, match="Poisson system, which has no constraints"):
        plan("lotka_volterra", method="strang", h=0.1, steps=1, on_singular="continue")


@pytest.mark.slow
def test_the_command_line_takes_what_to_do_and_tells_the_branch(daebench):
    words = ("run", "slider_crank", "--case", "lock_up", "--method", "rattle", "--h", 0.01, "--t-end", 1)
    code, out, _ = daebench(*words, "--json")
    assert code == 1
    assert "G loses rank" in json.loads(out)["failure"]
    code, out, _ = daebench(*words, "--on-singular", "continue", "--json")
    assert code == 0
    (passage,) = json.loads(out)["passages"]
    assert passage["branch"] == "through"
    code, out, _ = daebench(*words, "--on-singular", "continue")
    assert "t = 0.8873" in out
    assert "through (turn" in out


@pytest.mark.slow
def test_compare_takes_what_to_do_too(daebench):
    words = ("compare", "slider_crank", "--case", "lock_up", "--methods", "rattle", "--h", 0.01, "--t-end", 1)
    assert daebench(*words)[0] == 1
    assert daebench(*words, "--on-singular", "continue")[0] == 0
