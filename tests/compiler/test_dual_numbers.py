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

NAMES = "sqrt exp expm1 log log1p log10 sin cos tan arcsin arccos arctan sinh cosh tanh arcsinh arccosh arctanh"
ONE = {name: getattr(mp, name.replace("arc", "a")) for name in NAMES.split()}
ONE |= {"exp2": lambda x: 2**x, "log2": lambda x: mp.log(x, 2)}
"""Functions of one number by NumPy's names, of mpmath."""

EXPRESSIONS = [
    *(f"{name}(x + 1.5)" if name == "arccosh" else f"{name}(x)" for name in ONE),
    *("x + y", "x - y", "x * y", "x / y", "-y", "2.0 / y", "y / 2.0", "3 - x", "y ** 3", "y ** -2.0", "x ** y", "2.0 ** y", "abs(y)"),
    *("arctan2(y, x)", "arctan2(x, y)", "arctan2(y, 2.0)", "max(x, y)", "min(x, y)", "max(y, x, 2.0 * x)"),
    *("x if x > y else y", "x if y > 0.0 else y"),
]


def in_many_digits(expression, x, y):
    """Return the value of an expression as Python has it of numbers of mpmath."""
    return eval(expression, {**ONE, "arctan2": mp.atan2, "x": mp.mpf(x), "y": mp.mpf(y)})


@pytest.fixture(scope="module")
def computed():
    """Return values and derivatives of all expressions, by dual numbers and by real ones, from one compilation each."""
    reals = f"def reals(x, y):\n    return {codegen.pack(EXPRESSIONS)}"
    duals = "def duals(x, y, dx, dy):\n    made = reals(lifted(x, dx), lifted(y, dy))\n    return values(made), tangents(made)"
    plain, (values, slopes) = compiled(reals, "reals")(X, Y), compiled(f"{reals}\n\n{duals}", "duals")(X, Y, *SLOPES)
    return {name: (plain[k], values[k], slopes[k]) for k, name in enumerate(EXPRESSIONS)}


def test_every_function_that_dual_numbers_have_is_here():
    assert {MATHEMATICS[name] for name in ONE} == set(RULES)


@pytest.mark.usefixtures("forty_digits")
def test_the_derivative_is_that_in_many_digits_and_the_value_is_that_of_float64(computed):
    for expression, (plain, value, slopes) in computed.items():
        by_x, by_y = (mp.diff(lambda x, y: in_many_digits(expression, x, y), (X, Y), n) for n in ((1, 0), (0, 1)))  # noqa: B023
        exact = [float(by_x * dx + by_y * dy) for dx, dy in zip(*SLOPES, strict=True)]
        assert value == plain
        assert np.allclose(slopes, exact, rtol=1e-14, atol=1e-15), expression


def test_a_type_of_numbers_is_known_by_its_name():
    assert number_type("float32").dtype == "float32"
    dual = number_type("dual4")
    assert (dual.kind, dual.dtype, dual.directions) == ("dual", "float64", 4)
    assert dual.entries(["integrate", "first"])[1] == ["integrate_dual", "first"]
    assert number_type("float64").entries(["integrate"]) == ([], ["integrate"])
