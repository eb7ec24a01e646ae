"""Derived expressions against Lagrange's and Hamilton's equations, written out anew in SymPy and compared in numbers."""

import numpy as np
import pytest
import sympy as sp

from daebench.compiler.constrained.derivation import Derivation
from daebench.compiler.constrained.extended import ExtendedDerivation
from daebench.systems.constrained import ConstrainedHamiltonian, coordinates

q, p = coordinates(2)
t = sp.Symbol("t", real=True)
w = sp.symbols("w1 w2", real=True)
M = sp.Matrix([[2 + q[0] ** 2, q[0] * q[1] / 2], [q[0] * q[1] / 2, 1 + q[1] ** 4]])
U = q[0] * q[1] ** 2
G_ = q[0] ** 2 + q[1] ** 3 - 2


def close(x, y, random):
    """Return whether expressions have the same values at some numbers."""
    difference = sp.Matrix([x]) - sp.Matrix([y])
    symbols = sorted(difference.free_symbols, key=lambda symbol: symbol.sort_key())
    value = sp.lambdify(symbols, difference, "numpy")
    return all(np.abs(np.array(value(*random.uniform(0.3, 1.5, len(symbols))), dtype=float)).max() < 1e-12 for _ in range(3))


def gradient(f, x):
    return sp.Matrix([f]).jacobian(x).T


@pytest.fixture(scope="module")
def mechanical():
    return Derivation(ConstrainedHamiltonian(q=q, p=p, g=[G_], M=M, U=U))


def test_velocity_terms_are_those_of_lagrange(mechanical, random):
    v = mechanical.v
    T = (v.T * M * v)[0] / 2
    impulse = gradient(T, v)
    assert close(mechanical.c, impulse.jacobian(q) * v - gradient(T, q), random)
    assert close(mechanical.T_q, gradient(T, q), random)
    assert close(mechanical.N, impulse.jacobian(q), random)


def test_the_second_derivative_of_g_along_a_motion_is_that_of_hamiltons_equations(random):
    H = p[0] ** 2 * (1 + q[1] ** 2) / 2 + p[0] * p[1] / 3 + p[1] ** 2 + U
    derivation = Derivation(ConstrainedHamiltonian(q=q, p=p, g=[G_], H=H))

    def along(F):
        rates = [(q[i], H.diff(p[i])) for i in range(2)] + [(p[i], -H.diff(q[i]) - G_.diff(q[i]) * derivation.lam[0]) for i in range(2)]
        return sum(F.diff(x) * rate for x, rate in rates)

    assert close(derivation.Gv, sp.Matrix([along(G_)]), random)
    assert close(derivation.a, sp.Matrix([along(along(G_))]), random)
    assert close(derivation.curvature, derivation.lam[0] * sp.hessian(G_, q), random)


def test_forces_without_a_potential_are_added_to_the_forces_of_h_and_their_power_to_the_time(random):
    H, F = p[0] ** 2 / 2 + p[1] ** 2 + U * (1 + t), [-p[0], q[0] * t]
    problem = ConstrainedHamiltonian(q=q, p=p, g=[G_ - t], H=H, t=t, force=F)
    derivation = ExtendedDerivation(problem)
    time = derivation.q[2]
    power = F[0] * H.diff(p[0]) + F[1] * H.diff(p[1])
    expected = sp.Matrix([H.diff(q[0]) - F[0], H.diff(q[1]) - F[1], H.diff(t) + power]).subs(t, time)
    assert close(derivation.H_q, expected, random)


def test_forces_at_fixed_velocities_are_those_of_lagrange(random):
    F = [-w[0] * q[1], q[0]]
    derivation = ExtendedDerivation(ConstrainedHamiltonian(q=q, p=p, g=[G_ - t], M=M, U=U, t=t, force=F, v=w))
    v = derivation.v[:2, :]
    T, at = (v.T * M * v)[0] / 2, dict(zip(w, v, strict=True))
    force = sp.Matrix(F).subs(at)
    assert close(derivation.T_q[:2, :], gradient(T, q) + force, random)
    impulse = gradient(T, list(v))
    assert close(derivation.c[:2, :], impulse.jacobian(q) * v - gradient(T, q) - force, random)
