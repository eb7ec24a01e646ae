"""Springs, dampers, rotors, motors and servos at the joints of a model, and couplings of joints."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp

from daebench.errors import BadInput
from daebench.joints.angles import Angle, Coupling, Travel
from daebench.joints.drivers import DrivenAngle
from daebench.joints.models.builder import Builder
from daebench.joints.models.motions import Motion
from daebench.joints.models.names import Names
from daebench.joints.models.space import ROUNDED, rounded
from daebench.joints.torques import AtAngle, PDMotor, RotationalDamper, RotationalSpring, Torque
from daebench.systems.lazily import mujoco


@dataclass
class Coordinates:
    """The joint coordinates of a model that forces and couplings use, each measured from the reference position."""

    path: Path
    model: Any
    data: Any
    """At the reference position."""
    builder: Builder
    motions: Mapping[int, Motion]
    names: Names
    used: dict[int, str] = field(default_factory=dict)
    """Names of coordinates by the number of the joint."""
    angles: dict[str, Angle | Travel] = field(default_factory=dict)

    def of(self, joint: int, why: str) -> str:
        """Return the name of a joint's coordinate; raise BadInput, with the reason for which it is needed, if it has none."""
        if joint not in self.used:
            angle = self._angle(joint, why)
            name = self.used[joint] = self.names.new(self.names.joint(joint))
            self.angles[name] = angle
        return self.used[joint]

    def value(self, joint: int) -> float:
        """Return the coordinate of MuJoCo at the reference position."""
        return float(self.data.qpos[self.model.jnt_qposadr[joint]])

    def _angle(self, joint: int, why: str) -> Angle | Travel:
        kind, number = mujoco.mjtJoint(self.model.jnt_type[joint]), int(self.model.jnt_bodyid[joint])
        motion, space, axis = self.motions[number], self.builder.space, self.data.xaxis[joint]
        ends = self.builder.named(number), self.builder.named(self.builder.links[number].parent)
        armature = rounded(self._armature(joint))
        if kind == mujoco.mjtJoint.mjJNT_HINGE and len(motion.turns) == 1:
            if not space.plane:
                return Angle(*ends, axis=space.vector(axis), armature=armature)
            return Angle(*(ends if axis @ space.normal > 0 else ends[::-1]), armature=armature)
        others = [x for x in motion.slides if abs(x @ axis) > ROUNDED]
        if kind == mujoco.mjtJoint.mjJNT_SLIDE and len(others) == 1:
            return Travel(*ends, self.builder.of[number][0], axis=space.vector(axis), armature=armature)
        raise BadInput(
            f"{self.path}: the joint {self.names.joint(joint)} has {why}, which is read only of hinges and slides, each the only one of "
            "its body along its axis; remove it, or put a body between.",
            "joint-feature-unread",
        )

    def _armature(self, joint: int) -> float:
        m = self.model
        of = [k for k in range(m.nu) if m.actuator_trnid[k, 0] == joint and at_joint(m, k)]
        return float(m.dof_armature[m.jnt_dofadr[joint]] + sum(m.actuator_armature[k] * m.actuator_gear[k, 0] ** 2 for k in of))

    def passive(self) -> Iterator[AtAngle]:
        """Yield springs and dampers of joints, and name the coordinates that have a rotor."""
        m = self.model
        for joint in range(m.njnt):
            first = m.jnt_dofadr[joint]
            stiffness, damping = rounded(float(m.jnt_stiffness[joint])), rounded(float(m.dof_damping[first]))
            if m.jnt_stiffnesspoly[joint].any() or m.dof_dampingpoly[first].any():
                raise BadInput(
                    f"{self.path}: the joint {self.names.joint(joint)} has a spring or damper whose law is a polynomial; only linear ones "
                    "are read, so give one number.",
                    "polynomial-joint-law",
                )
            if stiffness:
                name = self.of(joint, "stiffness")
                rest = rounded(float(m.qpos_spring[m.jnt_qposadr[joint]]) - self.value(joint), 1.0)
                yield RotationalSpring(name, stiffness=stiffness, rest=rest, damping=damping)
            elif damping:
                yield RotationalDamper(self.of(joint, "damping"), damping=damping)
            if m.dof_armature[first]:
                self.of(joint, "armature")

    def actuators(self, controls: Mapping[int, sp.Symbol]) -> Iterator[AtAngle]:
        """Yield motors and servos, whose force is gear (gain u + b0 + b1 l + b2 l') at the length l = gear q."""
        m = self.model
        for k, u in controls.items():
            joint, gear = int(m.actuator_trnid[k, 0]), float(m.actuator_gear[k, 0])
            name = self.of(joint, "an actuator")
            affine = m.actuator_biastype[k] == mujoco.mjtBias.mjBIAS_AFFINE
            b0, b1, b2 = m.actuator_biasprm[k, :3] if affine else (0.0, 0.0, 0.0)
            push = rounded(gear * m.actuator_gainprm[k, 0]) * u + rounded(gear * b0)
            kp, kd = rounded(-b1 * gear**2), rounded(-b2 * gear**2)
            if kp:
                yield PDMotor(name, kp=kp, kd=kd, target=sp.expand(push / kp) - rounded(self.value(joint), 1.0))
            elif kd:
                yield PDMotor(name, kp=0, kd=kd, target=0, target_rate=sp.expand(push / kd))
            else:
                yield Torque(name, push)
            if damping := rounded(float(m.actuator_damping[k]) * gear**2):
                yield RotationalDamper(name, damping=damping)

    def couplings(self) -> Iterator[Coupling | DrivenAngle]:
        """Yield joints that are polynomials of others."""
        m = self.model
        for k in np.flatnonzero((m.eq_type == mujoco.mjtEq.mjEQ_JOINT) & (m.eq_active0 != 0)).tolist():
            first, second = int(m.eq_obj1id[k]), int(m.eq_obj2id[k])
            names = [self.of(joint, "an equality constraint") for joint in (first, second) if joint >= 0]
            if second < 0:
                angle = self.angles[names[0]]
                if isinstance(angle, Travel):
                    raise BadInput(
                        f"{self.path}: an equality constraint holds the slide {names[0]} in one place; remove the joint instead.",
                        "slide-held-by-equality",
                    )
                yield DrivenAngle(angle.first, angle.second, 0, axis=angle.axis)
                continue
            shifts = [self.value(joint) - float(m.qpos0[m.jnt_qposadr[joint]]) for joint in (first, second)]
            polynomial = np.polynomial.Polynomial(m.eq_data[k, :5])(np.polynomial.Polynomial([shifts[1], 1])) - shifts[0]
            coefficients = [rounded(float(c), 1.0) for c in np.trim_zeros(polynomial.coef, "b")]
            yield Coupling(names[0], names[1], tuple(coefficients or [0]))


def at_joint(model: Any, k: int) -> bool:
    """Return whether an actuator acts on a joint."""
    kinds = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
    return mujoco.mjtTrn(model.actuator_trntype[k]) in kinds


def controls_of(model: Any, names: Names) -> dict[int, sp.Symbol]:
    """Return the controls of the motors and servos at joints, run-time parameters of the mechanism, by the number of the actuator."""
    linear = [k for k in range(model.nu) if at_joint(model, k) and _is_linear(model, k)]
    return {k: sp.Symbol(names.new(f"{names.actuator(k)}_control"), real=True) for k in linear}


def _is_linear(model: Any, k: int) -> bool:
    filters = (mujoco.mjtDyn.mjDYN_NONE, mujoco.mjtDyn.mjDYN_FILTER, mujoco.mjtDyn.mjDYN_FILTEREXACT)
    biases = (mujoco.mjtBias.mjBIAS_NONE, mujoco.mjtBias.mjBIAS_AFFINE)
    fixed = mujoco.mjtGain(model.actuator_gaintype[k]) == mujoco.mjtGain.mjGAIN_FIXED
    return fixed and mujoco.mjtDyn(model.actuator_dyntype[k]) in filters and mujoco.mjtBias(model.actuator_biastype[k]) in biases
