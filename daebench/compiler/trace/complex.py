"""Complex numbers in a program: pairs of real ones, whose functions keep a small imaginary part to round-off."""

from collections.abc import Callable, Mapping
from functools import wraps
from math import log
from typing import Any

from daebench.compiler.trace.code import Code
from daebench.compiler.trace.ir import FLOAT64, Value

COMPLEX = "z"
"""Kind of the entries of arrays of complex numbers. A complex number itself is two values."""


def _of_numbers(operation: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """Return an operation of two numbers, which leaves others, arrays say, to these."""

    @wraps(operation)
    def of_two(x: Any, y: Any) -> Any:
        return operation(x, y) if isinstance(y, Value | int | float | complex | Complex) else NotImplemented

    return of_two


class Complex:
    """A complex number: its parts are values, or numbers that are known while code is made."""

    __slots__ = ("code", "imag", "real")

    def __init__(self, code: Code, real: Any, imag: Any = 0.0) -> None:
        self.code, self.real, self.imag = code, real, imag

    def of(self, x: Any) -> "Complex":
        """Return a number as a complex one."""
        if isinstance(x, complex):
            return Complex(self.code, x.real, x.imag)
        return x if isinstance(x, Complex) else Complex(self.code, x)

    def merged(self, other: Any, merge: Callable[[Any, Any], Any]) -> "Complex":
        """Return the number whose parts are made of those of two."""
        y = self.of(other)
        return Complex(self.code, merge(self.real, y.real), merge(self.imag, y.imag))

    def __bool__(self) -> bool:
        raise TypeError("a number that is only known at run time stands where none can be tested")

    @_of_numbers
    def __add__(self, other: Any) -> Any:
        if _is_real(other):
            return Complex(self.code, self.real + other, self.imag)
        return self.merged(other, lambda a, b: a + b)

    __radd__ = __add__

    @_of_numbers
    def __sub__(self, other: Any) -> Any:
        if _is_real(other):
            return Complex(self.code, self.real - other, self.imag)
        return self.merged(other, lambda a, b: a - b)

    @_of_numbers
    def __rsub__(self, other: Any) -> Any:
        y = self.of(other)
        return Complex(self.code, y.real - self.real, -self.imag if _is_real(other) else y.imag - self.imag)

    @_of_numbers
    def __mul__(self, other: Any) -> Any:
        if _is_real(other):
            return Complex(self.code, self.real * other, self.imag * other)
        y = self.of(other)
        return Complex(self.code, self.real * y.real - self.imag * y.imag, self.real * y.imag + self.imag * y.real)

    __rmul__ = __mul__

    @_of_numbers
    def __truediv__(self, other: Any) -> Any:
        """Return the quotient, by Smith (1962), Algorithm 116, Comm. ACM 5."""
        if _is_real(other):
            return Complex(self.code, self.code.quotient(self.real, other), self.code.quotient(self.imag, other))
        y, choose = self.of(other), self.code.select
        large = abs(y.real) >= abs(y.imag)
        big, small = choose(large, y.real, y.imag), choose(large, y.imag, y.real)
        ratio = self.code.quotient(small, big)
        a, b, below = self.real, self.imag, big + small * ratio
        real, imag = choose(large, a + b * ratio, a * ratio + b), choose(large, b - a * ratio, b * ratio - a)
        return Complex(self.code, self.code.quotient(real, below), self.code.quotient(imag, below))

    @_of_numbers
    def __rtruediv__(self, other: Any) -> Any:
        return self.of(other) / self

    def __neg__(self) -> "Complex":
        return Complex(self.code, -self.real, -self.imag)

    def __pos__(self) -> "Complex":
        return self

    def __abs__(self) -> Any:
        return self.code.function_of("hypot")(self.real, self.imag)

    @_of_numbers
    def __pow__(self, exponent: Any) -> Any:
        if isinstance(exponent, int) or (isinstance(exponent, Value) and exponent.op == "const" and exponent.kind == "i"):
            return self.code.power(self, exponent)
        return _exp(self.code, _log(self.code, self) * exponent)

    @_of_numbers
    def __rpow__(self, base: Any) -> Any:
        return _exp(self.code, self * _log(self.code, self.of(base)))

    def __eq__(self, other: object) -> Any:
        y = self.of(other)
        return self.code.both(self.real == y.real, self.imag == y.imag)

    def __ne__(self, other: object) -> Any:
        y = self.of(other)
        return self.code.either(self.real != y.real, self.imag != y.imag)

    __hash__ = object.__hash__


def _is_real(x: Any) -> bool:
    return not isinstance(x, complex | Complex)


def _real(code: Code, name: str) -> Callable[..., Any]:
    return code.function_of(name)


def _exp(code: Code, z: Complex) -> Complex:
    size = _real(code, "exp")(z.real)
    return Complex(code, size * _real(code, "cos")(z.imag), size * _real(code, "sin")(z.imag))


def _expm1(code: Code, z: Complex) -> Complex:
    half = _real(code, "sin")(0.5 * z.imag)
    real = _real(code, "expm1")(z.real) * _real(code, "cos")(z.imag) - 2.0 * half * half
    return Complex(code, real, _real(code, "exp")(z.real) * _real(code, "sin")(z.imag))


def _log(code: Code, z: Complex) -> Complex:
    return Complex(code, _real(code, "log")(abs(z)), _real(code, "atan2")(z.imag, z.real))


def _log1p(code: Code, z: Complex) -> Complex:
    real = 0.5 * _real(code, "log1p")(z.real * (2.0 + z.real) + z.imag * z.imag)
    return Complex(code, real, _real(code, "atan2")(z.imag, 1.0 + z.real))


def _sqrt(code: Code, z: Complex) -> Complex:
    size = _real(code, "sqrt")(0.5 * (abs(z.real) + abs(z)))
    zero = size == 0.0
    other = code.select(zero, z.imag, z.imag / code.select(zero, 1.0, size + size))
    right, turned = z.real >= 0.0, code.select(z.imag < 0.0, -size, size)
    return Complex(code, code.select(right, size, abs(other)), code.select(right, other, turned))


def _sin(code: Code, z: Complex) -> Complex:
    cosh, sinh = _real(code, "cosh")(z.imag), _real(code, "sinh")(z.imag)
    return Complex(code, _real(code, "sin")(z.real) * cosh, _real(code, "cos")(z.real) * sinh)


def _cos(code: Code, z: Complex) -> Complex:
    cosh, sinh = _real(code, "cosh")(z.imag), _real(code, "sinh")(z.imag)
    return Complex(code, _real(code, "cos")(z.real) * cosh, -(_real(code, "sin")(z.real) * sinh))


def _turned(z: Complex) -> Complex:
    """Return i z."""
    return Complex(z.code, -z.imag, z.real)


def _back(z: Complex) -> Complex:
    """Return -i z."""
    return Complex(z.code, z.imag, -z.real)


def _atan(code: Code, z: Complex) -> Complex:
    x, y = z.real, z.imag
    real = 0.5 * _real(code, "atan2")(2.0 * x, (1.0 - x) * (1.0 + x) - y * y)
    return Complex(code, real, 0.25 * _real(code, "log1p")(4.0 * y / (x * x + (1.0 - y) * (1.0 - y))))


def _asin(code: Code, z: Complex) -> Complex:
    """Return arcsin z, by Kahan (1987), Branch Cuts for Complex Elementary Functions, table 1; so are the two below."""
    minus, plus = _sqrt(code, z.of(1.0) - z), _sqrt(code, z + 1.0)
    real = _real(code, "atan2")(z.real, (minus * plus).real)
    return Complex(code, real, _real(code, "asinh")(minus.real * plus.imag - minus.imag * plus.real))


def _acos(code: Code, z: Complex) -> Complex:
    minus, plus = _sqrt(code, z.of(1.0) - z), _sqrt(code, z + 1.0)
    real = 2.0 * _real(code, "atan2")(minus.real, plus.real)
    return Complex(code, real, _real(code, "asinh")(plus.real * minus.imag - plus.imag * minus.real))


def _acosh(code: Code, z: Complex) -> Complex:
    minus, plus = _sqrt(code, z - 1.0), _sqrt(code, z + 1.0)
    real = _real(code, "asinh")(minus.real * plus.real + minus.imag * plus.imag)
    return Complex(code, real, 2.0 * _real(code, "atan2")(minus.imag, plus.real))


def _angle(code: Code, y: Any, x: Any) -> Complex:
    """Return the angle of the point (x, y), to first order in imaginary parts."""
    x, y = as_complex(code, x), as_complex(code, y)
    imag = (x.real * y.imag - y.real * x.imag) / (x.real * x.real + y.real * y.real)
    return Complex(code, _real(code, "atan2")(y.real, x.real), imag)


FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "sqrt": _sqrt,
    "exp": _exp,
    "exp2": lambda code, z: _exp(code, z * log(2.0)),
    "expm1": _expm1,
    "log": _log,
    "log1p": _log1p,
    "log2": lambda code, z: _log(code, z) / log(2.0),
    "log10": lambda code, z: _log(code, z) / log(10.0),
    "sin": _sin,
    "cos": _cos,
    "tan": lambda code, z: _sin(code, z) / _cos(code, z),
    "sinh": lambda code, z: _back(_sin(code, _turned(z))),
    "cosh": lambda code, z: _cos(code, _turned(z)),
    "tanh": lambda code, z: _back(_sin(code, _turned(z)) / _cos(code, _turned(z))),
    "atan": _atan,
    "asin": _asin,
    "acos": _acos,
    "asinh": lambda code, z: _back(_asin(code, _turned(z))),
    "acosh": _acosh,
    "atanh": lambda code, z: _back(_atan(code, _turned(z))),
    "atan2": _angle,
}
"""Functions of complex numbers, by the names of the platform."""


def function_of(code: Code, name: str) -> Callable[..., Any]:
    """Return the function of this name for numbers of either type."""
    real, of_pairs = code.function_of(name), FUNCTIONS.get(name)

    def called(*args: Any) -> Any:
        given = [x for x in args if isinstance(x, Complex)]
        if not given:
            return real(*args)
        if of_pairs is None:
            raise TypeError(f"{name} is no function of complex numbers")
        return of_pairs(code, *args)

    return called


def as_complex(code: Code, x: Any) -> Complex:
    """Return a number as a complex one, of double precision."""
    if isinstance(x, Complex):
        return x
    if isinstance(x, complex):
        return Complex(code, x.real, x.imag)
    return Complex(code, code.as_kind(x, FLOAT64))
