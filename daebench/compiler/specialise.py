"""One function of the scheme language, rewritten for one problem: names resolved, parameters passed on, constants settled, work counted."""

import ast
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from daebench.compiler.syntax import DATA, LANGUAGE, RUN_TIME, SourceFile, call, called, gathered, parameters_of
from daebench.compiler.unroll import Unroller
from daebench.errors import InvalidProblem


class Linking(Protocol):
    """Interface of the linker for rewriting a function; :class:`daebench.compiler.link.Linker` describes the results."""

    derivation: Any
    constants: dict[str, bool | int | float]

    @property
    def kinds(self) -> Sequence[str]:
        """Kinds of work that are counted."""
        ...

    def file(self, module: str) -> SourceFile:
        """Return a source file as syntax."""
        ...

    def function(self, module: str, name: str, bound: Mapping[str, str]) -> str:
        """Emit a function of a file with these functions in place of its callable parameters; return its name."""
        ...

    def resolve(self, module: str, name: str) -> str:
        """Return the emitted name of an imported name of a file."""
        ...

    def given(self, emitted: str) -> list[str]:
        """Return the arguments that are appended to those of a function."""
        ...

    def takes_par(self, module: str, name: str) -> bool:
        """Whether calls of this function pass on the problem's parameters."""
        ...

    def work_of(self, emitted: str, name: str) -> list[int]:
        """Return the work that one call of this function counts for."""
        ...

    def tally(self, update: str) -> str:
        """Emit the function that turns a number of iterations into work; return its name."""
        ...


class Specialise(Unroller):
    """Rewrites one function: resolves names, passes parameters on, settles constants, removes annotations, and counts its calls."""

    def __init__(self, linker: Linking, file: SourceFile, bound: Mapping[str, str]) -> None:
        super().__init__(file.name)
        self.linker, self.file, self.bound = linker, file, bound
        self.work = [0] * len(linker.kinds)
        self.branches = 0
        self.reads = False

    def linked(self, node: ast.FunctionDef, emitted: str) -> ast.FunctionDef:
        """Return the function under its emitted name, with callable parameters replaced by the functions bound to them."""
        body = self.visited(node.body)
        arguments = [*(a for a in parameters_of(node) if a not in self.bound), "par", *[DATA] * self.reads]
        signature = ast.parse(f"def {emitted}({', '.join(arguments)}): pass").body[0]
        assert isinstance(signature, ast.FunctionDef)
        signature.body = body
        return ast.fix_missing_locations(signature)

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """Replace the language's constants and a file's literals by their values."""
        if node.id in self.indices:
            return ast.Constant(self.indices[node.id])
        module, name = self._target(node.id)
        if module == LANGUAGE and name in self.linker.constants:
            return ast.Constant(self.linker.constants[name])
        if module == LANGUAGE and name in RUN_TIME:
            self.reads |= RUN_TIME[name].startswith(DATA)
            return ast.parse(RUN_TIME[name].format(len(self.linker.derivation.parameters)), mode="eval").body
        return node if module == LANGUAGE else self.linker.file(module).literals.get(name, node)

    def visit_If(self, node: ast.If) -> ast.stmt | list[ast.stmt]:
        """Decide a branch on a constant of the language; visit any other."""
        if isinstance(node.test, ast.Name) and isinstance(test := self.visit_Name(node.test), ast.Constant):
            return self.visited(node.body if test.value else node.orelse)
        visited = self.generic_visit(node)
        assert isinstance(visited, ast.If)
        return visited

    def counts(self, name: str) -> bool:
        """Whether a name denotes the number of stages or of constraints."""
        return self._target(name) in ((LANGUAGE, "STAGES"), (LANGUAGE, "CONSTRAINTS"))

    def generic_visit(self, node: ast.AST) -> ast.AST:
        """Keep track of branches and loops: the number of calls inside them is not known."""
        inside = isinstance(node, ast.If | ast.For | ast.While | ast.IfExp | ast.BoolOp | ast.comprehension)
        self.branches += inside
        visited = super().generic_visit(node)
        self.branches -= inside
        return visited

    def visit_Call(self, node: ast.Call) -> ast.expr:
        """Resolve the called function and pass the parameters on."""
        assert isinstance(node.func, ast.Name)
        name = node.func.id
        if len(node.args) == 1 and isinstance(node.args[0], ast.GeneratorExp):
            return gathered(name, self.written_out(node.args[0]))
        module, target = self._target(name)
        if module == LANGUAGE and target == "tally":
            assert isinstance(node.args[0], ast.Name)
            return call(self.linker.tally(self.bound[node.args[0].id]), [self.visit(node.args[1])])
        if name in self.bound:
            if not self.branches:  # an iteration counts its own loop
                self._count(self.bound[name], self.linker.work_of(self.bound[name], self.bound[name]))
            return call(self.bound[name], [*map(self.visit, node.args), *self._given(self.bound[name])])
        if name not in self.file.imports and name not in self.file.functions:
            return call(name, [self.visit(a) for a in node.args])
        bound, handed = self._split(module, target, node.args)
        emitted = self.linker.function(module, target, bound) if bound else self.linker.resolve(module, target)
        self._count(target, self.linker.work_of(emitted, target))
        if self.linker.takes_par(module, target):
            handed += self._given(emitted)
        return call(emitted, handed)

    def _given(self, emitted: str) -> list[ast.expr]:
        """Return the arguments that are appended to those of a function."""
        given = self.linker.given(emitted)
        self.reads |= DATA in given
        return [ast.Name(name, ast.Load()) for name in given]

    def _count(self, name: str, work: Sequence[int]) -> None:
        """Add the work of one call. Work in branches cannot be counted, except in the loop over steps, which counts its own steps."""
        if any(work) and self.branches and not self.file.name.endswith(".loop"):
            raise InvalidProblem(
                f"{self.file.name} calls {name} in a branch or a loop, where its work cannot be counted; call it unconditionally."
            )
        self.work = [mine + more for mine, more in zip(self.work, work, strict=True)]

    def _target(self, name: str) -> tuple[str, str]:
        return self.file.imports.get(name, (self.file.name, name))

    def _split(self, module: str, target: str, arguments: Sequence[ast.expr]) -> tuple[dict[str, str], list[ast.expr]]:
        """Split a call's arguments into functions passed by name, emitted and bound to their parameters, and the others."""
        function = None if module == LANGUAGE else self.linker.file(module).functions[target]
        slots = [] if function is None else called(function)
        bound, handed = {}, []
        for position, argument in enumerate(arguments):
            if function is not None and (parameter := parameters_of(function)[position]) in slots:
                assert isinstance(argument, ast.Name)
                bound[parameter] = self.bound.get(argument.id) or self.linker.resolve(*self._target(argument.id))
            else:
                handed.append(self.visit(argument))
        return bound, handed
