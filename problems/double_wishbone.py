"""A wheel on two wishbones, with a tie rod and a spring: a suspension of nine unknowns in space, and one degree of freedom."""

import sympy as sp

from daebench.joints import Mechanism, Plate, PointMass, Spring, Start, points, rods
from daebench.systems.constrained import ConstrainedHamiltonian


def problem(
    *,
    arm_mass: float = 1.5,
    tie_mass: float = 0.8,
    upright_mass: float = 5.0,
    wheel_mass: float = 20.0,
    stiffness: float = 30e3,
    gravity: float = 9.81,
) -> ConstrainedHamiltonian:
    """Return the suspension in natural coordinates, q = (E, F, T): two ball joints and the end of the tie rod.

    ::

        arms        A - E, B - E below and C - F, D - F above, two uniform rods each; tie rod S - T; A, B, C, D, S at rest
        upright     a uniform triangle E F T, with the wheel as a mass in W in its plane: linear in E, F, T
        H           1/2 p^T M^-1 p + stiffness/2 (|H - E| - length)^2 + weight        g: eight distances

    The x-axis points forward, y to the wheel's side and z up; lengths are in metres. All joints are balls at points that bodies share, and
    need no equation. Without a tyre the wheel hangs in its spring, whose length without force is the one at the reference position. The
    wheel's moments of inertia are neglected, because it hardly turns.

    Parameters
    ----------
    arm_mass, tie_mass : float
        Mass of each of the four rods of the arms, and of the tie rod, kg.
    upright_mass, wheel_mass : float
        Mass of the upright and of the wheel, kg.
    stiffness : float
        Of the spring, N/m.
    gravity : float
        Gravitational acceleration along -z, m/s^2.
    """
    arm, tie, upright, wheel, k = sp.symbols("arm_mass tie_mass upright_mass wheel_mass stiffness", positive=True)
    gamma = sp.Symbol("gravity", real=True)
    return Mechanism(
        ground=points("A 0.16 0.38 -0.13, B -0.22 0.38 -0.12, C 0.13 0.45 0.14, D -0.17 0.45 0.13, S -0.14 0.36 -0.05, H 0 0.48 0.34"),
        points=points("E 0.01 0.73 -0.15, F -0.01 0.69 0.16, T -0.13 0.61 -0.06, W 0.07 0.77 -0.04"),
        bodies={
            **rods("A E, B E, C F, D F", mass=arm),
            **rods("S T", mass=tie),
            "upright": Plate("E", "F", "T", "W", mass=upright),
            "wheel": PointMass("W", wheel),
        },
        forces=[Spring("H", "E", stiffness=k)],
        gravity=(0, 0, -gamma),
        parameters={arm: arm_mass, tie: tie_mass, upright: upright_mass, wheel: wheel_mass, k: stiffness, gamma: gravity},
        cases={"released": Start(about="released at rest, the spring without force: the wheel falls into it and swings")},
    ).problem()
