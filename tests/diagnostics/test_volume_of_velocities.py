"""The volume of positions and velocities: that of a sleigh shrinks or grows as its divergence says, that of a knife edge stays."""

import numpy as np
import pytest
import sympy as sp
from integrating import by_dop853

from daebench import Case, ConstrainedHamiltonian, initial_value_problem
from daebench.diagnostics.symplecticity import tangent_basis, tangent_map
from daebench.diagnostics.volume import share_of_velocities
from daebench.methods.fixed_step.constrained import FixedStep

H, STEPS = 0.02, 50


def sleigh(offset, speed):
    """Return Chaplygin's sleigh of unit mass and inertia, its centre before the edge, or behind it; with none it is a knife edge."""
    q, p, v = sp.symbols("x y phi", real=True), sp.symbols("p1:4", real=True), sp.symbols("v1:4", real=True)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        v=v,
        M=sp.diag(1, 1, 1),
        U=sp.Integer(0),
        g=[],
        velocity=[sp.sin(q[2]) * v[0] - sp.cos(q[2]) * v[1] + offset * v[2]],
        cases={"turning": Case(q=(0, 0, 0), p=(speed, offset, 1))},
    )


def share(ivp, method, h, steps):
    """Return the share of volume that a method leaves."""
    flow, X = FixedStep(method, compiled=False).flow(ivp, h, steps), tangent_basis(ivp, ivp.p0, ivp.q0)
    end = tuple(np.real(x) for x in flow(ivp.p0, ivp.q0))
    return share_of_velocities(ivp, ivp.start, end, X, tangent_map(flow, ivp.p0, ivp.q0, X))


def exact(offset, speed):
    """Return the share of volume that the motion leaves: s' = a w^2, (1 + a^2) w' = -a s w, whose divergence is -a s / (1 + a^2)."""
    a, inertia = offset, 1 + offset**2

    def rate(_, y):
        return [a * y[1] ** 2, -a * y[0] * y[1] / inertia, -a * y[0] / inertia]

    return np.exp(by_dop853(rate, [speed, 1, 0], H * STEPS)[2])


@pytest.mark.parametrize(("offset", "speed"), [(0.3, -2.0), (0.0, 1.0)])
def test_the_motion_changes_the_volume_as_its_divergence_says(offset, speed):
    ivp = initial_value_problem(sleigh(offset, speed))
    assert share(ivp, "gauss4", H, STEPS) == pytest.approx(exact(offset, speed), abs=1e-10)
    assert (abs(exact(offset, speed) - 1) > 0.1) == bool(offset)


def test_a_scheme_of_second_order_changes_it_so_to_second_order():
    ivp = initial_value_problem(sleigh(0.3, 0.5))
    errors = [abs(share(ivp, "dla", H / n, STEPS * n) - exact(0.3, 0.5)) for n in (1, 2)]
    assert 3.5 < errors[0] / errors[1] < 4.5
