"""What may stand around a scheme: compositions, projections, forms, compensated sums, stage multipliers; and the grammar of their names."""

import numpy as np
import pytest
from oracles import solution
from refusals import refused

from daebench.diagnostics.energy_verdict import energy_error
from daebench.diagnostics.order import fit_order
from daebench.errors import BadInput
from daebench.methods.fixed_step.compositions import COMPOSITIONS
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.names import parse, several
from daebench.methods.plan import plan
from daebench.runs.request import Request

SEQUENCES = {4: (64, 96, 128, 192), 6: (24, 28, 32, 40, 48), 8: (14, 16, 18, 20, 24), 10: (8, 9, 10, 11, 12)}
"""Numbers of steps over T = 2 by order: large enough to be asymptotic, small enough to be above round-off."""


def run(method, ivp, h, steps, **more):
    return method.solve(ivp, Request(value=h, steps=steps, **more)).complete()


@pytest.mark.parametrize("name", COMPOSITIONS, ids=COMPOSITIONS)
def test_a_composition_of_rattle_has_its_order_and_keeps_what_rattle_keeps(name, get_ivp):
    ivp, method = get_ivp("planar"), FixedStep("rattle", composition=name, compiled=False)
    q, p = solution("planar", 2.0)
    counts = SEQUENCES[COMPOSITIONS[name].order]
    runs = [run(method, ivp, 2.0 / n, n) for n in counts]
    errors = [max(np.abs(each.q[-1] - q).max(), np.abs(each.p[-1] - p).max()) for each in runs]
    fit = fit_order([2.0 / n for n in counts], errors, floor=2e-12)
    assert abs(fit.slope - COMPOSITIONS[name].order) < 0.35, (fit, errors)
    assert method.claims.order == COMPOSITIONS[name].order
    assert max(runs[-1].maxima["g"], runs[-1].maxima["Gv"]) < 1e-13


def test_a_composition_counts_the_work_of_every_substep(get_ivp):
    ivp = get_ivp("spherical-fast")
    one = run(FixedStep("rattle", compiled=False), ivp, 0.001, 6).work
    two = run(FixedStep("rattle", composition="kahan_li8", compiled=False), ivp, 0.001, 6).work
    assert two["H_q"] == 17 * one["H_q"]
    assert two["newton"] > 10 * one["newton"]


def test_a_substep_without_a_solution_is_named(get_ivp):
    from daebench.methods.initial_value_problem import initial_value_problem

    ivp = initial_value_problem("spherical_pendulum", "fig1.2")
    stopped = FixedStep("rattle", composition="triple_jump4", compiled=False).solve(ivp, Request(value=0.1, steps=10))
    assert stopped.failure is not None
    assert (
        "rattle/triple_jump4 on spherical_pendulum, case fig1.2, stopped at t = 0 (step 1 of 10, h = 0.1, substep 2 of 3" in stopped.failure
    )
    assert stopped.steps == 0
    run(FixedStep("rattle", compiled=False), ivp, 0.1, 10)


def test_a_projected_energy_momentum_step_claims_no_energy():
    assert FixedStep("energy_momentum").claims.conserves_energy
    assert not FixedStep("energy_momentum", projection="proj").claims.conserves_energy


def test_compensation_changes_round_off_and_nothing_else(get_ivp):
    ivp = get_ivp("spherical-fast")
    plain, kept = (run(FixedStep("rattle", compensated=each, compiled=False), ivp, 0.01, 40) for each in (False, True))
    assert 0 < np.abs(plain.q - kept.q).max() < 1e-14
    assert plain.work == kept.work


@pytest.mark.exhaustive
def test_compensation_takes_most_of_the_random_walk_away(get_ivp):
    ivp = get_ivp("spherical-fast")
    request = Request(value=0.002, steps=2 * 10**6, every=2000, count=False, watch=("energy",))
    walks = [parse("rattle/kahan_li8", compensated=each).solve(ivp, request).complete() for each in (False, True)]
    sizes = [np.std(energy_error(ivp, walk)) for walk in walks]
    assert sizes[1] < sizes[0] / 5, sizes


def test_parts_of_a_name_that_do_not_go_together_are_refused_with_a_reason():
    for name, words in [
        ("rattle/foo", "unknown composition 'foo'"),
        ("rattle+foo", "unknown projection 'foo'"),
        ("foo:rattle", "unknown solver or form 'foo'"),
        ("ratle/suzuki4", "did you mean rattle"),
        ("rattle/", "no composition follows"),
        ("rk4+", "no projection follows"),
        ("midpoint+proj/suzuki4", r"write midpoint/suzuki4\+proj"),
        ("rattle+proj", "stays on the manifold by itself"),
        ("seproj+symproj", "stays on the manifold by itself"),
        ("shake+proj", "has a memory"),
        ("shake/suzuki4", "symmetric one-step methods of order 2"),
        ("lobatto3/suzuki4", "symmetric one-step methods of order 2"),
        ("energy_momentum/suzuki4", "momenta of energy_momentum leave the manifold"),
        ("energy_momentum+symproj", "momenta of energy_momentum leave the manifold"),
        ("baumgarte:midpoint/suzuki4", "symmetric one-step methods of order 2"),
        ("rk4/suzuki4", "symmetric one-step methods of order 2"),
        ("gauss2/suzuki4", "symmetric one-step methods of order 2"),
        ("stiff:rattle", "cannot be run on the form stiff"),
        ("local:se", "cannot be run on the form local"),
        ("canonical:rattle", "cannot be run on the form canonical"),
        ("canonical:gauss2+proj", "stays on the manifold by itself"),
        ("stiff:midpoint+proj", "does not follow the motion on the manifold"),
        ("soft:midpoint+proj", "does not follow the motion on the manifold"),
        ("local:midpoint+proj", "stays on the manifold by itself"),
        ("midpoint/suzuki4+symproj", r"use midpoint\+symproj"),
    ]:
        with pytest.raises(BadInput, match=words):
            parse(name)


def test_a_request_that_a_method_cannot_meet_is_refused_with_a_reason():
    for settings, words in [
        ({"method": "shake", "compensated": True}, "does not return its increments"),
        ({"method": "midpoint+proj", "compensated": True}, "has no increments"),
        ({"method": "rattle/suzuki4", "raw": True}, "belong to its substeps"),
        ({"method": "se", "raw": True}, "computes none"),
        ({"method": "rattle", "raw": True, "every": 3}, "every = 3"),
        ({"method": "rattle", "options": {"eps": 1.0}}, "unknown option of rattle"),
        ({"method": "stiff:midpoint", "options": {"eps": 0.0}}, "eps = 0 must be greater than 0"),
        ({"method": "soft:rk4", "options": {"impedance": 1.5}}, "impedance = 1.5 must be at most 1"),
        ({"method": "stiff:midpoint", "options": {"eps": float("nan")}}, "finite"),
    ]:
        with pytest.raises(BadInput, match=words):
            plan("spherical_pendulum", h=0.01, steps=5, **settings)


def test_an_option_goes_to_the_methods_that_have_it_and_one_that_none_has_is_refused():
    damped, plain, ida = several(["generalized_alpha", "rattle", "ida:baumgarte"], {"rho_inf": 0.5, "alpha": 3.0})
    assert damped.options == {"rho_inf": 0.5}
    assert plain.options == {}
    assert ida.name == "ida:baumgarte"
    with refused("unknown-name", name="rho", says=("rho_inf",)):
        several(["generalized_alpha", "rattle"], {"rho": 0.5})


def test_an_option_out_of_range_is_refused():
    for name, option, code in [
        ("generalized_alpha", {"rho_inf": 1.5}, "damping-out-of-range"),
        ("rattle_gauss_seidel", {"tolerance": 1.0}, "tolerance-not-below-one"),
        ("rattle_gauss_seidel", {"tolerance": 0.0}, "not-positive"),
        ("baumgarte:rk4", {"alpha": -1.0}, "not-positive"),
    ]:
        with refused(code):
            parse(name, option)


def test_a_solver_has_neither_raw_multipliers_nor_compensated_sums():
    with refused("solver-stage-multipliers"):
        plan("spherical_pendulum", method="ida:index2", tol=1e-8, t_end=1.0, raw=True)
    with refused("compensated-own-steps"):
        plan("spherical_pendulum", method="ida:index2", tol=1e-8, t_end=1.0, compensated=True)
