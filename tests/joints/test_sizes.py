"""A mechanism is understood alike in any unit of length and at any place: unknowns, constraints and what is refused."""

from functools import cache

import numpy as np
import pytest
import sympy as sp
from refusals import refused

from daebench.errors import InvalidProblem
from daebench.joints import Body, Distance, DrivenAngle, Guided, Mechanism, Plate, PointMass, Revolute, Rod, Spherical, Start, t

SIZES = [sp.Rational(1, 10**9), sp.Rational(1, 10**6), sp.Integer(10) ** 7]


def four_bar(s, off=0):
    at = {"A": (off, s), "B": (off + 2 * s, s * sp.Rational(3, 2))}
    bodies = {"crank": Rod("O", "A", mass=1), "coupler": Rod("A", "B", mass=2), "rocker": Rod("B", "P", mass=1)}
    return {"ground": {"O": (off, 0), "P": (off + 2 * s, 0)}, "points": at, "bodies": bodies}


def slider(s, off=0):
    at = {"A": (off, s), "B": Guided((off + 2 * s, 0), (1, 0))}
    return {"ground": {"O": (off, 0)}, "points": at, "bodies": {"crank": Rod("O", "A", mass=1), "rod": Rod("A", "B", mass=1)}}


def plates(s, off=0):
    at = {"A": (off + s, 0), "B": (off + s, s), "C": (off + 3 * s, s)}
    bodies = {"plate": Plate("O", "A", "B", mass=3), "tip": PointMass("C", 1)}
    return {"ground": {"O": (off, 0)}, "points": at, "bodies": bodies, "joints": [Distance("B", "C")]}


def arm(s, off=0):
    inertia = (s**2 * sp.Rational(3, 10), s**2 * sp.Rational(4, 10), s**2 / 2)
    first = Body("O", "A", mass=1, centre=(off + s / 2, 0, 0), inertia=inertia)
    second = Body("A", mass=2, centre=(off + 2 * s, 0, s / 3), inertia=inertia)
    joints = [Spherical("arm", "ground", "O"), Revolute("hand", "arm", "A", axis=(0, 0, 1))]
    return {"ground": {"O": (off, 0, 0)}, "points": {"A": (off + s, 0, 0)}, "bodies": {"arm": first, "hand": second}, "joints": joints}


MECHANISMS = {"four bar": four_bar, "slider": slider, "plates": plates, "arm": arm}


@cache
def usual_of(name):
    """Return a mechanism in metres, at its usual place."""
    return problem(MECHANISMS[name](sp.Integer(1)))


def problem(parts, **starts):
    return Mechanism(**parts, cases={name: Start(**start) for name, start in (starts or {"rest": {}}).items()}).problem()


PLACES = {"1e-9 m": (SIZES[0], 0), "1e-6 m": (SIZES[1], 0), "1e7 m": (SIZES[2], 0)}
PLACES |= {"10 km off": (sp.Integer(1), sp.Integer(10) ** 4), "1000 km off": (sp.Integer(1), -(sp.Integer(10) ** 6))}


@pytest.mark.sampled(by=lambda case: not case.endswith("1e-6 m"))
@pytest.mark.parametrize(("size", "off"), PLACES.values(), ids=PLACES)
@pytest.mark.parametrize("name", MECHANISMS)
def test_neither_lengths_nor_the_origin_change_what_a_mechanism_is(name, size, off):
    usual, other = usual_of(name), problem(MECHANISMS[name](size, off))
    assert (other.d, other.m) == (usual.d, usual.m)
    if off:
        return
    starts = [np.array(definition.cases["rest"].q, dtype=float) for definition in (usual, other)]
    scales = np.where(starts[1] == starts[0], 1.0, float(size))  # a direction has no unit
    G = [
        np.array(sp.Matrix(definition.g).jacobian(definition.q).subs(dict(zip(definition.q, q, strict=True))), dtype=float) * column
        for definition, q, column in zip((usual, other), starts, (1.0, scales), strict=True)
    ]
    rows = [row / np.linalg.norm(row, axis=1)[:, None] for row in G]
    assert np.linalg.matrix_rank(rows[0]) == np.linalg.matrix_rank(rows[1])


@pytest.mark.parametrize("size", [*SIZES, sp.Integer(1)], ids=["1e-9 m", "1e-6 m", "1e7 m", "1 m"])
def test_in_any_unit_a_crank_turns_as_fast_and_contradictions_of_a_start_are_refused(size):
    momenta = [problem(four_bar(unit), turning={"spin": {"crank": 3}}).cases["turning"].p for unit in (size, sp.Integer(1))]
    assert [sp.nsimplify(x / size) for x in momenta[0]] == list(momenta[1])
    with refused("velocities-against-joints", InvalidProblem, ["'two'"]):
        problem(four_bar(size), two={"spin": {"crank": 1, "rocker": -5}})
    with refused("case-residual", InvalidProblem, ["'off'", "the distance of O and A"]):
        problem(four_bar(size), off={"at": {"A": (size * sp.Rational(1001, 1000), 0)}})


SMOOTH = {
    "steps": sum(1 / (1 + sp.exp(-40 * t + sp.Rational(a))) for a in ("9.4", "31.2")),
    "gauss": sp.exp(-((t - sp.Rational("1.7")) ** 2) * 7),
    "tanh": sp.tanh(5 * t - sp.Rational("2.3")) + sp.log(1 + sp.exp(t - 3)),
    "sines": sp.sin(t + sp.Rational("0.3")) + sp.cos(3 * t + sp.Rational("1.1")),
}


@pytest.mark.parametrize("driver", SMOOTH.values(), ids=list(SMOOTH))
def test_a_smooth_driver_starts_with_its_velocity(driver):
    """The number of operations does not grow with the digits of exp(9.4): this took no end by exact elimination."""
    L, w, m = sp.symbols("L w m", positive=True)
    parts = {"ground": {"O": (0, 0)}, "points": {"A": (L, 0), "W": (w, 0)}, "parameters": {L: 2.0, w: 0.7, m: 1.5}}
    parts |= {"bodies": {"rod": Rod("O", "A", "W", mass=m), "weight": PointMass("W", m)}}
    found = Mechanism(**parts, joints=[DrivenAngle("rod", "ground", driver - driver.subs(t, 0))], cases={"rest": Start()}).problem()
    rate = float(driver.diff(t).subs(t, 0))
    expected = float((m * L / 3 + m * w**2 / L).subs(parts["parameters"])) * rate  # the moment about O is 1/3 m L^2 + m w^2
    assert np.array([x.subs(parts["parameters"]) for x in found.cases["rest"].p], dtype=float) == pytest.approx([0.0, expected], abs=1e-14)
