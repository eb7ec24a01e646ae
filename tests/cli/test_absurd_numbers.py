"""Absurd numbers: each is taken for what it is or refused in one sentence, and no code from outside is left to itself."""

import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from daebench.errors import LONGEST, BadInput, Overdue, RunFailed, Stopped, positive, real, whole
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.outside.call import Code
from daebench.methods.outside.ending import Limit
from daebench.methods.run import run
from daebench.methods.solvers.native import recorder
from daebench.methods.solvers.native import run as native
from daebench.reference.solution import reference_solution
from daebench.runs.external_state import external_state
from daebench.systems.files.execute import naming

HUGE = (10**30, 10**400, 10**5000)


CHECKS = {
    "real": partial(real, "x"),
    "positive": partial(positive, "x"),
    "whole": partial(whole, "x"),
    "state": lambda value: external_state([[value], [0]], [(1,), (1,)], "x must be")[0],
}
"""What a number, or a state with one, goes through."""


@pytest.mark.parametrize("value", [*HUGE, -(10**400)], ids=["1e30", "1e400", "1e5000", "-1e400"])
@pytest.mark.parametrize("check", CHECKS)
def test_a_number_of_any_size_is_itself_or_gets_a_sentence(check, value):
    if check != "whole" and abs(value) < 1e308:
        assert np.array_equal(np.ravel(CHECKS[check](value)), [1e30])
        return
    with pytest.raises(BadInput, match=r"^x "):
        CHECKS[check](value)


@pytest.mark.parametrize("length", [1000, 1001, 10**7])
def test_what_a_code_says_is_at_most_a_thousand_characters_long(length, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(f"def step(p, q, h):\n    raise ValueError({length} * 'x')\n")
    failure = run("planar_pendulum", method="./mine.py:step", h=0.1, steps=2).failure
    assert len(failure) <= LONGEST == 1000
    assert failure.endswith(".")


def test_a_record_of_steps_has_any_number_of_pieces(monkeypatch):
    monkeypatch.setattr(recorder, "ROWS", 1)
    monkeypatch.setattr(native, "ROWS", 1)
    steps = run("spherical_pendulum", method="ida:index2", tol=1e-6, t_end=60, points=2, solver_steps=True).solver_steps
    assert len(steps.t) > 600
    assert np.all(np.diff(steps.t) > 0)


@pytest.mark.parametrize("gravity", [0.0, -9.81, 1e-300])
def test_a_closed_form_that_has_no_values_gives_way_to_an_integration(gravity):
    ivp = initial_value_problem("planar_pendulum", "horizontal", {"gravity": gravity}, p0=[0.0, 1.0])
    known = reference_solution(ivp, [0.0, 1.0])
    assert all(np.isfinite(rows).all() for rows in known.states.values())
    if abs(gravity) < 1:  # it turns at a constant rate
        assert np.allclose(known.states["q"][1], [np.cos(1), np.sin(1)], atol=1e-9)


def test_the_time_of_a_code_ends_in_the_code_alone():
    rung = []

    def step(p, q, h):
        try:
            code.alarm._ring(0, sys._getframe(1))  # the caller: its variables would be torn
            rung.append("caller")
            code.alarm._ring(0, sys._getframe())
        except Overdue:
            rung.append("code")
        code.alarm._ring(0, sys._getframe())

    guard = partial(naming, "mine.py", Path(__file__), lambda: [Path(__file__)], RunFailed)  # of a file of one's own
    code = Code("mine", lambda: step, guard, Limit(100.0))
    with pytest.raises(Stopped, match="limit of 100 s"):
        code.step([np.zeros(1), np.zeros(1)], 0.1)
    assert rung == ["caller", "code"]
    assert not code.alarm.armed


def test_a_time_limit_is_no_mistake_of_the_file():
    with pytest.raises(Overdue), naming("mine.py", Path("mine.py"), list, RunFailed):
        raise Overdue
