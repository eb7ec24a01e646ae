"""A step that lands on another branch of g = 0 is named in every kind of kernel, and by every scheme that solves for positions."""

import numpy as np
import pytest
from memberwise import moving, request
from planted import plant

import daebench
from daebench.methods.ensemble.run import run_members
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.fixed_step.script import script
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.members import members
from daebench.runs.request import Request
from daebench.schemes.kernels.branch import ANOTHER_BRANCH

H = 0.01
NAMED = "the step ends on another branch of g = 0 than the one on which the motion goes on from there"
RUN = """([text, state, h, par, weights]) => {
  const kernel = eval("(" + text + ")"), S = new Float64Array(kernel.size), R = new Float64Array(8), rows = new Float64Array(40);
  S.set(state); kernel.start(S, h, par, R); kernel.integrate(S, h, 5, 1, 1, rows, par, weights, R);
  return [...R];
}"""


@pytest.fixture
def opposite(monkeypatch, tmp_path):
    """The iteration of positions starts at the opposite point of a pendulum's circle."""
    plant(
        monkeypatch,
        tmp_path,
        "schemes.kernels.constrain",
        "(update_position, (tangent, nu0),",
        "(update_position, (tangent - 2 * q0, nu0),",
    )


def pendulum():
    return initial_value_problem("planar_pendulum", "horizontal")


def alone(scheme="rattle", **settings):
    """Return what one run says."""
    compiled = settings.pop("compiled", True)
    run = FixedStep(scheme, compiled=compiled, **settings.pop("method", {})).solve(
        pendulum(), Request(value=H, steps=5, every=1, **settings)
    )
    return run.failure, len(run.t)


def differentiated():
    run = daebench.run("planar_pendulum", case="horizontal", method="rattle", h=H, steps=5, sensitivities=["gravity", "q0"])
    return run.failure, len(run.t)


def in_lanes():
    """Return what the last of ten members says, that has a step size of its own."""
    some = members(pendulum(), moving(pendulum(), 10), H + 1e-4 * np.arange(10), {})
    run = run_members(FixedStep("rattle"), some, request(5, every=1), lanes=4, threads=1)
    assert run.status.tolist() == [ANOTHER_BRANCH] * 10
    return run.failure(9), 1 + int(run.steps[9])


KINDS = {
    "as written": lambda: alone(compiled=False),
    "compiled": alone,
    "float32": lambda: alone(precision="float32"),
    "compensated": lambda: alone(method={"compensated": True}),
    "stored rarely": lambda: alone(watch=()),
    "derivatives": differentiated,
    "lanes": in_lanes,
    **{scheme: lambda scheme=scheme: alone(scheme, compiled=False) for scheme in ("symplectic_euler", "symplectic_euler_adjoint", "shake")},
}

COMPILED = ("compiled", "float32", "compensated", "stored rarely", "derivatives", "lanes")


@pytest.mark.sampled(left_out=("compiled", "float32", "compensated", "stored rarely"))
@pytest.mark.usefixtures("opposite")
@pytest.mark.parametrize("kind", [pytest.param(kind, marks=[pytest.mark.slow] * (kind in COMPILED)) for kind in KINDS], ids=str)
def test_another_branch_is_named_in_every_kind_of_kernel(kind):
    failure, states = KINDS[kind]()
    assert NAMED in (failure or "")
    assert states == 1


def test_nothing_is_named_where_nothing_is_planted():
    for kind in ("as written", "shake"):
        assert KINDS[kind]() == (None, 6)


@pytest.mark.slow
@pytest.mark.usefixtures("opposite")
def test_another_branch_is_named_in_a_browser(chromium):
    made = script(FixedStep("rattle"), pendulum(), H)
    page = chromium.new_page()
    report = page.evaluate(RUN, [made.text, np.concatenate(pendulum().start).tolist(), H, made.par, made.weights])
    page.close()
    assert (report[0], report[4]) == (0, ANOTHER_BRANCH)
