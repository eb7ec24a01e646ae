"""Declared kinds of the names that a function of a scheme file uses: kinds of constants, functions, and annotations."""

import ast
from collections.abc import Callable

from daebench.compiler.shapes import INDEX, NAMED, NUMBER, Function, Kind, Pack, Stages, Variable
from daebench.compiler.syntax import SourceFile


class Declarations:
    """Kinds of the names that a file imports or defines; ``read`` returns the file of a module."""

    def __init__(self, file: SourceFile, read: Callable[[str], SourceFile]) -> None:
        self.file, self.read = file, read

    def _home(self, name: str) -> tuple["Declarations", str]:
        """Return the file where a name is defined, and its name there."""
        module, defined_name = self.file.homes.get(name, (self.file.name, name))
        return (self, defined_name) if module == self.file.name else (Declarations(self.read(module), self.read), defined_name)

    def kind(self, name: str) -> Kind:
        """Return the kind of a constant, or of a function."""
        home, defined_name = self._home(name)
        if defined_name in home.file.functions:
            return home.signature(home.file.functions[defined_name])
        if defined_name in home.file.literals:
            return {int: INDEX, float: NUMBER}.get(type(home.file.literals[defined_name].value))
        return home.annotated(home.file.annotations.get(defined_name))

    def signature(self, node: ast.FunctionDef) -> Function:
        """Return the kinds of the parameters and of the result of a function."""
        return Function(tuple(self.annotated(argument.annotation) for argument in node.args.args), self.annotated(node.returns))

    def annotated(self, annotation: ast.expr | None) -> Kind:
        """Return the kind that an annotation names; None if it names none."""
        match annotation:
            case ast.Name(id=name):
                return NAMED[name] if name in NAMED else self._alias(name)
            case ast.Subscript(value=ast.Name(id="Callable"), slice=ast.Tuple(elts=[parameters, result])):
                known = parameters.elts if isinstance(parameters, ast.List) else []
                return Function(tuple(map(self.annotated, known)), self.annotated(result))
            case ast.Subscript(value=ast.Name(id="tuple"), slice=ast.Tuple(elts=[entry, ast.Constant(value=end)])) if end is ...:
                return Stages(self.annotated(entry))
            case ast.Subscript(value=ast.Name(id="tuple"), slice=ast.Tuple(elts=entries)):
                return Pack(tuple(map(self.annotated, entries)))
            case ast.Subscript(value=ast.Name(id="tuple"), slice=entry):
                return Pack((self.annotated(entry),))
        return None

    def _alias(self, name: str) -> Kind:
        """Return the kind of an alias defined in a file, or a type variable that calls determine."""
        home, defined_name = self._home(name)
        meaning = home.file.aliases.get(defined_name)
        return Variable(defined_name) if isinstance(meaning, ast.Call) else home.annotated(meaning)
