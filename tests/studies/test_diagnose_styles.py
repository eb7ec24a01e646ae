"""The faults planted anew in other styles: objects and loops in two precisions, a basis of the tangent space, and C."""

import shutil
import subprocess
from functools import cache, partial

import numpy as np
import pytest
from planted_codes import PLANTED, loaded, marks

from daebench.studies.diagnose.diagnosis import diagnose
from daebench.studies.diagnose.dictionary import FAULTS
from daebench.studies.diagnose.verdict import CORRECT, FAULT, UNSURE

pytestmark = [pytest.mark.usefixtures("plain_functions"), pytest.mark.filterwarnings("ignore::RuntimeWarning")]

basis_codes, engine_codes = loaded("basis_codes"), loaded("engine_codes")

ENGINE_ON = {
    "single": ("planar_pendulum", "horizontal", {"mass": 2.5, "gravity": 3.0}),
    "double": ("double_pendulum", "horizontal", {"mass2": 3.0}),
    "double_in_space": ("double_spherical_pendulum", "horizontal", {"mass1": 2.0, "mass2": 0.5}),
    "sprung": (str(PLANTED / "sprung_rods.py"), None, {}),
    "three": ("pendulum_chain", "horizontal5", {"links": 3}),
}
"""The problem that a model of the engine is."""

BASIS_ON = {
    "spring_pendulum": (("U_q", "g", "G", "M"), "moving"),
    "beads": (("grad", "cons", "jac", "M"), "thrown"),
}
"""The functions of a model, and its case."""

IN_C = (
    "correct",
    "reference_gradient_after_drift",
    "reference_gradient_each_sweep",
    "momentum_not_corrected",
    "velocity_not_projected",
    "loose_tolerance",
    "position_based",
    "mass_missing_in_position",
    "velocity_projected_at_q0",
    "reaction_missing",
    "constraint_missing",
    "force_scaled",
    "kick_missing",
)
"""What the numbers of MISTAKE in rods.c are."""

ONE_MASS = ("constraint_missing", "constraint_missing_in_position", "constraint_missing_in_velocity", "reaction_missing")
"""Habits that need two rods."""

ONE_METRIC = ("mass_missing_in_position", "mass_missing_in_velocity")
"""Habits that have no effect on equal masses."""

CONSTANT_FORCE = ("old_force", "force_before_correction")
"""Habits that have no effect under gravity alone."""


def engine(name, habit, real):
    problem, case, parameters = ENGINE_ON[name]
    return partial(diagnose, engine_codes.World(name, habit, real).step, problem, case=case, parameters=parameters, measure=False)


def basis(name, mistake):
    functions, case = BASIS_ON[name]
    model = loaded(f"{name}_codes")
    step = basis_codes.make(*(getattr(model, function) for function in functions), mistake)
    return diagnose(step, str(PLANTED / f"{name}.py"), case=case, measure=False)


@cache
def library(number, real, folder):
    path = folder / f"rods_{real}_{number}.so"
    flags = ["-O2", "-shared", "-fPIC", f"-DREAL={real}", f"-DMISTAKE={number}"]
    subprocess.run(["gcc", *flags, "-o", path, PLANTED / "rods.c", "-lm"], check=True)
    return path


def in_c(number, real, folder):
    if shutil.which("gcc") is None:
        pytest.skip("no C compiler")
    problem, case, parameters = ENGINE_ON["double_in_space"]
    return diagnose(f"{library(number, real, folder)}:step", problem, case=case, parameters=parameters, measure=False)


def right(name, habit, real):
    """Return the verdicts that are right, of a habit on a model."""
    fault = engine_codes.EXPECTED.get(habit, habit)
    if fault == "correct" or (habit in CONSTANT_FORCE and name != "sprung"):
        return {(CORRECT, ())}
    if name in ("single", "three") and habit in ONE_METRIC:
        return {(CORRECT, ())}
    if name == "three" and habit == "reference_gradient_at_q1":
        return {(UNSURE, ("reference_gradient_at_q1", "projected_after"))}  # of equal masses under a constant force they are one step
    if real is np.float32 and habit in ("index_reduced", "baumgarte"):
        return {(UNSURE, ())}  # it is rk4 of daebench; its feedback is below what it rounds
    if habit == "index_reduced":
        return {(UNSURE, ("index_reduced",))}  # it is rk4 of daebench
    if habit == "position_without_force" and name != "sprung":
        return {(UNSURE, ("kick_missing", "position_without_force"))}  # under a constant force they are one step
    if real is np.float32 and habit in ("loose_tolerance_fine", "loose_velocity"):
        return {(CORRECT, ())}  # its stop is below what it rounds
    return {(FAULT, (fault,))}


SLOW = [
    ("sprung", "", np.float32),
    ("double", "reference_gradient_after_drift", np.float64),
    ("double", "reaction_missing", np.float64),
]
"""Tried by the gate."""


def engines():
    """Return all codes of the engine."""
    for name in ENGINE_ON:
        for real in (np.float64, np.float32) if name in ("sprung", "double_in_space") else (np.float64,):
            for habit in engine_codes.HABITS:
                if name == "single" and habit in ONE_MASS:
                    continue
                entry = name, habit, real
                yield pytest.param(*entry, marks=marks(False, entry in SLOW), id=f"{name}-{habit or 'right'}-{real.__name__}")


@pytest.mark.parametrize(("name", "habit", "real"), list(engines()))
def test_an_engine_with_a_bad_habit(name, habit, real):
    shown = engine(name, habit, real)()
    assert (shown.verdict, shown.faults) in right(name, habit, real), shown.evidence


@pytest.mark.slow
@pytest.mark.sampled(by=lambda case: case == "spring_pendulum-velocity_projected_before_kick")
@pytest.mark.parametrize("mistake", basis_codes.MISTAKES, ids=lambda mistake: mistake or "right")
@pytest.mark.parametrize("name", BASIS_ON)
def test_a_code_in_a_basis_of_the_tangent_space(name, mistake):
    shown, fault = basis(name, mistake), basis_codes.MISTAKES[mistake]
    if mistake == "kick_at_end_only":
        assert (shown.verdict, shown.faults, shown.resembles) == (UNSURE, (fault,), "symplectic_euler_adjoint")
    else:
        assert (shown.verdict, shown.faults) == ((CORRECT, ()) if fault == "correct" else (FAULT, (fault,))), shown.evidence


@pytest.mark.slow
@pytest.mark.parametrize("real", ["double", pytest.param("float", marks=pytest.mark.exhaustive)])
@pytest.mark.parametrize(
    "number", [pytest.param(k, id=name, marks=[] if k == 0 else pytest.mark.exhaustive) for k, name in enumerate(IN_C)]
)
def test_a_code_in_c(number, real, tmp_path_factory):
    shown, fault = in_c(number, real, tmp_path_factory.getbasetemp()), IN_C[number]
    exact = fault == "correct" or (real == "float" and fault == "loose_tolerance")  # its stop is below what it rounds
    assert (shown.verdict, shown.faults) == ((CORRECT, ()) if exact else (FAULT, (fault,))), shown.evidence


def test_every_fault_is_planted_in_these_styles():
    engines = {engine_codes.EXPECTED.get(habit, habit) for habit in engine_codes.HABITS}
    # codes with other equations are in test_diagnose_equations.py
    assert set(FAULTS) <= engines | set(basis_codes.MISTAKES.values()) | {"other_equations"}


def test_a_fault_is_named_under_another_force_than_the_problem_s():
    step = engine_codes.World("single", "position_based").step
    shown = diagnose(step, "planar_pendulum", parameters={"mass": 2.5, "gravity": 1.0}, measure=False)
    assert (shown.verdict, shown.faults) == (FAULT, ("position_based",))
    assert "p' is that of 3 times the problem's force" in shown.evidence[0]
    assert "the force is 3 times the problem's" in shown.evidence[2]


class Wearing:
    """RATTLE for a pendulum that is right for thirty steps, and then leaves its momenta as they are."""

    def __init__(self):
        self.count = 0

    def step(self, p, q, h):
        self.count += 1
        down = np.array([0.0, 1.0])
        free = q + h * (p - h / 2 * down)
        inner = q @ free
        end = free - (inner - np.sqrt(inner**2 - free @ free + 1)) * q
        last = (end - q) / h - h / 2 * down
        return (last - (last @ end) * end if self.count <= 30 else last), end


def test_nothing_is_correct_against_its_own_measurement():
    shown = diagnose(Wearing, "planar_pendulum", measure=False)
    assert shown.verdict == CORRECT  # single steps and a short run show nothing
    shown = diagnose(Wearing, "planar_pendulum")
    assert shown.verdict == UNSURE
    assert "against it speaks that its order is" in shown.evidence[-1]
