"""The pytest plugin: the functions of ``daebench.testing`` as fixtures, imported by the first test that asks for one."""

from collections.abc import Callable
from typing import Any

import pytest


@pytest.fixture(scope="session")
def reference_trajectory() -> Callable[..., Any]:
    """``reference_trajectory(problem, case)`` returns a certified reference: t, q, p, lam or y, bound, amplification, horizon."""
    from daebench.testing import reference_trajectory

    return reference_trajectory


@pytest.fixture(scope="session")
def assert_converges() -> Callable[..., None]:
    """``assert_converges(step, problem, order)`` asserts the order of a one-step method ``step(p, q, h)``, or ``step(y, h)``."""
    from daebench.testing import assert_converges

    return assert_converges


@pytest.fixture(scope="session")
def assert_solver_converges() -> Callable[..., None]:
    """``assert_solver_converges(solve, problem, order)`` asserts the order of a whole run ``solve(p, q, h, t)``, or ``solve(y, h, t)``."""
    from daebench.testing import assert_solver_converges

    return assert_solver_converges


@pytest.fixture(scope="session")
def assert_agrees() -> Callable[..., None]:
    """``assert_agrees(problem, t=, q=, p=, digits=)``, or with ``y=``, asserts agreement of a trajectory to a number of digits."""
    from daebench.testing import assert_agrees

    return assert_agrees


@pytest.fixture(scope="session")
def assert_symplectic() -> Callable[..., None]:
    """``assert_symplectic(step, problem)`` asserts that ``step(p, q, h)`` keeps the two-form, or is a Poisson map."""
    from daebench.testing import assert_symplectic

    return assert_symplectic


@pytest.fixture(scope="session")
def assert_reversible() -> Callable[..., None]:
    """``assert_reversible(step, problem)`` asserts that steps with reversed momenta, or steps of -h, lead back."""
    from daebench.testing import assert_reversible

    return assert_reversible


@pytest.fixture(scope="session")
def assert_keeps() -> Callable[..., None]:
    """``assert_keeps(step, problem, "g", "Gv")`` asserts that constraints, energy or integrals are conserved."""
    from daebench.testing import assert_keeps

    return assert_keeps


@pytest.fixture(scope="session")
def assert_no_drift() -> Callable[..., None]:
    """``assert_no_drift(step, problem, t_end=100)`` asserts that the energy error is bounded."""
    from daebench.testing import assert_no_drift

    return assert_no_drift


@pytest.fixture(scope="session")
def assert_order() -> Callable[..., None]:
    """``assert_order(step, problem, order)`` asserts the order on a problem without a certified reference."""
    from daebench.testing import assert_order

    return assert_order
