"""A robot on two driven wheels, made of joints: three constraints on velocities, of which two combine to one on positions."""

import sympy as sp

from daebench.joints import Angle, Body, Mechanism, Rolling, RotationalDamper, Spin, Start, Torque, t
from daebench.systems.constrained import ConstrainedHamiltonian


def problem(
    *,
    mass: float = 10.0,
    inertia: float = 0.4,
    wheel: float = 0.01,
    radius: float = 0.1,
    track: float = 0.4,
    ahead: float = 0.05,
    torque: float = 0.5,
    damping: float = 0.1,
) -> ConstrainedHamiltonian:
    """Return a robot in the plane, seen from above: L and R are the hubs of its wheels, and its centre of mass is ahead of their axle.

    ::

        heading . L' = radius left'        heading . R' = radius right'        axle . L' = 0
        radius (right - left) - track angle = const

    Motors drive the left wheel with torque (1 + sin(t)), and the right one with torque (1 + cos(t)).

    Parameters
    ----------
    mass, inertia : float
        Mass with the wheels, kg, and moment of inertia about the centre of mass, kg m^2.
    wheel, radius : float
        Moment of inertia of a wheel about its axle, kg m^2, and its radius, m.
    track, ahead : float
        Distance of the wheels, and of the centre of mass from their axle, m.
    torque, damping : float
        Torque of the motors, N m, and their damping, N m s.
    """
    names = "mass inertia wheel radius track ahead torque damping"
    m, theta, J, r, b, a, tau, c = symbols = sp.symbols(names, positive=True)
    wheel_at = {"first": "chassis", "second": "ground", "axis": (0, 1), "radius": r}
    values = (mass, inertia, wheel, radius, track, ahead, torque, damping)
    return Mechanism(
        points={"L": (0, b / 2), "R": (0, -b / 2)},
        bodies={"chassis": Body("L", "R", mass=m, centre=(a, 0), inertia=theta)},
        angles={"left": Spin(J), "right": Spin(J), "turn": Angle("chassis")},
        joints=[Rolling(at="L", angle="left", **wheel_at), Rolling(at="R", angle="right", slides=True, **wheel_at)],
        forces=[
            *(Torque(side, tau * (1 + wave(t))) for side, wave in (("left", sp.sin), ("right", sp.cos))),
            *(RotationalDamper(side, c) for side in ("left", "right")),
        ],
        parameters=dict(zip(symbols, values, strict=True)),
        cases={
            "rest": Start(about="driven from rest"),
            "turning": Start(spin={"chassis": 1}, velocity={"L": ("0.1", 0)}, about="driven while it turns"),
        },
    ).problem()
