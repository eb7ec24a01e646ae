"""A recorded function as a method of a JavaScript object."""

from collections.abc import Callable, Mapping, Sequence

from daebench.compiler.print import precedence
from daebench.compiler.print.braces import Braces, Variables
from daebench.compiler.print.needed import width
from daebench.compiler.print.precedence import ATOM, Text, infix, signed
from daebench.compiler.trace.ir import POINTER, TRUTH, Call, Function, Value
from daebench.compiler.trace.names import FUNCTIONS

INFIX = precedence.INFIX | {"eq": ("===", 4), "ne": ("!==", 4)}
"""Operators with their precedences."""

SIGNS = {"neg": "-", "not": "!", "btoi": "+", "btod": "+"}
SAME = frozenset(("itod", "dtoi"))
"""Conversions that change nothing: whole numbers are numbers, and only whole numbers become such."""

CALLS = {name: f"Math.{name}({{}})" for name in (*FUNCTIONS, "abs")} | {"exp2": "Math.pow(2,{})"}
"""Functions of numbers."""

NOTHING: Text = ("0", ATOM)
"""A derivative that is known to be zero."""

WITHOUT: Mapping[str, Callable[..., Text]] = {
    "mul": lambda x, y: NOTHING,
    "add": lambda x, y: y if x == NOTHING else x,
    "sub": lambda x, y: x if y == NOTHING else signed("-", y),
    "neg": lambda x: x,
    "abs": lambda x: x,
}
"""Operations on derivatives of which one is zero."""


def number(x: float) -> str:
    """Return the text of a number, with as many digits as are needed to restore it."""
    if isinstance(x, bool):
        return str(x).lower()
    if x != x:
        return "NaN"
    if x in (float("inf"), -float("inf")):
        return "Infinity" if x > 0 else "-Infinity"
    text = repr(int(x)) if float(x).is_integer() and abs(x) < 1e6 and str(float(x)) != "-0.0" else repr(x)
    return text.removeprefix("0") if text.startswith("0.") else text


def method(function: Function, parameters: Sequence[str]) -> str:
    """Return a function as a method of an object, with these names for its parameters."""
    return f"{function.name}({','.join(parameters)}){{{_Printer(function, parameters).text()}}}"


def function(recorded: Function, parameters: Sequence[str]) -> str:
    """Return a function with these names for its parameters; arrays are Float64Arrays. Those that it calls are :func:`instance`."""
    return f"function {recorded.name}({', '.join(parameters)}){{{_OfModule(recorded, parameters).text()}}}"


def instance(recorded: Function) -> str:
    """Return a function that others call: its results are in an array with its name and ``_out``."""
    names = [f"in{k}" for k in range(len(recorded.parameters))]
    printer = _OfModule(recorded, names)
    body = printer.text()
    results = "".join(f"{recorded.name}_out[{k}]={printer.of(value)};" for k, value in enumerate(recorded.results))
    out = f"const {recorded.name}_out=new Float64Array({len(recorded.results)});"
    return f"{out}function {recorded.name}({', '.join(names)}){{{body}{results}}}"


class _Printer(Braces):
    """Prints one function."""

    infix, same, signs, one, what = INFIX, SAME, SIGNS, "1", "a page"

    def declared(self, variables: Variables) -> str:
        return f"let {','.join(name for name, _ in variables)};" if variables else ""

    def constant(self, name: str, kind: str, x: str) -> str:
        return f"const {name}={x};"

    def table(self, name: str, value: Value) -> str:
        return f"const {name}=[{','.join(number(x) for x in value.args[0])}];"

    def number(self, value: Value) -> str:
        x = value.args[0]
        return number(bool(x) if value.kind[0] == TRUTH else x)

    def operation(self, value: Value, x: Sequence[Text]) -> Text | None:
        op = value.op
        if op == "length":
            return f"{x[0][0]}.length", ATOM
        if width(value) > 1 and NOTHING in x and op in WITHOUT:
            return WITHOUT[op](*x)
        return (CALLS[op].format(",".join(operand[0] for operand in x)), ATOM) if op in CALLS else None

    def region(self, label: str, body: str) -> str:
        return f"{label}:{{{body}}}"

    def left(self, label: str) -> str:
        return f"break {label};"


class _OfModule(_Printer):
    """Prints one function of a module, which may have arrays of its own and call others."""

    what = "JavaScript"

    def table(self, name: str, value: Value) -> str:
        return f"const {name}=new Float64Array([{','.join(number(x) for x in value.args[0])}]);"

    def _whole(self, value: Value) -> list[Text]:
        base, *offsets = self._of(value)
        if value.kind != POINTER or not offsets:
            return [base, *offsets]
        return [(f"{base[0]}.subarray({infix(INFIX['add'], *offsets)[0]})", ATOM)]

    def memory(self, value: Value) -> None:
        if value.op == "alloc":
            self.written.append(f"{self._new(value)}=new Float64Array({self.of(value.args[0])});")
        elif value.op == "move":
            to, of, size = map(self.of, value.args[:3])
            self.written.append(f"{to}.set({of}.subarray(0,{size}));")
        elif value.op not in ("mark", "release"):
            super().memory(value)

    def _call(self, node: Call) -> None:
        self.written.append(f"{node.function.name}({','.join(map(self.of, node.args))});")
        for k, value in enumerate(node.results):
            self.written.append(f"{self._new(value)}={node.function.name}_out[{k}];")
