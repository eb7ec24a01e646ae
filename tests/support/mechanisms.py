"""Mechanisms for the tests of ``daebench.joints``, states of them, and the accelerations that a definition says they have there."""

from functools import cache
from itertools import pairwise

import numpy as np
import sympy as sp

from daebench.joints import Body, Distance, Guided, Mechanism, PointMass, Rod

GRAVITY = "9.81"


def double_rod():
    """Two uniform rods, one hung from the other."""
    return Mechanism(
        ground={"O": (0, 0)},
        points={"A": (1, 0), "B": (1, "-0.7")},
        bodies={"upper": Rod("O", "A", mass=2), "lower": Rod("A", "B", mass="0.5")},
        gravity=(0, "-" + GRAVITY),
    )


def slider_crank():
    """A crank, a rod and a slider."""
    return Mechanism(
        ground={"O": (0, 0)},
        points={"A": (1, 0), "B": Guided((3, 0), (1, 0))},
        bodies={"crank": Rod("O", "A", mass=1), "rod": Rod("A", "B", mass=1), "slider": PointMass("B", 1)},
        gravity=(0, "-" + GRAVITY),
    )


def four_bar():
    """Three uprights and two couplers between them."""
    points, ground = {f"B{k}": (k, 1) for k in range(3)}, {f"A{k}": (k, 0) for k in range(3)}
    bodies = {f"upright {k}": Rod(f"A{k}", f"B{k}", mass=1) for k in range(3)}
    bodies |= {f"coupler {k}": Rod(f"B{k - 1}", f"B{k}", mass=1) for k in (1, 2)}
    return Mechanism(ground=ground, points=points, bodies=bodies, gravity=(0, "-" + GRAVITY))


def skew_four_bar():
    """A four-bar linkage whose coupler carries a heavy corner off its line."""
    return Mechanism(
        ground={"O": (0, 0), "Q": (3, "0.5")},
        points={"A": ("0.6", "0.8"), "B": ("2.5", "2.2"), "C": ("1.4", "2.6")},
        bodies={
            "crank": Rod("O", "A", mass=1),
            "coupler": Body("A", "B", "C", mass=3, centre=("1.5", "1.9"), inertia="0.8"),
            "rocker": Rod("Q", "B", mass=2),
        },
        gravity=(0, "-" + GRAVITY),
    )


def heavy_top():
    """The heavy top of ``rigid_body_rotation``."""
    return Mechanism(
        ground={"O": (0, 0, 0)},
        points={},
        bodies={"top": Body("O", mass=15, centre=(0, 1, 0), inertia=("0.234375", "0.46875", "0.234375"))},
        gravity=(0, 0, "-" + GRAVITY),
    )


def top_of_points():
    """A body about a fixed point, by three other points of it."""
    return Mechanism(
        ground={"O": (0, 0, 0)},
        points={"C": (0, 1, "0.5"), "P": ("0.3", "0.9", 0), "R": ("-0.2", "0.1", "0.7")},
        bodies={"top": Body("O", "C", "P", "R", mass=15, centre=("0.1", 1, "0.2"), inertia=("0.8", "0.5", "0.6"))},
        gravity=(0, 0, "-" + GRAVITY),
    )


def wishbones():
    """Two pairs of rods, a tie rod, and an upright body between them."""
    ground = {"A": ("0.3", "0.4", "0.2"), "B": ("-0.3", "0.42", "0.2"), "C": ("0.25", "0.45", "0.55"), "D": ("-0.25", "0.45", "0.53")}
    arms = {"A": "E", "B": "E", "C": "F", "D": "F", "S": "T"}
    return Mechanism(
        ground={**ground, "S": ("-0.15", "0.4", "0.3")},
        points={"E": (0, "0.75", "0.18"), "F": ("-0.02", "0.72", "0.58"), "T": ("-0.15", "0.74", "0.28"), "W": (0, "0.8", "0.35")},
        bodies={f"{a}{b}": Rod(a, b, mass=1 + k) for k, (a, b) in enumerate(arms.items())}
        | {"upright": Body("E", "F", "T", "W", mass=25, centre=("0.01", "0.79", "0.36"), inertia=("0.6", 1, "0.7"))},
        gravity=(0, 0, "-" + GRAVITY),
    )


def masses_on_strings(*places, **more):
    """Return point masses on massless rods, one hung from the other."""
    names = [f"P{k}" for k in range(1, len(places) + 1)]
    return Mechanism(
        ground={"O": [0] * len(places[0])},
        points=dict(zip(names, places, strict=True)),
        bodies={f"mass {name}": PointMass(name, 1) for name in names},
        joints=[Distance(a, b) for a, b in pairwise(["O", *names])],
        gravity=[*[0] * (len(places[0]) - 1), "-" + GRAVITY],
        **more,
    )


MECHANISMS = {f.__name__: f for f in (double_rod, slider_crank, four_bar, skew_four_bar, top_of_points, wishbones)}


@cache
def problem_of(name):
    """Return the problem of one of the mechanisms, made once."""
    return MECHANISMS[name]().problem()


def called(problem, *expressions):
    """Return a function of q and v for matrices of expressions in q and ``rates(problem)``, at the parameters' defaults."""
    plain = [sp.Matrix(expression).subs(dict(problem.parameters)) for expression in expressions]
    return sp.lambdify([list(problem.q), list(rates(problem))], plain, "numpy", cse=True)


def rates(problem):
    """Return symbols of velocities."""
    return sp.symbols(f"v1:{problem.d + 1}", real=True)


_made = {}


def once(make):
    """Have a function of a problem called once for each; the problem is kept, so that no other has its id."""

    def kept(problem):
        key = make, id(problem)
        if key not in _made:
            _made[key] = problem, make(problem)
        return _made[key][1]

    return kept


@once
def constraints(problem):
    """Return a function of q and v for g and G."""
    g = sp.Matrix(list(problem.g))
    return called(problem, g, g.jacobian(problem.q))


@once
def equations(problem):
    """Return a function of q and v for M, U_q less the forces, G and (G v)_q v."""
    g, w = sp.Matrix(list(problem.g)), sp.Matrix(rates(problem))
    G = g.jacobian(problem.q) if len(g) else sp.zeros(0, problem.d)
    forces = sp.Matrix(problem.force).subs(dict(zip(problem.v, w, strict=True))) if problem.force else sp.zeros(problem.d, 1)
    drift = (G * w).jacobian(problem.q) * w if len(g) else sp.zeros(0, 1)
    return called(problem, problem.M, sp.Matrix([problem.U]).jacobian(problem.q).T - forces, G, drift)


def moving(problem, random):
    """Return q and v of a state near the first case, on the constraints."""
    call = constraints(problem)
    case = next(iter(problem.cases.values()))
    q = np.array([float(sp.sympify(x).subs(problem.parameters)) for x in case.q])
    q += 0.05 * np.abs(q).max() * random.uniform(-1, 1, problem.d)
    for _ in range(20):
        off, G = (np.array(x, dtype=float) for x in call(q, 0 * q))
        q -= np.linalg.lstsq(G, off.ravel(), rcond=None)[0]
    v = random.uniform(-2, 2, problem.d)
    G = np.array(call(q, v)[1], dtype=float)
    v -= np.linalg.lstsq(G, G @ v, rcond=None)[0]
    assert np.abs(call(q, v)[0]).max() < 1e-13
    return q, v


def accelerations(problem, q, v):
    """Return q'' of a definition with M, U and forces at a state, by the KKT system of G q'' = -(G v)_q v."""
    M, push, G, drift = (np.array(x, dtype=float) for x in equations(problem)(q, v))
    m = len(G)
    whole = np.linalg.solve(np.block([[M, G.T], [G, np.zeros((m, m))]]), -np.concatenate([push.ravel(), drift.ravel()]))
    return whole[: problem.d]


def named(problem, x, *, speeds=False):
    """Return the places of the named points of a state, or, of velocities or accelerations, how they move, by name."""
    points = {name: sp.Matrix(place).subs(dict(problem.parameters)) for name, place in problem.picture.points.items()}
    found = {}
    for name, place in points.items():
        form = place.jacobian(problem.q) * sp.Matrix(problem.q) if speeds else place
        found[name] = np.array(sp.lambdify([list(problem.q)], form, "numpy")(x), dtype=float).ravel()
    return found


def lagrange(xi, place, kinetic, potential):
    """Return a function of angles and rates for the accelerations of points: Lagrange's equations, by SymPy."""
    rate = sp.Matrix(sp.symbols(f"rate1:{len(xi) + 1}"))
    T, U = sp.Matrix([kinetic(rate)]), sp.Matrix([potential])
    by_rate = T.jacobian(rate)
    mass = by_rate.jacobian(rate)
    right = (T.jacobian(xi) - U.jacobian(xi)).T - by_rate.jacobian(xi) * rate
    curved = sp.Matrix([(sp.Matrix([x]).jacobian(xi) * rate).jacobian(xi) * rate for x in place])
    slope = place.jacobian(xi)
    call = sp.lambdify([list(xi), list(rate)], [mass, right, slope, curved, place, slope * rate], "numpy")

    def found(angles, rates):
        mass, right, slope, curved, at, velocity = (np.array(x, dtype=float) for x in call(angles, rates))
        return at.ravel(), velocity.ravel(), (slope @ np.linalg.solve(mass, right) + curved).ravel()

    return found
