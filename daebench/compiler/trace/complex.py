"""Complex numbers in a program: pairs of real ones, whose functions keep a small imaginary part to round-off."""

from collections.abc import Callable, Mapping
from functools import wraps
from math import log
from typing import Any

from daebench.compiler.trace.code import Code, Functions
from daebench.compiler.trace.ir import FLOAT64, Number, Value

COMPLEX = "z"
"""Kind of the entries of arrays of complex numbers. A complex number itself is two values."""


Binary = Callable[[Any, Any], Any]


class Pair(Number):
    """A number of two parts."""

    __slots__ = ("code",)
    code: Code

    @property
    def parts(self) -> tuple[Any, Any]:
        """Its parts."""
        raise NotImplementedError

    def of(self, x: Any) -> Any:
        """Return a number as one of this type."""
        raise NotImplementedError

    def merged(self, other: Any, merge: Binary) -> Any:
        """Return the number whose parts are made of those of two."""
        return type(self)(self.code, *map(merge, self.parts, self.of(other).parts))  # type: ignore[call-arg]


def of_numbers(operation: Binary) -> Binary:
    """Return an operation of two numbers, which leaves others, arrays say, to these."""

    @wraps(operation)
    def of_two(x: Any, y: Any) -> Any:
        return operation(x, y) if isinstance(y, Number | int | float | complex) else NotImplemented

    return of_two


class Complex(Pair):
    """A complex number: its parts are values, or numbers that are known while code is made."""

    __slots__ = ("imag", "real")

    def __init__(self, code: Code, real: Any, imag: Any = 0.0) -> None:
        self.code, self.real, self.imag = code, real, imag

    @property
    def parts(self) -> tuple[Any, Any]:
        """Its real and its imaginary part."""
        return self.real, self.imag

    def of(self, x: Any) -> "Complex":
        """Return a number as a complex one."""
        if isinstance(x, complex):
            return Complex(self.code, x.real, x.imag)
        return x if isinstance(x, Complex) else Complex(self.code, x)

    @of_numbers
    def __add__(self, other: Any) -> Any:
        if _is_real(other):
            return Complex(self.code, self.real + other, self.imag)
        return self.merged(other, lambda a, b: a + b)

    __radd__ = __add__

    @of_numbers
    def __sub__(self, other: Any) -> Any:
        if _is_real(other):
            return Complex(self.code, self.real - other, self.imag)
        return self.merged(other, lambda a, b: a - b)

    @of_numbers
    def __rsub__(self, other: Any) -> Any:
        y = self.of(other)
        return Complex(self.code, y.real - self.real, -self.imag if _is_real(other) else y.imag - self.imag)

    @of_numbers
    def __mul__(self, other: Any) -> Any:
        if _is_real(other):
            return Complex(self.code, self.real * other, self.imag * other)
        y = self.of(other)
        return Complex(self.code, self.real * y.real - self.imag * y.imag, self.real * y.imag + self.imag * y.real)

    __rmul__ = __mul__

    @of_numbers
    def __truediv__(self, other: Any) -> Any:
        """Return the quotient, by Smith (1962), Algorithm 116, Comm. ACM 5."""
        quotient, choose = self.code.quotient, self.code.select
        if _is_real(other):
            return Complex(self.code, quotient(self.real, other), quotient(self.imag, other))
        y = self.of(other)
        large = abs(y.real) >= abs(y.imag)
        big, small = choose(large, y.real, y.imag), choose(large, y.imag, y.real)
        ratio = quotient(small, big)
        a, b, below = self.real, self.imag, big + small * ratio
        real, imag = choose(large, a + b * ratio, a * ratio + b), choose(large, b - a * ratio, b * ratio - a)
        return Complex(self.code, quotient(real, below), quotient(imag, below))

    @of_numbers
    def __rtruediv__(self, other: Any) -> Any:
        return self.of(other) / self

    def __neg__(self) -> "Complex":
        return Complex(self.code, -self.real, -self.imag)

    def __abs__(self) -> Any:
        return self.code.functions.hypot(self.real, self.imag)

    @of_numbers
    def __pow__(self, exponent: Any) -> Any:
        if isinstance(exponent, int) or (isinstance(exponent, Value) and exponent.op == "const" and exponent.kind == "i"):
            return self.code.power(self, exponent)
        return _exp(_log(self) * exponent)

    @of_numbers
    def __rpow__(self, base: Any) -> Any:
        return _exp(self * _log(self.of(base)))

    def __eq__(self, other: object) -> Any:
        y = self.of(other)
        return self.code.both(self.real == y.real, self.imag == y.imag)

    def __ne__(self, other: object) -> Any:
        y = self.of(other)
        return self.code.either(self.real != y.real, self.imag != y.imag)

    __hash__ = object.__hash__


def _is_real(x: Any) -> bool:
    return not isinstance(x, complex | Complex)


def _function(parts: Callable[[Functions, Any, Any], tuple[Any, Any]]) -> Callable[[Complex], Complex]:
    """Return a function of a complex number, given what makes the parts of its value from functions of real numbers and the parts of z."""
    return lambda z: Complex(z.code, *parts(z.code.functions, *z.parts))


@_function
def _expm1(f: Functions, x: Any, y: Any) -> tuple[Any, Any]:
    half = f.sin(0.5 * y)
    return f.expm1(x) * f.cos(y) - 2.0 * half * half, f.exp(x) * f.sin(y)


_exp = _function(lambda f, x, y: ((size := f.exp(x)) * f.cos(y), size * f.sin(y)))
_log = _function(lambda f, x, y: (f.log(f.hypot(x, y)), f.atan2(y, x)))
_sin = _function(lambda f, x, y: (f.sin(x) * f.cosh(y), f.cos(x) * f.sinh(y)))
_cos = _function(lambda f, x, y: (f.cos(x) * f.cosh(y), -(f.sin(x) * f.sinh(y))))


def _sqrt(z: Complex) -> Complex:
    choose = z.code.select
    size = z.code.functions.sqrt(0.5 * (abs(z.real) + abs(z)))
    zero = size == 0.0
    other = choose(zero, z.imag, z.imag / choose(zero, 1.0, size + size))
    right, turned = z.real >= 0.0, choose(z.imag < 0.0, -size, size)
    return Complex(z.code, choose(right, size, abs(other)), choose(right, other, turned))


@_function
def _atan(f: Functions, x: Any, y: Any) -> tuple[Any, Any]:
    real = 0.5 * f.atan2(2.0 * x, (1.0 - x) * (1.0 + x) - y * y)
    return real, 0.25 * f.log1p(4.0 * y / (x * x + (1.0 - y) * (1.0 - y)))


def _asin(z: Complex) -> Complex:
    """Return arcsin z, by Kahan (1987), Branch Cuts for Complex Elementary Functions, table 1; so are the two below."""
    f, minus, plus = z.code.functions, _sqrt(z.of(1.0) - z), _sqrt(z + 1.0)
    return Complex(z.code, f.atan2(z.real, (minus * plus).real), f.asinh(minus.real * plus.imag - minus.imag * plus.real))


def _acos(z: Complex) -> Complex:
    f, minus, plus = z.code.functions, _sqrt(z.of(1.0) - z), _sqrt(z + 1.0)
    return Complex(z.code, 2.0 * f.atan2(minus.real, plus.real), f.asinh(plus.real * minus.imag - plus.imag * minus.real))


def _acosh(z: Complex) -> Complex:
    f, minus, plus = z.code.functions, _sqrt(z - 1.0), _sqrt(z + 1.0)
    return Complex(z.code, f.asinh(minus.real * plus.real + minus.imag * plus.imag), 2.0 * f.atan2(minus.imag, plus.real))


def _angle(y: Any, x: Any) -> Complex:
    """Return the angle of the point (x, y), to first order in imaginary parts."""
    code = (x if isinstance(x, Complex) else y).code
    x, y = as_complex(code, x), as_complex(code, y)
    imag = (x.real * y.imag - y.real * x.imag) / (x.real * x.real + y.real * y.real)
    return Complex(code, code.functions.atan2(y.real, x.real), imag)


def _turned(function: Callable[[Complex], Complex]) -> Callable[[Complex], Complex]:
    """Return the function -i f(i z)."""

    def of_turned(z: Complex) -> Complex:
        value = function(Complex(z.code, -z.imag, z.real))
        return Complex(z.code, value.imag, -value.real)

    return of_turned


def _tan(z: Complex) -> Any:
    return _sin(z) / _cos(z)


FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "sqrt": _sqrt,
    "exp": _exp,
    "exp2": lambda z: _exp(z * log(2.0)),
    "expm1": _expm1,
    "log": _log,
    "log1p": _function(lambda f, x, y: (0.5 * f.log1p(x * (2.0 + x) + y * y), f.atan2(y, 1.0 + x))),
    "log2": lambda z: _log(z) / log(2.0),
    "log10": lambda z: _log(z) / log(10.0),
    "sin": _sin,
    "cos": _cos,
    "tan": _tan,
    "sinh": _turned(_sin),
    "cosh": lambda z: _cos(Complex(z.code, -z.imag, z.real)),
    "tanh": _turned(_tan),
    "atan": _atan,
    "asin": _asin,
    "acos": _acos,
    "asinh": _turned(_asin),
    "acosh": _acosh,
    "atanh": _turned(_atan),
    "atan2": _angle,
}
"""Functions of complex numbers, by the names of the platform."""


def as_complex(code: Code, x: Any) -> Complex:
    """Return a number as a complex one, of double precision."""
    if isinstance(x, Complex):
        return x
    if isinstance(x, complex):
        return Complex(code, x.real, x.imag)
    return Complex(code, code.as_kind(x, FLOAT64))
