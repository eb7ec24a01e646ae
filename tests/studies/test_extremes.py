"""Names, numbers and files that are unusual and legal, or unusual and to be refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from ivps import ivp
from refusals import refused

import daebench
from daebench.compiler.definition import source_of
from daebench.errors import BadInput, InvalidProblem
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.runs.grid import Grid
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates

NAMES = ("lam1", "p", "lambda", "numpy")


def bent(stiffness, positions="q1:3", momenta="p1:3"):
    """Return the planar pendulum on a spring with a full mass matrix that depends on q, its one parameter of this name."""
    k = sp.Symbol(stiffness, real=True)
    q, p = sp.symbols(positions, real=True), sp.symbols(momenta, real=True)
    M = sp.Matrix([[2 + q[0] ** 2, q[1] / 2], [q[1] / 2, 2 + q[1] ** 2]])
    start = {"a": Case(q=(1, 0), p=(0, 1))}
    return ConstrainedHamiltonian(q=q, p=p, M=M, U=k * q[1] ** 2 + q[0], g=[q[0] ** 2 + q[1] ** 2 - 1], parameters={k: 3.0}, cases=start)


def swing(problem, method="rattle", **settings):
    where = make_ivp(source_of(problem, "bent"), "a")
    return FixedStep(method, compiled=False).solve(where, Request(value=0.01, steps=50, **settings)).complete()


def test_no_name_of_a_parameter_or_coordinate_changes_the_motion():
    plain = swing(bent("k")).q
    for name in NAMES:
        assert np.array_equal(swing(bent(name)).q, plain), name
    for names in (("p s", "u w"), ("q_{1} q_{2}", "p^1 p^2")):
        assert np.array_equal(swing(bent("k", *names)).q, plain), names


@pytest.mark.parametrize("name", ["lambda"])
def test_no_name_of_a_parameter_changes_what_ida_solves(name, plain_functions):
    plain, other = (daebench.run(bent(each), method="ida:index1", tol=1e-8, t_end=0.5) for each in ("k", name))
    assert np.array_equal(plain.q, other.q)


def test_a_symbol_with_two_meanings_is_refused():
    with refused("name-stands-for-two", InvalidProblem):
        bent("q1")


def test_a_hamiltonian_with_cases_is_refused_with_a_sentence():
    q, p = coordinates(2)
    with pytest.raises(InvalidProblem, match="twice differentiable"):
        ConstrainedHamiltonian(q=q, p=p, M=sp.eye(2), U=sp.Max(q[1], 0), g=[q[0]], cases={"a": Case(q=(0, 1), p=(0, 0))})


def test_initial_values_may_be_given_without_a_case():
    q, p = coordinates(2)
    bead = ConstrainedHamiltonian(q=q, p=p, M=sp.eye(2), U=q[1], g=[q[1] - q[0] ** 2])
    run = daebench.run(bead, method="ida:index2", tol=1e-6, t_end=1.0, q0=[-1.0, 1.0], p0=[0.0, 0.0])
    assert run.failure is None
    with refused("problem-without-cases"):
        daebench.run(bead, method="ida:index2", tol=1e-6, t_end=1.0, q0=[-1.0, 1.0])


def two_masses(light, heavy, *, tied):
    q, p = coordinates(4)
    first = q[0] ** 2 + q[1] ** 2 - 1
    second = (q[2] - tied * q[0]) ** 2 + (q[3] - tied * q[1]) ** 2 - 1
    M = sp.diag(light, light, heavy, heavy)
    start = Case(q=(1, 0, tied + 0, 1), p=(0, 0, 0, 0))
    return ConstrainedHamiltonian(q=q, p=p, M=M, U=light * q[1] + heavy * q[3], g=[first, second], cases={"a": start})


@pytest.mark.sampled(by=lambda case: case in ("light-rattle", "heavy-seproj"))
@pytest.mark.parametrize("method", ["rattle", "symplectic_euler", "implicit_euler", "se", "seproj", "shake"])
@pytest.mark.parametrize("light", [sp.Rational(1, 10**8), 10**8], ids=["light", "heavy"])
def test_mass_ratios_of_1e16_are_not_taken_for_rank_loss(method, light):
    problem = two_masses(light, 1 / light, tied=0)
    where = make_ivp(source_of(problem, "two"), "a")
    run = FixedStep(method, compiled=False).solve(where, Request(value=0.001, steps=20)).complete()
    alone = swing_alone(0.001, 20, method)
    assert np.abs(run.q[-1][:2] - alone).max() < 1e-12
    assert run.pivot > 0.1


def swing_alone(h, steps, method):
    q, p = coordinates(2)
    one = ConstrainedHamiltonian(q=q, p=p, M=sp.eye(2), U=q[1], g=[q[0] ** 2 + q[1] ** 2 - 1], cases={"a": Case(q=(1, 0), p=(0, 0))})
    where = make_ivp(source_of(one, "one"), "a")
    return FixedStep(method, compiled=False).solve(where, Request(value=h, steps=steps)).complete().q[-1]


def test_a_double_pendulum_with_a_mass_ratio_of_1e16_runs():
    where = make_ivp(source_of(two_masses(10**8, sp.Rational(1, 10**8), tied=1), "tied"), "a")
    run = FixedStep("rattle", compiled=False).solve(where, Request(value=0.001, steps=20)).complete()
    assert run.maxima["g"] < 1e-12


def test_lengths_and_masses_in_any_unit_give_the_same_motion():
    for method in ("rattle", "se", "seproj", "implicit_euler"):
        ends = []
        for mass, length in ((1.0, 1.0), (1e-8, 1e-3), (1e8, 1e3)):
            given = {"mass": mass, "length": length, "gravity": length}
            where = make_ivp(ivp("spherical-slow").source, "fig1.1", given, q0=start(length)[0], p0=start(mass * length)[1])
            ends.append(FixedStep(method, compiled=False).solve(where, Request(value=0.03, steps=40)).complete().q[-1] / length)
        assert max(np.abs(end - ends[0]).max() for end in ends) < 1e-12, method


def start(unit):
    return np.array([0, math.sin(0.1), -math.cos(0.1)]) * unit, np.array([0.06, 0, 0]) * unit


def test_a_watched_quantity_that_overflows_stops_the_run_and_one_that_is_not_is_no_success_at_its_end():
    fast = make_ivp(ivp("spherical-slow").source, "fig1.1", p0=[1e160, 0, 0])
    runs = [FixedStep("rattle", compiled=False).solve(fast, Request(value=1e-200, steps=3, watch=watch)) for watch in (("energy",), ())]
    assert "a monitored quantity is not finite" in runs[0].failure
    assert runs[0].steps == 0
    assert runs[1].steps == 3
    assert "H is not finite" in runs[1].failure


def test_forces_that_overflow_stop_the_run():
    where = make_ivp(ivp("spherical-slow").source, "fig1.1", {"gravity": 1e308, "mass": 1e10})
    run = FixedStep("rattle", compiled=False).solve(where, Request(value=1e-200, steps=3, watch=()))
    assert "no longer finite" in run.failure
    assert run.steps == 0


@pytest.mark.parametrize(
    ("h", "t_end", "steps"),
    [(0.1, 0.3, 3), (0.1, 0.7, 7), (0.03, 100, 3333), (1e-5, 1000, 10**8), (1e-6, 1000, 10**9), (0.003, 100, 33333), (0.3, 0.9, 3)],
)
def test_the_number_of_steps_is_what_one_would_count_by_hand(h, t_end, steps):
    assert Grid.fixed_step("rattle", Request(value=h, t_end=t_end, every=0), 3).steps == steps


def test_python_callers_get_a_sentence_too():
    for wrong in (
        {"h": "0.1"},
        {"h": True},
        {"steps": 2.0, "t_end": None},
        {"parameters": {"mass": None}},
        {"p0": "abc"},
        {"q0": [[1, 0, 0]]},
        {"method": None},
        {"problem": 3},
        {"seconds_limit": 0},
        {"watch": "enrgy"},
        {"precision": "float16"},
    ):
        settings = {"problem": "spherical_pendulum", "method": "rattle", "h": 0.1, "t_end": 1.0} | wrong
        with pytest.raises(BadInput):
            daebench.run(settings.pop("problem"), **settings)


def test_a_damaged_file_in_the_cache_is_written_again(tmp_path, monkeypatch):
    monkeypatch.setenv("DAEBENCH_CACHE", str(tmp_path))
    problem, damage = bent("k2"), b"\x00\xff"
    before = swing(problem).q
    for path in tmp_path.glob("*.py"):
        path.write_bytes(damage)
        monkeypatch.delitem(__import__("sys").modules, path.stem)
    assert np.array_equal(swing(problem).q, before)


def test_an_interruption_ends_a_whole_comparison():
    from daebench.studies.comparison.table import trajectories

    class Interrupted:
        name, knob = "interrupted", "h"

        def check(self, ivp, request):
            pass

        def solve(self, ivp, request):
            def press(_):
                raise KeyboardInterrupt

            return FixedStep("rattle", compiled=False).solve(ivp, replace(request, progress=press))

    found = trajectories(ivp("spherical-slow"), [Interrupted(), FixedStep("rattle", compiled=False)], h=0.01, t_end=5.0)
    assert len(found) == 1
    assert found[0].interrupted
    assert "interrupted" in found[0].failure
    assert 0 < found[0].steps < 500
    with pytest.raises(KeyboardInterrupt):
        Interrupted().solve(ivp("spherical-slow"), Request(value=0.01, t_end=5.0))
