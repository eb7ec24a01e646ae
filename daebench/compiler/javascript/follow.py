"""What follows a linked module as Python would run it, with numbers that stand for variables, and writes down each operation."""

import ast
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from daebench.compiler.javascript.duals import functions
from daebench.compiler.javascript.numbers import ELEMENTARY, Arithmetic, Dual, Entries, Number, Real, atom, value_of
from daebench.compiler.javascript.statements import Break, Expression, For, If, Label, Let, Put, Set, Variables
from daebench.errors import BadInput

BINARY = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
COMPARE = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "===", ast.NotEq: "!=="}
LETTERS = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
DIGITS = "0123456789"
RESULT = "return"
"""What the value of a function that returns from several places is kept under."""


class Again(Exception):
    """A variable turned out to be another kind than its first value; what is known of it now is kept for the next attempt."""


@dataclass
class Known:
    """What is known of variables before a module is followed.

    Parameters
    ----------
    changing : set of (str, str)
        Function and variable that is given a value in one block and read in another.
    directions : dict of (str, str, int) to int
        Function, variable and place in it that holds dual numbers, and in how many directions.
    """

    changing: set[tuple[str, str]] = field(default_factory=set)
    directions: dict[tuple[str, str, int], int] = field(default_factory=dict)


@dataclass
class Frame:
    """A call of a function that is being followed.

    Parameters
    ----------
    function : str
        Its name.
    changing : set of str
        Variables that are given values in more than one block.
    values, storage : dict
        Values of the others, and where these are kept.
    """

    function: str
    changing: set[str]
    declared: Variables
    label: str
    values: dict[str, Any] = field(default_factory=dict)
    storage: dict[str, Any] = field(default_factory=dict)
    escaped: set[str] = field(default_factory=set)
    depth: int = 0


class Follower:
    """Follows functions of a module.

    Parameters
    ----------
    source : str
        The module that the linker has made.
    known : Known
        What earlier attempts have found out.
    """

    def __init__(self, source: str, known: Known) -> None:
        self.functions: dict[str, ast.FunctionDef] = {}
        self.constants: dict[str, Any] = {}
        self.known, self.count, self.block = known, 0, list[Any]()
        self.changing_names: set[str] = set()
        self.arithmetic = Arithmetic(self.let)
        self.dual_functions = functions(self.arithmetic)
        for node in ast.parse(source).body:
            if isinstance(node, ast.FunctionDef):
                self.functions[node.name] = node
            elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                infinite = isinstance(node.value, ast.Attribute) and node.value.attr == "inf"
                self.constants[node.targets[0].id] = float("inf") if infinite else ast.literal_eval(node.value)

    def name(self) -> str:
        """Return a name that is not in use: a letter, a digit, and so on, which no word of the language is."""
        k, self.count = self.count, self.count + 1
        text = LETTERS[k % 52] + DIGITS[k // 52 % 10]
        k //= 520
        while k:
            text, k = text + LETTERS[k % 52], k // 52
        return text

    def let(self, expression: Expression) -> str:
        """Give an expression a name."""
        name = self.name()
        self.block.append(Let(name, expression))
        return name

    @contextmanager
    def within(self, block: list[Any]) -> Iterator[None]:
        """Write into another block."""
        outer, self.block = self.block, block
        yield
        self.block = outer

    def call(self, name: str, arguments: Sequence[Any]) -> Any:
        """Return what a function returns; its statements are written where it is called."""
        node = self.functions[name]
        parameters = [argument.arg for argument in node.args.args]
        changing = several_places(node, parameters) | {variable for function, variable in self.known.changing if function == name}
        frame, body = Frame(name, changing, Variables(), self.name()), list[Any]()
        with self.within(body):
            for parameter, argument in zip(parameters, arguments, strict=True):
                self.bind(frame, parameter, argument, copied=False)
            ended, value = self.run(frame, node.body)
        assert ended or name == "store", f"{name} has an end without a result"
        self.block.append(frame.declared)
        if RESULT in frame.storage:
            self.block.append(Label(frame.label, body))
            return frame.storage[RESULT]
        self.block += body
        return value

    def bind(self, frame: Frame, name: str, value: Any, *, copied: bool = True) -> None:
        """Give a variable a value: a name for it, or a place where it is kept."""
        if name in frame.changing or name == RESULT:
            self.keep(frame, name, value)
        else:
            frame.values[name] = self.copied(value) if copied else value
            frame.escaped.discard(name)

    def copied(self, value: Any) -> Any:
        """Return a value with copies of what may change."""
        match value:
            case tuple():
                return tuple(map(self.copied, value))
            case Dual():
                return Dual(self.copied(value.value), self.copied(value.parts))
            case Real() if value.name in self.changing_names:
                return Real(self.let(value.name))
        return value

    def keep(self, frame: Frame, name: str, value: Any) -> None:
        """Put a value where a variable that changes is kept."""
        places: list[int] = [0]
        if name not in frame.storage:
            frame.storage[name] = self.storage(frame, name, value, places)
            places = [0]
        pairs = list(self.pairs(frame, name, frame.storage[name], value, places))
        sources = [source if atom(source) == target else self.copied(source) for target, source in pairs]
        self.block += [Set(target, atom(source)) for (target, _), source in zip(pairs, sources, strict=True) if atom(source) != target]

    def storage(self, frame: Frame, name: str, value: Any, places: list[int]) -> Any:
        """Return new variables for a value of a form."""
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
        """Yield the variables of a storage with the numbers that go there."""
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
        """Follow statements; return whether they end the function, and what it then returns."""
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
        """Return the value of a function that ends here, kept where it may end elsewhere."""
        if not frame.depth and RESULT not in frame.storage:
            return value
        self.bind(frame, RESULT, value)
        if frame.depth:
            self.block.append(Break(frame.label))
        return frame.storage[RESULT]

    def branch(self, frame: Frame, test: Number, then: Sequence[ast.stmt], other: Sequence[ast.stmt]) -> tuple[bool, Any] | None:
        """Follow a branch; return what :meth:`run` does where it ends the function."""
        if not isinstance(test, Real):
            ended = self.run(frame, then if test else other)
            return ended if ended[0] else None
        statement = If(test.name, [], [])
        ends = [self.nested(frame, block, body) for block, body in ((statement.then, then), (statement.other, other))]
        self.block.append(statement)
        return (True, frame.storage[RESULT]) if all(ends) else None

    def nested(self, frame: Frame, block: list[Any], body: Sequence[ast.stmt]) -> bool:
        """Follow the statements of a block, whose own names end with it; return whether they end the function."""
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
        """Give what stands on the left a value; of several variables, all at once."""
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

    def variable(self, frame: Frame, name: str) -> Any:
        """Return what a name stands for."""
        if name in frame.storage:
            return frame.storage[name]
        if name in frame.values:
            return frame.values[name]
        if name in frame.escaped:
            self.known.changing.add((frame.function, name))
            raise Again
        return self.constants[name]

    def binary(self, op: ast.operator, a: Any, b: Any) -> Any:
        """Return the result of an operator."""
        if isinstance(op, ast.Pow):
            return self.arithmetic.power(a, b)
        return a + b if isinstance(a, tuple) else self.arithmetic.binary(BINARY[type(op)], a, b)

    def evaluate(self, frame: Frame, node: ast.expr) -> Any:  # noqa: C901 - a case a kind of expression
        """Return the value of an expression."""
        match node:
            case ast.Constant(value=value):
                return value
            case ast.Name(id=name):
                return self.variable(frame, name)
            case ast.Tuple(elts=entries) | ast.List(elts=entries):
                return self.entries(frame, entries)
            case ast.Subscript(value=value, slice=place):
                return self.entry(self.evaluate(frame, value), self.place(frame, place))
            case ast.Attribute(attr="inf"):
                return float("inf")
            case ast.Attribute(attr="real", value=value):
                return value_of(self.evaluate(frame, value))
            case ast.BinOp(left=left, op=op, right=right):
                return self.binary(op, self.evaluate(frame, left), self.evaluate(frame, right))
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return self.arithmetic.negative(self.evaluate(frame, operand))
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return self.arithmetic.negated(self.evaluate(frame, operand))
            case ast.BoolOp(op=op, values=values):
                return self.logical(frame, "&&" if isinstance(op, ast.And) else "||", values)
            case ast.Compare(left=left, ops=ops, comparators=others):
                return self.compared(ops, [self.evaluate(frame, side) for side in (left, *others)])
            case ast.IfExp(test=test, body=then, orelse=other):
                chosen = self.evaluate(frame, test)
                if not isinstance(chosen, Real):
                    return self.evaluate(frame, then if chosen else other)
                return self.arithmetic.chosen(chosen, self.evaluate(frame, then), self.evaluate(frame, other))
            case ast.Call(func=ast.Name(id=name), args=arguments):
                return self.called(name, self.entries(frame, arguments))
        raise untranslatable(node)

    def entries(self, frame: Frame, nodes: Sequence[ast.expr]) -> tuple[Any, ...]:
        """Return the values of expressions, of which some may be tuples that are written out."""
        values: list[Any] = []
        for node in nodes:
            values += self.evaluate(frame, node.value) if isinstance(node, ast.Starred) else [self.evaluate(frame, node)]
        return tuple(values)

    def place(self, frame: Frame, node: ast.expr) -> Any:
        """Return an index, several, or a slice."""
        if isinstance(node, ast.Slice):
            return slice(*(None if end is None else self.evaluate(frame, end) for end in (node.lower, node.upper, node.step)))
        return self.evaluate(frame, node)

    def entry(self, value: Any, place: Any) -> Any:
        """Return an entry of a tuple or of an array."""
        if isinstance(place, tuple):
            for index in place:
                value = self.entry(value, index)
            return value
        return Real(self.let(("index", value.name, atom(place)))) if isinstance(value, Entries) else value[place]

    def logical(self, frame: Frame, operation: str, nodes: Sequence[ast.expr]) -> Number:
        """Return whether all, or any, of several expressions are true."""
        result = self.evaluate(frame, nodes[0])
        for node in nodes[1:]:
            if not isinstance(result, Real) and bool(result) == (operation == "||"):
                return result
            result = self.arithmetic.logical(operation, result, self.evaluate(frame, node))
        return result

    def compared(self, ops: Sequence[ast.cmpop], sides: Sequence[Number]) -> Number:
        """Return whether neighbours compare."""
        result: Number = True
        for op, a, b in zip(ops, sides, sides[1:], strict=False):
            result = self.arithmetic.logical("&&", result, self.arithmetic.compare(COMPARE[type(op)], a, b))
        return result

    def called(self, name: str, arguments: tuple[Any, ...]) -> Any:  # noqa: C901 - a case a kind of function
        """Return the result of a function of the module, of dual numbers, of Python or of NumPy."""
        if name in self.functions:
            return self.call(name, arguments)
        if name in self.dual_functions:
            return self.dual_functions[name](*arguments)
        if name in ("max", "min"):
            result, *others = arguments
            for other in others:
                result = self.arithmetic.extreme(">" if name == "max" else "<", result, other)
            return result
        if name in ELEMENTARY:
            return self.arithmetic.elementary(name, arguments[0])
        if name == "arctan2" and not any(isinstance(argument, Dual) for argument in arguments):
            return self.arithmetic.made("Math.atan2", *arguments)
        if name == "bool":
            return arguments[0]
        if name == "len":
            (value,) = arguments
            return Real(self.let(("length", value.name))) if isinstance(value, Entries) else len(value)
        raise BadInput(f"a page has no {name} of such numbers; take another problem or method for it.")


def several_places(node: ast.FunctionDef, parameters: Sequence[str]) -> set[str]:
    """Return the names of variables that are given values in more than one block of a function."""
    places: dict[str, set[int]] = {name: {id(node.body)} for name in parameters}

    def look(body: Sequence[ast.stmt]) -> None:
        for statement in body:
            targets = statement.targets if isinstance(statement, ast.Assign) else []
            targets = [statement.target] if isinstance(statement, ast.AugAssign) else targets
            for target in targets:
                for inner in ast.walk(target):
                    if isinstance(inner, ast.Name) and isinstance(inner.ctx, ast.Store):
                        places.setdefault(inner.id, set()).add(id(body))
            for inner_body in (getattr(statement, part, []) for part in ("body", "orelse")):
                look(inner_body)

    look(node.body)
    return {name for name, blocks in places.items() if len(blocks) > 1}


def untranslatable(node: ast.AST) -> BadInput:
    """Return the error that an expression has no counterpart in a page."""
    return BadInput(f"a page cannot compute {ast.unparse(node)[:60]}; take another problem or method for it.")


Roots = Callable[[Follower], None]
"""What follows functions of a module and writes down what becomes of their results."""


def followed(source: str, roots: Roots) -> list[Any]:
    """Return the statements of what ``roots`` follows; it is called again until all variables are known."""
    known = Known()
    while True:
        follower = Follower(source, known)
        try:
            roots(follower)
        except Again:
            continue
        return follower.block
