"""Dual numbers in a program: a value, and its derivatives in k directions as one vector, which follow by the rules of calculus.

Values are computed as those of real numbers are.
"""

from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any

from daebench.compiler.trace.ir import FLOAT64, Code, Value


def _of_numbers(operation: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """Return an operation of two numbers, which leaves others, arrays say, to these."""

    @wraps(operation)
    def of_two(x: Any, y: Any) -> Any:
        return operation(x, y) if isinstance(y, Value | int | float | Dual) else NotImplemented

    return of_two


class Dual:
    """A number with derivatives: a value, and a value whose kind is a vector."""

    __slots__ = ("code", "tangents", "value")

    def __init__(self, code: Code, value: Any, tangents: Value) -> None:
        self.code, self.value, self.tangents = code, code.as_kind(value, FLOAT64), tangents

    @property
    def kind(self) -> str:
        """Kind of its derivatives."""
        return self.tangents.kind

    @property
    def real(self) -> Value:
        """Its value, as the real part of a complex number."""
        return self.value

    def of(self, x: Any) -> "Dual":
        """Return a number with derivatives, those of a real one being 0."""
        return x if isinstance(x, Dual) else Dual(self.code, x, self.code.constant(0.0, self.kind))

    def merged(self, other: Any, merge: Callable[[Any, Any], Any]) -> "Dual":
        """Return the number whose parts are made of those of two."""
        y = self.of(other)
        return Dual(self.code, merge(self.value, y.value), merge(self.tangents, y.tangents))

    def __bool__(self) -> bool:
        raise TypeError("a number that is only known at run time stands where none can be tested")

    def chained(self, value: Any, slope: Any) -> "Dual":
        """Return the number f(x), given the values of f and of f' here."""
        return Dual(self.code, value, slope * self.tangents)

    @_of_numbers
    def __add__(self, y: Any) -> Any:
        if not isinstance(y, Dual):
            return Dual(self.code, self.value + y, self.tangents)
        return Dual(self.code, self.value + y.value, self.tangents + y.tangents)

    @_of_numbers
    def __radd__(self, x: Any) -> Any:
        return Dual(self.code, x + self.value, self.tangents)

    @_of_numbers
    def __sub__(self, y: Any) -> Any:
        if not isinstance(y, Dual):
            return Dual(self.code, self.value - y, self.tangents)
        return Dual(self.code, self.value - y.value, self.tangents - y.tangents)

    @_of_numbers
    def __rsub__(self, x: Any) -> Any:
        return Dual(self.code, x - self.value, -self.tangents)

    @_of_numbers
    def __mul__(self, y: Any) -> Any:
        if not isinstance(y, Dual):
            return self.chained(self.value * y, y)
        return Dual(self.code, self.value * y.value, y.value * self.tangents + self.value * y.tangents)

    @_of_numbers
    def __rmul__(self, x: Any) -> Any:
        return self.chained(x * self.value, x)

    @_of_numbers
    def __truediv__(self, y: Any) -> Any:
        if not isinstance(y, Dual):
            return self.chained(self.code.quotient(self.value, y), self.code.quotient(1.0, y))
        value, inverse = self.value / y.value, 1.0 / y.value
        return Dual(self.code, value, inverse * (self.tangents - value * y.tangents))

    @_of_numbers
    def __rtruediv__(self, x: Any) -> Any:
        value, inverse = x / self.value, 1.0 / self.value
        return Dual(self.code, value, inverse * -(value * self.tangents))

    def __neg__(self) -> "Dual":
        return Dual(self.code, -self.value, -self.tangents)

    def __pos__(self) -> "Dual":
        return self

    def __abs__(self) -> "Dual":
        return self.chained(abs(self.value), self.code.select(self.value >= 0.0, 1.0, -1.0))

    @_of_numbers
    def __pow__(self, y: Any) -> Any:
        power = self.code.function_of("pow")
        if not isinstance(y, Dual):
            return self.chained(self.code.power(self.value, y), y * power(self.value, y - 1.0))
        a, b = self.value, y.value
        return self.chained(power(a, b), b * power(a, b - 1.0)) + y.chained(0.0, self.code.function_of("log")(a) * power(a, b))

    @_of_numbers
    def __rpow__(self, x: Any) -> Any:
        power = self.code.function_of("pow")(x, self.value)
        return self.chained(power, self.code.function_of("log")(x) * power)

    def __lt__(self, other: Any) -> Any:
        return self.value < value(other)

    def __le__(self, other: Any) -> Any:
        return self.value <= value(other)

    def __gt__(self, other: Any) -> Any:
        return self.value > value(other)

    def __ge__(self, other: Any) -> Any:
        return self.value >= value(other)

    def __eq__(self, other: object) -> Any:
        return self.value == value(other)

    def __ne__(self, other: object) -> Any:
        return self.value != value(other)

    __hash__ = object.__hash__


Function = Callable[[str], Callable[..., Any]]

SLOPES: Mapping[str, Callable[[Function, Any], Any]] = {
    "sqrt": lambda f, x: 0.5 / f("sqrt")(x),
    "exp": lambda f, x: f("exp")(x),
    "exp2": lambda f, x: 0.6931471805599453 * f("exp2")(x),
    "expm1": lambda f, x: f("exp")(x),
    "log": lambda f, x: 1.0 / x,
    "log1p": lambda f, x: 1.0 / (1.0 + x),
    "log2": lambda f, x: 1.4426950408889634 / x,
    "log10": lambda f, x: 0.4342944819032518 / x,
    "sin": lambda f, x: f("cos")(x),
    "cos": lambda f, x: -f("sin")(x),
    "tan": lambda f, x: 1.0 / f("cos")(x) ** 2,
    "asin": lambda f, x: 1.0 / f("sqrt")((1.0 - x) * (1.0 + x)),
    "acos": lambda f, x: -1.0 / f("sqrt")((1.0 - x) * (1.0 + x)),
    "atan": lambda f, x: 1.0 / (1.0 + x * x),
    "sinh": lambda f, x: f("cosh")(x),
    "cosh": lambda f, x: f("sinh")(x),
    "tanh": lambda f, x: 1.0 / f("cosh")(x) ** 2,
    "asinh": lambda f, x: 1.0 / f("sqrt")(1.0 + x * x),
    "acosh": lambda f, x: 1.0 / (f("sqrt")(x - 1.0) * f("sqrt")(x + 1.0)),
    "atanh": lambda f, x: 1.0 / ((1.0 - x) * (1.0 + x)),
}
"""Derivatives of functions of one number, by the names of the platform."""


def function_of(code: Code, name: str, args: tuple[Any, ...]) -> Any:
    """Return a function of numbers of which at least one has derivatives."""
    if name == "atan2":
        y, x = args
        a, b = value(x), value(y)
        square = a * a + b * b
        like = x if isinstance(x, Dual) else y
        turned = like.of(y).chained(code.function_of("atan2")(b, a), a / square)
        return turned + like.of(x).chained(0.0, -b / square)
    if name not in SLOPES:
        raise TypeError(f"{name} is no function of dual numbers")
    (x,) = args
    return x.chained(code.function_of(name)(x.value), SLOPES[name](code.function_of, x.value))


def extreme(code: Code, op: str, x: Any, y: Any) -> Any:
    """Return the larger or smaller of two numbers. If one is real, the derivatives are those of the other.

    Kernels use it only for sizes: changes of q are measured against max(LENGTH, |q|), and those of dq against |dq|.
    """
    if isinstance(x, Dual) and isinstance(y, Dual):
        return code.select(code.compare(op, x.value, y.value), x, y)
    dual = x if isinstance(x, Dual) else y
    return dual.chained(code.extreme(op, (value(x), value(y))), 1.0)


def value(x: Any) -> Any:
    """Return the value of a number."""
    return x.value if isinstance(x, Dual) else x
