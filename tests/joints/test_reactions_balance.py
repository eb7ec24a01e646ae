"""In motion, the loads on each body are the rates of momentum and angular momentum of the point masses that it is equivalent to."""

import numpy as np
import pytest
from measures import error_of
from mechanism_states import loads
from mechanisms import GRAVITY, MECHANISMS, accelerations, moving, named, problem_of

import daebench
from daebench.joints import Body, Guided, PointMass


def in_space(x):
    return np.pad(np.array([float(entry) for entry in x]), (0, 3 - len(x)))


def points_of(body, at):
    """Return masses and reference places of points with the moments of a body of order 0, 1 and 2."""
    m = float(body.mass)
    if isinstance(body, PointMass):
        return [(m, at[body.point])]
    if not isinstance(body, Body):
        a, b = (at[x] for x in body.names[:2])
        return [(m / 6, a), (4 * m / 6, (a + b) / 2), (m / 6, b)]
    centre, plane = in_space(body.centre), isinstance(body.inertia, str)
    moments = np.array([float(body.inertia) / 2] * 2 + [0]) if plane else np.sum(x := [*map(float, body.inertia)]) / 2 - x
    return [(m / 6, centre + sign * np.sqrt(3 * E / m) * axis) for E, axis in zip(moments, np.eye(3), strict=True) for sign in (-1, 1)]


def carried(body, at, where, reference):
    """Return the place, or acceleration, of a point of a body by those of its named points: an affine combination."""
    known = np.array([[*at[x], 1.0] for x in body.names]).T
    c = np.linalg.lstsq(known, [*reference, 1.0], rcond=None)[0]
    assert error_of(known @ c, [*reference, 1.0]) < 1e-12
    return sum(weight * in_space(where[x]) for weight, x in zip(c, body.names, strict=True))


@pytest.mark.sampled(left_out=("four_bar", "wishbones"))
@pytest.mark.parametrize("name", MECHANISMS)
def test_the_loads_on_a_body_change_its_momentum_and_angular_momentum(random, name):
    mechanism, problem = MECHANISMS[name](), problem_of(name)
    q, v = moving(problem, random)
    now, rates = named(problem, q), named(problem, accelerations(problem, q, v), speeds=True)
    places = {x: point.place if isinstance(point, Guided) else point for x, point in mechanism.points.items()}
    at = {x: in_space(place) for x, place in {**mechanism.ground, **places}.items()}
    found = loads(problem, q, v)
    size = max(np.abs(load.force).max() for load in found.values())
    weight = in_space([0] * (len(next(iter(now.values()))) - 1) + ["-" + GRAVITY])
    for body_name, body in mechanism.bodies.items():
        force, torque = np.zeros(3), np.zeros(3)
        for load in (load for (_, on), load in found.items() if on == body_name):
            here = in_space(load.force[0])
            force += here
            torque += np.cross(in_space(now[load.at]), here)
            torque += load.torque[0] if len(load.torque[0]) == 3 else [0, 0, load.torque[0, 0]]
        needed = [(mass * (carried(body, at, rates, x) - weight), carried(body, at, now, x)) for mass, x in points_of(body, at)]
        assert error_of(sum(pull for pull, _ in needed), force) < 1e-10 * size
        assert error_of(sum(np.cross(x, pull) for pull, x in needed), torque) < 1e-10 * size


@pytest.mark.exhaustive
@pytest.mark.usefixtures("uncompiled_schemes")
@pytest.mark.parametrize("name", ["double_wishbone", "rssr_four_bar", "watt_six_bar"])
def test_the_bodies_of_the_catalogues_mechanisms_are_balanced_along_a_run(name):
    reactions = daebench.run(name, method="rattle", h=0.01, t_end=0.1).reactions()
    assert 0 < reactions.residual < 1e-12
    assert all(np.isfinite(load.force).all() and np.isfinite(load.torque).all() for load in reactions.loads)
