"""Points on a sphere that come to rest, against their equations written by hand, and at their end against the published positions."""

import numpy as np
import pytest
import uncompiled
from integrating import by_dop853
from measures import error_of
from published import FEKETE_Q

import daebench
from daebench.compiler.link import Linker, Options
from daebench.compiler.syntax import LANGUAGE
from daebench.diagnostics.nearby import rates
from daebench.methods.initial_value_problem import initial_value_problem


def repelled(p):
    """Return the forces of the other points on each, (p_i - p_j) / |p_i - p_j|^2 summed, shape(n, 3)."""
    apart = p[:, None] - p[None]
    return (apart / (np.sum(apart**2, axis=2) + np.eye(len(p)))[:, :, None]).sum(axis=1)


def slope(y, damping=0.5):
    """Return the rates of positions and velocities, each point kept on the sphere by a force along its radius."""
    p, v = y.reshape(2, -1, 3)
    F = repelled(p) - damping * v
    along = np.sum(F * p, axis=1) + np.sum(v * v, axis=1)
    return np.concatenate([v.ravel(), (F - along[:, None] * p).ravel()])


def moved(q0, times, damping=0.5):
    """Return positions and velocities at times, from rest."""
    return by_dop853(lambda _, y: slope(y, damping), np.concatenate([q0, 0 * q0]), times)


def test_a_few_points_are_accelerated_as_in_the_equations_written_by_hand_and_lose_what_damping_takes():
    where = initial_value_problem("fekete", "spiral", {"damping": 0.7})
    for state in moved(where.q0[:-1], [0.25, 0.5, 1.0], damping=0.7):
        q, v = np.split(state, 2)
        p_rate, q_rate = rates(where, np.append(v, 0.0), np.append(q, 0.0))
        assert error_of(np.concatenate([q_rate[:-1], p_rate[:-1]]), slope(state, 0.7)) < 1e-11
        assert p_rate[-1] == pytest.approx(0.7 * v @ v, rel=1e-12)


def test_four_points_come_to_rest_in_a_tetrahedron():
    """With the multipliers (n - 1)/4 for g = |p|^2 - 1; the slowest motion decays as e^(-t/4), the damping's half."""
    where = initial_value_problem("fekete", "spiral")
    end = moved(where.q0[:-1], [100.0])[-1]
    points = end[:12].reshape(4, 3)
    assert error_of(points @ points.T, (np.eye(4) * 4 - 1) / 3) < 1e-9
    state = np.append(end[12:], 0.0), np.append(end[:12], 100.0)
    assert where.value("lam", *state) == pytest.approx([3 / 4] * 4, abs=1e-9)


def test_the_forces_on_six_points_in_loops_are_those_written_by_hand(random):
    where = initial_value_problem("fekete", "spiral", {"points": 6})
    linker = Linker(where.source.derivation, Options(compiled=False, loops=True))
    forces = uncompiled.run(linker.module("Forces.", [(LANGUAGE, "H_q")]), "forces")
    q, v = where.q0[:-1].reshape(6, 3), random.normal(size=(6, 3))
    found = -forces.H_q(np.append(v.ravel(), 0.0), where.q0, where.par)
    assert error_of(found[:18], (repelled(q) - 0.5 * v).ravel()) < 1e-12
    assert found[18] == pytest.approx(0.5 * np.sum(v**2), rel=1e-13)


@pytest.mark.slow
@pytest.mark.exhaustive
def test_a_compiled_run_of_twenty_points_ends_where_the_test_set_says():
    """The error of IDA is some ten tolerances: equations written by hand end within 2.6e-12 of the published positions."""
    end = daebench.run("fekete", case="bari", method="ida:index2", tol=1e-9, t_end=1000.0)
    assert end.failure is None
    assert error_of(end.q[-1][:60], FEKETE_Q) < 1e-7
