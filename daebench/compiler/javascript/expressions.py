"""Expressions of a linked module, evaluated as by Python, with numbers that stand for variables."""

import ast
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

from daebench.compiler.javascript.duals import functions
from daebench.compiler.javascript.frames import Again, Frame, Known
from daebench.compiler.javascript.numbers import ELEMENTARY, Arithmetic, Dual, Entries, Number, Real, atom, value_of
from daebench.compiler.javascript.statements import Expression, Let
from daebench.errors import BadInput

BINARY = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
COMPARE = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "===", ast.NotEq: "!=="}
LETTERS = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
DIGITS = "0123456789"


class Evaluator(ABC):
    """Evaluates expressions of a module, and records each operation.

    Parameters
    ----------
    source : str
        The linked module.
    known : Known
        Knowledge from earlier attempts.
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
        """Return a new name: a letter and a digit, and so on. No keyword of the language is of this form."""
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

    @abstractmethod
    def call(self, name: str, arguments: Sequence[Any]) -> Any:
        """Return the result of a function; its statements are written at the place of the call."""

    def variable(self, frame: Frame, name: str) -> Any:
        """Return the value of a name."""
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
        """Return the values of expressions; starred tuples are expanded."""
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
        """Return the truth value of a chain of comparisons."""
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
        raise BadInput(f"a page cannot compute {name} of these numbers; choose another problem or method for it.")


def untranslatable(node: ast.AST) -> BadInput:
    """Return the error for an expression without a counterpart in a page."""
    return BadInput(f"a page cannot compute {ast.unparse(node)[:60]}; choose another problem or method for it.")
