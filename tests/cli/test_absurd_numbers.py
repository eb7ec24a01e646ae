"""Absurd numbers, lists without a word, and very long texts in options: one sentence each, and never a fault."""

import numpy as np
import pytest
from refusals import refused

from daebench.errors import LONGEST, BadInput, Overdue, RunFailed, positive, real, whole
from daebench.methods.outside.call import Code
from daebench.methods.outside.ending import Limit
from daebench.methods.run import run
from daebench.methods.solvers.native import run as native
from daebench.reference.solution import reference_solution
from daebench.runs.external_state import external_state
from daebench.systems.files.execute import naming

HUGE = (10**30, 10**400, 10**5000)

PENDULUM = ("planar_pendulum", "--h", "0.05", "--t-end", "2")


@pytest.mark.parametrize("value", [*HUGE, -(10**400)], ids=["1e30", "1e400", "1e5000", "-1e400"])
@pytest.mark.parametrize("check", [real, positive, whole])
def test_a_number_of_any_size_gets_a_sentence(check, value):
    if check is not whole and abs(value) < 1e308:
        assert check("x", value) == float(value)
        return
    with pytest.raises(BadInput, match=r"^x = "):
        check("x", value)


COMMANDS = [
    ("shadow", *PENDULUM, "--method", ","),
    ("baumgarte", *PENDULUM, "--methods", ","),
    ("advise", "planar_pendulum", "--accuracy", "1e-3", "--methods", " , "),
    ("bench", "--methods", ","),
    ("work-precision", "planar_pendulum", "--methods", ","),
    ("work-precision", "planar_pendulum", "--methods", "rattle", "--t-end", "1e-320"),
    ("ensemble", *PENDULUM[:3], "--method", "rattle", "--steps", "3", "--members", 400 * "1"),
    ("run", *PENDULUM[:3], "--method", "rattle", "--steps", 5000 * "1"),
    ("compare", *PENDULUM[:3], "--method", "x" * 10**5, "--t-end", "1"),
    ("run", "x" * 10**5, "--method", "rattle"),
]


@pytest.mark.parametrize("words", COMMANDS, ids=lambda words: " ".join(words)[:60])
def test_an_absurd_option_gets_one_sentence(daebench, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    status, out, error = daebench(*words)
    assert (status, out, error.count("\n")) == (2, "", 1)
    assert error.startswith("daebench: ")
    assert len(error.rstrip("\n")) <= 1000


@pytest.mark.parametrize("length", [1000, 1001, 10**7])
def test_what_a_code_says_is_at_most_a_thousand_characters_long(length, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(f"def step(p, q, h):\n    raise ValueError({length} * 'x')\n")
    failure = run("planar_pendulum", method="./mine.py:step", h=0.1, steps=2).failure
    assert len(failure) <= LONGEST == 1000
    assert failure.endswith(".")


@pytest.mark.parametrize("value", [*HUGE, -(10**400)], ids=["1e30", "1e400", "1e5000", "-1e400"])
def test_a_state_of_huge_whole_numbers_is_no_state(value):
    if abs(value) < 1e308:
        assert np.array_equal(external_state([[value], [0]], [(1,), (1,)], "a step must return p and q"), [[1e30], [0]])
        return
    with pytest.raises(BadInput, match="a step must return p and q, of shape"):
        external_state([[value], [0]], [(1,), (1,)], "a step must return p and q")


def test_a_record_of_steps_has_any_number_of_pieces(monkeypatch):
    from daebench.methods.solvers.native import recorder

    monkeypatch.setattr(recorder, "ROWS", 1)
    monkeypatch.setattr(native, "ROWS", 1)
    steps = run("spherical_pendulum", method="ida:index2", tol=1e-6, t_end=60, points=2, solver_steps=True).solver_steps
    assert len(steps.t) > 600
    assert np.all(np.diff(steps.t) > 0)


@pytest.mark.parametrize("gravity", [0.0, -9.81, 1e-300])
def test_a_closed_form_that_has_no_values_gives_way_to_an_integration(gravity):
    from daebench.methods.initial_value_problem import initial_value_problem

    ivp = initial_value_problem("planar_pendulum", "horizontal", {"gravity": gravity}, p0=[0.0, 1.0])
    known = reference_solution(ivp, [0.0, 1.0])
    angle = 1.0 if abs(gravity) < 1 else None
    assert all(np.isfinite(rows).all() for rows in known.states.values())
    if angle:  # it turns at a constant rate
        assert np.allclose(known.states["q"][1], [np.cos(angle), np.sin(angle)], atol=1e-9)


def test_the_time_of_a_code_ends_in_the_code_alone():
    rung = []

    def step(p, q, h):
        import sys

        try:
            code.alarm._ring(0, sys._getframe(1))  # the caller: its variables would be torn
            rung.append("caller")
            code.alarm._ring(0, sys._getframe())
        except Overdue:
            rung.append("code")
        code.alarm._ring(0, sys._getframe())

    method = methods_of_nothing(step)
    code = Code("mine", lambda: step, method, Limit(100.0))
    with pytest.raises(Exception, match="the limit of 100 s is reached"):
        code.step([np.zeros(1), np.zeros(1)], 0.1)
    assert rung == ["caller", "code"]
    assert not code.alarm.armed


def methods_of_nothing(step):
    """Return the guard of a file of one's own."""
    from pathlib import Path

    return lambda: naming("mine.py", Path(__file__), lambda: [Path(__file__)], RunFailed)


def test_a_time_limit_is_no_mistake_of_the_file():
    from pathlib import Path

    with pytest.raises(Overdue), naming("mine.py", Path("mine.py"), list, RunFailed):
        raise Overdue


@pytest.mark.parametrize("text", ["1e-320", "5e-324"])
def test_a_number_that_has_few_digits_is_refused(text):
    with refused("below-normal-range"):
        positive("t_end", float(text))
