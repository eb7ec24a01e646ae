"""Types of LLVM, and the text of operations on numbers and vectors of them."""

from collections.abc import Mapping
from struct import pack, unpack

from daebench.compiler.trace.complex import COMPLEX
from daebench.compiler.trace.ir import FLOAT32, FLOAT64, INTEGER, POINTER, TRUTH, Function


class _Types(dict[str, str]):
    """Types by the kinds of values; those of vectors are made."""

    def __missing__(self, kind: str) -> str:
        return f"<{kind[1:]} x {self[kind[0]]}>"


TYPES = _Types({FLOAT64: "double", FLOAT32: "float", INTEGER: "i64", TRUTH: "i1", POINTER: "ptr", COMPLEX: "{double, double}"})
BYTES = {FLOAT64: 8, FLOAT32: 4, INTEGER: 8, TRUTH: 1, COMPLEX: 16}
SUFFIXES = {FLOAT64: "f64", FLOAT32: "f32"}

C_TYPES = {"d": "double", "i": "i32", "p": "i64", "a": "ptr"}
"""Types of C by their letters, see :data:`daebench.compiler.trace.names.KINDS`."""

INTRINSIC = frozenset(("fabs", "sqrt", "sin", "cos", "exp", "log", "pow"))
"""Functions of numbers that LLVM knows: only so does it make one call of the sine and the cosine of one number."""


def _formats() -> dict[tuple[str, str], str]:
    """Return the text of an operation on numbers of type {T} with a result of type {R}, by its name and the kind of its first argument."""
    formats = {("and", TRUTH): "and {T} {0}, {1}", ("or", TRUTH): "or {T} {0}, {1}", ("neg", INTEGER): "sub {T} zeroinitializer, {0}"}
    formats |= {("select", TRUTH): "select {T} {0}, {R} {1}, {R} {2}"}
    conversions = {
        "itod": "sitofp",
        "itos": "sitofp",
        "btoi": "zext",
        "btod": "uitofp",
        "btos": "uitofp",
        "dtos": "fptrunc",
        "stod": "fpext",
    }
    conversions |= {"dtoi": "fptosi", "stoi": "fptosi"}
    formats |= {(op, op[0]): f"{name} {{T}} {{0}} to {{R}}" for op, name in conversions.items()}
    # Ordered comparisons are false of NaN. "Not equal" is the unordered one: NaN differs from every number, as in Python.
    floats = {op: f"f{op}" for op in ("add", "sub", "mul", "div")} | {"mod": "frem", "ne": "fcmp une"}
    floats |= {op: f"fcmp o{op}" for op in ("lt", "le", "gt", "ge", "eq")}
    integers = {op: op for op in ("add", "sub", "mul")} | {"floordiv": "sdiv", "mod": "srem", "eq": "icmp eq", "ne": "icmp ne"}
    integers |= {op: f"icmp s{op}" for op in ("lt", "le", "gt", "ge")}
    for kind, names in ((FLOAT64, floats), (FLOAT32, floats), (INTEGER, integers)):
        formats |= {(op, kind): f"{name} {{T}} {{0}}, {{1}}" for op, name in names.items()}
    return formats | {("neg", kind): "fneg {T} {0}" for kind in (FLOAT64, FLOAT32)}


FORMATS: Mapping[tuple[str, str], str] = _formats()


def entrywise(name: str, function: str, kind: str, count: int) -> str:
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


def number(x: float, kind: str) -> str:
    """Return the text of a known number, or of a vector of equal ones."""
    if len(kind) > 1:
        return f"<{', '.join([f'{TYPES[kind[0]]} {number(x, kind[0])}'] * int(kind[1:]))}>"
    # LLVM writes a float as the double of the same value, which therefore has to be rounded first.
    if kind == FLOAT32:
        (x,) = unpack("<f", pack("<f", x))
    if kind in SUFFIXES:
        return f"0x{unpack('<Q', pack('<d', x))[0]:016X}"
    return str(int(x)) if kind == INTEGER else "null" if kind == POINTER else "true" if x else "false"
