"""A program that is being recorded: operations on numbers are added to its blocks, each once where its result is at hand."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from struct import pack
from typing import Any

from daebench.compiler.trace.ir import (
    FLOAT32,
    FLOATS,
    INTEGER,
    POINTER,
    TRUTH,
    Function,
    Value,
    common,
    counting,
    kind_of,
    met,
    real,
)


class Functions:
    """Functions of numbers of one kind: attributes with the names of the platform, sqrt or sin say."""

    def __init__(self, code: "Code") -> None:
        self.code = code

    def __getattr__(self, name: str) -> Callable[..., Any]:
        def called(*args: Any) -> Value:
            kind = real(common(*map(kind_of, args)))
            return self.code.emit(name, kind, tuple(self.code.as_kind(x, kind) for x in args))

        return called


class Code:
    """A program that is being recorded: the block in which operations go, and those whose results are at hand there."""

    def __init__(self) -> None:
        self.block: list[Any] = []
        self.functions = Functions(self)
        self.seen: dict[Any, Value] = {}
        self.added: list[Any] = []
        self.constants: dict[Any, Value] = {}
        self.allocated = 0
        self.together = ""
        self.mask: Value | None = None

    @contextmanager
    def inside(self, block: list[Any]) -> Iterator[None]:
        """Record into a block; what is computed there is not at hand behind it."""
        outer = self.block, self.added
        self.block, self.added = block, []
        try:
            yield
        finally:
            for key in self.added:
                del self.seen[key]
            self.block, self.added = outer

    @contextmanager
    def apart(self, function: Function) -> Iterator[None]:
        """Record a function of its own."""
        outer = self.block, self.seen, self.added
        self.block, self.seen, self.added = function.block, {}, []
        try:
            yield
        finally:
            self.block, self.seen, self.added = outer

    def emit(self, op: str, kind: str, args: tuple[Any, ...]) -> Value:
        """Return the result of an operation without effects, which is recorded unless it is at hand."""
        key = op, args
        value = self.seen.get(key)
        if value is None:
            value = self.seen[key] = Value(self, op, kind, args)
            self.added.append(key)
            self.block.append(value)
        return value

    def effect(self, op: str, kind: str, args: tuple[Any, ...]) -> Value:
        """Record an operation that reads or changes memory."""
        value = Value(self, op, kind, args)
        self.block.append(value)
        return value

    def constant(self, x: Any, kind: str) -> Value:
        """Return the value of a known number; equal bits are one value."""
        typed = float(x) if kind[0] in FLOATS else int(x)
        # By bits, since 0.0 equals -0.0, and NaN does not equal itself.
        key = kind, pack("<d", typed) if kind[0] in FLOATS else typed
        value = self.constants.get(key)
        if value is None:
            value = self.constants[key] = Value(self, "const", kind, (typed,))
        return value

    def as_kind(self, x: Any, kind: str) -> Value:
        """Return a number as a value of this kind."""
        if not isinstance(x, Value):
            return self.constant(x, kind)
        if x.kind == kind:
            return x
        if x.op == "const" and x.kind != POINTER:
            return self.constant(x.args[0], kind)
        if len(x.kind) == 1 < len(kind):
            return self.emit("splat", kind, (self.as_kind(x, kind[0]),))
        if x.kind[1:] != kind[1:]:
            raise TypeError("a vector stands where one number is needed")
        if kind[0] == TRUTH:
            return self.compare("ne", x, 0)  # type: ignore[no-any-return]
        return self.emit(f"{x.kind[0]}to{kind[0]}", kind, (x,))

    def arithmetic(self, op: str, x: Any, y: Any) -> Any:
        """Return a sum, difference or product."""
        tx, ty = type(x), type(y)
        if tx is Value and ty is Value and x.kind == y.kind and x.kind[0] in FLOATS:
            return self.emit(op, x.kind, (x, y))
        if tx not in NUMBERS or ty not in NUMBERS:
            return NotImplemented
        kind = counting(met(x, y))
        if kind == INTEGER:
            known = _of_known(op, x, y)
            if known is not None:
                return known
        return self.emit(op, kind, (self.as_kind(x, kind), self.as_kind(y, kind)))

    def quotient(self, x: Any, y: Any) -> Any:
        """Return x / y."""
        if type(x) not in NUMBERS or type(y) not in NUMBERS:
            return NotImplemented
        kind = real(met(x, y))
        return self.emit("div", kind, (self.as_kind(x, kind), self.as_kind(y, kind)))

    def whole(self, op: str, x: Any, y: Any) -> Any:
        """Return x // y or x % y of numbers that are not negative."""
        kind = common(kind_of(x), kind_of(y))
        if kind[0] in FLOATS and op == "floordiv":
            raise TypeError("// is for whole numbers")
        return self.emit(op, kind, (self.as_kind(x, kind), self.as_kind(y, kind)))

    def compare(self, op: str, x: Any, y: Any) -> Any:
        """Return the truth of a comparison."""
        if x is None or y is None:
            return op == "ne"
        if type(x) not in NUMBERS or type(y) not in NUMBERS:
            return NotImplemented
        kind = counting(met(x, y))
        return self.emit(op, TRUTH + kind[1:], (self.as_kind(x, kind), self.as_kind(y, kind)))

    def both(self, x: Any, y: Any) -> Any:
        """Return whether both are true; y has been computed."""
        return self._of_truths("and", x, y, decided=False)

    def either(self, x: Any, y: Any) -> Any:
        """Return whether one of two is true; y has been computed."""
        return self._of_truths("or", x, y, decided=True)

    def truth(self, x: Value) -> Value:
        """Return whether a number is not 0."""
        return self.as_kind(x, TRUTH + x.kind[1:])

    def _of_truths(self, op: str, x: Any, y: Any, *, decided: bool) -> Any:
        if not isinstance(x, Value):
            return x if bool(x) == decided else y
        if not isinstance(y, Value):
            return decided if bool(y) == decided else self.truth(x)
        kind = TRUTH + common(x.kind, y.kind)[1:]
        return self.emit(op, kind, (self.as_kind(self.truth(x), kind), self.as_kind(self.truth(y), kind)))

    def negated(self, x: Any) -> Any:
        """Return whether x is false."""
        return self.emit("not", TRUTH + x.kind[1:], (self.truth(x),)) if isinstance(x, Value) else not x

    def select(self, test: Any, x: Any, y: Any) -> Any:
        """Return ``x if test else y``, number by number; both have been computed."""
        if not isinstance(test, Value):
            return x if test else y
        if x is y:
            return x
        if isinstance(x, tuple):
            return tuple(self.select(test, a, b) for a, b in zip(x, y, strict=True))
        if not isinstance(x, tuple(NUMBERS)):
            return x.merged(y, lambda a, b: self.select(test, a, b))
        if not isinstance(y, tuple(NUMBERS)):
            return y.merged(x, lambda a, b: self.select(test, b, a))
        kind = met(x, y)
        kind = kind if kind == POINTER else kind[0] + common(kind, test.kind)[1:]
        x, y = self.as_kind(x, kind), self.as_kind(y, kind)
        return x if x is y else self.emit("select", kind, (self.truth(test), x, y))

    def power(self, x: Any, exponent: Any) -> Any:
        """Return a power: of a known whole exponent by products, in the order of squarings, otherwise by the function of the platform."""
        if isinstance(exponent, Value) and exponent.op == "const" and exponent.kind == INTEGER:
            exponent = exponent.args[0]
        if type(exponent) not in NUMBERS:
            return NotImplemented
        if not isinstance(exponent, int):
            kind = common(kind_of(x), kind_of(exponent), FLOAT32)
            return self.emit("pow", kind, (self.as_kind(x, kind), self.as_kind(exponent, kind)))
        remaining, product, square = abs(exponent), None, x
        while remaining:
            if remaining & 1:
                product = square if product is None else product * square
            remaining >>= 1
            if remaining:
                square = square * square
        return 1.0 if product is None else 1.0 / product if exponent < 0 else product

    def extreme(self, op: str, x: Any, y: Any) -> Any:
        """Return the larger or smaller of two numbers, as Python does: the first of equal ones, and NaN only if it is the first."""
        if not (isinstance(x, Value) or isinstance(y, Value)):
            return max(x, y) if op == "gt" else min(x, y)
        kind = met(x, y)
        x, y = self.as_kind(x, kind), self.as_kind(y, kind)
        return self.select(self.compare(op, y, x), y, x)


NUMBERS = frozenset((Value, int, float, bool))


def _of_known(op: str, x: Any, y: Any) -> Any:
    """Return the result of an operation on whole numbers of which one is 0 or 1; None otherwise."""
    if type(y) is not Value and y == 0:
        return 0 if op == "mul" else x
    if type(x) is not Value and x == 0 and op != "sub":
        return 0 if op == "mul" else y
    if op == "mul" and type(y) is not Value and y == 1:
        return x
    if op == "mul" and type(x) is not Value and x == 1:
        return y
    return None
