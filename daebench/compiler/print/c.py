"""A recorded function as a function of C99, which C++ takes too."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from daebench.compiler.print.braces import Braces
from daebench.compiler.print.texts import ATOM, CHOICE, SIGN, Text, bound, infix, signed
from daebench.compiler.trace.ir import FLOAT32, FLOAT64, INTEGER, POINTER, TRUTH, Call, Function, If, Leave, Loop, Region, Value

TYPES = {FLOAT64: "double", FLOAT32: "float", INTEGER: "int64_t", TRUTH: "int"}
TYPES |= {f"{POINTER}{kind}": f"{name} *" for kind, name in TYPES.items()}
"""Types by the kinds of values; pointers have the kind of what they point to behind theirs."""

INFIX: Mapping[str, tuple[str, int]] = {
    "and": ("&&", 3),
    "or": ("||", 2),
    "eq": ("==", 4),
    "ne": ("!=", 4),
    "lt": ("<", 5),
    "le": ("<=", 5),
    "gt": (">", 5),
    "ge": (">=", 5),
    "add": ("+", 6),
    "sub": ("-", 6),
    "mul": ("*", 7),
    "div": ("/", 7),
    "mod": ("%", 7),
    "floordiv": ("/", 7),
}
"""Operators with their precedences."""

TESTS = ("and", "or", "eq", "ne", "lt", "le", "gt", "ge")
"""Operators whose operands compilers want in parentheses where these are such operations."""

_NAMES = "acos acosh asin asinh atan atan2 atanh cbrt cos cosh exp exp2 expm1 hypot log log10 log1p log2 pow sin sinh sqrt tan tanh"

CALLS = frozenset(_NAMES.split(" "))
"""Functions of numbers, which have these names in C."""

CONVERSIONS = {f"{of}to{to}": TYPES[to] for of in "dsib" for to in "dsib" if of != to}
"""Types that numbers are converted to, by the name of the operation."""


def function(recorded: Function, parameters: Sequence[str]) -> str:
    """Return a function with these names for its parameters; arrays are in capital letters, and constant where nothing is written to them.

    Raises
    ------
    BadInput
        If it contains an operation that C cannot compute.
    """
    body = _Printer(recorded, parameters).text()
    given = []
    for name, parameter in zip(parameters, recorded.parameters, strict=True):
        if parameter.kind == POINTER:
            changed = re.search(rf"\b{name}\[[^\]]*\]=(?!=)", body)
            given.append(f"{'' if changed else 'const '}double *{name}")
        else:
            given.append(f"{TYPES[parameter.kind]} {name}")
    unused = "".join(f"(void){name};" for name in parameters if not re.search(rf"\b{name}\b", body))
    return f"static void {recorded.name}({', '.join(given)})\n{{\n{unused}{body}}}\n"


def instance(recorded: Function) -> str:
    """Return a function that others call: its results go where its last arguments point to."""
    names = [f"in{k}" for k in range(len(recorded.parameters))]
    printer = _Printer(recorded, names)
    body = printer.text()
    results = [f"*out{k}={x};\n" for k, value in enumerate(recorded.results) for x, _ in printer.of(value)]
    given = [f"{TYPES[parameter.kind]} {name}" for parameter, name in zip(recorded.parameters, names, strict=True)]
    given += [f"{TYPES[value.kind]} *out{k}" for k, value in enumerate(recorded.results)]
    whole = "".join([body, *results])
    unused = "".join(f"(void){name};\n" for name in names if not re.search(rf"\b{name}\b", whole))
    return f"static void {recorded.name}({', '.join(given)})\n{{\n{unused}{whole}}}\n"


class _Printer(Braces):
    """Prints one function."""

    infix, same, what = INFIX, frozenset(), "C"

    def __init__(self, function: Function, parameters: Sequence[str]) -> None:
        super().__init__(function, parameters)
        self.pointed = Pointed(function)
        self.arrays: list[str] = []

    def text(self) -> str:
        """Return the statements."""
        body = super().text()
        return "".join([*self.arrays, body])

    def kind_of(self, value: Value) -> str:
        """Return the kind of a variable for a value."""
        return f"{POINTER}{self.pointed.kind(value)}" if value.kind == POINTER else value.kind[0]

    def memory(self, value: Value) -> None:
        """Write a statement on memory: arrays of known lengths belong to the call of a function."""
        if value.op == "alloc" and value.args[0].op == "const":
            name = self._name()
            self.arrays.append(f"{TYPES[self.pointed.kind(value)]} {name}[{value.args[0].args[0]}];\n")
            self.texts[value] = [(name, ATOM)]
        elif value.op == "move":
            to, of, size, kind = value.args
            count = bound(self._of(size)[0], INFIX["mul"][1])
            places = (self._whole(x)[0][0] for x in (to, of))
            self.written.append(f"memmove({','.join(places)},{count}*sizeof({TYPES[kind]}));\n")
        elif value.op not in ("mark", "release"):
            super().memory(value)

    def of(self, value: Value) -> list[Text]:
        """Return what stands for the entries of a value."""
        return self._of(value)

    def call(self, node: Call) -> None:
        """Write the call of another function."""
        given = [self._of(x)[0][0] for x in node.args]
        for value in node.results:
            name = self._name()
            self.variables.append((name, value.kind))
            self.texts[value] = [(name, ATOM)]
            given.append(f"&{name}")
        self.written.append(f"{node.function.name}({','.join(given)});\n")

    def declared(self, variables: Sequence[tuple[str, str]]) -> str:
        by_type: dict[str, list[str]] = {}
        for name, kind in variables:
            by_type.setdefault(TYPES[kind[-1]], []).append(f"{'*' * (kind[0] == POINTER)}{name}=0")
        return "".join(f"{type_} {','.join(names)};\n" for type_, names in by_type.items())

    def constant(self, name: str, kind: str, x: str) -> str:
        return f"const {TYPES[kind]} {name}={x};\n"

    def table(self, name: str, value: Value) -> str:
        entries, kind = value.args
        return f"static const {TYPES[kind]} {name}[]={{{','.join(number(x, kind) for x in entries)}}};\n"

    def number(self, value: Value) -> str:
        return number(value.args[0], value.kind[0])

    def operation(self, value: Value, x: Sequence[Text]) -> Text | None:
        op, kind = value.op, value.kind[0]
        if op in TESTS:
            return infix(INFIX[op], *((f"({text})", ATOM) if level <= 5 else (text, level) for text, level in x))
        if op == "select":
            test, then, other = (bound(each, CHOICE + 1) for each in x)
            return f"{test}?{then}:{other}", CHOICE
        if op in ("neg", "not"):
            return signed("-" if op == "neg" else "!", x[0])
        if op in CONVERSIONS:
            return f"({CONVERSIONS[op]}){bound(x[0], SIGN)}", SIGN
        if op in ("mul", "div") and x[0][0] in ("1.0", "-1.0") and op == "mul":  # exact
            return x[1] if x[0][0] == "1.0" else signed("-", x[1])
        name = {"abs": "fabs", "mod": "fmod"}.get(op, op) if op == "abs" or (op == "mod" and kind != INTEGER) else op
        if name not in CALLS and name not in ("fabs", "fmod"):
            return None
        known = [a.args[0] for a in value.args if isinstance(a, Value) and a.op == "const"]
        if len(known) == len(value.args) and kind == FLOAT64 and hasattr(math, name):
            return number(getattr(math, name)(*map(float, known)), kind), ATOM
        return f"{name}{'f' if kind == FLOAT32 else ''}({','.join(each[0] for each in x)})", ATOM

    def region(self, label: str, body: str) -> str:
        return f"{{\n{body}}}\n{label}:;\n" if f"goto {label};" in body else f"{{\n{body}}}\n"

    def left(self, label: str) -> str:
        return f"goto {label};\n"


class Pointed:
    """What pointers of a function point to: numbers of which kind."""

    def __init__(self, function: Function) -> None:
        self._same: dict[Value, Value] = {}
        self._kinds: dict[Value, str] = {}
        self._block(function.block)

    def kind(self, pointer: Value) -> str:
        """Return the kind of the numbers that a pointer points to."""
        return self._kinds.get(self._root(pointer), FLOAT64)

    def _root(self, pointer: Value) -> Value:
        while pointer in self._same:
            pointer = self._same[pointer]
        return pointer

    def _join(self, one: Value, other: Value) -> None:
        a, b = self._root(one), self._root(other)
        if a is not b:
            self._same[a] = b
            if a in self._kinds:
                self._kinds.setdefault(b, self._kinds[a])

    def _pairs(self, targets: Sequence[Value], values: Sequence[Value]) -> None:
        for target, value in zip(targets, values, strict=False):
            if target.kind == POINTER:
                self._join(target, value)

    def _block(self, block: Sequence[Any]) -> None:
        for node in block:
            if isinstance(node, Value):
                self._value(node)
            elif isinstance(node, If):
                for side, given in zip(node.blocks, node.yields, strict=True):
                    self._block(side)
                    self._pairs(node.results, given)
            elif isinstance(node, Leave):
                self._pairs(node.region.results, node.values)
            elif isinstance(node, Region | Loop):
                self._block(node.block)
                if isinstance(node, Loop):
                    self._pairs(node.parameters, node.initial)
                    self._pairs(node.parameters, node.nexts or ())

    def _value(self, node: Value) -> None:
        if node.op == "offset":
            self._join(node, node.args[0])
        elif node.op == "load":
            self._kinds.setdefault(self._root(node.args[0]), node.kind[0])
        elif node.op == "store":
            self._kinds.setdefault(self._root(node.args[0]), node.args[2].kind[0])
        elif node.op == "move":
            self._join(node.args[0], node.args[1])


def number(x: float, kind: str) -> str:
    """Return the text of a number, from which every compiler makes the same bits."""
    if kind in (INTEGER, TRUTH):
        return str(int(x))
    suffix = "f" if kind == FLOAT32 else ""
    if x != x:
        return "NAN"
    if math.isinf(x):
        return "INFINITY" if x > 0 else "-INFINITY"
    written = repr(float(x))
    return (written if len(written) <= 8 else float(x).hex()) + suffix
