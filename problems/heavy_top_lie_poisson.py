"""The heavy top in angular momentum and direction of gravity, both seen from the body: a Lie-Poisson system with two Casimir functions."""

from collections.abc import Sequence
from itertools import permutations

import sympy as sp

from daebench.problems._rotations import hat, turned
from daebench.problems.free_rigid_body import kinetic, on_unit_sphere
from daebench.systems.poisson import Part, PoissonCase, PoissonSystem

State = Sequence[sp.Expr]


def problem(
    *,
    I1: float = 15.234375,
    I2: float = 0.46875,
    I3: float = 15.234375,
    mass: float = 15.0,
    gravity: float = 9.81,
    r1: float = 0.0,
    r2: float = 1.0,
    r3: float = 0.0,
) -> PoissonSystem:
    """Return the heavy top with a fixed point: angular momentum y, and Gamma, the upward vertical, in the axes of the body.

    ::

        y'     = y x I^-1 y + Gamma x (mass gravity r)      H = 1/2 sum y_i^2/I_i + mass gravity r . Gamma
        Gamma' = Gamma x I^-1 y
        B      = [[hat(y), hat(Gamma)], [hat(Gamma), 0]]    C1 = 1/2 |Gamma|^2,  C2 = y . Gamma

    Splittings: ``V123`` and the other five orders of the rotations T_i = y_i^2/(2 I_i), which rotate y and Gamma alike, each after the
    potential V, which changes only y. For particular moments there is a fourth integral - Lagrange's and Kovalevskaya's. It does not hold
    for other moments, so it is not declared.

    Parameters
    ----------
    I1, I2, I3 : float
        Principal moments of inertia about the fixed point, kg m^2, positive.
    mass : float
        Mass of the body, kg.
    gravity : float
        Gravitational acceleration along -Gamma, m/s^2.
    r1, r2, r3 : float
        Centre of mass from the fixed point, in the axes of the body, m.
    """
    y, Gamma = sp.symbols("y1:4", real=True), sp.symbols("Gamma1:4", real=True)
    moments, m = sp.symbols("I1:4", positive=True), sp.Symbol("mass", positive=True)
    g, *r = sp.symbols("gravity r1:4", real=True)
    weight = [m * g * component for component in r]
    V = sp.Add(*(w * component for w, component in zip(weight, Gamma, strict=True)))
    orders = ["".join(order) for order in permutations("123")]
    return PoissonSystem(
        y=(*y, *Gamma),
        B=sp.Matrix(sp.BlockMatrix([[hat(y), hat(Gamma)], [hat(Gamma), sp.zeros(3, 3)]])),
        H=kinetic(y, moments) + V,
        casimirs={"C1": kinetic(Gamma, (1, 1, 1)), "C2": sp.Add(*(a * b for a, b in zip(y, Gamma, strict=True)))},
        parameters=dict(zip((*moments, m, g, *r), (I1, I2, I3, mass, gravity, r1, r2, r3), strict=True)),
        cases=cases(moments),
        parts=parts(y, Gamma, moments) | {"V": potential(y, Gamma, V, weight)},
        splittings={f"V{order}": ("V", *(f"T{axis}" for axis in order)) for order in orders},
        picture=on_unit_sphere(Gamma, ("Γ1", "Γ2", "Γ3")),
    )


def cases(moments: State) -> dict[str, PoissonCase]:
    """Return tops by name: the fast one of the problem ``rigid_body_rotation``, Lagrange's and Kovalevskaya's."""
    half, tilt = sp.Rational(1, 2), sp.Rational(3, 10)
    upright = (sp.sin(tilt), 0, sp.cos(tilt))
    unit = {"mass": 1.0, "gravity": 1.0, "r2": 0.0}
    return {
        "heavy_top": PoissonCase(
            # Decimals as they are printed with the benchmark.
            y=(0, 150 * moments[1], -sp.Rational("4.61538") * moments[2], 0, 0, 1),
            about="as rigid_body_rotation: spinning at 150 rad/s about axis 2, which lies horizontal and precesses",
        ),
        "lagrange": PoissonCase(
            y=(0, 0, 2, *upright),
            parameters={"I1": 1.0, "I2": 1.0, "I3": 0.5, "r3": 1.0} | unit,
            about="Lagrange's top, I1 = I2 with its centre of mass on axis 3: y3 is constant too",
        ),
        "kovalevskaya": PoissonCase(
            y=(half, 0, 1, *upright),
            parameters={"I1": 1.0, "I2": 1.0, "I3": 0.5, "r1": 1.0} | unit,
            about="Kovalevskaya's top, I1 = I2 = 2 I3 with its centre of mass on axis 1: it has a fourth integral",
        ),
    }


def parts(y: State, Gamma: State, moments: State) -> dict[str, Part]:
    """Return the rotations T1, T2, T3 of y and Gamma together."""
    t = sp.Symbol("t", real=True)
    angles = [component / moment * t for component, moment in zip(y, moments, strict=True)]
    return {
        f"T{i + 1}": Part(H=y[i] ** 2 / (2 * moments[i]), t=t, y=(*turned(y, i, angle), *turned(Gamma, i, angle)))
        for i, angle in enumerate(angles)
    }


def potential(y: State, Gamma: State, V: sp.Expr, weight: State) -> Part:
    """Return the potential, along whose flow Gamma is constant and y grows linearly by the torque Gamma x weight."""
    t = sp.Symbol("t", real=True)
    torque = hat(Gamma) * sp.Matrix(weight)
    return Part(H=V, t=t, y=(*(component + t * part for component, part in zip(y, torque, strict=True)), *Gamma))
