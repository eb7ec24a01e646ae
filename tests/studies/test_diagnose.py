"""Codes with a mistake that is known, written without knowledge of the dictionary: each is named, or left open, and none is misnamed."""

import json
import shutil
import subprocess
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from fault_effects import PROBLEMS, effects, kept
from planted_codes import PLANTED, marks
from refusals import refused

from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of, parse
from daebench.methods.names_tables import CONSTRAINED
from daebench.studies.diagnose.battery import map_of, uncompiled
from daebench.studies.diagnose.diagnosis import diagnose
from daebench.studies.diagnose.dictionary import FAULTS
from daebench.studies.diagnose.faulty_steps import FAULTY_STEPS
from daebench.studies.diagnose.verdict import CORRECT, FAULT, UNSURE

pytestmark = pytest.mark.usefixtures("plain_functions")

CODES = json.loads((PLANTED / "index.json").read_text(encoding="utf-8"))

LEFT_OPEN = {
    "two_bodies_codes.py:reference_gradient_at_q1_2": "on spheres both gradients are along the same line",
    "sphere_codes.py:end_normal": "on spheres both gradients are along the same line",
    "ellipsoid_codes.py:normal_of_the_end": "without a force it is implicit_euler, and a projection of free motion",
    "ellipsoid_codes.py:straight_then_down": "without a force it is implicit_euler, and a projection of free motion",
    "ellipsoid_codes.py:halved": "the mass is 2",
    "ellipsoid_codes.py:reduced_euler": "it is se",
    "dsp_reduced_euler.c:step": "it is se",
    "multibody_codes.py:fourbar_reduced_euler": "it is se",
    "slider_crank_codes.py:index_reduced_3": "it is midpoint",
    "sphere_codes.py:midpoint_reduced": "it is midpoint",
    "multibody_codes.py:chain_midpoint_on_reduced": "it is midpoint",
}
"""Codes of which two verdicts are right, or which are a scheme of daebench."""


@cache
def compiled(file, folder):
    library = folder / Path(file).with_suffix(".so").name
    subprocess.run(["gcc", "-O2", "-shared", "-fPIC", "-o", library, PLANTED / file, "-lm"], check=True)
    return library


def address(entry, folder):
    file, _, name = entry["code"].partition(":")
    if not file.endswith(".c"):
        return f"{PLANTED / file}:{name}"
    if shutil.which("gcc") is None:
        pytest.skip("no C compiler")
    return f"{compiled(file, folder)}:{name}"


def diagnosed(entry, folder, **options):
    problem = str(PLANTED / entry["problem"]) if entry["problem"].endswith(".py") else entry["problem"]
    return diagnose(address(entry, folder), problem, case=entry["case"], parameters=entry["parameters"], measure=False, **options)


QUICK = ("double_pendulum_codes.py:correct_3", "double_pendulum_codes.py:full_kick_1")
"""Tried in each run of the tests: a right code, and a mistake."""

SLOW = (
    "double_pendulum_codes.py:correct_1",
    "two_bodies_codes.py:reference_gradient_at_q1_2",
    "two_bodies_codes.py:index_reduced_2",
    "two_bodies_codes.py:step_off_by_one_2",
    "multibody_codes.py:correct_fourbar",
    "spring_pendulum_codes.py:other_6",
)
"""Tried by the gate: one for each way in which a verdict is found."""


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # planted codes leave the domain of their forces
@pytest.mark.parametrize(
    "entry", [pytest.param(entry, id=entry["code"], marks=marks(entry["code"] in QUICK, entry["code"] in SLOW)) for entry in CODES]
)
def test_a_planted_fault_is_named(entry, tmp_path_factory):
    shown = diagnosed(entry, tmp_path_factory.getbasetemp())
    if entry["expected"] == "correct":
        assert (shown.verdict, shown.faults) == (CORRECT, ())
    elif entry["expected"] == "other":
        assert shown.verdict == UNSURE
    elif entry["code"] in LEFT_OPEN:
        assert shown.verdict == UNSURE
        assert entry["expected"] in shown.faults or shown.resembles == "se"
    else:
        assert (shown.verdict, shown.faults) == (FAULT, (entry["expected"],)), shown.evidence
    assert len(shown.remedies) == len(shown.faults)
    assert shown.evidence


SINCE = (
    "reference_gradient_after_drift",
    "reference_gradient_at_midpoint",
    "position_based",
    "momentum_at_half_step",
    "velocity_projected_at_q0",
    "velocity_projected_before_kick",
    "force_before_correction",
    "kick_missing",
    "position_without_force",
    "multiplier_times_h",
    "multiplier_clamped",
    "constraint_missing",
    "constraint_shifted",
    "reaction_missing",
    "force_scaled",
    "other_equations",
    "momentum_damped",
    "step_size_ignored",
)
"""Faults that are planted in other styles, see test_diagnose_styles.py and test_diagnose_equations.py."""


def test_every_fault_is_planted_on_three_problems():
    problems = {fault: set() for fault in FAULTS if fault not in SINCE}
    for entry in CODES:
        if entry["expected"] in problems:
            problems[entry["expected"]].add(entry["problem"])
    assert {fault for fault, names in problems.items() if len(names) < 3} == set()
    assert sum(entry["expected"] == "correct" for entry in CODES) >= 20


SPECIAL = ("boris", "lie", "lie_adjoint", "strang", "rattle_conformal", "rattle_settle")
SCHEMES = [
    listed.name
    for listed in CONSTRAINED.listed()
    if listed.knob == "h" and listed.name not in SPECIAL and not parse(listed.name).member.claims.nonholonomic
]
"""Those for constraints on positions that need no charge, no flow of the kinetic energy, no damping and no water."""

SAME_STEPS = {"livens": "energy_momentum"}
"""Schemes that take the steps of another where the mass matrix is constant."""


def black_box(name):
    ivp = initial_value_problem("double_pendulum", None, {"mass2": 3.0})
    step = map_of(uncompiled(method_of(ivp, name)), ivp)
    return lambda p, q, h: step(p, q, h)


@pytest.mark.sampled(by=lambda case: case in ("rattle", "shake", "rk4"), slow=("shake", "rk4"))
@pytest.mark.parametrize("name", SCHEMES)
def test_a_scheme_of_daebench_is_never_accused(name):
    code = black_box(name)
    own = diagnose(code, "double_pendulum", parameters={"mass2": 3.0}, scheme=name, measure=False)
    assert (own.verdict, own.faults) == (CORRECT, ())
    unclaimed = diagnose(code, "double_pendulum", parameters={"mass2": 3.0}, measure=False)
    if name in ("rattle", "lobatto2"):
        assert unclaimed.verdict == CORRECT
    else:
        assert (unclaimed.verdict, unclaimed.resembles) == (UNSURE, SAME_STEPS.get(name, name))


def test_a_right_code_for_another_scheme_is_no_fault_of_it():
    shown = diagnose(black_box("rattle"), "double_pendulum", parameters={"mass2": 3.0}, scheme="lobatto3", measure=False)
    assert (shown.verdict, shown.resembles) == (UNSURE, "lobatto2")


def test_what_cannot_show_is_said():
    shown = diagnose(black_box("rattle"), "double_pendulum", parameters={"mass2": 3.0}, measure=False)
    assert "old_force" in shown.not_seen  # gravity is constant
    assert "multiplier_half" not in shown.not_seen


def test_bad_input_is_one_sentence():
    for code, problem, options, message in (
        ("rattle", "double_pendulum", {}, "diagnose-own-method"),
        (lambda p, q, h: (p, q), "lotka_volterra", {}, "diagnose-no-positions"),
        (lambda p, q, h: (p, q), "double_pendulum", {"scheme": "ida:index2"}, "compared-own-steps"),
        (lambda p, q, h: (p, q), "double_pendulum", {"scheme": "strang"}, "method-refuses-problem"),
        (lambda p, q, h: p, "double_pendulum", {}, "state-not-arrays"),
        (lambda p, q, h: (p, q), "arevalo", {}, "diagnose-faults-unknown"),
        (lambda p, q, h: (p, q), "planar_pendulum", {"q0": (0.0, -1.0), "p0": (0.0, 0.0)}, "diagnose-at-rest"),
    ):
        with refused(message):
            diagnose(code, problem, **options)


def test_a_step_that_changes_nothing_counts_wrong():
    shown = diagnose(lambda p, q, h: (p.copy(), q.copy()), "double_pendulum", parameters={"mass2": 3.0}, measure=False)
    assert shown.faults == ("step_off_by_one",)


SHOWN = {("reference_gradient_at_q1", "double_pendulum"), ("multiplier_half", "slider_crank")}
"""Effects that are measured anew."""


def test_effects_are_kept_of_every_fault_on_every_problem():
    assert [(row["fault"], row["problem"]) for row in kept()] == [(fault, problem) for problem in PROBLEMS for fault in FAULTY_STEPS]
    assert set(FAULTY_STEPS) == set(FAULTS)


@pytest.mark.exhaustive
@pytest.mark.parametrize("row", [row for row in kept() if (row["fault"], row["problem"]) in SHOWN], ids=lambda row: row["fault"])
def test_effects_are_what_is_measured(row):
    now = effects(row["fault"], row["problem"])
    assert now["energy"] == row["energy"]
    for name in ("order", "symmetric", "symplectic", "H"):
        rounding = 1e-10 if name == "symplectic" else 1e-13
        assert np.isclose(now[name], float(row[name]), rtol=0.02, atol=rounding), name


def test_a_step_without_any_force_is_told_so():
    found = diagnose(lambda p, q, h: (p, q + h * p / [1, 1, 3, 3]), "double_pendulum", parameters={"mass2": 3.0}, measure=False)
    assert any("that of no force" in str(line) for line in found.printed())
