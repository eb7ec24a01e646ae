"""The parts of a mechanism in words: what each constraint keeps, joints that add nothing, forces, and numbers with a slip of a unit."""

from dataclasses import replace

import pytest
import sympy as sp
from mechanisms import MECHANISMS, double_rod, heavy_top, problem_of
from refusals import refused

from daebench import Case, ConstrainedHamiltonian
from daebench.diagnostics.freedom import dependence
from daebench.diagnostics.problem.check import held
from daebench.errors import InvalidProblem
from daebench.joints import (
    Angle,
    Body,
    Damper,
    Distance,
    DrivenAngle,
    DrivenCoordinate,
    DrivenDistance,
    Guided,
    Mechanism,
    PDMotor,
    Revolute,
    Rod,
    Spring,
    t,
)
from daebench.joints.exact import exact
from daebench.joints.parts import forces_of, rows_of
from daebench.joints.placing import places_of
from daebench.joints.unit_slips import doubts_of
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.problems import rssr_four_bar
from daebench.runs.mechanism import parts_printed

PARALLEL = {
    "ground": {"O": (0, 0), "Q": (2, 0), "S": (1, 0)},
    "points": {"A": (0, 1), "B": (2, 1), "C": (1, 1)},
    "bodies": {
        "left": Rod("O", "A", mass=1),
        "right": Rod("Q", "B", mass=1),
        "middle": Rod("S", "C", mass=1),
        "bar": Rod("A", "B", "C", mass=1),
    },
}


def test_a_redundant_constraint_is_named_by_its_body():
    ivp = initial_value_problem(Mechanism(**PARALLEL).problem(), consistent=False)
    why = dependence(ivp)
    names = ("the place of C in bar", "the distance of O and A in left", "the distance of Q and B in right")
    assert all(name in why for name in names)
    (note,) = [finding.note for finding in held(ivp) if finding.note]
    assert names[0] in note
    assert not any(f"g{k}" in note + why for k in range(1, 9))


def test_a_constraint_that_a_start_breaks_is_named():
    with refused("off-the-manifold", says=["the distance of A and B in lower"]):
        initial_value_problem(double_rod().problem(), q0=[1, 0, 3, 3])


def test_a_driver_that_is_not_smooth_is_named_by_its_body():
    with refused("function-not-differentiable", InvalidProblem, ["g[2] (the DrivenAngle of upper and ground)"]):
        replace(double_rod(), joints=[DrivenAngle("upper", "ground", sp.Abs(t - 1) - 1)]).problem()


def test_a_problem_with_other_constraints_has_no_names_of_those_of_the_mechanism():
    problem = double_rod().problem()
    assert replace(problem, g=problem.g[:1]).parts is None


DROPPED = {
    "a distance within a rod": ([Distance("A", "O")], ["the Distance of A and O", "the distance of O and A in upper"]),
    "a hinge at a shared point": ([Revolute("upper", "lower", "A")], ["the Revolute of upper and lower"]),
    "the same twice": ([Distance("B", "O")] * 2, ["the Distance of B and O"]),
    "two of the ground": ([Distance("O", "P")], ["the Distance of O and P"]),
}


@pytest.mark.parametrize(("joints", "names"), DROPPED.values(), ids=DROPPED)
def test_a_joint_that_adds_no_equation_is_named(joints, names):
    mechanism = replace(double_rod(), ground={"O": (0, 0), "P": (5, 0)}, joints=joints)
    (found,) = mechanism.problem().parts.dropped
    assert all(name in found for name in names)
    assert f"{found}." in parts_printed(mechanism.problem().parts)
    assert [problem_of(name).parts.dropped for name in MECHANISMS] == [()] * len(MECHANISMS)
    assert replace(double_rod(), joints=[Distance("B", "O")]).problem().parts.dropped == ()


def test_forces_and_drivers_are_listed():
    mechanism = replace(
        double_rod(),
        ground={"O": (0, 0), "P": (5, 0)},
        angles={"turn": Angle("upper", armature=2)},
        joints=[DrivenAngle("upper", "ground", 3 * t), DrivenCoordinate("B", 1, t), DrivenDistance("B", "P", 4 + t)],
        forces=[Spring("P", "B", stiffness=7, length=2, damping="0.5"), Damper("P", "A", "0.3"), PDMotor("turn", 8, 3, t, 0)],
    )
    listed = forces_of(mechanism.forces, mechanism.joints, mechanism.angles)
    assert [line.split(" ")[0].strip(":") for line in listed] == [
        *("Spring", "Damper", "PDMotor"),
        *("DrivenAngle", "DrivenCoordinate", "DrivenDistance"),
        "Armature",
    ]
    assert all(number in line for line, number in zip(listed, ("0.5", "0.3", "kp 8", "3*t", "t m", "t + 4", "2 kg"), strict=True))


def test_the_table_of_bodies_has_their_numbers():
    (row,) = heavy_top().problem().parts.bodies
    assert row == ("top", "Body", "15", "0.2344, 0.2344, 0.4688", "0, 1, 0", "1")
    assert double_rod().problem().parts.bodies[1] == ("lower", "Rod", "0.5", "0.02042", "1, -0.35", "0.7")


def doubts(mechanism):
    values = dict(mechanism.parameters)
    places = places_of(mechanism.ground, mechanism.points, mechanism.directions, mechanism.fixed_directions, values)
    for name, body in mechanism.bodies.items():
        places.body(name, body)
    return doubts_of(rows_of(mechanism.bodies, places.columns, values), places.columns, values)


def slipped(mechanism, name, what, factor):
    """Return a mechanism with one number of a body times a factor."""
    body = mechanism.bodies[name]
    fields = {field: getattr(body, field) for field in body.__dataclass_fields__}
    number = fields[what]
    fields[what] = [exact(x) * factor for x in number] if isinstance(number, tuple) else exact(number) * factor
    changed = object.__new__(type(body))
    for field, value in fields.items():
        object.__setattr__(changed, field, value)
    return replace(mechanism, bodies={**mechanism.bodies, name: changed})


def test_no_number_of_a_sound_mechanism_is_doubted():
    assert [doubts(f()) for f in (*MECHANISMS.values(), heavy_top)] == [[]] * (len(MECHANISMS) + 1)
    assert rssr_four_bar.problem().parts.doubts == ()


SLIPS = [(name, body, what, factor)
    for name, f in MECHANISMS.items()
    for body, declared in f().bodies.items()
    for what in ("mass", "inertia") if hasattr(declared, what)
    for factor in (1000, sp.Rational(1, 1000))
]  # fmt: skip


@pytest.mark.parametrize(("name", "body", "what", "factor"), SLIPS, ids=[f"{name}-{body}-{what}-{x}" for name, body, what, x in SLIPS])
def test_a_slip_of_a_unit_in_a_mass_or_an_inertia_is_doubted(name, body, what, factor):
    found = doubts(slipped(MECHANISMS[name](), body, what, factor))
    assert any(f" of {body}, " in sentence for sentence in found)


PLACES = [(name, point) for name, f in MECHANISMS.items() for point, place in f().points.items() if not isinstance(place, Guided)]


@pytest.mark.parametrize(("name", "point"), PLACES, ids=[f"{name}-{point}" for name, point in PLACES])
def test_a_point_that_is_a_thousand_times_too_far_is_doubted(name, point):
    mechanism = MECHANISMS[name]()
    far = tuple(1000 * exact(x) for x in mechanism.points[point])
    assert any(f"the point {point} is " in sentence for sentence in doubts(replace(mechanism, points={**mechanism.points, point: far})))


def test_numbers_that_are_less_than_the_factor_apart_are_not_doubted():
    heavy = replace(double_rod(), bodies={"upper": Rod("O", "A", mass=1), "lower": Rod("A", "B", mass=60)})
    assert doubts(heavy) == []
    wide = Mechanism(
        ground={"O": (0, 0)},
        points={"A": (1, 0)},
        bodies={"body": Body("O", "A", mass=1, centre="A", inertia=8)},
    )
    assert doubts(wide) == []


Q, P, V = (sp.symbols(f"{name}1:3", real=True) for name in "qpv")
REASONS = {
    "masses in time": ({"M": (2 + sp.sin(t)) * sp.eye(2)}, "depends on time, its masses too"),
    "H in time": ({"M": None, "U": None, "H": (1 + t**2) * sum(x**2 for x in P) / 2}, "depends on time, its masses too"),
    "a damper": ({"force": [-V[0] * Q[1] ** 2, 0], "v": V}, "has forces that depend on the velocity"),
    "masses along the path": ({"M": (2 + Q[0] ** 2) * sp.eye(2), "U": Q[1] * sp.cos(t)}, "which problem does not have"),
}


@pytest.mark.parametrize(("more", "reason"), REASONS.values(), ids=REASONS)
def test_what_a_system_in_time_lacks_is_told_with_its_reason(more, reason):
    given = {"M": sp.eye(2), "U": Q[1]} | more
    pendulum = ConstrainedHamiltonian(q=Q, p=P, t=t, g=[Q[0] ** 2 + Q[1] ** 2 - 1], cases={"still": Case(q=(0, -1), p=(0, 0))}, **given)
    assert reason in parse("rattle_gauss_seidel").refusal(initial_value_problem(pendulum))
