"""Operations on numbers in blocks with structured control flow: what tracing records, and what transformations and printers read.

A block is a list. Its entries are values, each one operation, and nodes:

- :class:`If` has a test, two blocks, and results, which are pairs of values at the ends of the blocks;
- :class:`Region` is a block that is left by a :class:`Leave`, which ends a block and gives the results of the region;
- :class:`Loop` is an endless block with parameters that pass from one turn to the next; it is left by leaving a region around it;
- :class:`Call` calls another :class:`Function`.

There is no other control flow: ``return`` in a loop, ``break`` and the end of ``for`` are all departures from a region.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import count
from struct import pack
from typing import Any

FLOAT64, FLOAT32, INTEGER, TRUTH, POINTER = "d", "s", "i", "b", "p"
"""Kinds of values. Vectors have the kind of their entries, and their number: d4 is a vector of four doubles."""

ORDER = (TRUTH, INTEGER, FLOAT32, FLOAT64)
"""Kinds of numbers from the narrowest to the widest."""

FLOATS = (FLOAT64, FLOAT32)


class NeedsKnown(TypeError):
    """A number that is only known at run time stands where a known one is needed."""


def _operators(method: str, *op: str) -> tuple[Any, Any]:
    """Return an operator of values, which a method of the program records, and the same with its operands exchanged."""
    return (
        lambda self, other: getattr(self.code, method)(*op, self, other),
        lambda self, other: getattr(self.code, method)(*op, other, self),
    )


class Value:
    """One operation, and its result. Python's operators on it record further operations in its program."""

    __slots__ = ("args", "born", "code", "kind", "op")

    def __init__(self, code: "Code", op: str, kind: str, args: tuple[Any, ...] = ()) -> None:
        self.code, self.op, self.kind, self.args, self.born = code, op, kind, args, next(code.clock)

    def __bool__(self) -> bool:
        raise TypeError("a number that is only known at run time stands where none can be tested")

    __add__, __radd__ = _operators("arithmetic", "add")
    __sub__, __rsub__ = _operators("arithmetic", "sub")
    __mul__, __rmul__ = _operators("arithmetic", "mul")
    __truediv__, __rtruediv__ = _operators("quotient")
    __floordiv__ = _operators("whole", "floordiv")[0]
    __mod__ = _operators("whole", "mod")[0]
    __lt__ = _operators("compare", "lt")[0]
    __le__ = _operators("compare", "le")[0]
    __gt__ = _operators("compare", "gt")[0]
    __ge__ = _operators("compare", "ge")[0]
    __eq__ = _operators("compare", "eq")[0]
    __ne__ = _operators("compare", "ne")[0]
    __pow__, __rpow__ = _operators("power")
    __and__, __rand__ = _operators("both")
    __or__, __ror__ = _operators("either")
    __hash__ = object.__hash__  # which a class with an __eq__ of its own does not inherit

    def __neg__(self) -> Any:
        return self.code.emit("neg", self.kind, (self,))

    def __index__(self) -> int:
        raise NeedsKnown("a number that is only known at run time stands where a known one is needed")

    def __pos__(self) -> Any:
        return self

    def __abs__(self) -> Any:
        return self.code.emit("abs", self.kind, (self,)) if self.kind[0] in FLOATS else self.code.select(self < 0, -self, self)

    @property
    def real(self) -> "Value":
        """The number itself."""
        return self

    @property
    def imag(self) -> float:
        """Its imaginary part."""
        return 0.0


class If:
    """A branch; ``falls`` tells which of the blocks go on behind it, and ``yields`` are the values of the results at their ends."""

    __slots__ = ("blocks", "falls", "results", "test", "yields")

    def __init__(self, test: Value) -> None:
        self.test, self.falls = test, [True, True]
        self.blocks: tuple[list[Any], list[Any]] = ([], [])
        self.results: list[Value] = []
        self.yields: tuple[list[Value], list[Value]] = ([], [])


class Region:
    """A block that is left by its ``leaves``."""

    __slots__ = ("block", "born", "leaves", "results")

    def __init__(self, code: "Code") -> None:
        self.block: list[Any] = []
        self.leaves: list[Leave] = []
        self.results: list[Value] = []
        self.born = next(code.clock)


class Loop:
    """An endless block; ``nexts`` are the values of its parameters in the next turn, None if no turn ever ends."""

    __slots__ = ("block", "initial", "nexts", "parameters")

    def __init__(self) -> None:
        self.block: list[Any] = []
        self.parameters: list[Value] = []
        self.initial: list[Value] = []
        self.nexts: list[Value] | None = []


class Leave:
    """The end of a block that leaves a region with these ``values``; ``structure`` is what they were before they were put side by side."""

    __slots__ = ("block", "region", "structure", "values")

    def __init__(self, region: Region, structure: Any, block: list[Any]) -> None:
        self.region, self.structure, self.block = region, structure, block
        self.values: list[Value] = []


class Call:
    """A call of a function."""

    __slots__ = ("args", "function", "results")

    def __init__(self, code: "Code", function: "Function", args: tuple[Value, ...]) -> None:
        self.function, self.args = function, args
        self.results = [Value(code, "get", value.kind, (self, k)) for k, value in enumerate(function.results)]


class Function:
    """A function with parameters, a block, and results, which are values at its end."""

    __slots__ = ("block", "name", "parameters", "results")

    def __init__(self, name: str) -> None:
        self.name = name
        self.block: list[Any] = []
        self.parameters: list[Value] = []
        self.results: list[Value] = []


def kind_of(x: Any) -> str:
    """Return the kind of a value or of a number that is known while code is made."""
    if isinstance(x, Value):
        return x.kind
    return TRUTH if isinstance(x, bool) else INTEGER if isinstance(x, int) else FLOAT64


def differs(*numbers: Any) -> bool:
    """Return whether one of several numbers is a vector."""
    return any(len(kind_of(x)) > 1 for x in numbers)


def entries_of(x: Value) -> list[Value]:
    """Return the numbers of a vector, or a number alone."""
    return [x.code.emit("vget", x.kind[0], (x, k)) for k in range(int(x.kind[1:]))] if len(x.kind) > 1 else [x]


def common(*kinds: str) -> str:
    """Return the kind of the sum of numbers of these kinds: whole numbers with those of single precision give double precision."""
    if POINTER in kinds:
        return POINTER
    lengths = {kind[1:] for kind in kinds} - {""}
    if len(lengths) > 1:
        raise TypeError("vectors of different lengths meet")
    entries = [kind[0] for kind in kinds]
    widest = FLOAT64 if FLOAT32 in entries and INTEGER in entries else max(entries, key=ORDER.index)
    return widest + "".join(lengths)


def met(*numbers: Any) -> str:
    """Return the kind of an operation on numbers; known ones are of single precision where the others are."""
    kinds = [kind_of(x) for x in numbers]
    unknown = [kind for kind, x in zip(kinds, numbers, strict=True) if isinstance(x, Value)]
    return common(*(unknown if unknown and all(kind[0] == FLOAT32 for kind in unknown) else kinds))


def real(kind: str) -> str:
    """Return a kind, or that of double precision in place of that of whole numbers and truths."""
    return kind if kind[0] in FLOATS else FLOAT64 + kind[1:]


def counting(kind: str) -> str:
    """Return a kind, or that of whole numbers in place of that of truths."""
    return INTEGER + kind[1:] if kind[0] == TRUTH else kind


class Code:
    """A program that is being recorded: the block in which operations go, and those whose results are at hand there."""

    def __init__(self) -> None:
        self.clock = count()
        self.block: list[Any] = []
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
        if not isinstance(x, Value):
            return y if x else x
        if not isinstance(y, Value):
            return self.truth(x) if y else False
        return self._of_truths("and", x, y)

    def either(self, x: Any, y: Any) -> Any:
        """Return whether one of two is true; y has been computed."""
        if not isinstance(x, Value):
            return x if x else y
        if not isinstance(y, Value):
            return True if y else self.truth(x)
        return self._of_truths("or", x, y)

    def truth(self, x: Value) -> Value:
        """Return whether a number is not 0."""
        return self.as_kind(x, TRUTH + x.kind[1:])

    def _of_truths(self, op: str, x: Value, y: Value) -> Value:
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

    def function_of(self, name: str) -> Callable[..., Any]:
        """Return the function of numbers of this name, sqrt or sin say, whose arguments are numbers of one kind."""

        def called(*args: Any) -> Value:
            kind = real(common(*map(kind_of, args)))
            return self.emit(name, kind, tuple(self.as_kind(x, kind) for x in args))

        return called

    def extreme(self, op: str, args: Sequence[Any]) -> Any:
        """Return the largest or smallest of numbers, as Python does: the first of equal ones, and NaN only if it is the first."""
        args = args[0] if len(args) == 1 else args
        if not any(isinstance(x, Value) for x in args):
            return max(args) if op == "gt" else min(args)
        extreme = args[0]
        for x in args[1:]:
            kind = met(extreme, x)
            extreme, x = self.as_kind(extreme, kind), self.as_kind(x, kind)
            extreme = self.select(self.compare(op, x, extreme), x, extreme)
        return extreme


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
