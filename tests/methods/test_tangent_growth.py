"""Growth of tangent vectors by the scheme's own tangent map, against complex steps and against variational equations."""

import numpy as np
import pytest

from daebench import BadInput, initial_value_problem
from daebench.methods.ensemble.tangents import tangent_growth, tangent_vectors
from daebench.methods.names import method_of
from daebench.runs.members import members

COMPLEX = 1e-30


def grown(ivp, name, h, vectors, *, every, intervals, **settings):
    """Return the growth of vectors that start at one point."""
    some = members(ivp, tuple(np.repeat(part[None], len(vectors), axis=0) for part in ivp.start), h, {})
    return tangent_growth(method_of(ivp, name, None), some, vectors, np.ones(ivp.size), every=every, intervals=intervals, **settings)


CASES = [
    ("double_pendulum", "horizontal", "rattle"),
    pytest.param("double_pendulum", "horizontal", "rattle/suzuki4", marks=pytest.mark.slow),
    ("spherical_pendulum", "fig1.2", "rattle"),
    pytest.param("planar_pendulum", "horizontal", "local:gauss2", marks=pytest.mark.slow),
    pytest.param("planar_pendulum", "horizontal", "generalized_alpha", marks=pytest.mark.slow),
    ("free_rigid_body", "hlw", "lie"),
]


@pytest.mark.sampled(
    left_out=("free_rigid_body-hlw-lie", "planar_pendulum-horizontal-generalized_alpha", "planar_pendulum-horizontal-local:gauss2")
)
@pytest.mark.parametrize(("problem", "case", "name"), CASES, ids=lambda x: str(x))
def test_the_tangent_is_that_of_the_discrete_scheme(problem, case, name):
    ivp = initial_value_problem(problem, case)
    h, every, intervals = 0.01, 7, 12
    some = members(ivp, tuple(part[None] for part in ivp.start), h, {})
    vector = tangent_vectors(some, np.ones(ivp.size), 3)
    result = grown(ivp, name, h, vector, every=every, intervals=intervals)
    parts = np.split(np.concatenate(ivp.start) + 1j * COMPLEX * vector[0], np.cumsum([len(part) for part in ivp.start])[:-1])
    rows, failure = method_of(ivp, name, None).path(ivp, h, every * intervals)(*parts)
    lengths = np.linalg.norm(rows.imag / COMPLEX, axis=1)[::every]
    assert failure is None
    np.testing.assert_allclose(result.growth[0], np.diff(np.log(lengths)), atol=1e-9)


def test_vectors_are_tangent_and_of_length_one():
    ivp = initial_value_problem("spherical_pendulum", "fig1.2")
    units = np.array([2.0] * 3 + [0.5] * 3)
    vectors = tangent_vectors(members(ivp, tuple(np.repeat(x[None], 5, 0) for x in ivp.start), 0.01, {}), units, 0)
    G, p_q = ivp.value("G", ivp.q0), (ivp.value("Gv_p", *ivp.start), ivp.value("Gv_q", *ivp.start))
    np.testing.assert_allclose(vectors[:, 3:] @ G.T, 0, atol=1e-14)
    np.testing.assert_allclose(vectors[:, :3] @ p_q[0].T + vectors[:, 3:] @ p_q[1].T, 0, atol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(vectors * units, axis=1), 1)


def test_a_run_that_stops_says_where_and_has_no_growth_from_there_on():
    ivp = initial_value_problem("planar_pendulum", "horizontal")
    some = members(ivp, tuple(x[None] for x in ivp.start), 1.0, {})
    result = grown(ivp, "rattle", 1.0, tangent_vectors(some, np.ones(ivp.size), 0), every=5, intervals=10)
    assert result.reason(0) == "no convergence"
    assert "stopped at t = 1 (step 2 of 50" in result.sentence(0)
    assert np.all(np.isnan(result.growth[0]))


def test_states_held_as_arrays_are_refused():
    ivp = initial_value_problem("pendulum_chain", algebra="arrays")
    with pytest.raises(BadInput, match="arrays"):
        grown(ivp, "rattle", 0.01, np.ones((1, ivp.size)), every=5, intervals=10)
