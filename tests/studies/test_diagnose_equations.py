"""Codes with a wrong mass, inertia or force are told so, whatever their integrator is; right ones never are."""

import numpy as np
import pytest
from planted_codes import PLANTED, loaded, marks

from daebench.studies.diagnose.diagnosis import diagnose
from daebench.studies.diagnose.dictionary import FAULTS
from daebench.studies.diagnose.verdict import CORRECT, FAULT, UNSURE

pytestmark = pytest.mark.usefixtures("plain_functions")

equations_codes, engine_codes = loaded("equations_codes"), loaded("engine_codes")

POSED = {
    "spring_pendulum": (str(PLANTED / "spring_pendulum.py"), "moving"),
    "beads": (str(PLANTED / "beads.py"), "thrown"),
    "slider_crank": ("slider_crank", None),
}

SLOW = {("spring_pendulum", "reduced", "mass_and_force"), ("slider_crank", "rattle", ""), ("slider_crank", "rattle", "inertia")}
"""Tried by the gate."""

NAMED_OTHERWISE = ("force_scaled", "kick_missing")
"""Faults that are a factor of the whole force, zero among them."""


def entries():
    """Return all codes."""
    for entry in equations_codes.codes():
        name, style, change = entry
        yield pytest.param(*entry, marks=marks(False, entry in SLOW), id=f"{name}-{style}-{change or 'right'}")


@pytest.mark.parametrize(("name", "style", "change"), list(entries()))
def test_a_wrong_mass_inertia_or_force_is_named_and_a_right_code_is_not_accused(name, style, change):
    step, words = equations_codes.code(name, style, change)
    problem, case = POSED[name]
    shown = diagnose(step, problem, case=case, measure=False)
    if not change:
        assert "other equations" not in " ".join(shown.evidence)
        assert "other_equations" not in shown.faults
        assert shown.verdict == CORRECT or style == "reduced"
        return
    assert words in shown.evidence[0]
    assert shown.verdict != CORRECT
    if shown.faults != ("other_equations",):
        assert set(shown.faults) <= set(NAMED_OTHERWISE)


@pytest.mark.slow
def test_the_number_of_a_wrong_mass_and_of_a_wrong_force_are_told():
    """Hold the sentence to 9.81 times the masses 1 and 2.5; the last digit of 24.525 may be rounded either way."""
    step, _ = equations_codes.code("spring_pendulum", "rattle", "mass_and_force")
    shown = diagnose(step, POSED["spring_pendulum"][0], case="moving", measure=False)
    assert (shown.verdict, shown.faults) == (FAULT, ("other_equations",))
    assert shown.evidence[0] in {
        "as h goes to zero the step solves other equations: q' is that of another mass matrix, M[3,3] = 5 in place of 2.5 and M[4,4] = 5 "
        f"in place of 2.5; p' is that of a force with -9.81 more in component 2 and {told} more in component 4"
        for told in ("-24.52", "-24.53")
    }
    assert shown.remedies == (FAULTS["other_equations"].remedy,)


def test_agreement_with_a_scheme_does_not_outweigh_other_equations():
    """Hold a code that is right at large steps, and under another gravity at small ones, against its limit."""
    right, wrong = engine_codes.World("single"), engine_codes.World("single", "force_scaled")

    def step(p, q, h):
        return (right if h > 4e-3 else wrong).step(p, q, h)

    shown = diagnose(step, "planar_pendulum", parameters={"mass": 2.5, "gravity": 3.0}, measure=False)
    assert shown.verdict == UNSURE
    assert shown.evidence[0].startswith("as h goes to zero the step solves other equations: p' is that of 0.75 times the problem's force")


def test_a_right_code_in_float32_is_not_accused_by_an_order_that_its_rounding_has():
    step = engine_codes.World("single", "", np.float32).step
    shown = diagnose(step, "planar_pendulum", parameters={"mass": 2.5, "gravity": 3.0})
    assert (shown.verdict, shown.measured["order"]) == (CORRECT, "round-off")
