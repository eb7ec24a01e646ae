"""The verdict on the energy of real runs: symplectic methods are bounded or kept, and no bound of another method is violated."""

import re

import numpy as np
import pytest

from daebench.diagnostics.energy_verdict import PART, energy_error, energy_verdict
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import methods_of
from daebench.runs.request import Request
from daebench.studies.comparison.table import row

MOTIONS = {"fast swing": ("spherical_pendulum", "fig1.2", 0.05, 100.0), "rotating": ("planar_pendulum", "rotating", 0.02, 60.0)}
SYMPLECTIC = ("rattle", "symplectic_euler", "lobatto3", "strang", "rattle/suzuki4")
OTHERS = ("rk4", "implicit_euler", "generalized_alpha", "rk4+proj", "radau2_ggl", "se", "scipy:RK45", "scipy:Radau")


def run_of(motion, name, times=1.0):
    problem, case, h, t_end = MOTIONS[motion]
    ivp = initial_value_problem(problem, case)
    (method,) = methods_of(ivp, [name])
    value = h if method.knob == "h" else 1e-6
    every = {"every": 2} if method.knob == "h" else {"points": 2001}
    return ivp, method.solve(ivp, Request(value=value, t_end=times * t_end, keep_interrupted=True, **every))


USUAL = ("rattle-fast swing", "strang-rotating", "rk4-fast swing", "rk4+proj-rotating")
"""Methods on both motions, which the gate takes."""


@pytest.mark.slow
@pytest.mark.sampled(by=lambda case: case in USUAL)
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("name", SYMPLECTIC)
def test_symplectic_methods_keep_or_bound_the_energy(motion, name):
    ivp, run = run_of(motion, name)
    found = energy_verdict(ivp, run)
    assert found.verdict in ("kept", "bounded")
    assert found.change_bound < max(np.ptp(energy_error(ivp, run)), 1e-13)


@pytest.mark.slow
@pytest.mark.sampled(by=lambda case: case in USUAL)
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("name", OTHERS)
def test_no_bound_of_another_method_is_violated_by_a_run_four_times_as_long(motion, name):
    """The truth is the mean over the first eighth of the longer run against that about the end of the shorter one."""
    ivp, run = run_of(motion, name)
    found = energy_verdict(ivp, run)
    assert found.verdict != "kept"
    if found.verdict == "bounded":
        ivp, longer = run_of(motion, name, 4.0)
        error, t = energy_error(ivp, longer), longer.t / run.t[-1]
        change = np.mean(error[(t > 0.8) & (t < 1.2)]) - np.mean(error[t < 0.2])
        assert abs(change) <= found.change_bound


def told_over(t_end, steps, motion, name):
    """Return the verdict on a run of so many steps."""
    ivp = initial_value_problem(*MOTIONS[motion][:2])
    return energy_verdict(ivp, FixedStep(name).solve(ivp, Request(value=t_end / steps, t_end=t_end)))


@pytest.mark.parametrize(("motion", "swing"), [("fast swing", 0.87), ("rotating", 3.16)])
def test_a_part_of_an_oscillation_is_no_drift(motion, swing):
    """RATTLE bounds the energy, whatever part of a swing a run shows."""
    told = [told_over(part * swing, 60, motion, "rattle") for part in (0.15, 0.3, 0.5, 0.7, 1.0)]
    assert {found.verdict for found in told} == {"undetermined"}
    assert told[0].reason == told[1].reason == PART


def test_a_motion_that_is_lost_within_a_swing_drifts():
    """Implicit Euler loses 0.4 and 1.3 times the mean kinetic energy; rotations that last as long do not swing twice."""
    assert told_over(2.0, 40, "rotating", "implicit_euler").verdict == "undetermined"
    assert told_over(4.0, 40, "rotating", "implicit_euler").verdict == "drifts"


def test_the_four_methods_of_the_fast_swing_have_a_true_verdict_each():
    problem, case, h, t_end = MOTIONS["fast swing"]
    ivp, told = initial_value_problem(problem, case), {}
    verdicts = {"implicit_euler": "drifts", "rk4": "drifts", "rattle": "bounded", "generalized_alpha": "drifts"}
    for name in verdicts:
        run = FixedStep(name).solve(ivp, Request(value=h, t_end=t_end))
        told[name] = row(ivp, run, energy_verdict(ivp, run))
    assert {name: each["energy_verdict"] for name, each in told.items()} == verdicts
    low, high = map(float, re.fullmatch(r"saturated at \S+ \((\S+) to (\S+)\)", told["implicit_euler"]["energy_law"]).groups())
    hanging = ivp.value("H", np.zeros(3), np.array([0.0, 0.0, -1.0])) - ivp.value("H", *ivp.start)
    assert low <= hanging <= high
    assert high - low < 0.1 * abs(hanging)
    assert [name for name, each in told.items() if each["energy_size"] > 1] == ["implicit_euler", "generalized_alpha"]
    assert told["rattle"]["energy_change_bound"] < 1e-3 < told["rattle"]["energy_error"]


@pytest.mark.slow
@pytest.mark.sampled(left_out=("120",))
@pytest.mark.parametrize(
    ("t_end", "allowed"), [(60.0, {"undetermined"}), (120.0, {"undetermined"}), (240.0, {"drifts"})], ids=["60", "120", "240"]
)
def test_a_loose_iteration_is_not_bounded_before_it_drifts(t_end, allowed):
    """Gauss-Seidel iteration that stops at 1e-3: the mean moves by half the oscillation in 120 s, and goes on."""
    ivp = initial_value_problem("rigid_water", "tumbling")
    (method,) = methods_of(ivp, ["rattle_gauss_seidel"], {"tolerance": 1e-3})
    found = energy_verdict(ivp, method.solve(ivp, Request(value=0.01, t_end=t_end)))
    assert found.verdict in allowed
    if found.verdict == "drifts":
        assert found.exponent_low <= 1 <= found.exponent_high
