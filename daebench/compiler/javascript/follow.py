"""Follows a linked module as Python would run it, with numbers that stand for variables, and records each operation."""

import ast
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from daebench.compiler.javascript.expressions import Evaluator, untranslatable
from daebench.compiler.javascript.frames import Again, Frame, Known, several_places
from daebench.compiler.javascript.numbers import Dual, Entries, Number, Real, atom, value_of
from daebench.compiler.javascript.statements import Break, For, If, Label, Put, Set, Variables

RESULT = "return"
"""Key of the value of a function that returns from several places."""


class Follower(Evaluator):
    """Follows functions of a module, statement by statement."""

    @contextmanager
    def within(self, block: list[Any]) -> Iterator[None]:
        """Write into another block."""
        outer, self.block = self.block, block
        yield
        self.block = outer

    def call(self, name: str, arguments: Sequence[Any]) -> Any:
        """Return the result of a function; its statements are written at the place of the call."""
        node = self.functions[name]
        parameters = [argument.arg for argument in node.args.args]
        changing = several_places(node, parameters) | {variable for function, variable in self.known.changing if function == name}
        frame, body = Frame(name, changing, Variables(), self.name()), list[Any]()
        with self.within(body):
            for parameter, argument in zip(parameters, arguments, strict=True):
                self.bind(frame, parameter, argument, copied=False)
            ended, value = self.run(frame, node.body)
        assert ended or name == "store", f"{name} ends without a result"
        self.block.append(frame.declared)
        if RESULT in frame.storage:
            self.block.append(Label(frame.label, body))
            return frame.storage[RESULT]
        self.block += body
        return value

    def bind(self, frame: Frame, name: str, value: Any, *, copied: bool = True) -> None:
        """Give a variable a value: a new name, or storage if it changes."""
        if name in frame.changing or name == RESULT:
            self.keep(frame, name, value)
        else:
            frame.values[name] = self.copied(value) if copied else value
            frame.escaped.discard(name)

    def copied(self, value: Any) -> Any:
        """Return a value with copies of the parts that may change."""
        match value:
            case tuple():
                return tuple(map(self.copied, value))
            case Dual():
                return Dual(self.copied(value.value), self.copied(value.parts))
            case Real() if value.name in self.changing_names:
                return Real(self.let(value.name))
        return value

    def keep(self, frame: Frame, name: str, value: Any) -> None:
        """Write a value into the storage of a variable that changes."""
        places: list[int] = [0]
        if name not in frame.storage:
            frame.storage[name] = self.storage(frame, name, value, places)
            places = [0]
        pairs = list(self.pairs(frame, name, frame.storage[name], value, places))
        sources = [source if atom(source) == target else self.copied(source) for target, source in pairs]
        self.block += [Set(target, atom(source)) for (target, _), source in zip(pairs, sources, strict=True) if atom(source) != target]

    def storage(self, frame: Frame, name: str, value: Any, places: list[int]) -> Any:
        """Return new variables for a value of this form."""
        if isinstance(value, tuple):
            return tuple(self.storage(frame, name, entry, places) for entry in value)
        if value is None or isinstance(value, Entries):
            return value
        k = len(value.parts) if isinstance(value, Dual) else self.known.directions.get((frame.function, name, places[0]), 0)
        places[0] += 1
        names = [self.name() for _ in range(k + 1)]
        frame.declared.names += names
        self.changing_names |= set(names)
        return Dual(Real(names[0]), tuple(map(Real, names[1:]))) if k else Real(names[0])

    def pairs(self, frame: Frame, name: str, target: Any, value: Any, places: list[int]) -> Iterator[tuple[str, Number]]:
        """Yield the variables of a storage, each with the number to be stored there."""
        if isinstance(target, tuple):
            for inner, entry in zip(target, value, strict=True):
                yield from self.pairs(frame, name, inner, entry, places)
        elif isinstance(target, Dual):
            parts = value.parts if isinstance(value, Dual) else (0.0,) * len(target.parts)
            yield from zip([target.value.name, *(part.name for part in target.parts)], [value_of(value), *parts], strict=True)
            places[0] += 1
        elif isinstance(target, Real):
            if isinstance(value, Dual):
                self.known.directions[frame.function, name, places[0]] = len(value.parts)
                raise Again
            places[0] += 1
            yield target.name, value

    def run(self, frame: Frame, body: Sequence[ast.stmt]) -> tuple[bool, Any]:  # noqa: C901 - a case a kind of statement
        """Follow statements; return whether they end the function, and its result if they do."""
        for node in body:
            match node:
                case ast.Expr(value=ast.Call()):
                    self.evaluate(frame, node.value)
                case ast.Expr():
                    pass
                case ast.Assign(targets=[target], value=value):
                    self.assign(frame, target, self.evaluate(frame, value))
                case ast.AugAssign(target=ast.Name(id=name), op=op, value=value):
                    self.bind(frame, name, self.binary(op, self.variable(frame, name), self.evaluate(frame, value)))
                case ast.Return(value=value):
                    return True, self.returned(frame, self.evaluate(frame, value) if value else None)
                case ast.If(test=test, body=then, orelse=other):
                    if (ended := self.branch(frame, self.evaluate(frame, test), then, other)) is not None:
                        return ended
                case ast.For(target=ast.Name(id=name), iter=ast.Call(args=bounds), body=inner):
                    self.loop(frame, name, [self.evaluate(frame, bound) for bound in bounds], inner)
                case _:
                    raise untranslatable(node)
        return False, None

    def returned(self, frame: Frame, value: Any) -> Any:
        """Return the result of a function that ends here; it is stored if the function may also end elsewhere."""
        if not frame.depth and RESULT not in frame.storage:
            return value
        self.bind(frame, RESULT, value)
        if frame.depth:
            self.block.append(Break(frame.label))
        return frame.storage[RESULT]

    def branch(self, frame: Frame, test: Number, then: Sequence[ast.stmt], other: Sequence[ast.stmt]) -> tuple[bool, Any] | None:
        """Follow a branch; return the result of :meth:`run` if the branch ends the function."""
        if not isinstance(test, Real):
            ended = self.run(frame, then if test else other)
            return ended if ended[0] else None
        statement = If(test.name, [], [])
        ends = [self.nested(frame, block, body) for block, body in ((statement.then, then), (statement.other, other))]
        self.block.append(statement)
        return (True, frame.storage[RESULT]) if all(ends) else None

    def nested(self, frame: Frame, block: list[Any], body: Sequence[ast.stmt]) -> bool:
        """Follow the statements of a block, whose local names end with it; return whether they end the function."""
        before = dict(frame.values)
        frame.depth += 1
        with self.within(block):
            ended, _ = self.run(frame, body)
        frame.depth -= 1
        frame.escaped |= {name for name, value in frame.values.items() if before.get(name) is not value}
        frame.values = {name: value for name, value in before.items() if name not in frame.escaped}
        return ended

    def loop(self, frame: Frame, name: str, bounds: Sequence[Number], body: Sequence[ast.stmt]) -> None:
        """Follow a loop."""
        start, stop = (0, *bounds) if len(bounds) == 1 else bounds
        counter, block = self.name(), list[Any]()
        self.changing_names.add(counter)
        frame.values[name] = Real(counter)
        self.nested(frame, block, body)
        self.block.append(For(counter, atom(start), atom(stop), block))

    def assign(self, frame: Frame, target: ast.expr, value: Any) -> None:
        """Assign a value to the left-hand side; several variables are assigned at once."""
        match target:
            case ast.Name(id=name):
                self.bind(frame, name, value)
            case ast.Tuple(elts=targets):
                for inner, entry in zip(targets, self.copied(value), strict=True):
                    self.assign(frame, inner, entry)
            case ast.Subscript(value=ast.Name(id=name), slice=ast.Tuple(elts=[row, ast.Constant(value=column)])):
                array = self.variable(frame, name)
                place = self.arithmetic.binary("+", self.arithmetic.binary("*", self.evaluate(frame, row), array.width), column)
                self.block.append(Put(array.name, atom(place), atom(value)))
            case _:
                raise untranslatable(target)


Roots = Callable[[Follower], None]
"""A function that follows functions of a module and records where their results go."""


def followed(source: str, roots: Roots) -> list[Any]:
    """Return the statements that ``roots`` produces. ``roots`` is called again until all variables are known."""
    known = Known()
    while True:
        follower = Follower(source, known)
        try:
            roots(follower)
        except Again:
            continue
        return follower.block
