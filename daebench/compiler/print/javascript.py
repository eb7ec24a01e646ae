"""A recorded function as a method of a JavaScript object: one variable a value, unless it is read once, where it is made."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from daebench.compiler.print.needed import EFFECTS, Needed
from daebench.compiler.trace.ir import TRUTH, Function, If, Leave, Loop, Region, Value
from daebench.errors import BadInput

INFIX = {"and": ("&&", 3), "or": ("||", 2), "eq": ("===", 4), "ne": ("!==", 4), "lt": ("<", 5), "le": ("<=", 5), "gt": (">", 5)}
INFIX |= {"ge": (">=", 5), "add": ("+", 6), "sub": ("-", 6), "mul": ("*", 7), "div": ("/", 7), "mod": ("%", 7)}
"""Operators with their precedences."""

SIGNS = {"neg": "-", "not": "!", "btoi": "+", "btod": "+"}
CHOICE, SIGN, ATOM = 1, 8, 9
"""Precedences of a choice, of a sign, and of what needs no parentheses."""

SAME = frozenset(("itod", "dtoi"))
"""Conversions that change nothing: whole numbers are numbers, and only whole numbers become such."""

_NAMES = "abs acos acosh asin asinh atan atan2 atanh cbrt cos cosh exp expm1 hypot log log10 log1p log2 pow sin sinh sqrt tan tanh"

CALLS = {name: f"Math.{name}({{}})" for name in _NAMES.split()} | {"exp2": "Math.pow(2,{})"}
"""Functions of numbers."""

NOTHING: "Text" = ("0", ATOM)
"""A derivative that is known to be zero."""

WITHOUT: Mapping[str, Callable[..., "Text"]] = {
    "mul": lambda x, y: NOTHING,
    "add": lambda x, y: y if x == NOTHING else x,
    "sub": lambda x, y: x if y == NOTHING else _signed("-", y),
    "neg": lambda x: x,
    "abs": lambda x: x,
}
"""Operations on derivatives of which one is zero."""

LETTERS = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"

Text = tuple[str, int]
"""An expression, and its precedence."""


@dataclass
class _Use:
    """Where a value is made and read: blocks as paths from the outermost, and how often."""

    home: tuple[int, ...] = ()
    times: int = 0
    places: list[tuple[int, ...]] = field(default_factory=list)

    @property
    def once(self) -> bool:
        """Whether it is read once, in the block where it is made."""
        return self.times == 1 and self.places == [self.home]

    @property
    def outside(self) -> bool:
        """Whether it is read behind the block where it is made."""
        return any(place[: len(self.home)] != self.home for place in self.places)


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
        self.uses: dict[Value, _Use] = {}
        self.written: list[str] = []
        self.variables: list[str] = []
        self.labels: dict[Region, str] = {}
        self.tables: list[str] = []
        self.count = 0
        self._look(function.block, ())

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

    # ---- what is read where ----------------------------------------------------------------------------------------------

    def _same(self, value: Value) -> Value:
        while value in self.need.same:
            value = self.need.same[value]
        return value

    def _used(self, value: Value, place: tuple[int, ...], times: int = 1) -> None:
        use = self.uses.setdefault(self._same(value), _Use())
        use.times += times
        use.places.append(place)

    def _made(self, values: Sequence[Value], place: tuple[int, ...]) -> None:
        for value in values:
            self.uses.setdefault(value, _Use()).home = place

    def _look(self, block: Sequence[Any], place: tuple[int, ...]) -> None:
        """Note where values are made and read; a block within another has the place of its node at the end of its own."""
        for k, node in enumerate(block):
            _LOOKS[type(node)](self, node, place, k)

    def _look_value(self, node: Value, place: tuple[int, ...], k: int) -> None:
        if node not in self.need.needed:
            return
        self._made([node], place)
        for x in node.args:
            if isinstance(x, Value):
                self._used(x, place, _width(node) if _width(x) < _width(node) else 1)

    def _look_if(self, node: If, place: tuple[int, ...], k: int) -> None:
        self._made(node.results, place)
        self._used(node.test, place)
        for side, inner in enumerate(node.blocks):
            self._look(inner, (*place, k, side))
            self._given(node.results, node.yields[side], (*place, k, side))

    def _look_region(self, node: Region, place: tuple[int, ...], k: int) -> None:
        self._made(node.results, place)
        self._look(node.block, (*place, k))

    def _look_loop(self, node: Loop, place: tuple[int, ...], k: int) -> None:
        self._made(node.parameters, (*place, k))
        self._given(node.parameters, node.initial, place)
        self._look(node.block, (*place, k))
        self._given(node.parameters, node.nexts or (), (*place, k))

    def _look_leave(self, node: Leave, place: tuple[int, ...], k: int) -> None:
        self._given(node.region.results, node.values, place)

    def _given(self, targets: Sequence[Value], values: Sequence[Value], place: tuple[int, ...]) -> None:
        for target, value in zip(targets, values, strict=False):
            if self._changes(target):
                self._used(value, place)

    def _changes(self, target: Value) -> bool:
        """Return whether a result, or a parameter of a loop, is a variable."""
        return target in self.need.needed and target not in self.need.same

    # ---- expressions -----------------------------------------------------------------------------------------------------

    def _of(self, value: Value) -> list[Text]:
        """Return what stands for the entries of a value."""
        value = self._same(value)
        if value.op == "const":
            return [_constant(value)] * _width(value)
        if value.op == "table" and value not in self.texts:
            name = self._name()
            self.tables.append(f"const {name}=[{','.join(number(x) for x in value.args[0])}];")
            self.texts[value] = [(name, ATOM)]
        return self.texts[value]

    def _entries(self, value: Value) -> list[Text]:
        """Return the expressions for the entries of the result of an operation."""
        args, length = value.args, _width(value)
        if value.op == "vset":
            return [self._of(x)[0] for x in args]
        if value.op == "vget":
            return [self._of(args[0])[args[1]]]
        if value.op == "any":
            return [_infix("or", *self._of(args[0]))]
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
            return x[1] if x[0][0] == "1" else _signed("-", x[1])
        if _width(value) > 1 and NOTHING in x and op in WITHOUT:
            return WITHOUT[op](*x)
        if op in INFIX:
            return _infix(op, *x)
        if op in SIGNS:
            return _signed(SIGNS[op], x[0])
        if op == "select":
            test, then, other = (_bound(each, CHOICE + 1) for each in x)
            return f"{test}?{then}:{other}", CHOICE
        if op in CALLS:
            return CALLS[op].format(",".join(each[0] for each in x)), ATOM
        raise BadInput(f"a page cannot compute {op} of these numbers; choose another problem or method for it.")

    def _place(self, pointer: Value, index: Value) -> str:
        """Return an entry of an array."""
        base, *offsets = self._of(pointer)
        parts = [x for x in (*offsets, *self._of(index)) if x[0] != "0"]
        return f"{base[0]}[{_infix('add', *parts)[0] if parts else '0'}]"

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
        entries, use = self._entries(value), self.uses.get(value, _Use())
        if value.op == "load" or not use.once:
            entries = [self._kept(entry, use) for entry in entries]
        self.texts[value] = entries

    def _kept(self, entry: Text, use: _Use) -> Text:
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
            if self._changes(value):
                names = [self._name() for _ in range(_width(value))]
                (self.variables if self.uses[value].outside else here).extend(names)
                self.texts[value] = [(name, ATOM) for name in names]
        self.written += [f"let {','.join(here)};"] if here else []

    def _assigned(self, targets: Sequence[Value], values: Sequence[Value]) -> list[Text]:
        """Return variables, each with what it is given."""
        pairs = [(t, v) for t, v in zip(targets, values, strict=True) if self._changes(t)]
        given = [(name[0], x[0]) for t, v in pairs for name, x in zip(self._of(t), self._of(v), strict=True)]
        return [(name, x) for name, x in given if name != x]  # type: ignore[misc]

    def _give(self, targets: Sequence[Value], values: Sequence[Value]) -> None:
        self.written += [f"{name}={x};" for name, x in self._assigned(targets, values)]

    def _if(self, node: If) -> None:
        wanted = any(map(self._changes, node.results))
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
            self.written.append(f"if(!{_bound(test, ATOM)}){{{other}}}")

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
        first = [self._of(x) for p, x in zip(node.parameters, node.initial, strict=True) if self._changes(p)]
        self._variable(node.parameters)
        names = [self._of(p) for p in node.parameters if self._changes(p)]
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


_LOOKS: Mapping[type, Callable[[_Printer, Any, tuple[int, ...], int], None]] = {
    Value: _Printer._look_value,
    If: _Printer._look_if,
    Region: _Printer._look_region,
    Loop: _Printer._look_loop,
    Leave: _Printer._look_leave,
}

_NODES: Mapping[type, Callable[[_Printer, Any], None]] = {
    If: _Printer._if,
    Region: _Printer._region,
    Loop: _Printer._loop,
    Leave: _Printer._leave,
}


def _width(value: Value) -> int:
    """Return the number of entries."""
    return int(value.kind[1:] or 1)


def _constant(value: Value) -> Text:
    x = value.args[0]
    written = number(bool(x) if value.kind[0] == TRUTH else x)
    return written, SIGN if written.startswith("-") else ATOM


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


def _infix(op: str, first: Text, *others: Text) -> Text:
    """Return an operation on two or more operands; operations stay in the order in which they were recorded."""
    sign, level = INFIX[op]
    found = first
    for other in others:
        right = level if op in ("and", "or") else level + 1
        found = f"{_bound(found, level, first=True)}{sign}{_bound(other, right)}", level
    return found


def _signed(sign: str, x: Text) -> Text:
    """Return an expression with a sign before it."""
    return sign + _bound(x, ATOM), SIGN


def _bound(x: Text, least: int, *, first: bool = False) -> str:
    """Return an expression, in parentheses if its precedence is below ``least`` or if two signs would meet."""
    written, level = x
    return f"({written})" if level < least or (written[0] in "-+" and not first) else written
