"""Whether H_pp determines the multipliers: gauges are named, and a singular H_pp that determines them is no fault."""

import dataclasses

import numpy as np
import pytest
import sympy as sp

from daebench.compiler.definition import source_of
from daebench.diagnostics.consistency import project
from daebench.diagnostics.freedom import dependence
from daebench.diagnostics.inverse_mass import inverse_mass
from daebench.diagnostics.problem.check import HESSIAN, held
from daebench.runs.make_ivp import make_ivp
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates

UNITS = (1.0, 2.0**-30, 2.0**23)


def posed(H, g, q, p, start):
    case = Case(q=start[0], p=start[1])
    return make_ivp(source_of(ConstrainedHamiltonian(q=q, p=p, H=H, g=g, cases={"a": case}), "own"), "a")


def quaternion(unit, gauge, moments=(0.8, 0.8, 1.8)):
    """A heavy top by a quaternion of length ``unit``, without a gauge term or with one."""
    q, p = coordinates(4)
    a, b, c, d = q
    E = sp.Matrix([[-b, a, d, -c], [-c, -d, a, b], [-d, c, -b, a]])
    L = E * sp.Matrix(p) / 2
    H = sum(x**2 / (2 * moment) for x, moment in zip(L, moments, strict=True)) + 5 * (a * a - b * b - c * c + d * d)
    H += sp.Rational(gauge) * sp.Matrix(q).dot(sp.Matrix(p)) ** 2 / 8
    q0 = [unit * sp.Rational(3, 5), unit * sp.Rational(4, 5), 0, 0]
    p0 = list(2 * E.subs(dict(zip(q, q0, strict=True))).T * sp.Matrix([0, 0, 9]))
    return posed(H, [sum(x**2 for x in q) - unit**2], q, p, (q0, p0))


def turning(unit, gauge):
    """A point on a sphere by its angular momentum, H homogeneous of degree zero under q -> c q, p -> p / c."""
    q, p = coordinates(3)
    Q, P = sp.Matrix(q), sp.Matrix(p)
    L = Q.cross(P)
    H = L.dot(L) / 2 + sp.Rational(gauge) * Q.dot(P) ** 2 / 2 + q[2] / unit
    return posed(H, [Q.dot(Q) - unit**2], q, p, ((unit, 0, 0), (0, 1, sp.Rational(1, 2))))


def rays(unit, gauge):
    """A ray on a sphere, H = |p| or |p|^2 / 2: H_pp of the first is singular along p, which is a tangent."""
    q, p = coordinates(3)
    size = sp.Matrix(p).dot(sp.Matrix(p))
    return posed(size / 2 if gauge else sp.sqrt(size), [sum(x**2 for x in q) - unit**2], q, p, ((unit, 0, 0), (0, 1, sp.Rational(1, 2))))


def drawn(unit, gauge):
    """A point whose first coordinate moves with speed 1, on a circle in the others."""
    q, p = coordinates(3)
    H = p[0] + sp.Rational(gauge) * p[0] ** 2 / 2 + (p[1] ** 2 + p[2] ** 2) / 2
    return posed(H, [q[1] ** 2 + q[2] ** 2 - unit**2], q, p, ((0, 0, -unit), (0, 1, 0)))


def two_bodies(unit, gauge):
    """Two tops that are not coupled, of which the second has a gauge term in any case."""
    q, p = coordinates(6)
    parts = [(sp.Matrix(q[:3]), sp.Matrix(p[:3]), gauge), (sp.Matrix(q[3:]), sp.Matrix(p[3:]), 1)]
    H = sum(Q.cross(P).dot(Q.cross(P)) / 2 + sp.Rational(c) * Q.dot(P) ** 2 / 2 for Q, P, c in parts)
    g = [Q.dot(Q) - unit**2 for Q, _, _ in parts]
    return posed(H, g, q, p, ((unit, 0, 0, 0, unit, 0), (0, 1, 0, 1, 0, 0)))


@pytest.mark.sampled(by=lambda case: case in (f"homogeneous-{UNITS[1]}", "two bodies-1.0"))
@pytest.mark.parametrize("unit", UNITS, ids=str)
@pytest.mark.parametrize(
    ("body", "rank", "d"), [(quaternion, 3, 4), (turning, 2, 3), (two_bodies, 5, 6)], ids=["quaternion", "homogeneous", "two bodies"]
)
def test_a_gauge_is_named_in_any_units_and_its_term_makes_it_good(body, rank, d, unit):
    without, with_term = body(unit, 0), body(unit, 1)
    (fault,) = [each.fault for each in held(without) if each.what == HESSIAN]
    assert all(part in fault for part in (f"rank {rank} of {d}", f"rank {without.m - 1} of {without.m}", "gradient of g1", "gauge term"))
    assert "gauge term" in dependence(without)
    assert [each.fault for each in held(with_term) if each.what == HESSIAN] == [""]
    assert dependence(with_term) is None


@pytest.mark.sampled(by=lambda case: case in (f"rays-{UNITS[0]}", f"drawn-{UNITS[2]}"))
@pytest.mark.parametrize("unit", UNITS, ids=str)
@pytest.mark.parametrize("motion", [rays, drawn], ids=["rays", "drawn"])
def test_a_singular_h_pp_that_determines_the_multipliers_is_no_fault_and_is_told(motion, unit):
    singular, regular = motion(unit, 0), motion(unit, 1)
    assert [(each.fault, each.note) for each in held(regular) if each.what == HESSIAN] == [("", "")]
    (check,) = [each for each in held(singular) if each.what == HESSIAN]
    assert "rank 2 of 3" in check.note
    assert all(not each.fault for each in held(singular))
    p, q, *_ = project(singular, singular.p0 + 1e-3, singular.q0 * 1.001)
    assert np.abs(singular.value("Gv", p, q)).max() < 1e-12 * np.abs(singular.value("G", q)).max()


def test_light_and_heavy_masses_and_coupled_ones_are_regular(random):
    q, p = coordinates(3)
    for masses in ((1, 1e-14, 1e14), (1e-9, 1e-9, 1)):
        point = posed(sum(x**2 / (2 * m) for x, m in zip(p, masses, strict=True)), [q[0] ** 2 - 1], q, p, ((1, 0, 0), (0, 1, 1)))
        found = inverse_mass(point, point.p0, point.q0)
        assert (found.rank, found.definite, found.fault, found.note) == (3, True, "", "")
    for _ in range(5):
        B = random.normal(size=(3, 3))
        A = B @ B.T + 1e-3 * np.eye(3)
        H = (sp.Matrix([p]) * sp.Matrix(A.tolist()) * sp.Matrix(p))[0] / 2
        point = posed(H, [q[0] ** 2 + q[1] - 1], q, p, ((1, 0, 0), (0, 0, 0)))
        assert inverse_mass(point, point.p0, point.q0).note == ""


def test_an_indefinite_h_pp_is_told_and_one_that_loses_a_multiplier_is_a_fault():
    q, p = coordinates(2)
    well = posed(p[0] ** 2 / 2 - p[1] ** 2 / 2, [q[0] ** 2 + 2 * q[1] - 1], q, p, ((0, sp.Rational(1, 2)), (0, 0)))
    (check,) = [each for each in held(well) if each.what == HESSIAN]
    assert (check.fault, "negative eigenvalues" in check.note) == ("", True)
    null = dataclasses.replace(well, q0=np.array([1.0, 0.0]))
    assert "rank 0 of 1" in inverse_mass(null, null.p0, null.q0).fault
