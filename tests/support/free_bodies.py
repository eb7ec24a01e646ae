"""Mechanisms as Pinocchio has them: every body free in space by a joint of its own, and points of bodies held together.

What is taken of a mechanism is what it declares: places of points, masses, centres and moments. Pinocchio gives the mass matrix of the free
bodies, their bias forces, and Jacobians and accelerations of points; the forces that hold the points together follow from these.
"""

import numpy as np
import pinocchio as pin

from daebench.joints import Body, Guided, PointMass


def in_space(x):
    """Return numbers of a place or vector, with z = 0 where it is of the plane."""
    found = np.array([float(entry) for entry in x])
    return np.pad(found, (0, 3 - len(found)))


def declared(mechanism):
    """Return the reference places of all points, the guided ones among them."""
    points = {name: x.place if isinstance(x, Guided) else x for name, x in mechanism.points.items()}
    return {name: in_space(x) for name, x in {**mechanism.ground, **points}.items()}


def inertia(body, at):
    """Return mass, centre and tensor about it at the reference position.

    A rod, which has no moment about itself, gets one: nothing turns it.
    """
    mass = float(body.mass)
    if isinstance(body, PointMass):
        return mass, at[body.point], np.eye(3)
    if isinstance(body, Body):
        centre = at[body.centre] if isinstance(body.centre, str) else in_space(body.centre)
        moments = [1, 1, float(body.inertia)] if isinstance(body.inertia, str) else [float(x) for x in body.inertia]
        return mass, centre, np.diag(moments)
    a, b = (at[name] for name in body.names[:2])
    return mass, (a + b) / 2, mass * (b - a) @ (b - a) / 12 * np.eye(3)


def turned(reference, now):
    """Return the rotation of points with their first one as the centre: the least one where they are in one line."""
    legs = [np.array([x - points[0] for x in points[1:]]) for points in (reference, now)]
    u, sizes, w = np.linalg.svd(legs[1].T @ legs[0])
    if np.sum(sizes > 1e-12 * sizes[0]) == 1:
        a, b = (leg[0] / np.linalg.norm(leg[0]) for leg in legs)
        axis, cosine = np.cross(a, b), a @ b
        hat = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        return np.eye(3) + hat + hat @ hat / (1 + cosine)
    return u @ np.diag([1, 1, np.linalg.det(u @ w)]) @ w


def spin(now, rates):
    """Return the least angular velocity at which points move so."""
    rows = [-np.cross(np.eye(3), x - now[0]).T for x in now[1:]]
    return np.linalg.lstsq(np.vstack(rows), np.concatenate([v - rates[0] for v in rates[1:]]), rcond=None)[0] if rows else np.zeros(3)


def point_accelerations(mechanism, places, speeds):
    """Return the accelerations of named points by Pinocchio, of a state that is given by places and speeds of all of them."""
    return motion_and_forces(mechanism, places, speeds)[0]


def motion_and_forces(mechanism, places, speeds):
    """Return the accelerations of named points, and the forces on each body at each of its points, of a state."""
    at = declared(mechanism)
    model = pin.Model()
    model.gravity.linear = in_space(mechanism.gravity)
    joints, q, v = {}, [], []
    for name, body in mechanism.bodies.items():
        mass, centre, tensor = inertia(body, at)
        joints[name] = joint = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), name)
        model.appendBodyToJoint(joint, pin.Inertia(mass, centre - at[body.names[0]], tensor), pin.SE3.Identity())
        now, rates = ([in_space(x[point]) for point in body.names] for x in (places, speeds))
        R = turned([at[x] for x in body.names], now) if len(now) > 1 else np.eye(3)
        q.append(np.concatenate([now[0], pin.Quaternion(R).coeffs()]))
        v.append(np.concatenate([R.T @ rates[0], R.T @ spin(now, rates)]))
    holders = {}
    for name, body in mechanism.bodies.items():
        for point in body.names:
            offset = pin.SE3(np.eye(3), at[point] - at[body.names[0]])
            holders.setdefault(point, []).append(
                model.addFrame(pin.Frame(f"{name} {point}", joints[name], 0, offset, pin.FrameType.OP_FRAME))
            )
    return held(mechanism, model, np.concatenate(q), np.concatenate(v), holders)


def held(mechanism, model, q, v, holders):
    """Return the accelerations of points that are held together, and the forces that hold them: M a + b = J^T f, J a + drift = 0."""
    data = model.createData()
    whole = pin.crba(model, data, q)
    M = np.triu(whole) + np.triu(whole, 1).T
    bias = pin.rnea(model, data, q, v, np.zeros(model.nv))
    pin.computeJointJacobians(model, data, q)
    pin.forwardKinematics(model, data, q, v, np.zeros(model.nv))
    pin.updateFramePlacements(model, data)
    world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

    def moved(frame):
        J = pin.getFrameJacobian(model, data, frame, world)[:3]
        return J, pin.getFrameClassicalAcceleration(model, data, frame, world).linear

    rows, drifts, forces, count = [], [], {}, 0
    for point, frames in holders.items():
        parts = [moved(frame) for frame in frames]
        names = [model.frames[frame].name.removesuffix(f" {point}") for frame in frames]
        if point in mechanism.ground:
            parts.append((np.zeros((3, model.nv)), np.zeros(3)))
            names.append("ground")
        if isinstance(guide := mechanism.points.get(point), Guided):
            free = np.array([in_space(way) for way in guide.along])
            off = np.eye(3) - np.linalg.pinv(free) @ free
            rows, drifts = [*rows, off @ parts[0][0]], [*drifts, off @ parts[0][1]]
            count += 3
        for name, (J, drift) in zip(names[1:], parts[1:], strict=True):
            rows, drifts = [*rows, J - parts[0][0]], [*drifts, drift - parts[0][1]]
            forces[point, name] = [(slice(count, count + 3), 1.0)]
            forces.setdefault((point, names[0]), []).append((slice(count, count + 3), -1.0))
            count += 3
    J, drift = np.vstack(rows), np.concatenate(drifts)
    kkt = np.block([[M, -J.T], [J, np.zeros((len(J), len(J)))]])
    solved = np.linalg.lstsq(kkt, -np.concatenate([bias, drift]), rcond=None)[0]
    a, f = solved[: model.nv], solved[model.nv :]
    accelerations = {point: moved(frames[0])[0] @ a + moved(frames[0])[1] for point, frames in holders.items()}
    return accelerations, {key: sum(sign * f[part] for part, sign in parts) for key, parts in forces.items()}
