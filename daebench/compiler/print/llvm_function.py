"""A recorded function as text of LLVM: one label a block, one phi a result."""

from collections.abc import Sequence
from typing import Any

from daebench.compiler.print.llvm_operations import BYTES, C_TYPES, FORMATS, TYPES, number, result_type
from daebench.compiler.print.needed import Needed, Walker
from daebench.compiler.trace.ir import Call, Function, If, Leave, Loop, Region, Value


class Printer(Walker):
    """Prints one function."""

    def __init__(self, text: Any, function: Function, need: Needed) -> None:
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
            whole = self._new(f"insertvalue {kind} {whole}, {TYPES[result.kind]} {self._at(result)}, {k}")
        self.lines.append(f"ret {kind} {whole}" if self.function.results else "ret {} zeroinitializer")
        return self.slots + self.lines

    def _fresh(self) -> str:
        self.count += 1
        return f"%v{self.count}"

    def _new(self, text: str) -> str:
        """Write the line of an operation; return the name of its result."""
        name = self._fresh()
        self.lines.append(f"{name} = {text}")
        return name

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
                name = number(value.args[0], value.kind)
            elif value.op == "table":
                name = self.text.table(value)
            elif value.op == "slot":
                name = self._slot(value)
            else:
                name = self._at(self.need.same[value])
            self.names[value] = name
        return name

    def _leave(self, node: Leave) -> None:
        label, came = self.arrivals[node.region]
        results = zip(node.values, node.region.results, strict=True)
        came.append((self.label, [self._at(value) for value, result in results if result in self.need.needed]))
        self.lines.append(f"br label %{label}")

    def _value(self, value: Value) -> None:
        form = FORMATS.get((value.op, value.args[0].kind[0])) if value.args and isinstance(value.args[0], Value) else None
        if form is not None:
            self._named(value, form.format(*map(self._at, value.args), T=TYPES[value.args[0].kind], R=TYPES[value.kind]))
        else:
            getattr(self, f"_{value.op}", self._function)(value)

    def _not(self, value: Value) -> None:
        self._named(value, f"xor {TYPES[value.kind]} {self._at(value.args[0])}, {number(1, value.kind)}")

    def _named(self, value: Value, text: str) -> None:
        self.names[value] = self._new(text)

    def _address(self, pointer: Value, index: Value, kind: str) -> str:
        """Return the address of an entry."""
        if index.op == "const" and index.args[0] == 0:
            return self._at(pointer)
        return self._new(f"getelementptr {TYPES[kind]}, ptr {self._at(pointer)}, i64 {self._at(index)}")

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
        # There is no test: where the memory is full, new arrays overwrite old ones, and the run fails
        # because the last word is set, see Memory.require_enough.
        size, new = self._at(value.args[0]), self._new
        top = new("load ptr, ptr %arena")
        behind = new(f"getelementptr i64, ptr {top}, i64 {size}")
        places = [new(f"getelementptr i64, ptr %arena, i64 {k}") for k in (1, 2, 3)]
        end, base = (new(f"load ptr, ptr {place}") for place in places[:2])
        full = new(f"icmp ugt ptr {behind}, {end}")
        other = new(f"getelementptr i64, ptr {base}, i64 {size}")
        late = new(f"select i1 {full}, ptr {other}, ptr {behind}")
        self.lines.append(f"store ptr {late}, ptr %arena")
        noted = new(f"select i1 {full}, i64 1, i64 {new(f'load i64, ptr {places[2]}')}")
        self.lines.append(f"store i64 {noted}, ptr {places[2]}")
        self._named(value, f"select i1 {full}, ptr {base}, ptr {top}")

    def _splat(self, value: Value) -> None:
        (number,), kind = value.args, TYPES[value.kind]
        first = self._new(f"insertelement {kind} undef, {TYPES[number.kind]} {self._at(number)}, i32 0")
        self._named(value, f"shufflevector {kind} {first}, {kind} undef, <{value.kind[1:]} x i32> zeroinitializer")

    def _vset(self, value: Value) -> None:
        kind, whole = TYPES[value.kind], "undef"
        for k, entry in enumerate(value.args):
            whole = self._new(f"insertelement {kind} {whole}, {TYPES[entry.kind]} {self._at(entry)}, i32 {k}")
        self.names[value] = whole

    def _vget(self, value: Value) -> None:
        vector, k = value.args
        self._named(value, f"extractelement {TYPES[vector.kind]} {self._at(vector)}, i32 {k}")

    def _any(self, value: Value) -> None:
        """Print whether one of a vector of truths is true."""
        (truths,) = value.args
        word = f"i{truths.kind[1:]}"
        bits = self._new(f"bitcast {TYPES[truths.kind]} {self._at(truths)} to {word}")
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
        function = self._new(f"inttoptr i64 {self._at(address)} to ptr")
        given = []
        for letter, x in zip(letters[1:], args, strict=True):
            name = self._new(f"trunc i64 {self._at(x)} to i32") if letter == "i" else self._at(x)
            given.append(f"{C_TYPES[letter]} {name}")
        result = self.names[value] = self._new(f"call {C_TYPES[letters[0]]} {function}({', '.join(given)})")
        if letters[0] == "i":
            self._named(value, f"sext i32 {result} to i64")

    def _mark(self, value: Value) -> None:
        self._named(value, "load ptr, ptr %arena")

    def _release(self, value: Value) -> None:
        self.lines.append(f"store ptr {self._at(value.args[0])}, ptr %arena")

    def _move(self, value: Value) -> None:
        to, of, size, kind = value.args
        self.text.declarations.add("declare void @llvm.memmove.p0.p0.i64(ptr, ptr, i64, i1)")
        count = self._new(f"mul i64 {self._at(size)}, {BYTES[kind]}")
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
        # A phi names the values of the next turn, which are known only behind the block: its line is filled in then.
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
        kind = result_type(node.function)
        args = [f"{TYPES[x.kind]} {self._at(x)}" for x in node.args] + ["ptr %arena"] * (node.function in self.text.allocating)
        name = self._new(f"call {kind} @{node.function.name}({', '.join(args)})")
        for k, result in enumerate(node.results):
            if result in self.need.needed:
                self._named(result, f"extractvalue {kind} {name}, {k}")
