"""A recorded function as a function of C99, which C++ takes too."""

import math
import re
from collections.abc import Mapping, Sequence
from ctypes import c_float
from types import MappingProxyType

from daebench.compiler.print.braces import Braces, Variables
from daebench.compiler.print.precedence import ATOM, INFIX, SIGN, Text, bound, infix
from daebench.compiler.trace.ir import FLOAT32, FLOAT64, INTEGER, POINTER, TRUTH, Call, Function, Value
from daebench.compiler.trace.names import FUNCTIONS

TYPES = {FLOAT64: "double", FLOAT32: "float", INTEGER: "int64_t", TRUTH: "int"}
TYPES |= {f"{POINTER}{kind}": f"{name} *" for kind, name in TYPES.items()}
"""Types by the kinds of values; pointers have the kind of what they point to behind theirs."""

TESTS = ("and", "or", "eq", "ne", "lt", "le", "gt", "ge")
"""Operators whose operands compilers want in parentheses where these are such operations."""

CALLS = {name: name for name in FUNCTIONS} | {"abs": "fabs", "mod": "fmod"}
"""Functions of numbers with a point, with their names in C."""

CONVERSIONS = {f"{of}to{to}": TYPES[to] for of in "dsib" for to in "dsib" if of != to}
"""Types that numbers are converted to, by the name of the operation."""


def function(recorded: Function, parameters: Sequence[str], real: str = FLOAT64) -> str:
    """Return a function with these names for its parameters; arrays are in capital letters, and constant where nothing is written to them.

    Those that it is given have numbers of the kind ``real``.
    """
    body = _Printer(recorded, parameters, real).text()
    given = ", ".join(_given(recorded, parameters, body, real))
    return f"static void {recorded.name}({given}){{{_unread(parameters, body)}{body}}}"


def instance(recorded: Function, real: str = FLOAT64) -> str:
    """Return a function that others call: its results go where its last arguments point to."""
    names = [f"in{k}" for k in range(len(recorded.parameters))]
    printer = _Printer(recorded, names, real)
    body = printer.text()
    results = [f"*out{k}={printer.of(value)};" for k, value in enumerate(recorded.results)]
    given = _given(recorded, names, body, real) + [f"{TYPES[value.kind]} *out{k}" for k, value in enumerate(recorded.results)]
    whole = "".join([body, *results])
    return f"static void {recorded.name}({', '.join(given)}){{{_unread(names, whole)}{whole}}}"


def _unread(names: Sequence[str], body: str) -> str:
    """Return statements on parameters that are not read, of which compilers would warn."""
    return "".join(f"(void){name};" for name in names if not re.search(rf"\b{name}\b", body))


def _given(recorded: Function, names: Sequence[str], body: str, real: str) -> list[str]:
    """Return the declarations of the parameters; what pointers point to is constant where nothing is written to it."""
    given = []
    for name, parameter in zip(names, recorded.parameters, strict=True):
        changed = re.search(rf"\b{name}\[[^\]]*\]=(?!=)", body)
        kind = f"{'' if changed else 'const '}{TYPES[real]} *" if parameter.kind == POINTER else f"{TYPES[parameter.kind]} "
        given.append(f"{kind}{name}")
    return given


class _Printer(Braces):
    """Prints one function."""

    infix, same, one, what = INFIX | {"floordiv": ("/", 7)}, frozenset(), "1.0", "C"
    signs: Mapping[str, str] = MappingProxyType({"neg": "-", "not": "!"})

    def __init__(self, function: Function, parameters: Sequence[str], real: str) -> None:
        super().__init__(function, parameters)
        self.real = real
        self.arrays: dict[str, str] = {}

    def text(self) -> str:
        """Return the statements."""
        body = super().text()
        unread = [name for name in self.arrays if not re.search(rf"\b{name}\b(?!\[[^\]]*\]=(?!=))", body)]
        return "".join([*self.arrays.values(), *(f"(void){name};" for name in unread), body])

    def kind_of(self, value: Value) -> str:
        """Return the kind of a variable for a value."""
        return f"{POINTER}{self._pointed(value)}" if value.kind == POINTER else value.kind[0]

    def _pointed(self, pointer: Value) -> str:
        """Return the kind of the numbers that a pointer points to; parameters of functions point to those of a state."""
        while pointer in self.need.sources:
            pointer = self.need.sources[pointer][0]
        places = {"alloc": 1, "table": 1, "offset": 2}
        return pointer.args[places[pointer.op]] if pointer.op in places else self.real

    def memory(self, value: Value) -> None:
        """Write a statement on memory: arrays of known lengths belong to the call of a function."""
        if value.op == "alloc" and value.args[0].op == "const":
            name = self._name()
            self.arrays[name] = f"{TYPES[self._pointed(value)]} {name}[{value.args[0].args[0]}];"
            self.texts[value] = [(name, ATOM)]
        elif value.op == "move":
            to, of, size, kind = value.args
            count = bound(self._of(size)[0], INFIX["mul"][1])
            self.written.append(f"memmove({self.of(to)},{self.of(of)},{count}*sizeof({TYPES[kind]}));")
        elif value.op not in ("mark", "release"):
            super().memory(value)

    def _call(self, node: Call) -> None:
        """Write the call of another function."""
        given = [*map(self.of, node.args), *(f"&{self._new(value)}" for value in node.results)]
        self.written.append(f"{node.function.name}({','.join(given)});")

    def declared(self, variables: Variables) -> str:
        by_type: dict[str, list[str]] = {}
        for name, kind in variables:
            by_type.setdefault(TYPES[kind[-1]], []).append(f"{'*' * (kind[0] == POINTER)}{name}=0")
        return "".join(f"{type_} {','.join(names)};" for type_, names in by_type.items())

    def constant(self, name: str, kind: str, x: str) -> str:
        return f"const {TYPES[kind]} {name}={x};"

    def table(self, name: str, value: Value) -> str:
        entries, kind = value.args
        return f"static const {TYPES[kind]} {name}[]={{{','.join(number(x, kind) for x in entries)}}};"

    def number(self, value: Value) -> str:
        return number(value.args[0], value.kind[0])

    def operation(self, value: Value, x: Sequence[Text]) -> Text | None:
        op, kind = value.op, value.kind[0]
        if op in TESTS:
            return infix(INFIX[op], *((f"({text})", ATOM) if level <= 5 else (text, level) for text, level in x))
        if op in CONVERSIONS:
            return f"({CONVERSIONS[op]}){bound(x[0], SIGN)}", SIGN
        if op not in CALLS or kind == INTEGER:
            return None
        name, known = CALLS[op], [rounded(a.args[0], kind) for a in value.args if a.op == "const"]
        if len(known) == len(x) and hasattr(math, name):  # compilers compute it otherwise than the platform does
            return number(getattr(math, name)(*known), kind), ATOM
        return f"{name}{'f' * (kind == FLOAT32)}({','.join(operand[0] for operand in x)})", ATOM

    def region(self, label: str, body: str) -> str:
        return f"{{{body}}}{label}:;" if f"goto {label};" in body else f"{{{body}}}"

    def left(self, label: str) -> str:
        return f"goto {label};"


def number(x: float, kind: str) -> str:
    """Return the text of a number, from which every compiler makes the same bits."""
    if kind in (INTEGER, TRUTH):
        return str(int(x))
    suffix = "f" if kind == FLOAT32 else ""
    if x != x:
        return f"({TYPES[kind]})NAN"
    if math.isinf(x):
        return ("" if x > 0 else "-") + ("INFINITY" if kind == FLOAT32 else "HUGE_VAL")  # INFINITY is a float
    written = repr(float(x))
    return (written if len(written) <= 8 else rounded(x, kind).hex()) + suffix


def rounded(x: float, kind: str) -> float:
    """Return a number as one of this kind has it."""
    return c_float(x).value if kind == FLOAT32 else float(x)
