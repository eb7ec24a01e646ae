"""A scheme is judged where its faults can show: on a problem with curvature in U where the given one has a constant force."""

from dataclasses import replace

import pytest
import sympy as sp
from fault_effects import as_method

from daebench.compiler.definition import source_of
from daebench.errors import CannotShow
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names_tables import CONSTRAINED
from daebench.methods.outside.call import Stated
from daebench.runs.make_ivp import make_ivp
from daebench.studies.claims.bench import FALLS_SHORT, OK
from daebench.studies.claims.second import constant_force, curved, judged, on_second, unseen
from daebench.studies.diagnose.battery import map_of, uncompiled
from daebench.studies.diagnose.faulty_steps import FAULTY_STEPS
from daebench.studies.diagnose.kick_drift_kick import RATTLE, along_first_gradient, tangent
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates
from daebench.testing import assert_reversible, assert_symplectic

pytestmark = [
    pytest.mark.usefixtures("plain_functions"),
    pytest.mark.filterwarnings("ignore::daebench.diagnostics.derivative.DerivativeWarning"),
]


def at_midpoint(mechanics, p, q, h):
    """Return a step of RATTLE with both kicks at the middle of the free drift."""
    kick = -h / 2 * mechanics.slope(p, q + h / 2 * mechanics.velocity(p, q))
    q1, impulse = along_first_gradient(mechanics, p + kick, q, h)
    return tangent(mechanics, p + kick - impulse + kick, q1), q1


SHIFTED = ("old_force", "force_before_correction")
"""Faults in which the force is evaluated in another place, which no step shows under a constant force."""

MISSING = ("kick_missing", "full_kick")
"""Faults that change the force."""

FAULTS = {name: next(iter(FAULTY_STEPS[name].values())) for name in (*SHIFTED, *MISSING)} | {"at_midpoint": at_midpoint}

SCHEMES = [listed.name for listed in CONSTRAINED.listed() if listed.knob == "h"]


def claiming(ivp, variant, name):
    """Return a step as a method that claims what RATTLE claims."""
    return replace(as_method(ivp, variant, name), claims=Stated(order=2, symmetric=True, symplectic=True))


@pytest.mark.sampled(by=lambda case: case in ("old_force", "right"))
@pytest.mark.parametrize("name", [*FAULTS, "right"])
def test_a_fault_of_the_force_shows_on_the_second_problem_and_a_right_step_is_not_accused(name):
    rows = judged(curved(), claiming(curved(), (FAULTS | {"right": RATTLE})[name], name))
    assert {row.property for row in rows} == {f"{what} on two_bodies_on_sphere" for what in ("order", "symmetric", "symplectic")}
    assert (FALLS_SHORT in {row.verdict for row in rows}) == (name in FAULTS), rows


def test_under_a_constant_force_the_place_of_the_force_does_not_show():
    """The reason for a second problem: on the pendulum the same code holds all that it claims."""
    name = SHIFTED[0]
    ivp = initial_value_problem("planar_pendulum")
    assert constant_force(ivp)
    assert {row.verdict for row in judged(ivp, claiming(ivp, FAULTS[name], name))} == {OK}


@pytest.mark.sampled(by=lambda case: case in ("rattle", "se", "lobatto3"), slow=("lobatto3",))
@pytest.mark.parametrize("name", SCHEMES)
def test_no_scheme_of_daebench_falls_short_on_the_second_problem(name):
    rows = on_second(initial_value_problem("planar_pendulum"), FixedStep(name))
    assert FALLS_SHORT not in {row.verdict for row in rows}
    assert rows or FixedStep(name).refusal(curved())


def test_a_claim_too_much_falls_short_there_too(monkeypatch):
    boast = replace(FixedStep("se").claims, symplectic=True, order=2)
    monkeypatch.setattr(FixedStep, "claims", property(lambda _: boast))
    rows = on_second(initial_value_problem("planar_pendulum"), FixedStep("se"))
    assert [row.property.split()[0] for row in rows if row.verdict == FALLS_SHORT] == ["order", "symplectic"]


def test_a_problem_with_curvature_needs_no_second():
    assert on_second(curved(), FixedStep("rattle")) == []
    assert on_second(initial_value_problem("lotka_volterra"), FixedStep("rattle")) == []


def posed(U, g, M):
    """Return a problem in the plane."""
    q, p = coordinates(2)
    problem = ConstrainedHamiltonian(q=q, p=p, M=sp.diag(*M), U=U(*q), g=[g(*q)], cases={"start": Case(q=(0, -1), p=(1, 0))})
    return make_ivp(source_of(problem, "posed"), "start")


CIRCLE, LINE = (lambda x, y: x**2 + y**2 - 1), (lambda x, y: y + 1)


@pytest.mark.parametrize(
    ("U", "g", "M", "words"),
    [
        (lambda x, y: y, CIRCLE, (1, 2), ["its force is constant", "one constraint"]),
        (lambda x, y: y**2 * x, CIRCLE, (1, 2), ["one constraint"]),
        (lambda x, y: sp.Integer(0), CIRCLE, (1, 2), ["because it has none", "one constraint"]),
        (lambda x, y: x**4, LINE, (1, 2), ["one constraint", "gradients of the constraints, because they are constant"]),
        (lambda x, y: x**2, CIRCLE, (3, 3), ["one constraint", "all its masses are equal"]),
    ],
    ids=["gravity", "curved", "free", "linear", "equal masses"],
)
def test_what_a_problem_cannot_show_is_said_and_nothing_else(U, g, M, words):
    sentences = unseen(posed(U, g, M))
    assert len(sentences) == len(words)
    for sentence, word in zip(sentences, words, strict=True):
        assert sentence.startswith("posed cannot show ")
        assert word in sentence


def test_an_assertion_judges_a_scheme_on_both_and_warns_of_a_code_that_it_cannot(monkeypatch):
    assert_symplectic("rattle", "planar_pendulum")
    ivp = initial_value_problem("planar_pendulum")
    step = map_of(uncompiled(FixedStep("rattle")), ivp)
    with pytest.warns(CannotShow, match=r"^symplecticity is asserted, and planar_pendulum cannot show where a scheme evaluates the force"):
        assert_symplectic(lambda p, q, h: step(p, q, h), "planar_pendulum")
    with pytest.warns(CannotShow, match="reversibility is asserted"):
        assert_reversible(lambda p, q, h: step(p, q, h), "planar_pendulum")
    boast = [replace(row, measured=1.0) for row in on_second(ivp, FixedStep("rattle")) if row.property.startswith("symplectic")]
    monkeypatch.setattr("daebench.studies.claims.properties.on_second", lambda *_: boast)
    with pytest.raises(AssertionError, match="symplectic on two_bodies_on_sphere: 1, against"):
        assert_symplectic("rattle", "planar_pendulum")
