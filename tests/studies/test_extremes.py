"""Names, numbers and files that are unusual and legal, or unusual and to be refused."""

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


def bent(stiffness, positions="q1:3", momenta="p1:3"):
    """Return the planar pendulum on a spring with a full mass matrix that depends on q, its one parameter of this name."""
    k = sp.Symbol(stiffness, real=True)
    q, p = sp.symbols(positions, real=True), sp.symbols(momenta, real=True)
    M = sp.Matrix([[2 + q[0] ** 2, q[1] / 2], [q[1] / 2, 2 + q[1] ** 2]])
    start = {"a": Case(q=(1, 0), p=(0, 1))}
    return ConstrainedHamiltonian(q=q, p=p, M=M, U=k * q[1] ** 2 + q[0], g=[q[0] ** 2 + q[1] ** 2 - 1], parameters={k: 3.0}, cases=start)


def motion(problem, method="rattle", h=0.01, steps=50):
    return FixedStep(method, compiled=False).solve(make_ivp(source_of(problem, "own"), "a"), Request(value=h, steps=steps)).complete()


def test_no_name_of_a_parameter_or_coordinate_changes_the_motion(plain_functions):
    plain = motion(bent("k")).q
    for names in (["lam1"], ["p"], ["lambda"], ["numpy"], ["k", "p s", "u w"], ["k", "q_{1} q_{2}", "p^1 p^2"]):
        assert np.array_equal(motion(bent(*names)).q, plain), names
    plain, other = (daebench.run(bent(each), method="ida:index1", tol=1e-8, t_end=0.5) for each in ("k", "lambda"))
    assert np.array_equal(plain.q, other.q)


def test_a_symbol_with_two_meanings_and_a_hamiltonian_with_cases_are_refused():
    with refused("name-stands-for-two", InvalidProblem):
        bent("q1")
    q, p = coordinates(2)
    with refused("function-not-differentiable", InvalidProblem):
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
    q, p = coordinates(2)
    one = ConstrainedHamiltonian(q=q, p=p, M=sp.eye(2), U=q[1], g=[q[0] ** 2 + q[1] ** 2 - 1], cases={"a": Case(q=(1, 0), p=(0, 0))})
    run = motion(two_masses(light, 1 / light, tied=0), method, 0.001, 20)
    assert np.abs(run.q[-1][:2] - motion(one, method, 0.001, 20).q[-1]).max() < 1e-12
    assert run.pivot > 0.1


def test_a_double_pendulum_with_a_mass_ratio_of_1e16_runs():
    assert motion(two_masses(10**8, sp.Rational(1, 10**8), tied=1), h=0.001, steps=20).maxima["g"] < 1e-12


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


class Interrupted(FixedStep):
    def solve(self, ivp, request):
        def press(_):
            raise KeyboardInterrupt

        return super().solve(ivp, replace(request, progress=press))


def test_an_interruption_ends_a_whole_comparison():
    from daebench.studies.comparison.table import trajectories

    pressed = Interrupted("rattle", compiled=False)
    (found,) = trajectories(ivp("spherical-slow"), [pressed, FixedStep("rattle", compiled=False)], h=0.01, t_end=5.0)
    assert found.interrupted
    assert 0 < found.steps < 500
    with pytest.raises(KeyboardInterrupt):
        pressed.solve(ivp("spherical-slow"), Request(value=0.01, t_end=5.0))
