"""The pytest plugin: the functions of ``daebench.testing`` as fixtures, imported by the first test that asks for one."""

from importlib import import_module
from typing import Any

import pytest


def _fixture(name: str, about: str) -> Any:
    """Return the fixture that gives a function of ``daebench.testing``."""

    def function() -> Any:
        return getattr(import_module("daebench.testing"), name)

    function.__doc__ = about
    return pytest.fixture(scope="session", name=name)(function)


reference_trajectory = _fixture(
    "reference_trajectory",
    "``reference_trajectory(problem, case)`` returns a certified reference: t, q, p, lam or y, bound, amplification, horizon.",
)
assert_converges = _fixture(
    "assert_converges",
    "``assert_converges(step, problem, order)`` asserts the order of a one-step method ``step(p, q, h)``, or ``step(y, h)``.",
)
assert_solver_converges = _fixture(
    "assert_solver_converges",
    "``assert_solver_converges(solve, problem, order)`` asserts the order of a whole run ``solve(p, q, h, t)``, or ``solve(y, h, t)``.",
)
assert_agrees = _fixture(
    "assert_agrees",
    "``assert_agrees(problem, t=, q=, p=, digits=)``, or with ``y=``, asserts agreement of a trajectory to a number of digits.",
)
assert_symplectic = _fixture(
    "assert_symplectic",
    "``assert_symplectic(step, problem)`` asserts that ``step(p, q, h)`` keeps the two-form, or is a Poisson map.",
)
assert_reversible = _fixture(
    "assert_reversible",
    "``assert_reversible(step, problem)`` asserts that steps with reversed momenta, or steps of -h, lead back.",
)
assert_keeps = _fixture(
    "assert_keeps",
    '``assert_keeps(step, problem, "g", "Gv")`` asserts that constraints, energy or integrals are conserved.',
)
assert_no_drift = _fixture(
    "assert_no_drift",
    "``assert_no_drift(step, problem, t_end=100)`` asserts that the energy error is bounded.",
)
assert_order = _fixture(
    "assert_order",
    "``assert_order(step, problem, order)`` asserts the order on a problem without a certified reference.",
)
