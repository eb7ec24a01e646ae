"""Torques at angles: springs, dampers and motors that turn one body against another."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from daebench.joints.angles import Angles
from daebench.joints.drivers import t
from daebench.joints.exact import Values, exact, number
from daebench.joints.forces import Force, NegativeDamping
from daebench.systems.picture import Exact


@dataclass(frozen=True)
class Torque:
    """A torque on the first body of an angle, and the opposite one on the second.

    Parameters
    ----------
    angle : str
        Name of the angle.
    torque : number or Expr
        Torque, N m, constant or a function of ``daebench.joints.t``.
    """

    angle: str
    torque: Exact

    @property
    def words(self) -> str:
        """It in words."""
        return f"{self.torque} N m"

    def law(self, angle: sp.Expr, rate: sp.Expr) -> sp.Expr:
        """Return the torque."""
        return exact(self.torque)


@dataclass(frozen=True)
class RotationalSpring:
    """A spring at an angle, with a damper beside it: U = stiffness/2 (angle - rest)^2, and a torque -damping angle'.

    Parameters
    ----------
    angle : str
        Name of the angle.
    stiffness : number or Expr
        Its stiffness, N m/rad.
    rest : number or Expr
        The angle without torque, rad; it may be more than a turn.
    damping : number or Expr
        Damping, N m s/rad; a negative one feeds energy in, which a warning says.
    """

    angle: str
    stiffness: Exact
    rest: Exact = 0
    damping: Exact = 0

    @property
    def words(self) -> str:
        """It in words."""
        also = f", damping {self.damping} N m s/rad" if exact(self.damping) != 0 else ""
        return f"stiffness {self.stiffness} N m/rad, {self.rest} rad without torque{also}"

    def energy(self, angle: sp.Expr) -> sp.Expr:
        """Return U."""
        return exact(self.stiffness) / 2 * (angle - exact(self.rest)) ** 2

    def law(self, angle: sp.Expr, rate: sp.Expr) -> sp.Expr:
        """Return the torque of the damper: that of the spring has a potential."""
        return -exact(self.damping) * rate


@dataclass(frozen=True)
class RotationalDamper:
    """A damper at an angle: a torque -damping angle'.

    Parameters
    ----------
    angle : str
        Name of the angle.
    damping : number or Expr
        Damping, N m s/rad; a negative one feeds energy in, which a warning says.
    """

    angle: str
    damping: Exact

    @property
    def words(self) -> str:
        """It in words."""
        return f"damping {self.damping} N m s/rad"

    def law(self, angle: sp.Expr, rate: sp.Expr) -> sp.Expr:
        """Return the torque."""
        return -exact(self.damping) * rate


@dataclass(frozen=True)
class PDMotor:
    """A motor with a controller: a torque kp (target - angle) + kd (target_rate - angle').

    Parameters
    ----------
    angle : str
        Name of the angle.
    kp : number or Expr
        Gain of the angle, N m/rad.
    kd : number or Expr
        Gain of its rate, N m s/rad.
    target : number or Expr
        The angle that is aimed at, in ``daebench.joints.t``, rad; it may be more than a turn.
    target_rate : number or Expr, optional
        Its rate, rad/s; by default the derivative of the target.
    """

    angle: str
    kp: Exact
    kd: Exact
    target: Exact
    target_rate: Exact | None = None

    @property
    def words(self) -> str:
        """It in words."""
        rate = "" if self.target_rate is None else f" at {self.target_rate} rad/s"
        return f"kp {self.kp} N m/rad, kd {self.kd} N m s/rad, target {self.target} rad{rate}"

    def law(self, angle: sp.Expr, rate: sp.Expr) -> sp.Expr:
        """Return the torque."""
        target = exact(self.target)
        aimed = target.diff(t) if self.target_rate is None else exact(self.target_rate)
        return exact(self.kp) * (target - angle) + exact(self.kd) * (aimed - rate)


AtAngle = Torque | RotationalSpring | RotationalDamper | PDMotor
"""Torques, springs, dampers and motors at angles."""

AnyForce = Force | AtAngle
"""Forces between points, and torques at angles."""


def torque_force(torques: Sequence[AtAngle], angles: Angles, v: Sequence[sp.Symbol], values: Values) -> list[sp.Expr] | None:
    """Return the generalised forces of all torques without a potential, shape(d,); None where there are none."""
    q = angles.places.q
    total = sp.zeros(len(q), 1)
    for one in torques:
        damping = exact(getattr(one, "damping", 0))
        if number(damping, values) < 0:
            text = f"the {type(one).__name__} at {one.angle} has negative damping {damping}, so it adds energy."
            warnings.warn(text, NegativeDamping, stacklevel=3)
        angle, slope = angles.given(one.angle), angles.slope(one.angle)
        total += one.law(angle, (slope * sp.Matrix(v))[0]) * slope.T
    return list(total) if any(total) else None
