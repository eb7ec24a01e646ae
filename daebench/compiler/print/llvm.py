"""A recorded program as text of LLVM: one label a block, one phi a result."""

from collections.abc import Iterable, Mapping, Sequence
from struct import pack, unpack
from typing import Any

from daebench.compiler.print.needed import Needed
from daebench.compiler.trace.complex import COMPLEX
from daebench.compiler.trace.ir import FLOAT32, FLOAT64, INTEGER, POINTER, TRUTH, Call, Function, If, Leave, Loop, Region, Value


class _Types(dict[str, str]):
    """Types by the kinds of values; those of vectors are made."""

    def __missing__(self, kind: str) -> str:
        return f"<{kind[1:]} x {self[kind[0]]}>"


TYPES = _Types({FLOAT64: "double", FLOAT32: "float", INTEGER: "i64", TRUTH: "i1", POINTER: "ptr", COMPLEX: "{double, double}"})
BYTES = {FLOAT64: 8, FLOAT32: 4, INTEGER: 8, TRUTH: 1, COMPLEX: 16}
SUFFIXES = {FLOAT64: "f64", FLOAT32: "f32"}

C_TYPES = {"d": "double", "i": "i32", "p": "i64", "a": "ptr"}
"""Types of C by their letters, see :data:`daebench.compiler.trace.foreign.KINDS`."""

MEMORY = frozenset(("alloc", "mark", "release"))
"""Operations on the memory of new arrays."""

INTRINSIC = frozenset(("fabs", "sqrt", "sin", "cos", "exp", "log", "pow"))
"""Functions of numbers that LLVM knows: only so does it make one call of the sine and the cosine of one number."""

SHORT, LONGEST = 40, 2000
"""Lines of the longest function that is inlined in any case, and of the longest that may be."""


def _formats() -> dict[tuple[str, str], str]:
    """Return the text of an operation on numbers of type {T} with a result of type {R}, by its name and the kind of its first argument."""
    made = {("and", TRUTH): "and {T} {0}, {1}", ("or", TRUTH): "or {T} {0}, {1}", ("neg", INTEGER): "sub {T} zeroinitializer, {0}"}
    made |= {("floordiv", INTEGER): "sdiv {T} {0}, {1}", ("mod", INTEGER): "srem {T} {0}, {1}"}
    floats = (FLOAT64, FLOAT32)
    conversions = {"sitofp": (INTEGER, floats), "zext": (TRUTH, INTEGER), "uitofp": (TRUTH, floats)}
    conversions |= {"fptrunc": (FLOAT64, FLOAT32), "fpext": (FLOAT32, FLOAT64)}
    pairs = [(name, (of, to)) for name, (of, several) in conversions.items() for to in several]
    pairs += [("fptosi", (of, INTEGER)) for of in floats]
    made |= {(f"{of}to{to}", of): f"{name} {{T}} {{0}} to {{R}}" for name, (of, to) in pairs}
    for kind in floats:
        made |= {(op, kind): f"f{op} {{T}} {{0}}, {{1}}" for op in ("add", "sub", "mul", "div")}
        made |= {("neg", kind): "fneg {T} {0}", ("mod", kind): "frem {T} {0}, {1}"}
        orders = {"lt": "olt", "le": "ole", "gt": "ogt", "ge": "oge", "eq": "oeq", "ne": "une"}
        made |= {(op, kind): f"fcmp {order} {{T}} {{0}}, {{1}}" for op, order in orders.items()}
    made |= {(op, INTEGER): f"{op} {{T}} {{0}}, {{1}}" for op in ("add", "sub", "mul")}
    orders = {"lt": "slt", "le": "sle", "gt": "sgt", "ge": "sge", "eq": "eq", "ne": "ne"}
    return made | {(op, INTEGER): f"icmp {order} {{T}} {{0}}, {{1}}" for op, order in orders.items()}


FORMATS: Mapping[tuple[str, str], str] = _formats()


BRANCHES = '!0 = !{!"branch_weights", i32 1, i32 1000}'
"""Weights of branches that only exchange numbers, rows of an elimination say: LLVM would have later steps wait for the test of each."""


class Text:
    """The text of functions and of what they need."""

    def __init__(self) -> None:
        self.declarations: set[str] = set()
        self.tables: dict[Value, tuple[str, str]] = {}
        self.effective: set[Function] = set()
        self.allocating: set[Function] = set()
        self.functions: list[str] = []
        self.entrywise: dict[str, str] = {}

    def add(self, function: Function) -> None:
        """Add a function; those that it calls were added before."""
        if any(node.op in MEMORY if type(node) is Value else node.function in self.allocating for node in _leaves(function.block)):
            self.allocating.add(function)
        need = Needed(function, self.effective)
        if need.changes or function in self.allocating:
            self.effective.add(function)
        printer = _Printer(self, function, need)
        lines = printer.printed()
        length = len(lines)
        attribute = "alwaysinline " if length < SHORT else "noinline " if length > LONGEST else ""
        parameters = [f"{TYPES[p.kind]} %a{k}" for k, p in enumerate(function.parameters)]
        parameters += ["ptr %arena"] * (function in self.allocating)
        head = f"define internal {result_type(function)} @{function.name}({', '.join(parameters)}) nounwind {attribute}{{"
        self.functions.append("\n".join([head, "entry:", *lines, "}"]))

    def entry(self, function: Function, name: str) -> None:
        """Add a function without result: it takes arguments from an array of words, and puts results into another.

        Its third argument is the memory of new arrays: where the next goes, where the memory ends, where it begins, and whether it was
        too small.
        """
        self.add(function)
        lines, args = [], []
        for k, parameter in enumerate(function.parameters):
            kind = TYPES[parameter.kind]
            lines.append(f"%p{k} = getelementptr i64, ptr %in, i64 {k}")
            if parameter.kind == TRUTH:
                lines += [f"%w{k} = load i64, ptr %p{k}", f"%x{k} = trunc i64 %w{k} to i1"]
            else:
                lines.append(f"%x{k} = load {kind}, ptr %p{k}")
            args.append(f"{kind} %x{k}")
        args += ["ptr %arena"] * (function in self.allocating)
        lines.append(f"%r = call {result_type(function)} @{function.name}({', '.join(args)})")
        for k, result in enumerate(function.results):
            lines.append(f"%e{k} = extractvalue {result_type(function)} %r, {k}")
            kind, value = TYPES[result.kind], f"%e{k}"
            if result.kind == TRUTH:
                lines.append(f"%z{k} = zext i1 {value} to i64")
                kind, value = "i64", f"%z{k}"
            lines += [f"%o{k} = getelementptr i64, ptr %out, i64 {k}", f"store {kind} {value}, ptr %o{k}"]
        head = f"define void @{name}(ptr noalias %in, ptr noalias %out, ptr noalias %arena) nounwind {{"
        self.functions.append("\n".join([head, *lines, "ret void", "}"]))

    def callback(self, function: Function, name: str, letters: str, user: int, arena: int, known: Any) -> None:
        """Add a function that C calls.

        Parameters
        ----------
        function : Function
            The recorded function.
        name : str
            Its name for C.
        letters : str
            Types of C, that of the result first.
        user : int
            The argument that is the address of the memory of callbacks.
        arena : int
            The word there that is the address of the memory of new arrays, all of which is free at each call.
        known : int
            What it returns, where that does not depend on its arguments.
        """
        self.add(function)
        lines, args = [], []
        for k, letter in enumerate(letters[1:]):
            lines += [f"%x{k} = sext i32 %a{k} to i64"] * (letter == "i")
            args.append(f"{TYPES[function.parameters[k].kind]} %{'x' if letter == 'i' else 'a'}{k}")
        if function in self.allocating:
            lines += [f"%user = inttoptr i64 %a{user} to ptr", f"%word = getelementptr ptr, ptr %user, i64 {arena}"]
            lines += ["%arena = load ptr, ptr %word", "%place = getelementptr ptr, ptr %arena, i64 2"]
            lines += ["%free = load ptr, ptr %place", "store ptr %free, ptr %arena"]
            args.append("ptr %arena")
        lines += [f"%r = call {result_type(function)} @{function.name}({', '.join(args)})"]
        status = f"extractvalue {result_type(function)} %r, 0" if function.results else f"add i64 0, {known}"
        lines += [f"%e = {status}", "%o = trunc i64 %e to i32", "ret i32 %o"]
        parameters = ", ".join(f"{C_TYPES[letter]} %a{k}" for k, letter in enumerate(letters[1:]))
        self.functions.append("\n".join([f"define i32 @{name}({parameters}) nounwind {{", *lines, "}"]))

    def whole(self) -> str:
        """Return the text of all."""
        tables = [table for _, table in self.tables.values()]
        return "\n".join([*sorted(self.declarations), *tables, *self.entrywise.values(), *self.functions, BRANCHES])

    def function(self, op: str, kind: str, count: int) -> str:
        """Return the name of a function of numbers or vectors; one that LLVM does not know is called for one entry after another."""
        known, length = op in INTRINSIC, f"v{kind[1:]}" * (len(kind) > 1)
        name = f"llvm.{op}.{length}{SUFFIXES[kind[0]]}" if known else op + "f" * (kind[0] == FLOAT32)
        if known or not length:
            types = ", ".join([TYPES[kind]] * count)
            self.declarations.add(f"declare {TYPES[kind]} @{name}({types}) memory(none) nounwind willreturn")
            return name
        entrywise = f"{name}.{length}"
        if entrywise not in self.entrywise:
            self.entrywise[entrywise] = _entrywise(entrywise, self.function(op, kind[0], count), kind, count)
        return entrywise

    def table(self, value: Value) -> str:
        """Return the name of a table of constants."""
        if value not in self.tables:
            entries, kind = value.args
            name, kind_name = f"@table{len(self.tables)}", TYPES[kind]
            content = ", ".join(f"{kind_name} {_number(entry, kind)}" for entry in entries)
            self.tables[value] = name, f"{name} = private constant [{len(entries)} x {kind_name}] [{content}]"
        return self.tables[value][0]


def _entrywise(name: str, function: str, kind: str, count: int) -> str:
    """Return the text of a function of vectors that calls one of numbers for each entry."""
    whole, number, given = TYPES[kind], TYPES[kind[0]], range(count)
    lines, result = [], "undef"
    for k in range(int(kind[1:])):
        lines += [f"%x{j}_{k} = extractelement {whole} %a{j}, i32 {k}" for j in given]
        lines.append(f"%y{k} = call {number} @{function}({', '.join(f'{number} %x{j}_{k}' for j in given)})")
        lines.append(f"%r{k} = insertelement {whole} {result}, {number} %y{k}, i32 {k}")
        result = f"%r{k}"
    head = f"define internal {whole} @{name}({', '.join(f'{whole} %a{j}' for j in given)}) noinline memory(none) nounwind willreturn {{"
    return "\n".join([head, *lines, f"ret {whole} {result}", "}"])


def result_type(function: Function) -> str:
    """Return the type of all results of a function."""
    return "{" + ", ".join(TYPES[result.kind] for result in function.results) + "}"


def _leaves(block: Sequence[Any]) -> Iterable[Any]:
    """Return the values and calls of a block."""
    for node in block:
        if type(node) is If:
            yield from _leaves(node.blocks[0])
            yield from _leaves(node.blocks[1])
        elif isinstance(node, Region | Loop):
            yield from _leaves(node.block)
        elif type(node) is not Leave:
            yield node


def _number(x: float, kind: str) -> str:
    if len(kind) > 1:
        return f"<{', '.join([f'{TYPES[kind[0]]} {_number(x, kind[0])}'] * int(kind[1:]))}>"
    if kind == FLOAT32:
        (x,) = unpack("<f", pack("<f", x))
    if kind in SUFFIXES:
        return f"0x{unpack('<Q', pack('<d', x))[0]:016X}"
    return str(int(x)) if kind == INTEGER else "null" if kind == POINTER else "true" if x else "false"


class _Printer:
    """Prints one function."""

    def __init__(self, text: Text, function: Function, need: Needed) -> None:
        self.text, self.function, self.need = text, function, need
        self.lines: list[str] = []
        self.slots: list[str] = []
        self.names: dict[Value, str] = {p: f"%a{k}" for k, p in enumerate(function.parameters)}
        self.count, self.label = 0, "entry"
        self.arrivals: dict[Region, tuple[str, list[tuple[str, list[str]]]]] = {}

    def printed(self) -> list[str]:
        """Return the lines."""
        self._block(self.function.block)
        kind, whole = result_type(self.function), "undef"
        for k, result in enumerate(self.function.results):
            name = self._fresh()
            self.lines.append(f"{name} = insertvalue {kind} {whole}, {TYPES[result.kind]} {self._at(result)}, {k}")
            whole = name
        self.lines.append(f"ret {kind} {whole}" if self.function.results else "ret {} zeroinitializer")
        return self.slots + self.lines

    def _fresh(self) -> str:
        self.count += 1
        return f"%v{self.count}"

    def _labels(self, count: int) -> list[str]:
        self.count += 1
        return [f"b{self.count}_{k}" for k in range(count)]

    def _begin(self, label: str) -> None:
        self.lines.append(f"{label}:")
        self.label = label

    def _at(self, value: Value) -> str:
        """Return the operand that stands for a value."""
        name = self.names.get(value)
        if name is None:
            if value.op == "const":
                name = _number(value.args[0], value.kind)
            elif value.op == "table":
                name = self.text.table(value)
            elif value.op == "slot":
                name = self._slot(value)
            else:
                name = self._at(self.need.same[value])
            self.names[value] = name
        return name

    def _block(self, block: Sequence[Any]) -> None:
        for node in block:
            if type(node) is Value:
                if node in self.need.needed:
                    self._value(node)
            else:
                _NODES[type(node)](self, node)

    def _leave(self, node: Leave) -> None:
        label, came = self.arrivals[node.region]
        results = zip(node.values, node.region.results, strict=True)
        came.append((self.label, [self._at(value) for value, result in results if result in self.need.needed]))
        self.lines.append(f"br label %{label}")

    def _value(self, value: Value) -> None:
        form = FORMATS.get((value.op, value.args[0].kind[0])) if value.args and isinstance(value.args[0], Value) else None
        if form is not None:
            name = self.names[value] = self._fresh()
            self.lines.append(f"{name} = {form.format(*map(self._at, value.args), T=TYPES[value.args[0].kind], R=TYPES[value.kind])}")
        elif value.op in _SPECIAL:
            _SPECIAL[value.op](self, value)
        else:
            self._function(value)

    def _select(self, value: Value) -> None:
        self._named(value, "select " + ", ".join(f"{TYPES[x.kind]} {self._at(x)}" for x in value.args))

    def _not(self, value: Value) -> None:
        self._named(value, f"xor {TYPES[value.kind]} {self._at(value.args[0])}, {_number(1, value.kind)}")

    def _named(self, value: Value, text: str) -> None:
        name = self.names[value] = self._fresh()
        self.lines.append(f"{name} = {text}")

    def _address(self, pointer: Value, index: Value, kind: str) -> str:
        """Return the address of an entry."""
        if index.op == "const" and index.args[0] == 0:
            return self._at(pointer)
        name = self._fresh()
        self.lines.append(f"{name} = getelementptr {TYPES[kind]}, ptr {self._at(pointer)}, i64 {self._at(index)}")
        return name

    def _load(self, value: Value) -> None:
        pointer, index = value.args
        place = self._address(pointer, index, value.kind[0])
        self._named(value, f"load {TYPES[value.kind]}, ptr {place}{self._aligned(value.kind)}")

    def _store(self, value: Value) -> None:
        pointer, index, what = value.args
        place = self._address(pointer, index, what.kind[0])
        self.lines.append(f"store {TYPES[what.kind]} {self._at(what)}, ptr {place}{self._aligned(what.kind)}")

    @staticmethod
    def _aligned(kind: str) -> str:
        """Return that a vector lies where its entries may."""
        return f", align {BYTES[kind[0]]}" if len(kind) > 1 else ""

    def _offset(self, value: Value) -> None:
        pointer, index, kind = value.args
        self._named(value, f"getelementptr {TYPES[kind]}, ptr {self._at(pointer)}, i64 {self._at(index)}")

    def _alloc(self, value: Value) -> None:
        """Print that an array is taken from the memory of new arrays, from its beginning where it is full, which is noted."""
        top, new, end, full, base, other, late, flag, noted = (self._fresh() for _ in range(9))
        places = [self._fresh() for _ in range(3)]
        size = self._at(value.args[0])
        self.lines += [
            f"{top} = load ptr, ptr %arena",
            f"{new} = getelementptr i64, ptr {top}, i64 {size}",
            *(f"{place} = getelementptr i64, ptr %arena, i64 {k}" for k, place in enumerate(places, 1)),
            f"{end} = load ptr, ptr {places[0]}",
            f"{base} = load ptr, ptr {places[1]}",
            f"{full} = icmp ugt ptr {new}, {end}",
            f"{other} = getelementptr i64, ptr {base}, i64 {size}",
            f"{late} = select i1 {full}, ptr {other}, ptr {new}",
            f"store ptr {late}, ptr %arena",
            f"{flag} = load i64, ptr {places[2]}",
            f"{noted} = select i1 {full}, i64 1, i64 {flag}",
            f"store i64 {noted}, ptr {places[2]}",
        ]
        self._named(value, f"select i1 {full}, ptr {base}, ptr {top}")

    def _splat(self, value: Value) -> None:
        (number,), kind, first = value.args, TYPES[value.kind], self._fresh()
        self.lines.append(f"{first} = insertelement {kind} undef, {TYPES[number.kind]} {self._at(number)}, i32 0")
        self._named(value, f"shufflevector {kind} {first}, {kind} undef, <{value.kind[1:]} x i32> zeroinitializer")

    def _vset(self, value: Value) -> None:
        kind, whole = TYPES[value.kind], "undef"
        for k, entry in enumerate(value.args):
            name = self._fresh()
            self.lines.append(f"{name} = insertelement {kind} {whole}, {TYPES[entry.kind]} {self._at(entry)}, i32 {k}")
            whole = name
        self.names[value] = whole

    def _vget(self, value: Value) -> None:
        vector, k = value.args
        self._named(value, f"extractelement {TYPES[vector.kind]} {self._at(vector)}, i32 {k}")

    def _any(self, value: Value) -> None:
        """Print whether one of a vector of truths is true."""
        (truths,), bits = value.args, self._fresh()
        word = f"i{truths.kind[1:]}"
        self.lines.append(f"{bits} = bitcast {TYPES[truths.kind]} {self._at(truths)} to {word}")
        self._named(value, f"icmp ne {word} {bits}, 0")

    def _slot(self, value: Value) -> str:
        """Print a place in memory for so many words, at the beginning of the function; return its name."""
        name = self._fresh()
        self.slots.append(f"{name} = alloca i64, i64 {value.args[0]}, align 64")
        return name

    def _seen(self, value: Value) -> None:
        """Print that a place is read and written here as far as LLVM knows, which then does not hold its content in registers."""
        self.lines.append(f'call void asm sideeffect "", "r,~{{memory}}"(ptr {self._at(value.args[0])})')

    def _itop(self, value: Value) -> None:
        self._named(value, f"inttoptr i64 {self._at(value.args[0])} to ptr")

    def _ccall(self, value: Value) -> None:
        """Print the call of a function of C at an address; whole numbers of C have 32 bits."""
        address, *args, letters = value.args
        function = self._fresh()
        self.lines.append(f"{function} = inttoptr i64 {self._at(address)} to ptr")
        given = []
        for letter, x in zip(letters[1:], args, strict=True):
            name = self._at(x)
            if letter == "i":
                name = self._fresh()
                self.lines.append(f"{name} = trunc i64 {self._at(x)} to i32")
            given.append(f"{C_TYPES[letter]} {name}")
        result = self._fresh()
        self.lines.append(f"{result} = call {C_TYPES[letters[0]]} {function}({', '.join(given)})")
        self.names[value] = result
        if letters[0] == "i":
            self._named(value, f"sext i32 {result} to i64")

    def _mark(self, value: Value) -> None:
        self._named(value, "load ptr, ptr %arena")

    def _release(self, value: Value) -> None:
        self.lines.append(f"store ptr {self._at(value.args[0])}, ptr %arena")

    def _move(self, value: Value) -> None:
        to, of, size, kind = value.args
        self.text.declarations.add("declare void @llvm.memmove.p0.p0.i64(ptr, ptr, i64, i1)")
        count = self._fresh()
        self.lines.append(f"{count} = mul i64 {self._at(size)}, {BYTES[kind]}")
        self.lines.append(f"call void @llvm.memmove.p0.p0.i64(ptr {self._at(to)}, ptr {self._at(of)}, i64 {count}, i1 false)")

    def _function(self, value: Value) -> None:
        """Print the call of a function of numbers."""
        kind = TYPES[value.kind]
        name = self.text.function("fabs" if value.op == "abs" else value.op, value.kind, len(value.args))
        self._named(value, f"call {kind} @{name}({', '.join(f'{kind} {self._at(x)}' for x in value.args)})")

    def _phis(self, results: Sequence[Value], came: Sequence[tuple[str, Sequence[str]]]) -> None:
        for k, result in enumerate(results):
            self._named(result, f"phi {TYPES[result.kind]} " + ", ".join(f"[{values[k]}, %{label}]" for label, values in came))

    def _if(self, node: If) -> None:
        wanted = [k for k, result in enumerate(node.results) if result in self.need.needed]
        if not wanted and node not in self.need.steering:
            return
        yes, no, end = self._labels(3)
        exchange = len(wanted) > 1 and not any(node.blocks)
        self.lines.append(f"br i1 {self._at(node.test)}, label %{yes}, label %{no}{', !prof !0' if exchange else ''}")
        came = []
        for k, label in enumerate((yes, no)):
            self._begin(label)
            self._block(node.blocks[k])
            if node.falls[k]:
                came.append((self.label, [self._at(node.yields[k][j]) for j in wanted] if node.yields[k] else []))
                self.lines.append(f"br label %{end}")
        if came:
            self._begin(end)
            self._phis([node.results[j] for j in wanted], came)

    def _region(self, node: Region) -> None:
        (label,) = self._labels(1)
        self.arrivals[node] = label, []
        self._block(node.block)
        if came := self.arrivals[node][1]:
            self._begin(label)
            self._phis([result for result in node.results if result in self.need.needed], came)

    def _loop(self, node: Loop) -> None:
        (head,) = self._labels(1)
        carried = [k for k, p in enumerate(node.parameters) if p in self.need.needed and p not in self.need.same]
        came, first = self.label, [self._at(node.initial[k]) for k in carried]
        self.lines.append(f"br label %{head}")
        self._begin(head)
        start = len(self.lines)
        for k in carried:
            self.names[node.parameters[k]] = self._fresh()
            self.lines.append("")
        self._block(node.block)
        for at, (k, begun) in enumerate(zip(carried, first, strict=True), start):
            parameter = node.parameters[k]
            arrivals = f"[{begun}, %{came}]"
            if node.nexts is not None:
                arrivals += f", [{self._at(node.nexts[k])}, %{self.label}]"
            self.lines[at] = f"{self.names[parameter]} = phi {TYPES[parameter.kind]} {arrivals}"
        if node.nexts is not None:
            self.lines.append(f"br label %{head}")

    def _call(self, node: Call) -> None:
        if node not in self.need.needed:
            return
        name, kind = self._fresh(), result_type(node.function)
        args = [f"{TYPES[x.kind]} {self._at(x)}" for x in node.args] + ["ptr %arena"] * (node.function in self.text.allocating)
        self.lines.append(f"{name} = call {kind} @{node.function.name}({', '.join(args)})")
        for k, result in enumerate(node.results):
            if result in self.need.needed:
                self._named(result, f"extractvalue {kind} {name}, {k}")


_NODES: Mapping[type, Any] = {
    If: _Printer._if,
    Region: _Printer._region,
    Loop: _Printer._loop,
    Leave: _Printer._leave,
    Call: _Printer._call,
}

_SPECIAL: Mapping[str, Any] = {
    "select": _Printer._select,
    "load": _Printer._load,
    "store": _Printer._store,
    "offset": _Printer._offset,
    "alloc": _Printer._alloc,
    "not": _Printer._not,
    "splat": _Printer._splat,
    "vset": _Printer._vset,
    "vget": _Printer._vget,
    "any": _Printer._any,
    "seen": _Printer._seen,
    "itop": _Printer._itop,
    "ccall": _Printer._ccall,
    "mark": _Printer._mark,
    "release": _Printer._release,
    "move": _Printer._move,
}
