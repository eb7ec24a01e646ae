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
    """``assert_agrees(problem, t=, q=, p=, digits=)``, or with ``y=``, asserts agreement of a trajectory to so many digits."""
    from daebench.testing import assert_agrees

    return assert_agrees
