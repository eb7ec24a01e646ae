"""Plans: everything is checked where one is made, what is asked again is not made again, and a run goes through few files."""

import sys
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from refusals import refused

import daebench
from daebench.methods import plan as plans
from daebench.methods.plan import plan
from daebench.systems.constrained import Case, ConstrainedHamiltonian

QUESTION = {"problem": "spherical_pendulum", "method": "rattle", "h": 0.01, "t_end": 1}
ROOT = Path(daebench.__file__).parent


def entered(call):
    """Return the files of the package in which functions are entered by a call; bodies of modules and generated code do not count."""
    files = set()

    def look(frame, event, _):
        path = Path(frame.f_code.co_filename)
        if event == "call" and frame.f_code.co_name != "<module>" and path.is_relative_to(ROOT):
            files.add(str(path.relative_to(ROOT)))

    before = sys.getprofile()
    sys.setprofile(look)
    try:
        call()
    finally:
        sys.setprofile(before)
    return files


def test_the_second_run_of_a_process_goes_through_fifteen_files():
    daebench.run(**QUESTION)
    files = entered(lambda: daebench.run(**QUESTION))
    assert {"methods/run.py", "methods/plan.py", "methods/fixed_step/stepping.py"} <= files
    assert len(files) <= 15, sorted(files)


def test_what_is_asked_again_has_the_same_plan_and_the_same_numbers():
    plans._plans.clear()
    first, second = daebench.run(**QUESTION), daebench.run(**QUESTION)
    assert len(plans._plans) == 1
    assert first.q.tobytes() == second.q.tobytes()
    assert first.work == second.work
    assert first.q is not second.q
    assert plan(**QUESTION) is plan(**QUESTION)


def test_who_changes_a_result_or_an_argument_changes_no_later_run():
    asked = {"problem": "planar_pendulum", "case": "horizontal", "t_end": 1}
    rattle, options = {"method": "rattle", "h": 0.01}, {"alpha": 10.0, "beta": 10.0}
    first = daebench.run(**asked, **rattle)
    gravity = first.parameters["gravity"]
    first.ivp.q0[:], first.ivp.parameters["gravity"] = [0, -1], 1.62
    second = daebench.run(**asked, **rattle)
    assert second.q.tobytes() == first.q.tobytes()
    assert second.parameters["gravity"] == gravity
    ida = {"method": "ida:baumgarte", "tol": 1e-6}
    before = daebench.run(**asked, **ida, options=options)
    options["alpha"] = options["beta"] = 1.0
    assert not np.array_equal(daebench.run(**asked, **ida, options=options).q, before.q)
    assert np.array_equal(daebench.run(**asked, **ida, options={"alpha": 10.0, "beta": 10.0}).q, before.q)


def test_derivatives_of_what_is_asked_again_begin_at_the_start_again():
    asked = QUESTION | {"sensitivities": ["gravity"]}
    first, second = daebench.run(**asked), daebench.run(**asked)
    assert first.sensitivities["gravity"]["q"].tobytes() == second.sensitivities["gravity"]["q"].tobytes()


def test_equal_numbers_of_another_type_are_another_question():
    count = {name: value for name, value in QUESTION.items() if name != "t_end"}
    plan(**count, steps=1)
    with refused("not-whole", name="steps"):
        plan(**count, steps=True)


def test_what_can_change_between_two_questions_is_asked_anew(tmp_path, monkeypatch):
    text = (ROOT / "problems" / "planar_pendulum.py").resolve().read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(text, encoding="utf-8")
    Path("code.py").write_text("def step(p, q, h):\n    return p, q\n", encoding="utf-8")
    q0 = np.array(plan("planar_pendulum", method="rattle", h=0.1, steps=1).ivp.q0)
    for settings in ({"problem": "./mine.py"}, {"method": "./code.py:step"}, {"q0": q0}):
        asked = {"problem": "planar_pendulum", "method": "rattle", "h": 0.1, "steps": 1} | settings
        assert plan(**asked) is not plan(**asked)


def test_a_progress_is_told_by_a_plan_that_is_kept():
    for _ in range(2):
        told = []
        daebench.run(**QUESTION, progress=told.append)
        assert told[-1] == 1.0


@pytest.mark.parametrize("number", [np.float64(9.81), np.float32(2), sp.Float(0.1 + 0.2), sp.GoldenRatio], ids=str)
def test_the_parameters_of_a_case_may_be_numbers_of_any_kind(number):
    (x, y), (p, r), gravity = sp.symbols("x y", real=True), sp.symbols("p r", real=True), sp.Symbol("gravity", positive=True)
    case = Case(q=(1, 0), p=(0, 0), parameters={"gravity": number})
    swing = ConstrainedHamiltonian(
        q=(x, y), p=(p, r), M=sp.eye(2), U=gravity * y, g=[x**2 + y**2 - 1], parameters={gravity: 1.0}, cases={"side": case}
    )
    assert plan(swing, method="rattle", h=0.1, steps=1).ivp.parameters["gravity"] == float(number)
