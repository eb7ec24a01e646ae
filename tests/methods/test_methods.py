"""What may stand around a scheme: compositions, projections, forms, compensated sums, stage multipliers; and the grammar of their names."""

from dataclasses import replace

import numpy as np
import pytest
from ivps import ivp
from measures import error_of
from refusals import refused
from runs import method, run, state_error

from daebench.diagnostics.energy_verdict import energy_error
from daebench.diagnostics.order import fit_order
from daebench.methods.fixed_step.compositions import COMPOSITIONS
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse, several
from daebench.methods.plan import plan
from daebench.runs.request import Request

SEQUENCES = {4: (64, 96, 128, 192), 6: (24, 28, 32, 40, 48), 8: (14, 16, 18, 20, 24), 10: (8, 9, 10, 11, 12)}
"""Numbers of steps over T = 2 by order: large enough to be asymptotic, small enough to be above round-off."""


@pytest.mark.parametrize("name", COMPOSITIONS, ids=COMPOSITIONS)
def test_a_composition_of_rattle_has_its_order_and_keeps_what_rattle_keeps(name):
    order, counts = COMPOSITIONS[name].order, SEQUENCES[COMPOSITIONS[name].order]
    errors = [state_error(f"rattle/{name}", "planar", n, T=2.0) for n in counts]
    fit = fit_order([2.0 / n for n in counts], errors, floor=2e-12)
    assert abs(fit.slope - order) < 0.35, (fit, errors)
    assert method(f"rattle/{name}").claims.order == order
    maxima = run(f"rattle/{name}", "planar", 2.0 / counts[-1], counts[-1]).maxima
    assert max(maxima["g"], maxima["Gv"]) < 1e-13


def test_a_composition_counts_the_work_of_every_substep():
    one, two = (run(name, "spherical-fast", 0.001, 6).work for name in ("rattle", "rattle/kahan_li8"))
    assert two["H_q"] == 17 * one["H_q"]
    assert two["newton"] > 10 * one["newton"]


def test_a_substep_without_a_solution_is_named():
    where = initial_value_problem("spherical_pendulum", "fig1.2")
    stopped = method("rattle/triple_jump4").solve(where, Request(value=0.1, steps=10))
    assert "(step 1 of 10, h = 0.1, substep 2 of 3" in stopped.failure
    assert stopped.steps == 0
    run("rattle", where, 0.1, 10)


def test_a_projected_energy_momentum_step_claims_no_energy():
    assert [method(name).claims.conserves_energy for name in ("energy_momentum", "energy_momentum+proj")] == [True, False]


def test_compensation_changes_round_off_and_nothing_else():
    request = Request(value=0.01, steps=40)
    plain, kept = (replace(method("rattle"), compensated=each).solve(ivp("spherical-fast"), request).complete() for each in (False, True))
    assert 0 < error_of(plain.q, kept.q) < 1e-14
    assert plain.work == kept.work


@pytest.mark.exhaustive
def test_compensation_takes_most_of_the_random_walk_away():
    fast, request = ivp("spherical-fast"), Request(value=0.002, steps=2 * 10**6, every=2000, count=False, watch=("energy",))
    walks = [parse("rattle/kahan_li8", compensated=each).solve(fast, request).complete() for each in (False, True)]
    sizes = [np.std(energy_error(fast, walk)) for walk in walks]
    assert sizes[1] < sizes[0] / 5, sizes


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


REFUSED = {
    ("unknown-name", "foo"): ("rattle/foo", "rattle+foo", "foo:rattle"),
    ("unknown-name", "rattle"): ("ratle/suzuki4",),
    ("method-part-empty", "follows"): ("rattle/", "rk4+"),
    ("composition-after-projection", "midpoint/suzuki4+proj"): ("midpoint+proj/suzuki4",),
    ("parts-refused", "manifold by itself"): ("rattle+proj", "seproj+symproj", "canonical:gauss2+proj", "local:midpoint+proj"),
    ("parts-refused", "memory"): ("shake+proj",),
    ("parts-refused", "symmetric one-step methods of order 2"): (
        *("shake/suzuki4", "lobatto3/suzuki4", "rk4/suzuki4", "gauss2/suzuki4", "baumgarte:midpoint/suzuki4"),
    ),
    ("parts-refused", "momenta of energy_momentum"): ("energy_momentum/suzuki4", "energy_momentum+symproj"),
    ("parts-refused", "midpoint+symproj"): ("midpoint/suzuki4+symproj",),
    ("parts-refused", "on the form"): ("stiff:rattle", "local:se", "canonical:rattle"),
    ("parts-refused", "follow the motion"): ("stiff:midpoint+proj", "soft:midpoint+proj"),
}
"""Names whose parts do not go together, by the codes of the refusals and a word of the reason."""


def test_parts_of_a_name_that_do_not_go_together_are_refused():
    for (code, reason), names in REFUSED.items():
        for name in names:
            with refused(code, says=(reason,)):
                parse(name)


def test_a_request_that_a_method_cannot_meet_is_refused():
    for name, settings, code in [
        ("shake", {"compensated": True}, "parts-refused"),
        ("midpoint+proj", {"compensated": True}, "parts-refused"),
        ("rattle/suzuki4", {"raw": True}, "no-stage-multipliers"),
        ("se", {"raw": True}, "no-stage-multipliers"),
        ("strang", {"raw": True}, "no-stage-multipliers"),
        ("rattle", {"raw": True, "every": 3}, "stage-multipliers-every"),
        ("rattle", {"options": {"eps": 1.0}}, "unknown-name"),
        ("stiff:midpoint", {"options": {"eps": 0.0}}, "not-positive"),
        ("baumgarte:midpoint", {"options": {"alpha": 0.0}}, "not-positive"),
        ("baumgarte:midpoint", {"options": {"beta": -1.0}}, "not-positive"),
        ("midpoint", {"options": {"alpha": 1.0}}, "unknown-name"),
        ("soft:rk4", {"options": {"impedance": 1.5}}, "number-too-large"),
        ("stiff:midpoint", {"options": {"eps": np.nan}}, "not-finite"),
    ]:
        with refused(code):
            plan("spherical_pendulum", method=name, h=0.01, steps=5, **settings)
