"""Recorded functions as one text of LLVM, with what they need, and with entries for Python and for C."""

from typing import Any

from daebench.compiler.print.llvm_function import Printer
from daebench.compiler.print.llvm_operations import C_TYPES, INTRINSIC, SUFFIXES, TYPES, entrywise, number, result_type
from daebench.compiler.print.needed import Needed, leaves
from daebench.compiler.trace.ir import FLOAT32, TRUTH, Function, Value

MEMORY = frozenset(("alloc", "mark", "release"))
"""Operations on the memory of new arrays."""

SHORT, LONGEST = 40, 2000
"""Lines of the longest function that is inlined in any case, and of the longest that may be."""


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
        if any(node.op in MEMORY if type(node) is Value else node.function in self.allocating for node in leaves(function.block)):
            self.allocating.add(function)
        need = Needed(function, self.effective)
        if need.changes or function in self.allocating:
            self.effective.add(function)
        printer = Printer(self, function, need)
        lines = printer.printed()
        length = len(lines)
        attribute = "alwaysinline " if length < SHORT else "noinline " if length > LONGEST else ""
        parameters = [f"{TYPES[p.kind]} %a{k}" for k, p in enumerate(function.parameters)]
        parameters += ["ptr %arena"] * (function in self.allocating)
        head = f"define internal {result_type(function)} @{function.name}({', '.join(parameters)}) nounwind {attribute}{{"
        self.functions.append("\n".join([head, "entry:", *lines, "}"]))

    def entry(self, function: Function) -> None:
        """Add a function without result: it takes arguments from an array of words, and puts results into another.

        Its third argument is the memory of new arrays: where the next goes, where the memory ends, where it begins, and whether it was
        too small.
        """
        self.add(function)
        lines, args = [], []
        for k, parameter in enumerate(function.parameters):
            kind, truth = TYPES[parameter.kind], parameter.kind == TRUTH
            lines += [f"%p{k} = getelementptr i64, ptr %in, i64 {k}", f"%{'wx'[not truth]}{k} = load {'i64' if truth else kind}, ptr %p{k}"]
            lines += [f"%x{k} = trunc i64 %w{k} to i1"] * truth
            args.append(f"{kind} %x{k}")
        args += ["ptr %arena"] * (function in self.allocating)
        lines.append(f"%r = call {result_type(function)} @{function.name}({', '.join(args)})")
        for k, result in enumerate(function.results):
            truth = result.kind == TRUTH
            lines.append(f"%e{k} = extractvalue {result_type(function)} %r, {k}")
            lines += [f"%z{k} = zext i1 %e{k} to i64"] * truth
            kind, value = ("i64", f"%z{k}") if truth else (TYPES[result.kind], f"%e{k}")
            lines += [f"%o{k} = getelementptr i64, ptr %out, i64 {k}", f"store {kind} {value}, ptr %o{k}"]
        head = "define void @entry(ptr noalias %in, ptr noalias %out, ptr noalias %arena) nounwind {"
        self.functions.append("\n".join([head, *lines, "ret void", "}"]))

    def callback(self, function: Function, letters: str, user: int, arena: int, known: Any) -> None:
        """Add a function that C calls."""
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
        lines.append(f"%r = call {result_type(function)} @{function.name}({', '.join(args)})")
        status = f"extractvalue {result_type(function)} %r, 0" if function.results else f"add i64 0, {known}"
        lines += [f"%e = {status}", "%o = trunc i64 %e to i32", "ret i32 %o"]
        parameters = ", ".join(f"{C_TYPES[letter]} %a{k}" for k, letter in enumerate(letters[1:]))
        self.functions.append("\n".join([f"define i32 @entry({parameters}) nounwind {{", *lines, "}"]))

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
        name = f"{name}.{length}"
        if name not in self.entrywise:
            self.entrywise[name] = entrywise(name, self.function(op, kind[0], count), kind, count)
        return name

    def table(self, value: Value) -> str:
        """Return the name of a table of constants."""
        if value not in self.tables:
            entries, kind = value.args
            name, kind_name = f"@table{len(self.tables)}", TYPES[kind]
            content = ", ".join(f"{kind_name} {number(entry, kind)}" for entry in entries)
            self.tables[value] = name, f"{name} = private constant [{len(entries)} x {kind_name}] [{content}]"
        return self.tables[value][0]
