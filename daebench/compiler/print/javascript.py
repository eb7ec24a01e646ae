"""A recorded function as a method of a JavaScript object: one variable a value, unless it is read once, where it is made."""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from daebench.compiler.print.javascript_operations import (
    ATOM,
    CALLS,
    CHOICE,
    INFIX,
    NOTHING,
    SAME,
    SIGN,
    SIGNS,
    WITHOUT,
    Text,
    bound,
    infix,
    number,
    signed,
)
from daebench.compiler.print.needed import EFFECTS, Needed
from daebench.compiler.print.uses import Use, Uses, width
from daebench.compiler.trace.ir import TRUTH, Function, If, Leave, Loop, Region, Value
from daebench.errors import BadInput

LETTERS = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"


def method(function: Function, parameters: Sequence[str]) -> str:
    """Return a function as a method of an object, with these names for its parameters.

    Raises
    ------
    BadInput
        If it contains an operation that a page cannot compute.
    """
    return f"{function.name}({','.join(parameters)}){{{_Printer(function, parameters).text()}}}"


class _Printer:
    """Prints one function, which changes arrays and returns nothing."""

    def __init__(self, function: Function, parameters: Sequence[str]) -> None:
        self.function, self.need = function, Needed(function, set())
        self.texts: dict[Value, list[Text]] = {p: [(name, ATOM)] for p, name in zip(function.parameters, parameters, strict=True)}
        self.uses = Uses(function, self.need)
        self.written: list[str] = []
        self.variables: list[str] = []
        self.labels: dict[Region, str] = {}
        self.tables: list[str] = []
        self.count = 0

    def text(self) -> str:
        """Return the statements."""
        self._block(self.function.block)
        head = f"let {','.join(self.variables)};" if self.variables else ""
        return "".join([*self.tables, head, *self.written])

    def _name(self) -> str:
        """Return a new name: a letter and a digit, and so on. No keyword of the language is of this form."""
        k, self.count = self.count, self.count + 1
        name, k = LETTERS[k % 52] + str(k // 52 % 10), k // 520
        while k:
            name, k = name + LETTERS[k % 52], k // 52
        return name

    # ---- expressions -----------------------------------------------------------------------------------------------------

    def _of(self, value: Value) -> list[Text]:
        """Return what stands for the entries of a value."""
        value = self.uses.same(value)
        if value.op == "const":
            return [_constant(value)] * width(value)
        if value.op == "table" and value not in self.texts:
            name = self._name()
            self.tables.append(f"const {name}=[{','.join(number(x) for x in value.args[0])}];")
            self.texts[value] = [(name, ATOM)]
        return self.texts[value]

    def _entries(self, value: Value) -> list[Text]:
        """Return the expressions for the entries of the result of an operation."""
        args, length = value.args, width(value)
        if value.op == "vset":
            return [self._of(x)[0] for x in args]
        if value.op == "vget":
            return [self._of(args[0])[args[1]]]
        if value.op == "any":
            return [infix("or", *self._of(args[0]))]
        if value.op in ("splat", *SAME):
            return [self._of(args[0])[0]] * length
        if value.op == "load":
            return [(f"{self._place(args[0], args[1])}", ATOM)]
        if value.op == "length":
            return [(f"{self._of(args[0])[0][0]}.length", ATOM)]
        given = [self._of(x) for x in args]
        columns = zip(*(x * length if len(x) < length else x for x in given), strict=True)
        return [self._operation(value, column) for column in columns]

    def _operation(self, value: Value, x: Sequence[Text]) -> Text:
        op = value.op
        if op == "mul" and x[0][0] in ("1", "-1"):  # exact
            return x[1] if x[0][0] == "1" else signed("-", x[1])
        if width(value) > 1 and NOTHING in x and op in WITHOUT:
            return WITHOUT[op](*x)
        if op in INFIX:
            return infix(op, *x)
        if op in SIGNS:
            return signed(SIGNS[op], x[0])
        if op == "select":
            test, then, other = (bound(each, CHOICE + 1) for each in x)
            return f"{test}?{then}:{other}", CHOICE
        if op in CALLS:
            return CALLS[op].format(",".join(each[0] for each in x)), ATOM
        raise BadInput(f"a page cannot compute {op} of these numbers; choose another problem or method for it.")

    def _place(self, pointer: Value, index: Value) -> str:
        """Return an entry of an array."""
        base, *offsets = self._of(pointer)
        parts = [x for x in (*offsets, *self._of(index)) if x[0] != "0"]
        return f"{base[0]}[{infix('add', *parts)[0] if parts else '0'}]"

    # ---- statements ------------------------------------------------------------------------------------------------------

    def _block(self, block: Sequence[Any]) -> None:
        for node in block:
            if type(node) is not Value:
                _NODES[type(node)](self, node)
            elif node in self.need.needed:
                self._value(node)

    def _value(self, value: Value) -> None:
        if value.op == "store":
            pointer, index, what = value.args
            (stored,) = self._of(what)
            self.written.append(f"{self._place(pointer, index)}={stored[0]};")
            return
        if value.op == "offset":
            self.texts[value] = [*self._of(value.args[0]), *self._of(value.args[1])]
            return
        if value.op in (*EFFECTS, "alloc", "mark", "ccall"):
            raise BadInput("a page cannot compute with arrays; choose a smaller problem.")
        entries, use = self._entries(value), self.uses[value]
        if value.op == "load" or not use.once:
            entries = [self._kept(entry, use) for entry in entries]
        self.texts[value] = entries

    def _kept(self, entry: Text, use: Use) -> Text:
        """Return the variable that an expression is given to, or a name or a constant itself."""
        if re.fullmatch(r"\w+", entry[0]):
            return entry
        name = self._name()
        if use.outside:
            self.variables.append(name)
        self.written.append(f"{'' if use.outside else 'const '}{name}={entry[0]};")
        return name, ATOM

    def _variable(self, values: Sequence[Value]) -> None:
        """Declare results or parameters where they are made, so that the engine need not carry them through loops around."""
        here: list[str] = []
        for value in values:
            if self.uses.changes(value):
                names = [self._name() for _ in range(width(value))]
                (self.variables if self.uses[value].outside else here).extend(names)
                self.texts[value] = [(name, ATOM) for name in names]
        self.written += [f"let {','.join(here)};"] if here else []

    def _assigned(self, targets: Sequence[Value], values: Sequence[Value]) -> list[Text]:
        """Return variables, each with what it is given."""
        pairs = [(t, v) for t, v in zip(targets, values, strict=True) if self.uses.changes(t)]
        given = [(name[0], x[0]) for t, v in pairs for name, x in zip(self._of(t), self._of(v), strict=True)]
        return [(name, x) for name, x in given if name != x]  # type: ignore[misc]

    def _give(self, targets: Sequence[Value], values: Sequence[Value]) -> None:
        self.written += [f"{name}={x};" for name, x in self._assigned(targets, values)]

    def _if(self, node: If) -> None:
        wanted = any(map(self.uses.changes, node.results))
        if not wanted and node not in self.need.steering:
            return
        self._variable(node.results)
        outer, (test,), sides = self.written, self._of(node.test), []
        for k, block in enumerate(node.blocks):
            self.written = []
            self._block(block)
            if node.falls[k] and node.yields[k]:
                self._give(node.results, node.yields[k])
            sides.append("".join(self.written))
        self.written = outer
        then, other = sides
        if then:
            self.written.append(f"if({test[0]}){{{then}}}" + (f"else{{{other}}}" if other else ""))
        elif other:
            self.written.append(f"if(!{bound(test, ATOM)}){{{other}}}")

    def _region(self, node: Region) -> None:
        self._variable(node.results)
        label = self.labels[node] = self._name()
        self.written.append(f"{label}:{{")
        self._block(node.block)
        self.written.append("}")

    def _leave(self, node: Leave) -> None:
        self._give(node.region.results, node.values)
        self.written.append(f"break {self.labels[node.region]};")

    def _loop(self, node: Loop) -> None:
        first = [self._of(x) for p, x in zip(node.parameters, node.initial, strict=True) if self.uses.changes(p)]
        self._variable(node.parameters)
        names = [self._of(p) for p in node.parameters if self.uses.changes(p)]
        pairs = [pair for both in zip(names, first, strict=True) for pair in zip(*both, strict=True)]
        self.written += [f"{name[0]}={x[0]};" for name, x in pairs]
        self.written.append("for(;;){")
        self._block(node.block)
        if node.nexts is not None:
            self._next(self._assigned(node.parameters, node.nexts))
        self.written.append("}")

    def _next(self, pairs: Sequence[tuple[str, Any]]) -> None:
        """Give parameters their values in the next turn: those that later ones are computed from wait until these are."""
        last: list[str] = []
        for k, (name, x) in enumerate(pairs):
            if any(name in re.findall(r"\w+", other) for _, other in pairs[k + 1 :]):
                kept = self._name()
                self.written.append(f"const {kept}={x};")
                last.append(f"{name}={kept};")
        waiting = {text.partition("=")[0] for text in last}
        self.written += [f"{name}={x};" for name, x in pairs if name not in waiting] + last


_NODES: Mapping[type, Callable[[_Printer, Any], None]] = {
    If: _Printer._if,
    Region: _Printer._region,
    Loop: _Printer._loop,
    Leave: _Printer._leave,
}


def _constant(value: Value) -> Text:
    x = value.args[0]
    written = number(bool(x) if value.kind[0] == TRUTH else x)
    return written, SIGN if written.startswith("-") else ATOM
