"""A recorded function as statements of a language with braces: one variable a value, unless it is read once, where it is made.

C and JavaScript differ in how variables are declared, in what leaves a block, and in the texts of numbers and operations.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

from daebench.compiler.print.needed import EFFECTS, Needed, Use, Uses, Walker, width
from daebench.compiler.print.precedence import ATOM, CHOICE, SIGN, Text, bound, infix, signed
from daebench.compiler.trace.ir import POINTER, Call, Function, If, Leave, Loop, Region, Value, Values
from daebench.errors import BadInput

Variables = list[tuple[str, str]]
"""Variables, each by its name and its kind."""

LETTERS = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"


class Braces(Walker, ABC):
    """Prints one function, which changes arrays and returns nothing."""

    infix: Mapping[str, tuple[str, int]]
    """Operators with their precedences."""

    same: frozenset[str]
    """Conversions that change nothing."""

    signs: Mapping[str, str]
    """Operations that are a sign before an expression."""

    one: str
    """The number 1."""

    what: str
    """Who computes, in words."""

    def __init__(self, function: Function, parameters: Sequence[str]) -> None:
        self.function, self.need = function, Needed(function, set())
        self.texts: dict[Value, list[Text]] = {p: [(name, ATOM)] for p, name in zip(function.parameters, parameters, strict=True)}
        self.uses = Uses(function, self.need)
        self.written: list[str] = []
        self.variables: Variables = []
        self.labels: dict[Region, str] = {}
        self.tables: list[str] = []
        self.count = 0

    def text(self) -> str:
        """Return the statements."""
        self._block(self.function.block)
        return "".join([*self.tables, self.declared(self.variables), *self.written])

    @abstractmethod
    def declared(self, variables: Variables) -> str:
        """Return the declaration of variables, given by name and kind, that get their values later."""

    @abstractmethod
    def constant(self, name: str, kind: str, x: str) -> str:
        """Return the declaration of a variable that keeps its value."""

    @abstractmethod
    def table(self, name: str, value: Value) -> str:
        """Return the declaration of a table of constants."""

    @abstractmethod
    def number(self, value: Value) -> str:
        """Return a known number."""

    @abstractmethod
    def operation(self, value: Value, x: Sequence[Text]) -> Text | None:
        """Return an operation on numbers that the language writes in its own way; None for another."""

    @abstractmethod
    def region(self, label: str, body: str) -> str:
        """Return a block that is left by its label."""

    @abstractmethod
    def left(self, label: str) -> str:
        """Return the statement that leaves a block."""

    def kind_of(self, value: Value) -> str:
        """Return the kind of a variable for a value, or for its entries."""
        return value.kind[0]

    def memory(self, value: Value) -> None:
        """Write a statement that takes memory for an array, gives it back, or moves its entries."""
        raise BadInput(f"{self.what} cannot compute with arrays; choose a smaller problem.", "no-arrays-in-output")

    def _name(self) -> str:
        """Return a new name: a letter and a digit, and so on. No keyword of a language is of this form."""
        k, self.count = self.count, self.count + 1
        name, k = LETTERS[k % 52] + str(k // 52 % 10), k // 520
        while k:
            name, k = name + LETTERS[k % 52], k // 52
        return name

    def _new(self, value: Value) -> str:
        """Return a variable for a value, which is declared at the beginning."""
        name = self._name()
        self.variables.append((name, value.kind))
        self.texts[value] = [(name, ATOM)]
        return name

    def of(self, value: Value) -> str:
        """Return the text of a number, or of a pointer."""
        return self._whole(value)[0][0]

    # ---- expressions -----------------------------------------------------------------------------------------------------

    def _of(self, value: Value) -> list[Text]:
        """Return the texts of the entries of a value; a table gets its name when it is first read."""
        value = self.uses.same(value)
        if value.op == "const":
            written = self.number(value)
            return [(written, SIGN if written.startswith("-") else ATOM)] * width(value)
        if value.op == "table" and value not in self.texts:
            name = self._name()
            self.tables.append(self.table(name, value))
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
            return [infix(self.infix["or"], *self._of(args[0]))]
        if value.op in ("splat", *self.same):
            return [self._of(args[0])[0]] * length
        if value.op == "load":
            return [(f"{self._place(args[0], args[1])}", ATOM)]
        given = [self._of(x) for x in args]
        columns = zip(*(x * length if len(x) < length else x for x in given), strict=True)
        return [self._operation(value, column) for column in columns]

    def _operation(self, value: Value, x: Sequence[Text]) -> Text:
        op = value.op
        if op == "mul" and x[0][0] in (self.one, f"-{self.one}"):  # exact
            return x[1] if x[0][0] == self.one else signed("-", x[1])
        if (text := self.operation(value, x)) is not None:
            return text
        if op == "select":
            test, then, other = (bound(operand, CHOICE + 1) for operand in x)
            return f"{test}?{then}:{other}", CHOICE
        if op in self.signs:
            return signed(self.signs[op], x[0])
        if op in self.infix:
            return infix(self.infix[op], *x)
        raise BadInput(
            f"{self.what} cannot compute {op} of these numbers; choose another problem or method for it.", "no-operation-in-output"
        )

    def _whole(self, value: Value) -> list[Text]:
        """Return the texts of the entries of a value, or one expression for a pointer."""
        base, *offsets = self._of(value)
        return [infix(self.infix["add"], base, *offsets)] if value.kind == POINTER and offsets else [base, *offsets]

    def _place(self, pointer: Value, index: Value) -> str:
        """Return an entry of an array."""
        base, *offsets = self._of(pointer)
        parts = [x for x in (*offsets, *self._of(index)) if x[0] != "0"]
        return f"{base[0]}[{infix(self.infix['add'], *parts)[0] if parts else '0'}]"

    # ---- statements ------------------------------------------------------------------------------------------------------

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
            self.memory(value)
            return
        entries, use = self._entries(value), self.uses[value]
        if value.op == "load" or not use.once:
            entries = [self._kept(entry, value.kind[0], use) for entry in entries]
        self.texts[value] = entries

    def _kept(self, entry: Text, kind: str, use: Use) -> Text:
        """Return the variable that an expression is given to, or a name or a constant itself."""
        if re.fullmatch(r"\w+", entry[0]):
            return entry
        name = self._name()
        if use.outside:
            self.variables.append((name, kind))
        self.written.append(f"{name}={entry[0]};" if use.outside else self.constant(name, kind, entry[0]))
        return name, ATOM

    def _variable(self, values: Values) -> None:
        """Declare results or parameters where they are made, so that an engine need not carry them through loops around."""
        here: Variables = []
        for value in values:
            if self.uses.changes(value):
                names = [(self._name(), self.kind_of(value)) for _ in range(width(value))]
                (self.variables if self.uses[value].outside else here).extend(names)
                self.texts[value] = [(name, ATOM) for name, _ in names]
        self.written += [self.declared(here)] if here else []

    def _assigned(self, targets: Values, values: Values) -> list[Text]:
        """Return variables, each with what it is given."""
        pairs = [(t, self._whole(v)) for t, v in zip(targets, values, strict=True) if self.uses.changes(t)]
        given = [(name[0], x[0]) for t, v in pairs for name, x in zip(self._of(t), v, strict=True)]
        return [(name, x) for name, x in given if name != x]  # type: ignore[misc]

    def _give(self, targets: Values, values: Values) -> None:
        self.written += [f"{name}={x};" for name, x in self._assigned(targets, values)]

    def _if(self, node: If) -> None:
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
        self.labels[node] = label = self._name()
        outer, self.written = self.written, []
        self._block(node.block)
        self.written = [*outer, self.region(label, "".join(self.written))]

    def _leave(self, node: Leave) -> None:
        self._give(node.region.results, node.values)
        self.written.append(self.left(self.labels[node.region]))

    def _loop(self, node: Loop) -> None:
        first = [self._whole(x) for p, x in zip(node.parameters, node.initial, strict=True) if self.uses.changes(p)]
        self._variable(node.parameters)
        names = [self._of(p) for p in node.parameters if self.uses.changes(p)]
        pairs = [pair for both in zip(names, first, strict=True) for pair in zip(*both, strict=True)]
        self.written += [f"{name[0]}={x[0]};" for name, x in pairs]
        self.written.append("for(;;){")
        self._block(node.block)
        if node.nexts is not None:
            self._next(node.parameters, self._assigned(node.parameters, node.nexts))
        self.written.append("}")

    def _call(self, node: Call) -> None:
        """Write the call of another function."""
        raise BadInput(f"{self.what} cannot call {node.function.name}; choose a smaller problem.", "no-function-in-output")

    def _next(self, parameters: Values, pairs: Sequence[tuple[str, Any]]) -> None:
        """Give parameters their values in the next turn: those that later ones are computed from wait until these are."""
        last: list[str] = []
        kinds = {name[0]: self.kind_of(p) for p in parameters if p in self.texts for name in self._of(p)}
        for k, (name, x) in enumerate(pairs):
            if any(name in re.findall(r"\w+", other) for _, other in pairs[k + 1 :]):
                temporary = self._name()
                self.written.append(self.constant(temporary, kinds[name], x))
                last.append(f"{name}={temporary};")
        waiting = {text.partition("=")[0] for text in last}
        self.written += [f"{name}={x};" for name, x in pairs if name not in waiting] + last
