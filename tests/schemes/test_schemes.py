"""Every scheme on every kind of problem: what it claims is what is measured. Kernels run uncompiled here."""

from dataclasses import replace

import numpy as np
import pytest
from covering import LARGE, design
from ivps import ALIKE, IVPS, ivp
from oracles import solution
from planted import plant
from refusals import refused

from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.energy_verdict import energy_error
from daebench.diagnostics.order import fit_order
from daebench.diagnostics.reversibility import reversibility_defect
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis
from daebench.errors import InvalidProblem
from daebench.methods.catalogue import schemes
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.runs.request import Request

ROUND_OFF = 1e-12
NO_SUCH = ("boris", "rattle_conformal", "rattle_settle")
"""Schemes for a magnetic force, for damping and for water, which no problem of the sweep has: they have tests of their own."""
ALIAS = {"fig1.1": "spherical-slow", "fig1.2b": "spherical-fast", "rotating": "planar"}


PLACES = (*IVPS, "knife_edge")
"""Those of all sweeps, and a problem for the schemes that need a constraint on velocities."""

MEASURED = [name for name in schemes() if name not in NO_SUCH]


def stepped(scheme):
    return FixedStep(scheme, compiled=False)


def run(method, ivp, h, steps, **more):
    return method.solve(ivp, Request(value=h, steps=steps, **more)).complete()


def state_error(name, trajectory, T):
    q, p = solution(name, T)
    return max(np.abs(trajectory.q[-1] - q).max(), np.abs(trajectory.p[-1] - p).max())


COUNTS = (2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 16, 18, 20, 22, 24, 27, 30, 34, 38, 42, 48)
"""Numbers of steps of methods of order 3 and more, close together: between the first asymptotic error and 2e-12 there is little room."""

MANY = 6
"""Positions from which on every other of them is enough: there a step takes long."""

ROOM = {8: {"planar": 2.0, "stretched-M": 2.0, "planar_pendulum": 2.0, "spherical-slow": 2.0, "relativistic": 1.0}, 10: {"planar": 1.0}}
"""For the highest orders, the problems that have this room, and T there: elsewhere the first error that is asymptotic is round-off."""


FAST = {
    **{order: {"double_wishbone": 0.05} for order in (1, 3, 5)},
    4: {"double_wishbone": 0.05, "rssr_four_bar": 0.25},
    2: {"double_wishbone": 0.1},
    6: {"andrews_squeezer": 0.5, "double_wishbone": 0.11},
    8: {"andrews_squeezer": 1.0, "double_wishbone": 0.2},
    10: {"andrews_squeezer": 0.5, "double_wishbone": 0.2},
}
"""By order, the initial value problems that turn several times while others turn once, or whose spring lets go of them, and T there."""

BETTER = {(scheme, "ellipsoid_geodesic"): 2 for scheme in ("symplectic_euler", "symplectic_euler_adjoint", "ggl_vi", "ggl_vi_mod")}
"""Schemes and initial value problems where they have a higher order than they claim: only the force is taken unevenly, and it is zero."""

CONVERGED = {("rattle_lincs", "pendulum_chain"): {"order": 16}}
"""Options with which what a series leaves of the velocities along bonds, a part of h, is too small to be seen beside h^2."""

ROUNDED = {("energy_momentum", "double_wishbone"): 4.0}
"""Roundings that a discrete derivative divides by how far a step leads, as a multiple of :data:`ROUND_OFF`."""


FLOOR = 2e-12
"""Errors below it are round-off where the order is 3 or more."""


UNWATCHED = {"watch": (), "count": False}
"""All checks of a scheme have one kernel, and the flow in complex numbers another one."""


def errors_of(method, ivp, T, counts):
    """Return the errors with these numbers of steps, or until three in a row are round-off, which all finer ones would be."""
    name, errors = ALIAS.get(ivp.case, ivp.problem), []
    for n in counts:
        run = method.solve(ivp, Request(value=T / n, steps=n, **UNWATCHED))
        errors.append(np.nan if run.failure else state_error(name, run, T))
        if len(errors) > 3 and max(errors[-3:]) < FLOOR:
            break
    return errors


DESIGN = {pair for pair in design({name: FixedStep(name).claims for name in schemes()}) if pair[0] in MEASURED}


CAUGHT = {(name, "spherical-fast") for name in ("rk4", "shake", "symplectic_euler", "symplectic_euler_adjoint", "strang", "implicit_euler")}
CAUGHT |= {("rattle", "stretched-M"), ("rattle", "stretched-H")}
"""Pairs by which planted faults are caught."""


def test_each_scheme_meets_two_problems_and_each_problem_two_schemes():
    assert not any(FixedStep(scheme).refusal(ivp(place)) for scheme, place in DESIGN - LARGE)
    for scheme in MEASURED:
        assert sum(of == scheme for of, _ in DESIGN) >= 1 + (not FixedStep(scheme).claims.nonholonomic), scheme
    for place in set(PLACES) - set(ALIKE):
        assert sum(at == place for _, at in DESIGN) >= 2, place


def order_is_claimed(method, each_ivp):
    name = ALIAS.get(each_ivp.case, each_ivp.problem)
    order = BETTER.get((method.scheme, name), method.claims.order)
    method = replace(method, options=method.options | CONVERGED.get((method.scheme, name), {}))
    T = 0.5 if order <= 5 else ROOM.get(order, {}).get(name, 1.0 if order == 6 else 2.0)
    T = FAST.get(order, {}).get(name, T)
    close = COUNTS if each_ivp.d < MANY else COUNTS[::2]
    counts = {1: (64, 128, 256, 512), 2: (32, 64, 128, 256)}.get(order, close)
    if order == 1 and name == "spherical-fast":  # asymptotic later than the others
        counts = (512, 1024, 2048) if method.scheme in ("ggl_vi", "ggl_vi_mod") else (*counts, 1024)
    errors = errors_of(method, each_ivp, T, counts)
    counts = counts[: len(errors)]
    if name in ROOM.get(order, {name: T}):
        fit = fit_order([T / n for n in counts], errors, floor=0.0 if order <= 2 else FLOOR)
        assert abs(fit.slope - order) < (0.15 if order <= 5 else 0.2), (fit, errors)
    else:
        assert_steep(order, T / np.array(counts), np.array(errors))


def assert_steep(order, h, errors):
    """Hold errors between 1e-3 and round-off against a slope somewhat below the claimed one; or four steps must be enough for round-off."""
    seen = (errors < 1e-3) & (errors > FLOOR)
    if np.sum(seen) < 3:
        assert errors[2] < 1e-12, errors
        return
    slope = np.polyfit(np.log(h[seen]), np.log(errors[seen]), 1)[0]
    assert slope > 0.75 * order, (slope, errors)


LAST = {"double_wishbone": 0.18}
"""Ends of the runs on problems whose motion does not go on for long: where its spring lets go of it, it locks after 0.21 s."""


def manifold_errors(method, ivp, h=0.004):
    states = run(method, ivp, min(h, LAST.get(ivp.problem, np.inf) / 60), 60, every=1, **UNWATCHED)
    values = {"g": ivp.along("g", states.q), "Gv": ivp.along("Gv", states.p, states.q)}
    return {name: np.abs(value).max(initial=0.0) for name, value in values.items()}


def step_size(method, ivp):
    """Return a step at which the error of a step is well above round-off, so that what is not kept is seen."""
    h = 0.1 if method.scheme == "livens" else {1: 0.01, 2: 0.01, 3: 0.03, 4: 0.05, 5: 0.05, 6: 0.1}.get(method.claims.order, 0.15)
    return min(h, LAST.get(ivp.problem, np.inf) / 10)


def two_form_defect(method, ivp, steps=10):
    flow = method.flow(ivp, step_size(method, ivp), steps)
    return symplecticity_defect(flow, ivp.p0, ivp.q0, tangent_basis(ivp, ivp.p0, ivp.q0))


def reversal_defect(method, ivp, steps=10):
    return reversibility_defect(method.flow(ivp, step_size(method, ivp), steps), ivp.p0, ivp.q0)


def manifold_is_kept(method, ivp):
    errors = manifold_errors(method, ivp)
    assert not method.claims.keeps_g or errors["g"] < ROUND_OFF
    assert not method.claims.keeps_Gv or errors["Gv"] < ROUND_OFF


def two_form_is_kept(method, ivp):
    assert not method.claims.symplectic or two_form_defect(method, ivp, 5) < ROUND_OFF


def reversal_returns(method, ivp):
    bound = ROUND_OFF * ROUNDED.get((method.scheme, ivp.problem), 1.0)
    assert not method.claims.symmetric or reversal_defect(method, ivp, 5) < bound


CHECKS = (order_is_claimed, manifold_is_kept, two_form_is_kept, reversal_returns)


@pytest.mark.parametrize(
    ("scheme", "place"),
    [pytest.param(*pair, id="-".join(pair), marks=[pytest.mark.slow] * (pair in LARGE)) for pair in sorted(DESIGN | CAUGHT)],
)
def test_a_scheme_is_what_it_claims(scheme, place):
    for check in CHECKS:
        check(stepped(scheme), ivp(place))


def fails(check, method, ivp):
    try:
        check(method, ivp)
    except AssertionError:
        return True
    return False


@pytest.mark.exhaustive
@pytest.mark.parametrize("check", CHECKS, ids=lambda x: x.__name__)
@pytest.mark.parametrize("scheme", MEASURED)
def test_a_scheme_keeps_its_claims_on_every_problem(scheme, check):
    taken = [place for place in PLACES if not stepped(scheme).refusal(ivp(place))]
    assert taken
    assert [place for place in taken if fails(check, stepped(scheme), ivp(place))] == []


ELSEWHERE = {"ggl_vi_mod": "double-pendulum", "livens": "stretched-M"}
"""Schemes that keep more than they claim on a sphere, or where M is constant, and problems where they do not."""


@pytest.mark.parametrize("scheme", [name for name in MEASURED if not FixedStep(name).claims.nonholonomic])
def test_what_is_not_claimed_fails_on_the_fast_pendulum(scheme):
    method, where = stepped(scheme), ivp(ELSEWHERE.get(scheme, "spherical-fast"))
    if "tolerance" in method.member.options:  # a single constraint holds to round-off by chance at a tight one
        method = replace(method, options={"tolerance": 1e-2})
    if "iterations" in method.member.options:
        pytest.skip("of a single constraint the expansion has one term, which is exact")
    claims = method.claims
    assert claims.symplectic or two_form_defect(method, where) > 1e4 * ROUND_OFF
    assert claims.symmetric or reversal_defect(method, where) > 1e4 * ROUND_OFF
    assert claims.on_manifold or max(manifold_errors(method, where, step_size(method, where)).values()) > 1e4 * ROUND_OFF


def test_one_step_of_se_from_the_manifold_is_symplectic_and_two_are_not():
    where = ivp("spherical-slow")
    X = tangent_basis(where, where.p0, where.q0)
    one, two = (symplecticity_defect(stepped("se").flow(where, 0.03, n), where.p0, where.q0, X) for n in (1, 2))
    assert one < 1e-14
    assert two > 1e-9


def test_se_keeps_q_dot_p_and_the_angular_momentum_on_the_sphere():
    maxima = run(stepped("se"), ivp("spherical-slow"), 0.03, 300, watch=("manifold", "integrals")).maxima
    assert max(maxima["Gv"], maxima["L3"]) < 1e-15
    assert maxima["g"] > 1e-4


@pytest.mark.exhaustive
def test_stopping_newton_on_the_residual_makes_the_energy_drift_and_our_rule_does_not(monkeypatch, tmp_path):
    request = Request(value=0.0028, t_end=20000, every=499)
    kept = FixedStep("rattle").solve(ivp("spherical-fast"), request).complete()
    line = "x, size, scale, residual, pivot = update(x, data)"
    accepted = "return before, (OK, residual, pivot, tally(update, iteration))"
    stop = f"before = x\n        {line}\n        if residual <= 1e-6:\n            {accepted}"
    plant(monkeypatch, tmp_path, "schemes.kernels.newton", line, stop)
    stopped = FixedStep("rattle").solve(ivp("spherical-fast"), request).complete()
    drifts = [energy_drift(run.t, energy_error(ivp("spherical-fast"), run)) for run in (kept, stopped)]
    assert stopped.maxima["g"] < 1e-6
    assert stopped.work["newton"] < kept.work["newton"]
    assert abs(drifts[0].slope) < 2 * drifts[0].slope_error
    assert abs(drifts[1].slope) > 8 * drifts[1].slope_error


def test_work_in_a_branch_is_refused_rather_than_miscounted(monkeypatch, tmp_path):
    right = "n, mu, settled = momentum_correction(p0 + dp, q1)"
    wrong = "n, mu, settled = momentum_correction(p0 if h > 1.0 else p0 + H_q(p0, q0), q1)"
    plant(monkeypatch, tmp_path, "schemes.rattle", right, wrong)
    with refused("scheme-out-of-reach", InvalidProblem):
        stepped("rattle").solve(ivp("spherical-fast"), Request(value=0.01, steps=1))
