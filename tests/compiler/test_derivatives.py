"""Derivatives of nested functions: those of SymPy, with each different part differentiated once."""

import math

import numpy as np
import pytest
import sympy as sp

from daebench.compiler import codegen
from daebench.compiler.expressions import nested_jacobian, parts, rebuilt
from daebench.systems.definition_parts import extent

x, y, c = sp.symbols("x y c", real=True)
r = sp.Symbol("r", positive=True)

VALUES = {
    "polynomial": 3 * x**2 * y - c * x / 7 + (x + y) ** 5,
    "roots": sp.sqrt(1 - x**2) * sp.sqrt(r**2 + sp.sqrt(1 + y**2)),
    "angles": sp.atan2(sp.sin(x) * y, sp.cos(x) + 2) + sp.acos(x / 3),
    "powers": r ** (x * y) + 2**x + r**y + x**r,
    "logarithm": sp.log(1 + sp.exp(-x * y)) + sp.tanh(c * x) ** 2,
    "shared": (sp.sin(x * y) + sp.cos(sp.sin(x * y))) / (2 + sp.sin(x * y)),
    "of no symbol": c**2 + 1,
}


def roots(depth):
    """Return square roots nested in each other, each written twice in the next."""
    value = x
    for _ in range(depth):
        value = sp.sqrt(1 + value**2 / 2 + value / 3)
    return value


@pytest.mark.parametrize("name", VALUES)
def test_derivatives_are_those_of_sympy(name):
    value = VALUES[name]
    found, right = nested_jacobian([value], [x, y, r])[:], sp.Matrix([value]).jacobian([x, y, r])[:]
    at = {x: sp.Rational(3, 10), y: sp.Rational(7, 10), c: sp.Rational(-5, 4), r: sp.Rational(9, 8)}
    for one, other in zip(found, right, strict=True):
        assert abs(sp.N((one - other).subs(at), 30)) <= abs(sp.N(other.subs(at), 30)) * 1e-25
    assert (max(abs(sp.N(one.subs(at))) for one in found) > 0.01) == (name != "of no symbol")


def test_a_part_is_differentiated_and_computed_once_however_often_it_is_written():
    value = roots(15)
    (slope,) = nested_jacobian([value], [x])
    assert extent(slope)[0] > 10**6
    assert len(list(parts([slope]))) < 500
    text = codegen.expressions("f", {"x": [x]}, [value, slope], (2,), [])
    assert text.count("\n") < 100
    namespace = {"sqrt": math.sqrt}
    exec(text, namespace)
    found = namespace["f"]((0.3,), ())
    t, dt = 0.3, 1.0
    for _ in range(15):
        new = math.sqrt(1 + t**2 / 2 + t / 3)
        t, dt = new, (t + 1 / 3) / (2 * new) * dt
    np.testing.assert_allclose(found, (t, dt), rtol=1e-13)


def test_parts_are_replaced_after_their_own_parts():
    value = sp.sin(x) ** 2 + sp.cos(sp.sin(x))
    (changed,) = rebuilt([value], lambda part: y if part in (x, sp.sin(y)) else part)
    assert changed == y**2 + sp.cos(y)
    assert rebuilt([value], lambda part: part) == [value]
