"""The faults planted anew in other styles: objects and loops in two precisions, a basis of the tangent space, and C."""

import shutil
import subprocess
from functools import cache

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

EVENLY_FORCED = set(ENGINE_ON) - {"sprung"}
"""Models under gravity alone."""

ONE_SWEEP_MEETS = {"loose_tolerance_fine", "loose_velocity"}
ON_THE_RAY = ("reference_gradient_at_q1", "reference_gradient_each_sweep", "projected_after", "reference_gradient_after_drift")

DOUBLE, SINGLE = {np.float64}, {np.float32}

NOT_TOLD = (
    # habits without an effect on a model
    (ENGINE_ON, {""}, DOUBLE | SINGLE, (CORRECT, ())),
    (EVENLY_FORCED, {"old_force", "force_before_correction"}, DOUBLE | SINGLE, (CORRECT, ())),
    ({"single", "three"}, {"mass_missing_in_position", "mass_missing_in_velocity"}, DOUBLE, (CORRECT, ())),  # their masses are equal
    ({"three"}, {"velocity_for_momentum"}, DOUBLE, (CORRECT, ())),  # its masses are one
    ({"single"}, ONE_SWEEP_MEETS, DOUBLE, (CORRECT, ())),  # the sweep that ends an iteration is exact for one rod
    (ENGINE_ON, ONE_SWEEP_MEETS, SINGLE, (CORRECT, ())),  # the stop is below what is rounded
    # habits that are one step on a model
    ({"single"}, ON_THE_RAY, DOUBLE, (UNSURE, ON_THE_RAY)),  # all end on the ray from the pivot to q0 + h v
    # with q1 = q0 + h v - c (q0 + q1), (1 + c) (q0 + q1) = 2 (q0 + h/2 v)
    (
        {"single"},
        {"reference_gradient_at_midpoint"},
        DOUBLE,
        (UNSURE, ("reference_gradient_after_drift", "reference_gradient_at_midpoint")),
    ),
    ({"three"}, {"reference_gradient_at_q1"}, DOUBLE, (UNSURE, ("reference_gradient_at_q1", "projected_after"))),
    (EVENLY_FORCED, {"position_without_force"}, DOUBLE, (UNSURE, ("kick_missing", "position_without_force"))),
    # steps of a scheme of daebench, which may be meant
    (ENGINE_ON, {"index_reduced"}, DOUBLE, (UNSURE, ("index_reduced",))),  # rk4
    (ENGINE_ON, {"index_reduced", "baumgarte"}, SINGLE, (UNSURE, ())),  # rk4: the feedback is below what is rounded
    (EVENLY_FORCED, {"position_without_force"}, SINGLE, (UNSURE, ())),  # symplectic_euler_adjoint
)
"""Models, habits and precisions in which a habit cannot be told from another, or from none, and the verdict that is right."""


def engine(name, habit, real, **attributes):
    problem, case, parameters = ENGINE_ON[name]
    world = engine_codes.World(name, habit, real)
    vars(world).update(attributes)
    return diagnose(world.step, problem, case=case, parameters=parameters, measure=False)


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
    """Return the verdict that is right, of a habit on a model."""
    told = FAULT, (engine_codes.EXPECTED.get(habit, habit),)
    return next((right for models, habits, reals, right in NOT_TOLD if name in models and habit in habits and real in reals), told)


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
    shown = engine(name, habit, real)
    assert (shown.verdict, shown.faults) == right(name, habit, real), shown.evidence


@pytest.mark.slow
@pytest.mark.sampled(by=lambda case: case == "single-float64")
@pytest.mark.parametrize("real", [np.float64, np.float32], ids=lambda real: real.__name__)
@pytest.mark.parametrize("name", ENGINE_ON)
def test_feedback_of_any_strength_is_taken_for_nothing_else(name, real):
    """The strongest makes runs explode, from which no step may be judged; in float32 a weak one is below what it rounds."""
    for strength in ((1.0, 1.0), (3.0, 10.0), (10.0, 25.0), (14.0, 60.0), (40.0, 400.0), (100.0, 2500.0)):
        shown = engine(name, "baumgarte", real, feedback=strength)
        assert (shown.verdict, shown.faults) == ((UNSURE, ()) if real is np.float32 else (FAULT, ("baumgarte",))), shown.evidence


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
