"""Mistakes in a mechanism: each gets one sentence that names the part and says what to do."""

import pytest
import sympy as sp

from daebench.errors import BadInput, InvalidProblem
from daebench.joints import (
    Body,
    Damper,
    Distance,
    DrivenAngle,
    DrivenDistance,
    Guided,
    Mechanism,
    Plate,
    PointMass,
    Revolute,
    Rod,
    Spring,
    Start,
    Universal,
    points,
    rods,
    t,
)

ROD = {"rod": Rod("O", "A", mass=1)}
PLANE = {"ground": {"O": (0, 0)}, "points": {"A": (1, 0)}, "bodies": ROD}
SPACE = {"ground": {"O": (0, 0, 0)}, "points": {"A": (1, 0, 0)}, "bodies": ROD}


def disk(*inertia, names=("A",), **more):
    return Mechanism(points={"A": (1, 0, 0)}, bodies={"disk": Body(*names, mass=1, centre="A", inertia=inertia)}, **more)


MISTAKES = {
    "line": (lambda: disk(0, 1, 1), "the Euler tensor of disk is singular: the moment of its mass along (0, 1, 0)"),
    "disk": (lambda: disk(1, 1, 2), "the moment of its mass along (0, 0, 1), half of I2 + I3 - I1, is 0; give it some width there"),
    "no body": (lambda: disk(1, 1, 3), "no body has the inertia of disk: the moment of its mass along (0, 0, 1)"),
    "tensor": (lambda: disk(1, 1), "inertia of disk is (1, 1); give the three moments about the axes"),
    "flat": (
        lambda: Mechanism(points={"A": (1, 0)}, bodies={"plate": Body("A", mass=1, centre="A", inertia=0)}),
        "the moment of inertia of plate is 0; give it a positive one, or make it a PointMass",
    ),
    "massless": (lambda: Mechanism(**PLANE | {"bodies": {"rod": Rod("O", "A", mass=0)}}), "rod has mass 0; give it a positive one"),
    "no body at": (lambda: Mechanism(**PLANE | {"points": {"A": (1, 0), "B": (2, 0)}}), "B belongs to no body, so it has no mass"),
    "itself": (
        lambda: Mechanism(**PLANE, joints=[Revolute("rod", "rod", "A")]),
        "the Revolute of rod and rod ties rod to itself; name two.",
    ),
    "itself by points": (lambda: Mechanism(**PLANE, joints=[Distance("A", "A")]), "the Distance of A and A ties A to itself"),
    "itself by a damper": (lambda: Mechanism(**PLANE, forces=[Damper("A", "A", 1)]), "the Damper of A and A ties A to itself; name two"),
    "itself by a driver": (
        lambda: Mechanism(**PLANE, joints=[DrivenAngle("rod", "rod", t)]),
        "the DrivenAngle of rod and rod ties rod to itself; name two.",
    ),
    "another time": (
        lambda: Mechanism(**PLANE, joints=[DrivenAngle("rod", "ground", sp.Symbol("t"))]),
        "t of the mechanism has no value; declare it in parameters, or use daebench.joints.t for the time",
    ),
    "contradicting drivers": (
        lambda: Mechanism(**PLANE, joints=[DrivenAngle("rod", "ground", t), DrivenAngle("rod", "ground", 2 * t)]),
        "the DrivenAngle of rod and ground contradicts the other joints and drivers: no velocities at the start of case 'rest' satisfy all",
    ),
    "driver of a rod": (
        lambda: Mechanism(**PLANE, joints=[DrivenAngle("rod", "ground", 0), DrivenDistance("O", "A", 1 + t)]),
        "the DrivenDistance of O and A contradicts the other joints and drivers",
    ),
    "driven from elsewhere": (
        lambda: Mechanism(**PLANE, joints=[DrivenDistance("O", "A", 2 + t)]),
        "case 'rest' starts in an inconsistent position: the equation of the DrivenDistance of O and A has a residual of -3",
    ),
    "flat and deep": (lambda: Mechanism(**PLANE | {"points": points("A 1")}), "point A has 1 coordinates in 'A 1'; give two or three"),
    "no comma": (lambda: points("A 1 0 B 2 0"), "point A has 5 coordinates in 'A 1 0 B 2 0'; give two or three, and commas between points"),
    "two points": (lambda: points("A 1 0, A 2 0"), "A is the name of two points in 'A 1 0, A 2 0'; rename one"),
    "a comma more": (lambda: rods("O A,", mass=1), "'O A,' has a comma with nothing before or after it; leave it out"),
    "two rods": (lambda: rods("O A, O A", mass=1), "'O A, O A' has two rods O-A; leave one out"),
    "one end": (lambda: rods("O", mass=1), "a Rod of 'O' needs 2 names of points first"),
    "no such body": (lambda: Mechanism(**PLANE, joints=[Revolute("rod", "rud", "A")]), "unknown body in the Revolute of rod and rud 'rud'"),
    "no such point": (lambda: Mechanism(**PLANE, forces=[Spring("O", "a", stiffness=1)]), "unknown point or direction"),
    "no such damped point": (lambda: Mechanism(**PLANE, forces=[Damper("X", "A", 1)]), "unknown point or direction"),
    "two names": (
        lambda: Mechanism(**PLANE | {"ground": {"A": (0, 0), "O": (0, 1)}}),
        "uses one name for two points or directions; rename one",
    ),
    "both": (lambda: Mechanism(**PLANE | {"ground": {"O": (0, 0, 0)}}), "all in the plane or all in space"),
    "gravity": (lambda: Mechanism(**PLANE, gravity=(0, 0, -9)), "gravity has 3 components, but the mechanism has 2 dimensions"),
    "axis": (lambda: Mechanism(**SPACE, joints=[Revolute("rod", "ground", "O")]), "has no axis; give axis=(x, y, z), or use Spherical"),
    "right angle": (
        lambda: disk(1, 1, 1, joints=[Universal("disk", "ground", "A", (1, 0, 0), (1, 1, 0))]),
        "are not at a right angle at the reference position",
    ),
    "plane": (lambda: Mechanism(**PLANE, joints=[Universal("rod", "ground", "O", (1, 0), (0, 1))]), "is for space"),
    "beside": (
        lambda: Mechanism(
            **PLANE | {"points": {"A": (1, 0, 0), "B": (1, 1, 0)}, "ground": {"O": (0, 0, 0)}, "bodies": {"r": Rod("O", "A", "B", mass=1)}}
        ),
        "is not fixed in 'r' by only O, A; give the body one more point or direction",
    ),
    "one point": (lambda: Mechanism(**PLANE | {"points": {"A": (0, 0)}}), "rod is a Rod whose first 2 points are not distinct"),
    "few corners": (lambda: Plate("A", "B", mass=1), "a Plate of 'A', 'B' needs 3 names of points first"),
    "no name": (lambda: Body(mass=1, centre=(0, 0), inertia=1), "needs the name of a point that is fixed in it"),
    "no way": (lambda: Guided((0, 0)), "has no direction of motion"),
    "open": (
        lambda: Mechanism(**PLANE, cases={"far": Start(at={"A": (2, 0)})}),
        "case 'far' starts in an inconsistent position: the equation of the distance of O and A in rod has a residual of 3",
    ),
    "follows": (
        lambda: Mechanism(
            **PLANE | {"points": {"A": (1, 0), "B": ("0.5", 0)}, "bodies": {"r": Rod("O", "A", "B", mass=1)}},
            cases={"c": Start(at={"B": (0, 1)})},
        ),
        "case 'c' places B, which depends on others; place some of A",
    ),
    "torn": (lambda: Mechanism(**PLANE, cases={"c": Start(velocity={"A": (1, 0)})}), "the velocities of case 'c' contradict the joints"),
    "long velocity": (
        lambda: Mechanism(**PLANE, cases={"c": Start(velocity={"A": (0, 1, 0)})}),
        "velocity of A in case 'c' has 3 coordinates; the mechanism has 2",
    ),
    "long place": (
        lambda: Mechanism(**PLANE, cases={"c": Start(at={"A": (0, 1, 0)})}),
        "A of case 'c' has 3 coordinates; the mechanism has 2",
    ),
    "spin of nobody": (
        lambda: Mechanism(**PLANE, cases={"c": Start(spin={"bod": 1})}),
        "unknown body in the spins of case 'c' 'bod'; did you mean rod",
    ),
    "spin of a point": (
        lambda: Mechanism(**PLANE | {"bodies": ROD | {"bob": PointMass("A", 1)}}, cases={"c": Start(spin={"bob": 5})}),
        "case 'c' gives the spin of bob, which has no direction that turns; leave it out",
    ),
    "mass without a value": (
        lambda: Mechanism(**PLANE | {"bodies": {"rod": Rod("O", "A", mass=sp.Symbol("m"))}}),
        "m of the mechanism has no value; declare it in parameters",
    ),
    "number": (lambda: Mechanism(**PLANE | {"points": {"A": (1, "x")}}), "'x' is not a number of a mechanism"),
    "coordinates": (
        lambda: Mechanism(**PLANE | {"points": {"A": (1,)}}),
        "point A is (1,); give two coordinates in the plane, three in space",
    ),
    "ground": (lambda: Mechanism(**PLANE | {"bodies": {"ground": PointMass("A", 1)}}), "a body is called 'ground'"),
}


@pytest.mark.parametrize(("mechanism", "sentence"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_gets_a_sentence_that_names_it(mechanism, sentence):
    with pytest.raises(BadInput) as said:
        mechanism().problem()
    assert sentence in str(said.value)


def test_a_flat_disk_away_from_its_fixed_point_has_all_moments_that_it_needs():
    top = Mechanism(ground={"O": (0, 0, 0)}, points={}, bodies={"top": Body("O", mass=2, centre=(0, 0, 1), inertia=(1, 1, 2))})
    assert [top.problem().M[k, k] for k in (0, 3, 6)] == [1, 1, 2]
    with pytest.raises(InvalidProblem, match="singular"):
        Mechanism(points={"O": (0, 0, 0)}, bodies={"top": Body("O", mass=2, centre=(0, 0, 1), inertia=(1, 1, 2))}).problem()
