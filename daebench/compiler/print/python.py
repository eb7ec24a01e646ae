"""A recorded program as functions of Python, for numbers of NumPy: what runs where there is no machine code.

A pointer is an array of one axis, which begins where it points to. A block that is left is a loop of one turn; ``out`` is the depth of the
loop that is being left, where others are between.
"""

import re
from collections.abc import Callable, Sequence
from typing import Any

from daebench.compiler.print.needed import EFFECTS, Needed, Uses, Walker
from daebench.compiler.trace.complex import COMPLEX
from daebench.compiler.trace.ir import FLOAT32, FLOAT64, INTEGER, POINTER, TRUTH, Call, Function, If, Leave, Loop, Region, Value, Values
from daebench.compiler.trace.names import FUNCTIONS

INFIX = {"and": "and", "or": "or", "eq": "==", "ne": "!=", "lt": "<", "le": "<=", "gt": ">", "ge": ">=", "add": "+", "sub": "-"}
INFIX |= {"mul": "*", "div": "/", "floordiv": "//"}
"""Operators."""

CONVERSIONS = {FLOAT64: "float64", FLOAT32: "float32", INTEGER: "whole"}
"""Functions that convert numbers, by the kind of the result."""

FORMATS = {"neg": "-{0}", "not": "not {0}", "select": "{1} if {0} else {2}"}
"""Other operations with a form of their own."""

NOTHING = frozenset(("mark", "release", "seen"))
MEMORY = frozenset(("store", "offset", "alloc", "move"))
"""Operations on memory that Python does without, and others."""

LONGEST = 120
"""Letters of the longest expression that stands within another: Python takes no more than 200 nested parentheses."""


class Unprintable(Exception):
    """An operation that only machine code has."""


def text(functions: Sequence[Function]) -> str:
    """Return the text of these functions, each of which calls only those before it.

    Their names are those of :mod:`daebench.compiler.in_python`; a function returns a tuple of its results.
    """
    effective: set[Function] = set()
    constants: dict[str, str] = {}
    texts = []
    for function in functions:
        need = Needed(function, effective)
        if need.changes:
            effective.add(function)
        texts.append(_Printer(function, need, constants).text())
    return "\n".join([*(f"{name} = {x}" for name, x in constants.items()), *texts])


class _Turn:
    """A loop of the text, and the region that leaving it leaves."""

    def __init__(self, region: Region | None) -> None:
        self.region = region
        self.crossed, self.reached = False, False


class _Printer(Walker):
    """Prints one function; ``constants`` are those of all, and the functions of the platform."""

    def __init__(self, function: Function, need: Needed, constants: dict[str, str]) -> None:
        self.function, self.need, self.constants = function, need, constants
        self.uses = Uses(function, need)
        self.parameters = [f"a{k}" for k in range(len(function.parameters))]
        self.texts: dict[Value, Any] = dict(zip(function.parameters, self.parameters, strict=True))
        self.lines: list[str] = []
        self.turns: list[_Turn] = []
        self.count, self.depth = 0, 1

    def text(self) -> str:
        """Return the function."""
        self._block(self.function.block)
        results = "".join(f"{self._of(value)}, " for value in self.function.results)
        head = f"def {self.function.name}({', '.join(self.parameters)}):"
        return "\n".join([head, "    out = 0", *self.lines, f"    return ({results})", ""])

    # ---- names -----------------------------------------------------------------------------------------------------------

    def _write(self, line: str) -> None:
        self.lines.append("    " * self.depth + line)

    def _name(self) -> str:
        self.count += 1
        return f"v{self.count}"

    def _constant(self, x: Any, kind: str) -> str:
        """Return the text of a known number; those with a point have NumPy's type, which divides by zero."""
        if kind == POINTER:
            return "None"
        if kind in (INTEGER, TRUTH):
            return f"({int(x)})" if kind == INTEGER else str(bool(x))
        name = f"{kind}_" + re.sub(r"\W", "_", repr(x).replace("-", "m"))
        self.constants[name] = f"{CONVERSIONS[kind]}({x!r})"
        return name

    def _of(self, value: Value) -> str:
        """Return the text of a value."""
        value = self.uses.same(value)
        if value.op == "const":
            return self._constant(value.args[0], value.kind)
        if value.op == "table":
            return self._table(value)
        text = self.texts[value]
        return text if isinstance(text, str) else f"{text[0]}[{' + '.join(text[1:])}:]"

    def _table(self, value: Value) -> str:
        if value not in self.texts:
            entries, kind = value.args
            self.texts[value] = name = f"table_{len(self.constants)}"
            self.constants[name] = f"array({list(entries)}, TYPES[{kind!r}])"
        return str(self.texts[value])

    def _parts(self, pointer: Value) -> list[str]:
        """Return the array of a pointer, and what is added to the index of its first entry."""
        pointer = self.uses.same(pointer)
        text = self.texts.get(pointer)
        return list(text) if isinstance(text, list) else [self._of(pointer)]

    def _place(self, pointer: Value, index: Value) -> str:
        base, *offsets = self._parts(pointer)
        return f"{base}[{' + '.join([*offsets, self._of(index)])}]"

    # ---- values ----------------------------------------------------------------------------------------------------------

    def _value(self, value: Value) -> None:
        if value.op in MEMORY:
            getattr(self, f"_{value.op}")(value)
        elif value.op not in NOTHING:
            self._number(value)

    def _number(self, value: Value) -> None:
        text = self._operation(value)
        if value.op != "load" and self.uses[value].once and len(text) < LONGEST:
            self.texts[value] = f"({text})"
        else:
            self.texts[value] = self._name()
            self._write(f"{self.texts[value]} = {text}")

    def _operation(self, value: Value) -> str:
        op, kind, args = value.op, value.kind, value.args
        if op == "load":
            return self._place(*args)
        if len(kind) > 1 or op in ("vget", "any") or op in EFFECTS:
            raise Unprintable(op)
        x = [self._of(part) for part in args]
        if op in INFIX:
            return f"{x[0]} {INFIX[op]} {x[1]}"
        if op in FORMATS:
            return FORMATS[op].format(*x)
        if op == "mod" and kind == INTEGER:
            return f"{x[0]} % {x[1]}"
        if op[1:3] == "to" and op[3:] in CONVERSIONS:
            return f"{CONVERSIONS[kind]}({x[0]})"
        return f"{self._function(op, kind)}({', '.join(x)})"

    def _function(self, op: str, kind: str) -> str:
        """Return the name of a function of numbers."""
        op = "fmod" if op == "mod" else op
        if op == "abs":
            return op
        if op not in FUNCTIONS and op != "fmod":
            raise Unprintable(op)
        name = f"{op}_{kind}"
        self.constants[name] = f"platform({op!r}, {kind!r})"
        return name

    def _numbers(self, count: Value, kind: str) -> str:
        """Return how many numbers so many entries of a kind are."""
        return f"2 * {self._of(count)}" if kind == COMPLEX else self._of(count)

    def _store(self, value: Value) -> None:
        self._write(f"{self._place(value.args[0], value.args[1])} = {self._of(value.args[2])}")

    def _offset(self, value: Value) -> None:
        pointer, index, kind = value.args
        self.texts[value] = [*self._parts(pointer), self._numbers(index, kind)]

    def _alloc(self, value: Value) -> None:
        self.texts[value] = self._name()
        self._write(f"{self.texts[value]} = empty({self._of(value.args[0])}, TYPES[{value.args[1]!r}])")

    def _move(self, value: Value) -> None:
        to, of = map(self._of, value.args[:2])
        size = self._numbers(*value.args[2:])
        self._write(f"{to}[:{size}] = {of}[:{size}]")

    def _call(self, node: Call) -> None:
        names = [self._name() for _ in node.results]
        self.texts |= dict(zip(node.results, names, strict=True))
        call = f"{node.function.name}({', '.join(map(self._of, node.args))})"
        self._write(f"{', '.join(names)}, = {call}" if names else call)

    # ---- control flow ----------------------------------------------------------------------------------------------------

    def _variables(self, values: Values) -> None:
        self.texts |= {value: self._name() for value in values if self.uses.changes(value)}

    def _give(self, targets: Values, values: Values) -> None:
        pairs = [(self.texts[t], self._of(v)) for t, v in zip(targets, values, strict=True) if self.uses.changes(t)]
        pairs = [(target, text) for target, text in pairs if target != text]
        if pairs:
            self._write(f"{', '.join(target for target, _ in pairs)} = {', '.join(text for _, text in pairs)}")

    def _if(self, node: If) -> None:
        self._variables(node.results)
        for head, block, falls, given in zip((f"if {self._of(node.test)}:", "else:"), node.blocks, node.falls, node.yields, strict=True):
            self._write(head)
            self.depth, before = self.depth + 1, len(self.lines)
            self._block(block)
            if falls and given:
                self._give(node.results, given)
            empty = len(self.lines) == before
            self.depth -= 1
            if empty:
                self.lines[-1] += " pass"

    def _turn(self, region: Region | None, block: Sequence[Any], end: Callable[[], None]) -> None:
        """Write a loop, behind which what is farther out is left too where that was meant."""
        turn = _Turn(region)
        self.turns.append(turn)
        self._write("while True:")
        self.depth += 1
        self._block(block)
        end()
        self.depth -= 1
        self.turns.pop()
        if turn.crossed:
            self._write(f"if out{f' and out <= {len(self.turns)}' * turn.reached}: break")
        if turn.reached:
            self._write("out = 0")

    def _region(self, node: Region) -> None:
        self._variables(node.results)
        *first, last = node.block
        if len(node.leaves) == 1 and last is node.leaves[0]:  # the end of the block
            self._block(first)
            self._give(node.results, last.values)
        elif type(last) is Loop and all(type(part) in (Value, Call) for part in first):
            self._block(first)
            self._loop(last, node)
        else:
            self._turn(node, node.block, lambda: None if type(last) is Leave else self._write("break"))

    def _leave(self, node: Leave) -> None:
        self._give(node.region.results, node.values)
        place = next(k for k, turn in enumerate(self.turns) if turn.region is node.region)
        if self.turns[place + 1 :]:
            self._write(f"out = {place + 1}")
            self.turns[place].reached = True
            for turn in self.turns[place + 1 :]:
                turn.crossed = True
        self._write("break")

    def _loop(self, node: Loop, region: Region | None = None) -> None:
        first = [self._of(x) for p, x in zip(node.parameters, node.initial, strict=True) if self.uses.changes(p)]
        self._variables(node.parameters)
        names = [self.texts[p] for p in node.parameters if self.uses.changes(p)]
        if names:
            self._write(f"{', '.join(names)} = {', '.join(first)}")
        self._turn(region, node.block, lambda: self._give(node.parameters, node.nexts) if node.nexts is not None else None)
