"""Numbers that stand for variables of a script, real and dual, and the operations on them.

Operations on constants are carried out at once. 1 x and x / 1 are replaced by x, which is exact. Zero derivatives are left out.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from daebench.compiler.javascript.statements import Expression
from daebench.compiler.trace.dual import SLOPES

COMPARISONS = {"<": lambda a, b: a < b, "<=": lambda a, b: a <= b, ">": lambda a, b: a > b, ">=": lambda a, b: a >= b}
COMPARISONS |= {"===": lambda a, b: a == b, "!==": lambda a, b: a != b}
ARITHMETIC: dict[str, Callable[[Any, Any], Any]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b if b else float("nan") if a == 0 or a != a else a * float("inf"),
}
ELEMENTARY = {
    name: f"Math.{name}" for name in ("sqrt", "exp", "expm1", "log", "log1p", "log2", "log10", "sin", "cos", "tan", "sinh", "cosh")
}
ELEMENTARY |= {"tanh": "Math.tanh", "abs": "Math.abs", "sign": "Math.sign"}
ELEMENTARY |= {f"arc{name}": f"Math.a{name}" for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh")}


@dataclass(frozen=True)
class Real:
    """A number, or a truth value, under the name of a variable."""

    name: str


@dataclass(frozen=True)
class Dual:
    """A value and its derivatives in several directions."""

    value: Any
    parts: tuple[Any, ...]


@dataclass(frozen=True)
class Entries:
    """An array of numbers: a vector, or rows of fixed length."""

    name: str
    width: int = 0


Number = Any
"""A constant, a Real or a Dual."""


def atom(x: Number) -> Expression:
    """Return a real number as an expression."""
    return x.name if isinstance(x, Real) else x


def value_of(x: Number) -> Number:
    """Return the value of a number, which may be real."""
    return x.value if isinstance(x, Dual) else x


class Arithmetic:
    """Operations on numbers. Each adds a statement through ``let``, a function from an expression to a name.

    Parameters
    ----------
    let : callable
        Gives an expression a name.
    """

    def __init__(self, let: Callable[[Expression], str]) -> None:
        self.let = let

    def made(self, operation: str, *operands: Number) -> Real:
        """Return the result of an operation on real numbers."""
        return Real(self.let((operation, *map(atom, operands))))

    def real(self, operation: str, a: Number, b: Number) -> Number:
        """Return a + b, a - b, a b or a / b of real numbers."""
        constant = not isinstance(a, Real), not isinstance(b, Real)
        if all(constant):
            return ARITHMETIC[operation](a, b)
        if operation == "*" and constant[0] and a in (1, -1):
            return b if a == 1 else self.made("neg", b)
        if operation in "*/" and constant[1] and b in (1, -1):
            return a if b == 1 else self.made("neg", a)
        return self.made(operation, a, b)

    def binary(self, operation: str, a: Number, b: Number) -> Number:
        """Return a + b, a - b, a b or a / b."""
        if not isinstance(a, Dual) and not isinstance(b, Dual):
            return self.real(operation, a, b)
        x, y, value = value_of(a), value_of(b), self.real(operation, value_of(a), value_of(b))
        k = len((a if isinstance(a, Dual) else b).parts)
        pairs = zip(*(z.parts if isinstance(z, Dual) else (0.0,) * k for z in (a, b)), strict=True)
        if operation in "+-":
            return Dual(value, tuple(self.sum(operation, dx, dy) for dx, dy in pairs))
        if operation == "*":
            return Dual(value, tuple(self.sum("+", self.times(y, dx), self.times(x, dy)) for dx, dy in pairs))
        inverse = self.real("/", 1.0, y)
        return Dual(value, tuple(self.times(inverse, self.sum("-", dx, self.times(value, dy))) for dx, dy in pairs))

    def sum(self, operation: str, a: Number, b: Number) -> Number:
        """Return a + b or a - b of derivatives, of which one may be zero."""
        if is_zero(b):
            return a
        if is_zero(a):
            return b if operation == "+" else self.negative(b)
        return self.real(operation, a, b)

    def times(self, factor: Number, derivative: Number) -> Number:
        """Return a derivative times a number."""
        return 0.0 if is_zero(derivative) else self.real("*", factor, derivative)

    def negative(self, a: Number) -> Number:
        """Return -a."""
        if isinstance(a, Dual):
            return Dual(self.negative(a.value), tuple(0.0 if is_zero(part) else self.negative(part) for part in a.parts))
        return self.made("neg", a) if isinstance(a, Real) else -a

    def compare(self, operation: str, a: Number, b: Number) -> Number:
        """Return the result of a comparison of values."""
        a, b = value_of(a), value_of(b)
        if isinstance(a, Real) or isinstance(b, Real):
            return self.made(operation, a, b)
        return COMPARISONS[operation](a, b)

    def logical(self, operation: str, a: Number, b: Number) -> Number:
        """Return a && b or a || b."""
        for first, other in ((a, b), (b, a)):
            if not isinstance(first, Real):
                return other if bool(first) == (operation == "&&") else first
        return self.made(operation, a, b)

    def negated(self, a: Number) -> Number:
        """Return !a."""
        return self.made("!", a) if isinstance(a, Real) else not a

    def chosen(self, test: Number, a: Any, b: Any) -> Any:
        """Return a if a truth value is true, else b; of tuples, entry by entry."""
        if not isinstance(test, Real):
            return a if test else b
        if isinstance(a, tuple):
            return tuple(self.chosen(test, x, y) for x, y in zip(a, b, strict=True))
        if isinstance(a, Dual) or isinstance(b, Dual):
            k = len((a if isinstance(a, Dual) else b).parts)
            parts = zip(*(z.parts if isinstance(z, Dual) else (0.0,) * k for z in (a, b)), strict=True)
            return Dual(self.chosen(test, value_of(a), value_of(b)), tuple(self.chosen(test, x, y) for x, y in parts))
        return a if a == b and type(a) is type(b) else self.made("?", test, a, b)

    def extreme(self, operation: str, a: Number, b: Number) -> Number:
        """Return the larger, or the smaller, of two numbers; if they are unordered, the second."""
        return self.chosen(self.compare(operation, a, b), a, b)

    def power(self, a: Number, b: Number) -> Number:
        """Return a^b: by products, in the order of squarings, if b is an integer constant."""
        if not isinstance(b, Real | Dual) and float(b).is_integer() and isinstance(b, int):
            product, square, left = None, a, abs(b)
            while left:
                if left & 1:
                    product = square if product is None else self.binary("*", product, square)
                left >>= 1
                square = self.binary("*", square, square) if left else square
            product = 1.0 if product is None else product
            return product if b >= 0 else self.binary("/", 1.0, product)
        if isinstance(a, Dual) and not isinstance(b, Dual):
            slope = self.binary("*", b, self.power(a.value, self.binary("-", b, 1.0)))
            return Dual(self.power(a.value, b), tuple(self.times(slope, part) for part in a.parts))
        return self.made("Math.pow", a, b)

    def elementary(self, name: str, a: Number) -> Number:
        """Return an elementary function of a number, with the derivative that dual numbers have."""
        if not isinstance(a, Dual):
            return self.made(ELEMENTARY[name], a)
        value = self.elementary(name, a.value)
        if name in ("abs", "sign"):
            slope: Number = self.chosen(self.compare(">=", a.value, 0.0), 1.0, -1.0) if name == "abs" else 0.0
        else:
            slope = SLOPES[name.replace("arc", "a")](self._of_symbols, Symbol(self, a.value)).number
        return Dual(value, tuple(self.times(slope, part) for part in a.parts))

    def _of_symbols(self, name: str) -> Callable[["Symbol"], "Symbol"]:
        return lambda x: Symbol(self, self.elementary(name, x.number))


def is_zero(x: Number) -> bool:
    """Return whether a number is the constant 0."""
    return not isinstance(x, Real | Dual) and x == 0


class Symbol:
    """A number with operators. The derivatives of elementary functions are written with it."""

    def __init__(self, arithmetic: Arithmetic, number: Number) -> None:
        self.arithmetic, self.number = arithmetic, number

    def _with(self, operation: str, a: Any, b: Any) -> "Symbol":
        numbers = (x.number if isinstance(x, Symbol) else x for x in (a, b))
        return Symbol(self.arithmetic, self.arithmetic.binary(operation, *numbers))

    def __add__(self, other: Any) -> "Symbol":
        return self._with("+", self, other)

    def __radd__(self, other: Any) -> "Symbol":
        return self._with("+", other, self)

    def __sub__(self, other: Any) -> "Symbol":
        return self._with("-", self, other)

    def __rsub__(self, other: Any) -> "Symbol":
        return self._with("-", other, self)

    def __mul__(self, other: Any) -> "Symbol":
        return self._with("*", self, other)

    def __rmul__(self, other: Any) -> "Symbol":
        return self._with("*", other, self)

    def __truediv__(self, other: Any) -> "Symbol":
        return self._with("/", self, other)

    def __rtruediv__(self, other: Any) -> "Symbol":
        return self._with("/", other, self)

    def __neg__(self) -> "Symbol":
        return Symbol(self.arithmetic, self.arithmetic.negative(self.number))

    def __pow__(self, exponent: int) -> "Symbol":
        return Symbol(self.arithmetic, self.arithmetic.power(self.number, exponent))
