"""States of mechanisms without a run, and bodies as point masses, for tests of the forces in joints."""

import numpy as np
import sympy as sp

from daebench.compiler.definition import source_of
from daebench.runs.make_ivp import make_ivp
from daebench.runs.trajectory import Trajectory


def mass(problem, ivp, q):
    """Return M at a position."""
    values = {x: ivp.parameters[str(x)] for x in problem.parameters} | dict(zip(problem.q, map(float, q), strict=False))
    return np.array(sp.Matrix(problem.M).subs(values), dtype=float)


def trajectory(problem, q, v, **parameters):
    """Return a trajectory with these states, one a row, as a run would return it, without a check of the case's start."""
    ivp = make_ivp(source_of(problem), parameters=parameters)
    q, v = np.atleast_2d(q), np.atleast_2d(v)
    p = np.array([mass(problem, ivp, row) @ rate for row, rate in zip(q, v, strict=True)])
    t = np.arange(len(q)) / 10
    if ivp.d > ivp.moving:
        q, p = np.column_stack([q, t]), np.column_stack([p, 0 * t])
    return Trajectory(
        problem=ivp.problem,
        case=ivp.case,
        method="none",
        parameters=ivp.parameters,
        knob="h",
        value=0.1,
        t=t,
        steps=0,
        seconds=0.0,
        q=q,
        p=p,
        ivp=ivp,
    )


def loads(problem, q, v, **parameters):
    """Return the loads at these states, by joint and body."""
    return {(load.joint, load.on): load for load in trajectory(problem, q, v, **parameters).reactions().loads}


def at_start(problem, **parameters):
    """Return the loads of the first case's start, one number each, by joint and body."""
    ivp = make_ivp(source_of(problem), parameters=parameters)
    p, q = ivp.start
    d = ivp.moving
    return loads(problem, q[:d], np.linalg.solve(mass(problem, ivp, q), p[:d]), **parameters)


def close(found, expected, size=1.0):
    return np.allclose(found, expected, rtol=0, atol=1e-10 * size)
