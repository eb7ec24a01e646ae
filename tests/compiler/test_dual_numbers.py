"""Dual numbers: derivatives of every function and operation against those in many digits, values against those of float64."""

import mpmath as mp
import numpy as np
import pytest
from recorded import compiled

from daebench.compiler import codegen
from daebench.compiler.number_types import number_type
from daebench.compiler.trace.dual import SLOPES as RULES
from daebench.compiler.trace.names import MATHEMATICS

X, Y = 0.3, -0.7
SLOPES = ((1.0, -2.0), (0.5, 3.0))
"""Derivatives of x and of y in two directions."""

ONE = {
    "sqrt": mp.sqrt,
    "exp": mp.exp,
    "expm1": mp.expm1,
    "exp2": lambda x: 2**x,
    "log": mp.log,
    "log1p": mp.log1p,
    "log2": lambda x: mp.log(x, 2),
    "log10": mp.log10,
    "sin": mp.sin,
    "cos": mp.cos,
    "tan": mp.tan,
    "arcsin": mp.asin,
    "arccos": mp.acos,
    "arctan": mp.atan,
    "sinh": mp.sinh,
    "cosh": mp.cosh,
    "tanh": mp.tanh,
    "arcsinh": mp.asinh,
    "arccosh": mp.acosh,
    "arctanh": mp.atanh,
}
"""Functions of one number by NumPy's names."""

TWO = {
    "x + y": lambda x, y: x + y,
    "x - y": lambda x, y: x - y,
    "x * y": lambda x, y: x * y,
    "x / y": lambda x, y: x / y,
    "-y": lambda x, y: -y,
    "2.0 / y": lambda x, y: 2 / y,
    "y / 2.0": lambda x, y: y / 2,
    "3 - x": lambda x, y: 3 - x,
    "y ** 3": lambda x, y: y**3,
    "y ** -2.0": lambda x, y: y**-2,
    "x ** y": lambda x, y: x**y,
    "2.0 ** y": lambda x, y: mp.mpf(2) ** y,
    "abs(y)": lambda x, y: abs(y),
    "arctan2(y, x)": lambda x, y: mp.atan2(y, x),
    "arctan2(x, y)": lambda x, y: mp.atan2(x, y),
    "arctan2(y, 2.0)": lambda x, y: mp.atan2(y, 2),
    "max(x, y)": lambda x, y: x,
    "min(x, y)": lambda x, y: y,
    "max(y, x, 2.0 * x)": lambda x, y: 2 * x,
    "x if x > y else y": lambda x, y: x,
    "x if y > 0.0 else y": lambda x, y: y,
}
"""Expressions in x and y."""

EXPRESSIONS = {
    f"{name}(x + {1.5 * (name == 'arccosh')})": lambda x, y, f=f, name=name: f(x + 1.5 * (name == "arccosh")) for name, f in ONE.items()
}
EXPRESSIONS |= TWO


@pytest.fixture(scope="module")
def computed():
    """Return values and derivatives of all expressions, by dual numbers and by real ones, from one compilation each."""
    reals = f"def reals(x, y):\n    return {codegen.pack(EXPRESSIONS)}"
    duals = "def duals(x, y, dx, dy):\n    made = reals(lifted(x, dx), lifted(y, dy))\n    return values(made), tangents(made)"
    plain, (values, slopes) = compiled(reals, "reals")(X, Y), compiled(f"{reals}\n\n{duals}", "duals")(X, Y, *SLOPES)
    return {name: (plain[k], values[k], slopes[k]) for k, name in enumerate(EXPRESSIONS)}


def test_every_function_that_dual_numbers_have_is_here():
    assert {MATHEMATICS[name] for name in ONE} == set(RULES)


def test_the_derivative_is_that_in_many_digits_and_the_value_is_that_of_float64(computed):
    for expression in EXPRESSIONS:
        plain, value, slopes = computed[expression]
        with mp.workdps(40):
            f, at = EXPRESSIONS[expression], (mp.mpf(X), mp.mpf(Y))
            by_x, by_y = mp.diff(f, at, (1, 0)), mp.diff(f, at, (0, 1))
            exact = [float(by_x * dx + by_y * dy) for dx, dy in zip(*SLOPES, strict=True)]
        assert value == plain
        assert np.allclose(slopes, exact, rtol=1e-14, atol=1e-15)


def test_a_type_of_numbers_is_known_by_its_name():
    assert number_type("float32").dtype == "float32"
    dual = number_type("dual4")
    assert (dual.kind, dual.dtype, dual.directions) == ("dual", "float64", 4)
    assert dual.entries(["integrate", "first"])[1] == ["integrate_dual", "first"]
    assert number_type("float64").entries(["integrate"]) == ([], ["integrate"])
