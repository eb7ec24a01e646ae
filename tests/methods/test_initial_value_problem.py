"""Initial value problems from a name, a path, a definition or another one."""

import numpy as np
import pytest
from refusals import refused

from daebench.errors import BadInput, InconsistentStart
from daebench.methods.initial_value_problem import declared_ivps, initial_value_problem


@pytest.mark.parametrize("file", ["ring.py", "orbit.py"])
def test_a_path_a_text_and_the_problem_of_an_initial_value_problem_give_the_same(folder, file):
    by_text, by_path = initial_value_problem(f"./{file}"), initial_value_problem(folder / file)
    assert by_text.case == by_path.case
    for one, other, again in zip(by_text.start, by_path.start, initial_value_problem(by_text).start, strict=True):
        assert one.tolist() == other.tolist() == again.tolist()


def test_an_initial_value_problem_keeps_what_is_not_replaced():
    first = initial_value_problem("spherical_pendulum", "fig1.2", {"gravity": 3.0}, p0=[0.0, 0.0, 0.0])
    heavy = initial_value_problem(first, parameters={"mass": 2.0})
    assert (heavy.case, heavy.parameters["gravity"], heavy.parameters["mass"]) == ("fig1.2[p0=0,0,0]", 3.0, 2.0)
    assert np.array_equal(heavy.p0, first.p0)
    other = initial_value_problem(first, "fig1.1")
    assert other.parameters == initial_value_problem("spherical_pendulum", "fig1.1").parameters
    assert np.array_equal(other.p0, initial_value_problem("spherical_pendulum", "fig1.1").p0)


def test_what_happens_where_G_loses_rank_stays_with_an_initial_value_problem():
    locked = initial_value_problem("slider_crank", "lock_up")
    chosen = initial_value_problem(locked, on_singular="least-squares")
    assert initial_value_problem(chosen).on_singular == "least-squares"


def test_what_cannot_be_meant_is_refused():
    for problem, more, words in [
        (3, {}, "a name, a ConstrainedHamiltonian or a PoissonSystem"),
        ("lotka_volterra", {"project": True}, "leave out project"),
        ("lotka_volterra", {"q0": [1.0, 2.0]}, "leave out q0"),
        ("spherical_pendulum", {"case": "fig9"}, "unknown case"),
        ("spherical_pendulum", {"parameters": {"weight": 1.0}}, "unknown parameter"),
    ]:
        with pytest.raises(BadInput, match=words):
            initial_value_problem(problem, **more)


def test_how_vectors_are_held_is_not_changed_afterwards():
    with refused("algebra-chosen-before"):
        initial_value_problem(initial_value_problem("planar_pendulum"), algebra="values")


def test_initial_values_off_the_manifold_are_refused_unless_they_are_projected_or_wanted():
    off = {"q0": [1.1, 0.0]}
    with pytest.raises(InconsistentStart):
        initial_value_problem("planar_pendulum", "horizontal", **off)
    assert initial_value_problem("planar_pendulum", "horizontal", **off, project=True).q0.tolist() == [1.0, 0.0]
    assert initial_value_problem("planar_pendulum", "horizontal", **off, consistent=False).q0.tolist() == [1.1, 0.0]


def test_all_cases_are_returned_as_they_are_declared():
    assert [ivp.case for ivp in declared_ivps("spherical_pendulum")] == list(initial_value_problem("spherical_pendulum").facts.CASES)
    assert [ivp.case for ivp in declared_ivps("spherical_pendulum", "fig1.2")] == ["fig1.2"]
