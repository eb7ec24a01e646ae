"""Studies of systems in time, whose last position is the time, and of magnetic forces, with which momenta at rest are not zero."""

import numpy as np
import pytest
import sympy as sp
from refusals import refused

import daebench
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.starts.draw import draw_starts
from daebench.studies.ensemble.energies import ended_members, member_energies
from daebench.studies.step_for.run import known
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates

IN_TIME = {"car_axis": "bari", "driven_slider_crank": "turning"}


def magnetic(gauge):
    """Return a charge on a sphere in a uniform magnetic field, with a vector potential that is zero at the start, or is not."""
    q, p = coordinates(3)
    A = sp.Matrix({"landau": (0, 2 * q[0], 0), "symmetric": (-q[1], q[0], 0)}[gauge])
    velocity = sp.Matrix(p) - A
    p0 = sp.Matrix([sp.Rational(3, 5), 0, sp.Rational(1, 10)]) + A.subs({q[0]: 0, q[1]: 1})
    H = velocity.dot(velocity) / 2 + q[2]
    return ConstrainedHamiltonian(q=q, p=p, H=H, g=[sum(x**2 for x in q) - 1], cases={"x": Case(q=(0, 1, 0), p=tuple(p0))})


def test_the_shadow_hamiltonian_of_a_charge_is_kept_to_its_order():
    for method in ("rattle", "symplectic_euler"):
        ranges = daebench.shadow(magnetic("symmetric"), method=method, h=0.01, t_end=1, orders=[2, 4, 8]).ranges
        assert ranges[8] < 1e-3 * ranges[4] < 1e-3 * ranges[2]
        assert ranges[8] < 1e-8


@pytest.mark.sampled(left_out=("symmetric",))
@pytest.mark.parametrize("gauge", ["landau", "symmetric"])
def test_starts_of_an_energy_have_it_where_the_vector_potential_is_zero_at_the_start_too(gauge):
    some = draw_starts(initial_value_problem(magnetic(gauge)), "energy", members=32, h=0.01, E=1.0).members
    assert np.asarray(some.along("H", *some.start)) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.sampled(left_out=("driven_slider_crank",))
@pytest.mark.parametrize("problem", IN_TIME)
def test_members_beside_a_start_in_time_begin_when_it_does(problem):
    some = daebench.ensemble(problem, method="rattle", h=1e-3, t_end=0.01, members=4).run.members
    assert np.all(some.start[1][:, -1] == 0)
    assert np.all(some.start[0][:, -1] == initial_value_problem(problem).p0[-1])
    assert np.ptp(some.start[1][:, 0]) > 0


@pytest.mark.slow
def test_a_member_has_the_energy_size_of_a_run():
    problem, case = "car_axis", "bari"
    row = daebench.compare(problem, case=case, methods=["rattle"], h=1e-3, t_end=1).iloc[0]
    bands = daebench.ensemble(problem, case=case, method="rattle", h=1e-3, t_end=1, members=2, drawn={"size": 1e-12}, points=1001)
    columns = member_energies(bands.run, ended_members(bands.run))
    assert columns["energy_size"] == pytest.approx([row["energy_size"]] * 2, rel=0.02)


@pytest.mark.parametrize("starts", ["energy", "liouville"])
def test_distributions_of_constant_energy_are_refused_in_time_for_that_reason(starts):
    settings = {"E": 1.0} if starts == "energy" else {"box": {"q1": (-1.0, 1.0)}}
    with refused("energy-not-constant", says=("car_axis",)):
        draw_starts(initial_value_problem("car_axis"), starts, members=4, h=0.01, **settings)


@pytest.mark.sampled(left_out=("slider_crank",))
@pytest.mark.parametrize("problem", ["slider_crank", "driven_slider_crank"])
def test_statistics_of_energies_are_those_of_the_masses(problem):
    run = daebench.ensemble(problem, method="rattle", h=1e-3, t_end=0.05, members=3).run
    states, some, own = run.states[-1], run.members, run.members.ivp
    T, U = [], []
    for p, q in map(own.vectors, states):
        n = own.moving
        T.append(p[:n] @ np.linalg.solve(own.value("mass", p, q)[:n, :n], p[:n]) / 2)
        U.append(float(own.value("U", q)))
    quantities = known(own)
    assert quantities["kinetic"](some, states) == pytest.approx(T, rel=1e-9)
    assert quantities["potential"](some, states) == pytest.approx(U, rel=1e-12)


def test_no_energies_are_told_apart_where_one_expression_has_the_time_in_it():
    assert not {"kinetic", "potential"} & set(known(initial_value_problem("car_axis")))
