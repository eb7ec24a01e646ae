"""Mistakes in a mechanism: each gets one sentence that names the part and says what to do."""

import pytest
import sympy as sp
from refusals import refused

from daebench.errors import InvalidProblem
from daebench.joints import (
    Body,
    Damper,
    DrivenAngle,
    DrivenDistance,
    Guided,
    Mechanism,
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
    "line": (lambda: disk(0, 1, 1), "body-without-width", ["disk", "(0, 1, 0)"]),
    "disk": (lambda: disk(1, 1, 2), "body-without-width", ["disk", "(0, 0, 1)", "I2 + I3 - I1"]),
    "no body": (lambda: disk(1, 1, 3), "inertia-impossible", ["disk", "(0, 0, 1)"]),
    "tensor": (lambda: disk(1, 1), "inertia-malformed-in-space", ["disk", "(1, 1)"]),
    "flat": (
        lambda: Mechanism(points={"A": (1, 0)}, bodies={"plate": Body("A", mass=1, centre="A", inertia=0)}),
        "body-without-inertia",
        ["plate"],
    ),
    "massless": ({"bodies": {"rod": Rod("O", "A", mass=0)}}, "mass-not-positive", ["rod", "0"]),
    "no body at": ({"points": {"A": (1, 0), "B": (2, 0)}}, "point-of-no-body", ["B"]),
    "itself": (
        {"joints": [Revolute("rod", "rod", "A")]},
        "joint-ties-to-itself",
        ["the Revolute of rod and rod"],
    ),
    "itself by a damper": ({"forces": [Damper("A", "A", 1)]}, "force-ties-to-itself", ["the Damper of A and A"]),
    "another time": (
        {"joints": [DrivenAngle("rod", "ground", sp.Symbol("t"))]},
        "mechanism-symbol-undeclared",
        ["t"],
    ),
    "contradicting drivers": (
        {"joints": [DrivenAngle("rod", "ground", t), DrivenAngle("rod", "ground", 2 * t)]},
        "driver-contradicts-others",
        ["the DrivenAngle of rod and ground", "'rest'"],
    ),
    "driver of a rod": (
        {"joints": [DrivenAngle("rod", "ground", 0), DrivenDistance("O", "A", 1 + t)]},
        "driver-contradicts-others",
        ["the DrivenDistance of O and A"],
    ),
    "driven from elsewhere": (
        {"joints": [DrivenDistance("O", "A", 2 + t)]},
        "case-residual",
        ["'rest'", "the DrivenDistance of O and A", "-3"],
    ),
    "no comma": (lambda: points("A 1 0 B 2 0"), "written-point-malformed", ["5", "'A 1 0 B 2 0'"]),
    "two points": (lambda: points("A 1 0, A 2 0"), "written-point-twice", ["'A 1 0, A 2 0'"]),
    "a comma more": (lambda: rods("O A,", mass=1), "written-comma-alone", ["'O A,'"]),
    "two rods": (lambda: rods("O A, O A", mass=1), "written-rod-twice", ["'O A, O A'", "O-A"]),
    "one end": (lambda: rods("O", mass=1), "element-without-points", ["Rod", "'O'", "2"]),
    "no such body": ({"joints": [Revolute("rod", "rud", "A")]}, "unknown-name", ["'rud'"]),
    "no such point": ({"forces": [Spring("O", "a", stiffness=1)]}, "unknown-name", ["'a'"]),
    "two names": (
        {"ground": {"A": (0, 0), "O": (0, 1)}},
        "mechanism-name-twice",
        [],
    ),
    "both": ({"ground": {"O": (0, 0, 0)}}, "points-of-mixed-dimension", []),
    "gravity": ({"gravity": (0, 0, -9)}, "gravity-dimension", ["3", "2"]),
    "axis": (lambda: Mechanism(**SPACE, joints=[Revolute("rod", "ground", "O")]), "joint-without-axis", ["Revolute"]),
    "right angle": (
        lambda: disk(1, 1, 1, joints=[Universal("disk", "ground", "A", (1, 0, 0), (1, 1, 0))]),
        "joint-axes-not-perpendicular",
        ["Universal"],
    ),
    "plane": (
        {"joints": [Universal("rod", "ground", "O", (1, 0), (0, 1))]},
        "joint-for-space-in-plane",
        ["Universal"],
    ),
    "beside": (
        {"points": {"A": (1, 0, 0), "B": (1, 1, 0)}, "ground": {"O": (0, 0, 0)}, "bodies": {"r": Rod("O", "A", "B", mass=1)}},
        "frame-underdetermined",
        ["point", "'r'", "O, A"],
    ),
    "one point": ({"points": {"A": (0, 0)}}, "body-points-coincide", ["rod", "Rod", "2"]),
    "no name": (lambda: Body(mass=1, centre=(0, 0), inertia=1), "body-without-point", []),
    "no way": (lambda: Guided((0, 0)), "guided-without-direction", []),
    "open": (
        {"cases": {"far": Start(at={"A": (2, 0)})}},
        "case-residual",
        ["'far'", "the distance of O and A in rod", "3"],
    ),
    "follows": (
        {"points": {"A": (1, 0), "B": ("0.5", 0)}, "bodies": {"r": Rod("O", "A", "B", mass=1)}, "cases": {"c": Start(at={"B": (0, 1)})}},
        "case-places-dependent",
        ["'c'", "B", "A"],
    ),
    "torn": ({"cases": {"c": Start(velocity={"A": (1, 0)})}}, "velocities-against-joints", ["'c'"]),
    "long velocity": (
        {"cases": {"c": Start(velocity={"A": (0, 1, 0)})}},
        "start-vector-dimension",
        ["velocity of A in case 'c'", "3", "2"],
    ),
    "spin of nobody": (
        {"cases": {"c": Start(spin={"bod": 1})}},
        "unknown-name",
        ["'bod'"],
    ),
    "spin of a point": (
        {"bodies": ROD | {"bob": PointMass("A", 1)}, "cases": {"c": Start(spin={"bob": 5})}},
        "spin-without-direction",
        ["'c'", "bob"],
    ),
    "mass without a value": (
        {"bodies": {"rod": Rod("O", "A", mass=sp.Symbol("m"))}},
        "mechanism-symbol-undeclared",
        ["m"],
    ),
    "number": ({"points": {"A": (1, "x")}}, "not-a-mechanism-number", ["'x'"]),
    "coordinates": (
        {"points": {"A": (1,)}},
        "vector-of-wrong-size",
        ["point A", "(1,)"],
    ),
    "ground": ({"bodies": {"ground": PointMass("A", 1)}}, "body-called-ground", ["'ground'"]),
}


@pytest.mark.parametrize(("mistake", "code", "names"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_gets_a_sentence_that_names_it(mistake, code, names):
    """It is a call, or parts in place of those of a rod in the plane."""
    with refused(code, says=names):
        (mistake() if callable(mistake) else Mechanism(**PLANE | mistake)).problem()


def test_a_flat_disk_away_from_its_fixed_point_has_all_moments_that_it_needs():
    top = Mechanism(ground={"O": (0, 0, 0)}, points={}, bodies={"top": Body("O", mass=2, centre=(0, 0, 1), inertia=(1, 1, 2))})
    assert [top.problem().M[k, k] for k in (0, 3, 6)] == [1, 1, 2]
    with refused("body-without-width", InvalidProblem, ["top"]):
        Mechanism(points={"O": (0, 0, 0)}, bodies={"top": Body("O", mass=2, centre=(0, 0, 1), inertia=(1, 1, 2))}).problem()
