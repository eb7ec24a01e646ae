"""The functions of a generated module, recorded: those without branches are executed by Python itself, others are followed."""

import re
from collections.abc import Callable, Sequence
from typing import Any

from daebench.compiler.files import Files, roots
from daebench.compiler.files import Function as OfFile
from daebench.compiler.syntax import steers
from daebench.compiler.trace.arrays import Array, contiguous
from daebench.compiler.trace.code import Code
from daebench.compiler.trace.complex import COMPLEX, Complex
from daebench.compiler.trace.follow import Follower, Steered
from daebench.compiler.trace.ir import FLOAT64, INTEGER, POINTER, Call, Function, If, Loop, Region, Value
from daebench.compiler.trace.names import names
from daebench.compiler.trace.structure import parts_of, pattern_of, rebuilt
from daebench.compiler.trace.together import Together

INLINED = 300
"""Operations of the longest function of which each call is recorded anew where nothing else is asked for."""

LONG = 1500
"""Letters of the shortest function without branches that may be called in place of being recorded anew."""

_FUNCTION = re.compile(r"^def (\w+)\(([^\n]*)\):(?:\n(?:[ \t][^\n]*)?)*", re.M)
_DOCSTRING = re.compile(r'"""(?:[^"]|"(?!""))*"""', re.S)
_STEERS = re.compile(r"\b(?:if|and|or|not|for|while)\b|[<>]|[=!]=")
_CALLED = re.compile(r"\b(\w+)\(")


def parameters_in(text: str, name: str) -> list[str]:
    """Return the names of the parameters of a function in the source of a module."""
    match = re.search(rf"^def {name}\((.*)\):$", text, re.M)
    return match[1].split(", ") if match else []


class Sized:
    """A function without branches that may be long and called often."""

    def __init__(self, program: "Program", name: str, function: Callable[..., Any]) -> None:
        self.program, self.name, self.function = program, name, function

    def __call__(self, *args: Any) -> Any:
        """Return the value of a call."""
        return self.program.called(self, args)

    def called(self, args: Sequence[Any]) -> str:
        """Return its name."""
        return self.name

    def inlined(self, args: Sequence[Any]) -> Any:
        """Record the function where it is called; return its result."""
        return self.function(*args)


class InFile(Steered):
    """A function of a file; the last of its arguments are the parameters and the run-time data."""

    program: "Program"
    plain: Callable[..., Any] | None = None

    def called(self, args: Sequence[Any]) -> str:
        """Return its name, with those of the functions that it is given."""
        return " ".join([self.name, *(x.key for x in args if hasattr(x, "key"))])

    def inlined(self, args: Sequence[Any]) -> Any:
        """Record the function where it is called, followed if it steers, else executed by Python; return its result."""
        *arguments, par = args
        with self.program.files.given(par):
            return self.plain(*arguments) if self.plain else super().inlined(arguments)


class Program:
    """The functions of a module, to be recorded."""

    def __init__(self, text: str, *, inlined: int = INLINED, alone: int = 0) -> None:
        self.code, self.inlined, self.alone = Code(), inlined, alone
        self.space: dict[str, Any] = names(self.code)
        self.sites: dict[str, int] = {}
        self.sizes: dict[str, int] = {}
        self.instances: dict[Any, tuple[Function, Any, bool]] = {}
        self.functions: list[Function] = []
        self.names, self.long = names(self.code), set[str]()
        self.space["files"] = self._files
        rest = self._add(text)
        lines = _DOCSTRING.sub("", rest).split("\n")
        exec("\n".join(line for line in lines if not line.startswith(("from ", "import ", "#"))), self.space)
        self.code.together = str(self.space.get("LANES", ""))
        self.follower: type[Follower] = Together if self.code.together else Follower

    def _add(self, text: str, *, many: bool = False) -> str:
        """Add the functions of a text, which are called ``many`` times; return the rest of it."""
        straight: list[tuple[str, str, int]] = []
        rest, at = [], 0
        for match in _FUNCTION.finditer(text):
            rest.append(text[at : match.start()])
            at = match.end()
            name, source = match[1], match[0]
            bare = _DOCSTRING.sub("", source.partition("\n")[2])
            for called in [*_CALLED.findall(bare), *[name] * (2 * many)]:
                self.sites[called] = self.sites.get(called, 0) + 1
            if _STEERS.search(bare):
                self.space[name] = Steered(self, name, source, space=self.space)
            else:
                straight.append((name, source, len(bare)))
        exec("\n".join(source for _, source, _ in straight), self.space)
        self.long |= {name for name, _, length in straight if length > LONG}
        self._size()
        return "".join([*rest, text[at:]])

    # ---- files of schemes ------------------------------------------------------------------------------------------------

    def _files(self, space: dict[str, Any], plan: Any, algebra: str) -> Files:
        """Return the files of schemes of a module, whose names get those of their roots."""
        self.files = Files(plan, self, algebra)
        for name, times in plan["sites"].items():
            self.sites[name] = self.sites.get(name, 0) + times
        self._size()
        functions = roots(self.files)
        for root in functions.values():
            root.program = self  # type: ignore[attr-defined]
        self.space.update(functions)
        return self.files

    def add(self, text: str) -> None:
        """Add operations of the algebra."""
        self._add(text, many=True)

    def take(self, name: str, operation: Callable[..., Any]) -> None:
        """Add an operation of the algebra."""
        self.sites[name] = self.sites.get(name, 0) + 2
        self.space[name] = Sized(self, name, operation)

    def body(self, function: OfFile) -> Callable[..., Any]:
        """Return the callable that records a call of a function of a file."""
        plain = function.plain
        callee = InFile(self, function.key, node=function.node, space={**plain.__globals__, "__file__": plain.__code__.co_filename})
        callee.plain = None if steers(function.node) else plain
        return lambda *args: self.called(callee, (*args, self.files.par))

    # ---- calls -----------------------------------------------------------------------------------------------------------

    def _size(self) -> None:
        """Have long functions that are called several times recorded once."""
        for name in self.long:
            if self.sites.get(name, 0) > 1 and not isinstance(self.space[name], Sized):
                self.space[name] = Sized(self, name, self.space[name])

    def called(self, function: Steered | Sized, args: Sequence[Any]) -> Any:
        """Return the value of a call: the first is recorded where it is, and if that was long, others are calls of one function."""
        name = function.called(args)
        if self.sites.get(name, 0) <= 1:
            if not self.alone or self._size_of(function, name, args) <= self.alone:
                return function.inlined(args)
        elif name not in self.sizes:
            block, start = self.code.block, len(self.code.block)
            result = function.inlined(args)
            self.sizes[name] = operations(block[start:])
            return result
        if self.sizes[name] <= self.inlined:
            return function.inlined(args)
        parts = parts_of(args)
        key = name, tuple(x.kind if isinstance(x, Value) else repr(x) for x in parts), pattern_of(args)
        allocated = self.code.allocated
        if key not in self.instances:
            made = self.instance(f"f{len(self.instances)}_{function.name.rpartition('.')[2]}", function, args)
            self.instances[key] = *made, self.code.allocated != allocated
        instance, structure, allocates = self.instances[key]
        self.code.allocated = allocated + allocates  # also where it was recorded before: a loop gives back what its calls allocate
        call = Call(self.code, instance, tuple(x for x in parts if isinstance(x, Value)))
        self.code.block.append(call)
        results = iter(call.results)
        return rebuilt(structure, (next(results) if isinstance(x, Value) else x for x in parts_of(structure)))

    def _size_of(self, function: Steered | Sized, name: str, args: Sequence[Any]) -> int:
        """Return the number of operations of a function, recorded aside."""
        if name not in self.sizes:
            aside: list[Any] = []
            with self.code.inside(aside):
                function.inlined(args)
            self.sizes[name] = operations(aside)
        return self.sizes[name]

    def instance(self, name: str, function: Steered | Sized, args: Sequence[Any]) -> tuple[Function, Any]:
        """Record a function of its own; return it with the structure of its result."""

        def given(recording: Function) -> Any:
            return rebuilt(args, (self.parameter(recording, x.kind) if isinstance(x, Value) else x for x in parts_of(args)))

        return self._recorded(name, function, given)

    def _recorded(self, name: str, function: Steered | Sized, given: Callable[[Function], Any]) -> tuple[Function, Any]:
        return self.recorded(name, lambda recording: function.inlined(given(recording)))

    def recorded(self, name: str, make: Callable[[Function], Any]) -> tuple[Function, Any]:
        """Record the operations of ``make``, given a function for its parameters; return that function and the structure of its result."""
        recording = Function(name)
        with self.code.apart(recording):
            result = make(recording)
        recording.results = [x for x in parts_of(result) if isinstance(x, Value)]
        self.functions.append(recording)
        return recording, result

    def parameter(self, function: Function, kind: str) -> Value:
        """Return a new parameter of a function."""
        function.parameters.append(Value(self.code, "parameter", kind))
        return function.parameters[-1]

    def entry(self, name: str, args: Sequence[Any]) -> tuple[Function, Any]:
        """Return the function of this name for arguments of these forms, and the structure of its result.

        Forms are letters of :mod:`daebench.compiler.trace.ir` for numbers, nested tuples of forms, None, and for arrays lists of a letter,
        the number of axes, and whether rows follow each other in memory.
        """

        def given(recording: Function, form: Any) -> Any:
            if isinstance(form, tuple):
                return tuple([given(recording, part) for part in form])
            if form == COMPLEX:
                return Complex(self.code, *(self.parameter(recording, FLOAT64) for _ in range(2)))
            if not isinstance(form, list):
                return form and self.parameter(recording, form)
            kind, axes, ordered = form
            pointer, *lengths = [self.parameter(recording, letter) for letter in (POINTER, *[INTEGER] * (axes if ordered else 2 * axes))]
            return Array(pointer, kind, lengths[:axes], contiguous(lengths) if ordered else lengths[axes:])

        function = self.space[name]
        function = function if isinstance(function, Steered | Sized) else Sized(self, name, function)
        return self._recorded(f"entry_{name}", function, lambda recording: given(recording, tuple(args)))


def operations(block: Sequence[Any]) -> int:
    """Return the number of operations in a block."""
    total = len(block)
    for node in block:
        if isinstance(node, If):
            total += operations(node.blocks[0]) + operations(node.blocks[1])
        elif isinstance(node, Region | Loop):
            total += operations(node.block)
    return total
