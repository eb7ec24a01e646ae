"""Assertions of one property of a code: each passes for a code that has it, and fails with a sentence for one that has not."""

import numpy as np
import pytest
from ball_on_a_string import force, rattle, shake
from refusals import refused

from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates
from daebench.testing import assert_keeps, assert_no_drift, assert_order, assert_reversible, assert_symplectic

pytestmark = pytest.mark.filterwarnings("ignore::daebench.errors.CannotShow")

BALL = {"problem": "spherical_pendulum", "case": "fig1.1"}


def reduced(p, q, h):
    """Symplectic Euler on the index-reduced equation."""
    p = p + h * (force(q) - (p @ p + force(q) @ q) / (q @ q) * q)
    return p, q + h * p


def still(p, q, h):
    return p, q


def rotating():
    """Return a point on a circle as a turning observer sees it: turning the momenta round does not reverse the motion."""
    q, p = coordinates(2)
    H = (p[0] ** 2 + p[1] ** 2) / 2 + q[0] * p[1] - q[1] * p[0]
    return ConstrainedHamiltonian(q=q, p=p, H=H, g=[q[0] ** 2 + q[1] ** 2 - 1], cases={"still": Case(q=(1, 0), p=(0, 1))})


@pytest.fixture(autouse=True)
def _uncompiled(plain_functions):
    """Compute without machine code, which would take longer to make than to use."""


def test_a_code_that_is_right_passes():
    assert_symplectic(rattle, **BALL)
    assert_reversible(rattle, **BALL)
    assert_keeps(rattle, "spherical_pendulum", "g", "Gv", case="fig1.1")
    assert_order(rattle, "spherical_pendulum", 2, case="fig1.1", halvings=5)
    assert_no_drift(rattle, **BALL, h=0.05, t_end=300)


def test_a_map_that_is_not_symplectic_is_said_to_be_none():
    with pytest.raises(AssertionError, match=r"reduced is not symplectic .* 10 steps of 0\.01 have a defect of 2\.78e-07, and rounding"):
        assert_symplectic(reduced, **BALL)


def test_a_map_that_is_not_reversible_is_said_to_be_none():
    with pytest.raises(AssertionError, match="reduced is not symmetric"):
        assert_reversible(reduced, **BALL)


def test_a_property_that_cannot_be_told_is_not_said_to_be_missing():
    seen = set()

    def of_one_motion(p, q, h):
        if seen and q.tobytes() not in seen:
            raise ValueError("another motion")
        p, q = rattle(p, q, h)
        seen.add(q.tobytes())
        return p, q

    with pytest.raises(
        AssertionError, match=r"^whether .*of_one_motion is symplectic on spherical_pendulum, case fig1\.1 cannot be decided: "
    ):
        assert_symplectic(of_one_motion, **BALL)


def test_all_that_is_not_kept_is_named():
    with pytest.raises(AssertionError) as error:
        assert_keeps(reduced, "spherical_pendulum", "g", "Gv", case="fig1.1")
    assert "does not keep g on" in str(error.value)
    assert "does not keep G H_p on" in str(error.value)
    assert_keeps(reduced, "spherical_pendulum", "g", case="fig1.1", within=1e-3)
    with pytest.raises(AssertionError, match="shake does not keep G H_p"):
        assert_keeps(shake, "spherical_pendulum", "g", "Gv", case="fig1.1")
    assert_keeps(shake, "spherical_pendulum", "g", case="fig1.1")


def test_an_order_that_is_lower_is_told():
    with pytest.raises(AssertionError, match=r"reduced .* is of order 0\.9\d*, and 2 is asked for"):
        assert_order(reduced, "spherical_pendulum", 2, case="fig1.1", halvings=5)


def test_a_drift_is_told_and_a_run_that_is_too_short_fails():
    with pytest.raises(AssertionError, match=r"the energy of reduced on spherical_pendulum.* drifts: linear"):
        assert_no_drift(reduced, **BALL, h=0.01, t_end=100)
    with pytest.raises(AssertionError, match="cannot be decided: fewer than 5 oscillations; run it longer"):
        assert_no_drift(rattle, **BALL, h=0.01, t_end=5)


def test_methods_of_daebench_and_poisson_systems_are_taken_too():
    assert_symplectic("rattle", **BALL)
    assert_symplectic(lambda y, h: y, "free_rigid_body")
    with pytest.raises(AssertionError, match="is not symplectic on free_rigid_body"):
        assert_symplectic(lambda y, h: np.exp(h) * y, "free_rigid_body")


def test_bad_input_is_no_failed_assertion():
    for code, call in [
        ("unknown-name", lambda: assert_keeps(rattle, "spherical_pendulum", "momentum")),
        ("round-off-bound-missing", lambda: assert_keeps(rattle, "spherical_pendulum", "L3")),
        ("state-not-arrays", lambda: assert_symplectic(lambda p, q, h: p, **BALL)),
        ("defect-of-too-many-steps", lambda: assert_symplectic(rattle, **BALL, steps=11)),
        ("defect-of-too-many-steps", lambda: assert_reversible(rattle, **BALL, steps=1000)),
        ("run-without-steps", lambda: assert_reversible(rattle, **BALL, steps=0)),
        ("property-unmeasured", lambda: assert_reversible(still, rotating())),
        ("not-positive", lambda: assert_no_drift(rattle, **BALL, h=0.0)),
        ("not-finite", lambda: assert_no_drift(rattle, **BALL, t_end=np.nan)),
        ("not-positive", lambda: assert_order(rattle, "spherical_pendulum", -1)),
    ]:
        with refused(code):
            call()
