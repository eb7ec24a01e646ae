"""Complex numbers as pairs of real ones: their functions against those of mpmath, and derivatives by a tiny imaginary part."""

import operator

import mpmath
import numpy as np
import pytest
from recorded import compiled
from refusals import refused

from daebench.compiler.trace.complex import FUNCTIONS
from daebench.errors import InvalidProblem

POINTS = [0.3 + 0.2j, 0.3 - 0.2j, -0.6 + 0.5j, -0.6 - 0.5j, 0.9 + 1e-9j, 1.7 + 0.4j, -2.3 + 0.7j, 4.0 - 3.0j]
NAMES = {"log10": lambda z: mpmath.log(z, 10), "log2": lambda z: mpmath.log(z, 2), "exp2": lambda z: mpmath.mpf(2) ** z}
NAMES |= {name: getattr(mpmath, name) for name in FUNCTIONS if name not in {*NAMES, "atan2"}}


@pytest.mark.parametrize("name", NAMES)
def test_a_function_is_that_of_mpmath(name):
    root = compiled(f"def root(z):\n    return {name}(z)")
    with mpmath.workdps(40):
        for z in POINTS:
            right = complex(NAMES[name](mpmath.mpc(z)))
            assert abs(root(z) - right) <= 8e-15 * max(1.0, abs(right)), z


@pytest.mark.parametrize("name", NAMES)
def test_a_tiny_imaginary_part_carries_the_derivative_to_round_off(name):
    root, x = compiled(f"def root(z):\n    return {name}(z)"), 1.4 if name == "acosh" else 0.4
    with mpmath.workdps(40):
        slope = float(mpmath.diff(NAMES[name], mpmath.mpf(x)).real)
    assert root(complex(x, 1e-30)).imag / 1e-30 == pytest.approx(slope, rel=1e-14)


OPERATIONS = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv}


@pytest.mark.parametrize("sign", OPERATIONS)
def test_operations_of_complex_and_real_numbers_are_those_of_python(sign):
    root = compiled(f"def root(x, y):\n    return x {sign} y")
    for x in [*POINTS, 2.5]:
        for y in [*POINTS, -0.7]:
            right = OPERATIONS[sign](x, y)
            assert abs(root(x, y) - right) <= 1e-15 * max(1.0, abs(right))


def test_powers_are_those_of_python():
    whole, broken = compiled("def root(z):\n    return z**3 + z**-2"), compiled("def root(z):\n    return z**1.5")
    for z in POINTS:
        assert whole(z) == pytest.approx(z**3 + z**-2, rel=1e-14)
        assert broken(z) == pytest.approx(z**1.5, rel=1e-14)


def test_quotients_do_not_overflow_where_the_result_does_not():
    root = compiled("def root(x, y):\n    return x / y")
    assert root(1e200 + 1e200j, 1e200 + 2e200j) == pytest.approx((1 + 1j) / (1 + 2j), rel=1e-15)


def test_arrays_of_complex_numbers_are_read_and_written():
    root, a = (
        compiled("def root(a, b):\n    for i in range(len(a)):\n        b[i] = a[i] * a[i] + 1.0\n    return a.real[0] + b[1].imag"),
        np.array(POINTS),
    )
    b = np.empty_like(a)
    assert root(a, b) == pytest.approx(a[0].real + (a[1] ** 2).imag)
    assert np.allclose(b, a * a + 1.0, rtol=1e-15)


def test_what_complex_numbers_do_not_have_is_said():
    with refused("scheme-not-compilable", InvalidProblem, ["hypot is no function of complex numbers"]):
        compiled("def root(x, y):\n    return hypot(x, y)")(1j, 2.0)
