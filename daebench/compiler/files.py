"""The files of schemes, run for one problem: on numbers, on values that record what is done with them, or on symbols of a chain.

A file is executed as it stands. The names that it imports from the scheme language are the problem's functions, the operations of an
algebra, or functions of other files; the constants of the language are known. What a machine does with a function, run it or follow it,
is the machine's affair.
"""

import ast
import builtins
import linecache
import threading
import types
from collections import ChainMap
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache, cached_property
from typing import Any, Protocol

from daebench.compiler import values
from daebench.compiler.linear.algebras import Arrays, Loops, Values
from daebench.compiler.linear.elimination import CHOICES, Target
from daebench.compiler.shapes import IDENTITY, MULTIPLIER, OVERLOADS, Kind, said
from daebench.compiler.syntax import LANGUAGES, PREFIX, RUN_TIME, TypedLiterals, path_of, placed, prepared
from daebench.errors import InvalidProblem
from daebench.schemes.kernels import language, poisson_language, spaces
from daebench.systems.files.package import text_of

Operation = Callable[..., Any]
Space = dict[str, Any]
"""Names, with what they mean."""


class Machine(Protocol):
    """A machine that runs functions of files. ``names`` take the place of those of Python; ``space`` has those of the generated module."""

    names: Space
    space: Space

    def add(self, text: str) -> None:
        """Add functions to the generated module, given by their source."""

    def take(self, name: str, operation: Operation) -> None:
        """Add an operation to the generated module."""

    def body(self, function: "Function") -> Operation:
        """Return the callable that runs the body of a function of a file."""


class Files:
    """The files of a scheme and of what surrounds it."""

    deferred = False
    """Whether both sides of a conditional expression are functions, for its test may be a symbol."""

    def __init__(self, plan: Mapping[str, Any], machine: Machine, algebra: str = "") -> None:
        self.plan, self.machine, self._algebra = plan, machine, algebra
        self._run = threading.local()
        self.read: dict[str, Space] = {}
        self._declared = cache(self._kinds)
        self.identity = values.Element(self.algebra, IDENTITY, None)

    def algebra(self, name: str, *held: Any) -> Any:
        """Carry out an operation of the algebra."""
        space = self.machine.space
        return (space[name] if name in space else self.operation(name))(*held)

    def operation(self, name: str) -> Any:
        """Return a function of the problem, an operation of the algebra, or a constant of the type of numbers, by name."""
        if name not in self.machine.space:
            if "exchanged" not in self.machine.space:
                self.add(CHOICES)
            self._operations.provide(name, self)
        return self.machine.space[name]

    @property
    def names(self) -> ChainMap[str, Any]:
        """Names that operations of the algebra may call."""
        return ChainMap(self.machine.space, self.machine.names, vars(builtins))

    def add(self, text: str) -> None:
        """Add functions to the module, given by their source."""
        self.machine.add(ast.unparse(TypedLiterals().visit(ast.parse(text))) if self.plan["single"] else text)

    def take(self, name: str, operation: Operation) -> None:
        """Add an operation to the module."""
        self.machine.take(name, operation)

    @cached_property
    def _operations(self) -> Any:
        # The text is the repr of an algebra, written into the generated module by the linker.
        return eval(self._algebra, {"Arrays": Arrays, "Target": Target, "Loops": Loops, "Values": Values})

    @contextmanager
    def given(self, par: Any) -> Iterator[None]:
        """Run with these parameters and run-time data."""
        before, self._run.par = self.par, par
        try:
            yield
        finally:
            self._run.par = before

    @property
    def par(self) -> Any:
        """Parameters and run-time data of what this thread runs."""
        return getattr(self._run, "par", ())

    def root(self, module: str, name: str) -> Operation:
        """Return a function of a file for code that holds vectors as the algebra does, and passes parameters last."""

        def called(*args: Any) -> Any:
            *arguments, par = args
            with self.given(par):
                function = self.function(module, name)
                given = self.as_kinds(name, function.kinds, [self._text(x) if callable(x) else x for x in arguments])
                return values.held(function(*given))

        called.taken = lambda: 1 + len(self.function(module, name).node.args.args)  # type: ignore[attr-defined]
        return called

    def _text(self, function: Operation) -> Operation:
        """Return a function of generated text for files."""

        def called(*args: Any) -> Any:
            return function(*map(values.held, args), self.par)

        called.key = getattr(function, "name", None) or function.__name__  # type: ignore[attr-defined]
        return called

    def function(self, module: str, name: str) -> "Function":
        """Return a function of a file."""
        function: Function = self.names_of(module)[name]
        return function

    def names_of(self, module: str) -> Space:
        """Return the names of a file, which is executed when it is first asked for."""
        if module not in self.read:
            # An import statement calls __import__ of the builtins: so a file imports the functions of its problem without a change.
            space: Space = {"__builtins__": {**vars(builtins), **self.machine.names, "__import__": self._import, "sum": values.summed}}
            space |= {"__name__": module, "_whole": values.whole, "_unrolled": lambda x: x, "_run_time": self._run_time}
            text = text_of(module)
            code, nodes = _compiled(module, text, self.deferred, self.plan["single"])
            # No file has this name: tracebacks, and the sentences of placed(), get its lines from here.
            linecache.cache[code.co_filename] = (len(text), None, text.splitlines(keepends=True), code.co_filename)
            exec(code, space)
            for name, function in space.items():
                if isinstance(function, types.FunctionType) and function.__globals__ is space:
                    space[name] = Function(self, module, function, nodes[function.__code__.co_firstlineno])
            space.update({name: Name(self, name) for name in self.plan.get("written", {}).get(module, ())})
            self.read[module] = space
        return self.read[module]

    def _import(self, name: str, into: Any = None, names: Any = None, asked: Sequence[str] = (), level: int = 0) -> Any:
        """Import for a file: names of the language and of other files are those of this problem."""
        if name in LANGUAGES:
            return types.SimpleNamespace(**{symbol: self._name(symbol) for symbol in asked})
        if name.startswith("daebench.schemes.") and not name.endswith(".claims"):
            return types.SimpleNamespace(**self.names_of(name))
        return __import__(name, into, names, asked, level)

    def _name(self, name: str) -> Any:
        if name in self.plan["constants"]:
            return self.plan["constants"][name]
        if name in RUN_TIME:
            return name
        if name == "State":
            return self.names_of(f"daebench.schemes.kernels.{self.plan['states']}")["State"]
        if name in ("EPS", "INF"):
            return self.operation(name)
        if name == "I":
            return self.identity
        if name in vars(spaces):
            return vars(spaces)[name]
        return Name(self, name)

    def _run_time(self, name: str) -> Any:
        """Return run-time data."""
        if name in self.plan["constants"]:
            return self.plan["constants"][name]
        return self.datum(*RUN_TIME[name])

    def datum(self, place: int, *inside: int) -> Any:
        """Return run-time data at a place behind the parameters."""
        data: Any = self.par[self.plan["after"] + place]
        for i in inside:
            data = data[i]
        return data

    def called(self, name: str, args: Sequence[Any]) -> Any:
        """Return the value of a call of a function of the scheme language."""
        if name == "tally":
            return self._tally(*args)
        if name == "multiplier":
            return values.Element(self.algebra, MULTIPLIER, tuple(args[0]))
        if name in OVERLOADS:
            operation, kind = values.overloaded(name, args)
            return values.as_kind(self.algebra, kind, self.algebra(operation, *map(values.held, args)))
        taken, result = self._declared(name)
        if home := self.plan["homes"].get(name):
            value = self.function(*home)(*args)
        else:
            args = self.as_kinds(name, taken, args)
            value = self.operation(name)(*map(values.held, args), *[self.par] * (not self.bare(name)))
        return values.like(args[0], value) if name == "with_tangents" else values.as_kind(self.algebra, result, value, vouched=True)

    def _kinds(self, name: str) -> tuple[Sequence[Kind], Kind]:
        """Return the declared kinds of the parameters and of the result of a function of the scheme language."""
        files = [language, poisson_language] if self.plan["states"] == "constrained" else [poisson_language, language]
        declared = next((vars(file)[name] for file in files if name in vars(file)), None)
        return values.kinds_of(declared) if declared else ((), None)

    def bare(self, name: str) -> bool:
        """Whether a function is called without the parameters of the problem."""
        return name in self.plan["bare"]

    def as_kinds(self, name: str, kinds: Sequence[Kind], args: Sequence[Any]) -> list[Any]:
        """Return the arguments of a function as what it takes."""
        taken = [values.whole(x) for x in args]
        for place, (kind, x) in enumerate(zip(kinds, taken, strict=False)):
            try:
                taken[place] = values.as_kind(self.algebra, kind, x)
            except values.Misfit as error:
                raise values.Misfit(f"argument {place + 1} is {values.named(x)}, but {name} takes {said(kind)} there") from error
        return taken

    def _tally(self, update: Any, iterations: Any) -> Any:
        return tuple([n * iterations for n in self.plan["work"].get(update.key, ())])


class Name:
    """A function of the scheme language, for files that import it."""

    def __init__(self, files: Files, name: str) -> None:
        self.files, self.name = files, name

    def __call__(self, *args: Any) -> Any:
        """Return the value of a call."""
        return self.files.called(self.name, args)


class Function:
    """A function of a file."""

    def __init__(self, files: Files, module: str, plain: types.FunctionType, node: ast.FunctionDef) -> None:
        self.files, self.module, self.plain, self.node = files, module, plain, node
        self.name, self.key = plain.__name__, f"{module}.{plain.__name__}"
        self._kinds = values.kinds_of(plain)
        self.kinds = self._kinds[0]

    @cached_property
    def _body(self) -> Operation:
        return self.files.machine.body(self)

    def __call__(self, *args: Any) -> Any:
        """Return the value of a call, of which everything is whole."""
        taken = self.files.as_kinds(self.name, self.kinds, args)
        try:
            value = self._body(*taken)
        except values.Misfit as error:
            raise placed(error) or error from error
        try:
            return values.as_kind(self.files.algebra, self._kinds[1], value, vouched=True)
        except values.Misfit as error:
            where = f"{path_of(self.module)}, line {self.node.lineno}"
            raise InvalidProblem(
                f"{where}: {self.name} does not return what its annotation says: {error}.", "scheme-return-annotation"
            ) from error


@cache
def _compiled(module: str, text: str, deferred: bool, single: bool) -> tuple[types.CodeType, Mapping[int, ast.FunctionDef]]:
    """Return the code of a file, and the syntax of its functions by their first lines."""
    tree = prepared(path_of(module), text, deferred, single)
    nodes = {node.lineno: node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    return compile(tree, f"{PREFIX}{module}", "exec"), nodes


def roots(files: Files) -> dict[str, Operation]:
    """Return the functions of files, and operations, that text calls, by their names there."""
    operations = {name: files.operation(name) for name in files.plan["operations"]}
    return operations | {name: files.root(*home) for name, home in files.plan["roots"].items()}
