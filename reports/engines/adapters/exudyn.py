"""EXUDYN: point masses at fixed distances, bars with revolute joints, a top on its Lie group; index-2 trapezoid and generalized-alpha."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from daebench.reports.engines.contender import Array, Contender, States, halved, mass_matrix
from daebench.runs.ivp import ConstrainedIvp
from daebench.systems.lazily import exudyn
from daebench.systems.lazily import exudyn_items as items

PACKAGE = "exudyn"

RADII = (0.6, 0.8, 0.9, 0.95)
"""Spectral radii of generalized-alpha at infinity that are swept; its documentation has 0.5 to 1."""

NEWTON = {"relativeTolerance": 1e-10, "absoluteTolerance": 1e-12}
"""Tolerances of Newton's iteration; 1e-8 and 1e-10 if left out. With 1e-12 and 1e-13 it fails now and then."""

SPARSE = 60
"""Coordinates from which on the sparse solver is taken."""


@dataclass
class System:
    """A system, the sensors that are read from it, and how their rows are daebench's p and q."""

    mbs: Any
    """The assembled system."""
    sensors: list[int]
    """Sensors, which keep what they see."""
    mapped: Callable[[list[Array]], tuple[Array, Array]]
    """From rows of the sensors, each without its time, to p and q, shape(n, d) each."""


def run(pose: Callable[[ConstrainedIvp], System], solver: str, radius: float, ivp: ConstrainedIvp, h: float, times: Array) -> States:
    """Run a system from its start to the last of equidistant times; the whole call of the solver is timed."""
    exudyn.config.printToConsole = False
    system, steps = pose(ivp), round(float(times[-1]) / h)
    settings: Any = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps, settings.timeIntegration.endTime = steps, float(times[-1])
    settings.timeIntegration.generalizedAlpha.spectralRadius = radius
    settings.timeIntegration.adaptiveStep = False
    settings.timeIntegration.verboseMode = 0
    for name, value in NEWTON.items():
        setattr(settings.timeIntegration.newton, name, value)
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = float(times[0])
    if system.mbs.systemData.ODE2Size() > SPARSE:
        settings.linearSolver.solverType = exudyn.LinearSolverType.EigenSparse
    began = time.process_time()
    system.mbs.SolveDynamic(settings, solverType=getattr(exudyn.DynamicSolverType, solver))
    seconds = time.process_time() - began
    rows = [system.mbs.GetSensorStoredData(sensor) for sensor in system.sensors]
    at = np.searchsorted(rows[0][:, 0], times - h / 2)
    p, q = system.mapped([seen[at, 1:] for seen in rows])
    return States(p, q, seconds, np.full(len(times), np.nan))


def empty() -> tuple[Any, int]:
    """Return a system and its ground."""
    mbs = exudyn.SystemContainer().AddSystem()
    return mbs, mbs.AddObject(items.ObjectGround())


def watched(mbs: Any, nodes: list[int]) -> list[int]:
    """Return sensors of the coordinates of nodes, and of their velocities after them."""
    kinds = (exudyn.OutputVariableType.CoordinatesTotal, exudyn.OutputVariableType.Coordinates_t)
    return [
        mbs.AddSensor(items.SensorNode(nodeNumber=node, storeInternal=True, outputVariableType=kind)) for kind in kinds for node in nodes
    ]


def points(ivp: ConstrainedIvp) -> System:
    """Pose pendulums and chains as point masses, each at a fixed distance from the one before, as its example of the IFToMM pendulum is."""
    mbs, ground = empty()
    M, gravity = mass_matrix(ivp), ivp.parameters["gravity"]
    before = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=ground, localPosition=[0, 0, 0]))
    q, v = ivp.q0.reshape(-1, 2), np.linalg.solve(M, ivp.p0).reshape(-1, 2)
    lengths = np.linalg.norm(np.diff(q, axis=0, prepend=0.0), axis=1)
    nodes = []
    for k, length in enumerate(lengths):
        mass = float(M[2 * k, 2 * k])
        nodes.append(mbs.AddNode(items.NodePoint2D(referenceCoordinates=q[k].tolist(), initialVelocities=v[k].tolist())))
        mbs.AddObject(items.MassPoint2D(physicsMass=mass, nodeNumber=nodes[-1]))
        marker = mbs.AddMarker(items.MarkerNodePosition(nodeNumber=nodes[-1]))
        mbs.AddObject(items.DistanceConstraint(markerNumbers=[before, marker], distance=float(length)))
        mbs.AddLoad(items.Force(markerNumber=marker, loadVector=[0, -mass * gravity, 0]))
        before = marker
    sensors = watched(mbs, nodes)
    mbs.Assemble()
    return System(mbs, sensors, lambda rows: (np.hstack(rows[ivp.m :]) @ M, np.hstack(rows[: ivp.m])))


def bar(mbs: Any, start: Array, end: Array, v_start: Array, v_end: Array, mass: float, gravity: float) -> tuple[int, int, int]:
    """Add a uniform bar between two points with given velocities; return its node and the markers of its ends."""
    along, turning = end - start, v_end - v_start
    length = float(np.linalg.norm(along))
    place = [*((start + end) / 2), np.arctan2(along[1], along[0])]
    velocity = [*((v_start + v_end) / 2), (along[0] * turning[1] - along[1] * turning[0]) / length**2]
    node = mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=list(map(float, place)), initialVelocities=list(map(float, velocity))))
    body = mbs.AddObject(items.RigidBody2D(nodeNumber=node, physicsMass=mass, physicsInertia=mass * length**2 / 12))
    mbs.AddLoad(items.LoadMassProportional(markerNumber=mbs.AddMarker(items.MarkerBodyMass(bodyNumber=body)), loadVector=[0, -gravity, 0]))
    ends = [mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=body, localPosition=[x * length / 2, 0, 0])) for x in (-1, 1)]
    return node, ends[0], ends[1]


def tip(place: Array, velocity: Array, length: float) -> tuple[Array, Array]:
    """Return where the ends of a bar are, and their velocities, shape(n, 2), from rows of its node."""
    along = length / 2 * np.column_stack([np.cos(place[:, 2]), np.sin(place[:, 2])])
    across = length / 2 * velocity[:, 2:] * np.column_stack([-np.sin(place[:, 2]), np.cos(place[:, 2])])
    return place[:, :2] + along, velocity[:, :2] + across


def joined(mbs: Any, pairs: list[tuple[int, int]]) -> None:
    """Add revolute joints between markers."""
    for pair in pairs:
        mbs.AddObject(items.RevoluteJoint2D(markerNumbers=list(pair)))


def slider_crank(ivp: ConstrainedIvp) -> System:
    """Pose the slider crank of two bars and a point mass on its line."""
    mbs, ground = empty()
    crank, _, crank_mass, rod_mass, slider_mass, gravity = ivp.par
    M = mass_matrix(ivp)
    v = np.linalg.solve(M, ivp.p0)
    pivot, knee, end = np.zeros(2), ivp.q0[:2], np.array([ivp.q0[2], 0.0])
    v_knee, v_end = v[:2], np.array([v[2], 0.0])
    first = bar(mbs, pivot, knee, np.zeros(2), v_knee, crank_mass, gravity)
    second = bar(mbs, knee, end, v_knee, v_end, rod_mass, gravity)
    slider = mbs.AddNode(items.NodePoint2D(referenceCoordinates=end.tolist(), initialVelocities=v_end.tolist()))
    mbs.AddObject(items.MassPoint2D(physicsMass=slider_mass, nodeNumber=slider))
    fixed = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(items.NodePointGround()), coordinate=0))
    line = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=slider, coordinate=1))
    mbs.AddObject(items.CoordinateConstraint(markerNumbers=[fixed, line]))
    origin = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=ground, localPosition=[0, 0, 0]))
    joined(mbs, [(origin, first[1]), (first[2], second[1]), (second[2], mbs.AddMarker(items.MarkerNodePosition(nodeNumber=slider)))])
    sensors = watched(mbs, [first[0], slider])
    mbs.Assemble()

    def mapped(rows: list[Array]) -> tuple[Array, Array]:
        x, velocity = tip(rows[0], rows[2], crank)
        return np.hstack([velocity, rows[3][:, :1]]) @ M, np.hstack([x, rows[1][:, :1]])

    return System(mbs, sensors, mapped)


def four_bar(ivp: ConstrainedIvp) -> System:
    """Pose the linkages of bars with revolute joints, as its example of the IFToMM benchmark is."""
    mbs, ground = empty()
    length, mass, gravity = (ivp.parameters[name] for name in ("length", "mass", "gravity"))
    M = mass_matrix(ivp)
    ends, speeds = ivp.q0.reshape(-1, 2), np.linalg.solve(M, ivp.p0).reshape(-1, 2)
    pivots = [np.array([i * length, 0.0]) for i in range(len(ends))]
    uprights = [bar(mbs, a, b, np.zeros(2), v, mass, gravity) for a, b, v in zip(pivots, ends, speeds, strict=True)]
    couplers = [bar(mbs, ends[i], ends[i + 1], speeds[i], speeds[i + 1], mass, gravity) for i in range(len(ends) - 1)]
    grounds = [mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=ground, localPosition=[*a, 0.0])) for a in pivots]
    joined(mbs, [(a, upright[1]) for a, upright in zip(grounds, uprights, strict=True)])
    for i, coupler in enumerate(couplers):
        joined(mbs, [(uprights[i][2], coupler[1]), (coupler[2], uprights[i + 1][2])])
    count = len(uprights)
    sensors = watched(mbs, [upright[0] for upright in uprights])
    mbs.Assemble()

    def mapped(rows: list[Array]) -> tuple[Array, Array]:
        tips = [tip(rows[i], rows[count + i], length) for i in range(count)]
        return np.hstack([v for _, v in tips]) @ M, np.hstack([x for x, _ in tips])

    return System(mbs, sensors, mapped)


def top(ivp: ConstrainedIvp) -> System:
    """Pose the heavy top by its rotation vector on the Lie group, about its fixed point, as its test of the heavy top is by parameters."""
    mbs, _ = empty()
    values = ivp.parameters
    moments = np.array([values[name] for name in ("I1", "I2", "I3")])
    y = ivp.p0.reshape(3, 3) - ivp.p0.reshape(3, 3).T
    omega = np.array([y[2, 1], y[0, 2], y[1, 0]]) / moments
    node = mbs.AddNode(items.NodeRigidBodyRotVecLG(referenceCoordinates=[0.0] * 6, initialVelocities=[0.0, 0.0, 0.0, *omega.tolist()]))
    body = mbs.AddObject(items.ObjectRigidBody(physicsMass=values["mass"], physicsInertia=[*moments.tolist(), 0, 0, 0], nodeNumber=node))
    centre = mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=body, localPosition=[values[name] for name in ("r1", "r2", "r3")]))
    mbs.AddLoad(items.Force(markerNumber=centre, loadVector=[0, 0, -values["mass"] * values["gravity"]]))
    fixed = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(items.NodePointGround()), coordinate=0))
    for axis in range(3):
        marker = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=axis))
        mbs.AddObject(items.CoordinateConstraint(markerNumbers=[fixed, marker]))
    kinds = (exudyn.OutputVariableType.RotationMatrix, exudyn.OutputVariableType.AngularVelocityLocal)
    sensors = [mbs.AddSensor(items.SensorBody(bodyNumber=body, storeInternal=True, outputVariableType=kind)) for kind in kinds]
    mbs.Assemble()

    def mapped(rows: list[Array]) -> tuple[Array, Array]:
        Q, (wx, wy, wz) = rows[0].reshape(-1, 3, 3), rows[1].T
        zero = np.zeros_like(wx)
        hat = np.array([[zero, -wz, wy], [wz, zero, -wx], [-wy, wx, zero]]).transpose(2, 0, 1)
        return (Q @ hat @ np.diag(moments.sum() / 2 - moments)).reshape(-1, 9), rows[0]

    return System(mbs, sensors, mapped)


def contenders() -> list[Contender]:
    """Return both implicit solvers on every motion that it can express, and explicit Runge-Kutta on the top, which it takes there."""
    poses = {"pendulum": points, "double": points, "slider": slider_crank, "fourbar": four_bar, "iftomm": four_bar}
    poses |= {"chain10": points, "chain100": points, "top": top}
    first = {"double": 1 / 32, "slider": 1 / 32, "fourbar": 1 / 8, "top": 1 / 512, "chain100": 1 / 64}
    entries = []
    for motion, pose in poses.items():
        values = halved(first.get(motion, 1 / 16), 10)
        entries.append(Contender("EXUDYN", "index-2 trapezoid", motion, "h", values, partial(run, pose, "TrapezoidalIndex2", 1.0)))
        alpha = {f"spectral radius {radius:g}": partial(run, pose, "GeneralizedAlpha", radius) for radius in RADII}
        entries.append(Contender("EXUDYN", "generalized-alpha", motion, "h", values, alpha["spectral radius 0.8"], variants=alpha))
    return [*entries, Contender("EXUDYN", "Lie group RK44", "top", "h", halved(1 / 256, 9), partial(run, top, "RK44", 1.0))]
