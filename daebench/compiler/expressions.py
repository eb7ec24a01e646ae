"""Expressions of scheme files, with their operators replaced by operations of the algebra.

A weight is held separately until its factor appears in a sum, so that ``y + w * x`` is one operation. A transpose is held separately until
its matrix appears in a product.
"""

import ast
from collections.abc import Sequence
from dataclasses import dataclass, replace

from daebench.compiler import arithmetic, shapes
from daebench.compiler.declared import Declarations
from daebench.compiler.shapes import DATA, GRAM, HALF_MATRIX, IDENTITY, INDEX, MATRIX, NUMBER, ROWS, Function, Kind, Pack, Stages, said
from daebench.compiler.syntax import call
from daebench.errors import InvalidProblem

NUMBERS = (NUMBER, DATA, INDEX)


@dataclass(frozen=True)
class Value:
    """An expression with its kind, a weight that is not yet multiplied in, and a flag for its transpose.

    For an outer product y x^T the expression is y, and ``outer`` is x.
    """

    node: ast.expr
    kind: Kind
    weight: ast.expr | None = None
    turned: bool = False
    outer: ast.expr | None = None

    @property
    def shape(self) -> str:
        """Kind of a factor, ".T" marking a transpose."""
        return f"{self.kind}{'.T' * self.turned}"


class Expressions:
    """Replaces operators in one function of a scheme file, given its path and the kinds of the names that the function uses."""

    def __init__(self, where: str, scope: Declarations) -> None:
        self.where, self.scope = where, scope
        self.kinds: dict[str, Kind] = {}
        self.used: set[str] = set()

    def _bind(self, target: ast.expr, kind: Kind, value: ast.expr) -> None:
        if isinstance(target, ast.Name):
            self.kinds[target.id] = kind
        elif isinstance(target, ast.Tuple):
            if isinstance(kind, Pack) and len(kind.kinds) != len(target.elts):
                raise self._refusal(value, f"it has {len(kind.kinds)} values, but there are {len(target.elts)} names")
            for place, name in enumerate(target.elts):
                self._bind(name, _entry(kind, place), value)

    def _refusal(self, node: ast.AST, why: str, text: str = "") -> InvalidProblem:
        """Return the error that says why, and where, an expression is refused."""
        return InvalidProblem(f"{self.where}, line {getattr(node, 'lineno', '?')}: {text or ast.unparse(node)}: {why}.")

    def _whole(self, node: ast.expr) -> Value:
        """Return an expression on its own, with its weight and its transpose applied."""
        return self._finished(self._value(node), node)

    def _finished(self, value: Value, node: ast.expr | None = None) -> Value:
        if value.outer is not None or (value.turned and shapes.wider(value.kind) != MATRIX):
            raise self._refusal(node or value.node, f"the transpose of {said(value.kind)} may only appear in a product")
        if value.turned:
            value = Value(self._call("transpose", value.node), MATRIX, value.weight)
        if value.weight is None:
            return value
        kind = shapes.wider(value.kind)
        if not isinstance(kind, str) or kind not in shapes.SCALE:
            raise self._refusal(node or value.node, f"{said(value.kind)} cannot be multiplied by a number")
        return Value(self._call(shapes.SCALE[kind], value.weight, value.node), kind)

    def _call(self, name: str, *arguments: ast.expr) -> ast.Call:
        """Return the call of an operation of the algebra, and make the file import it."""
        self.used.add(name)
        return call(name, arguments)

    def _value(self, node: ast.expr) -> Value:
        """Return an expression in terms of the algebra, with weight and transpose held separately."""
        value = self._lowered(node)
        return replace(value, node=ast.copy_location(value.node, node))

    def _lowered(self, node: ast.expr) -> Value:
        match node:
            case ast.Constant(value=value):
                return Value(node, INDEX if type(value) is int else NUMBER if type(value) is float else None)
            case ast.Name(id=name):
                return Value(node, self.kinds[name] if name in self.kinds else self.scope.kind(name))
            case ast.Call():
                return self._called(node)
            case ast.BinOp():
                return self._operation(node)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return self._negated(node, self._value(operand))
            case ast.Attribute(value=value, attr="T"):
                return self._transposed(node, self._value(value))
        return self._composed(node)

    def _composed(self, node: ast.expr) -> Value:
        """Return an entry, a tuple, a choice between two values, or the terms of a generator."""
        match node:
            case ast.Subscript(value=value, slice=index):
                operand, place = self._whole(value), self._whole(index).node
                return Value(ast.Subscript(operand.node, place, ast.Load()), _entry(operand.kind, _literal(index)))
            case ast.Starred(value=value):
                operand = self._whole(value)
                return Value(ast.Starred(operand.node, ast.Load()), operand.kind)
            case ast.Tuple(elts=elts):
                parts = [self._whole(part) for part in elts]
                return Value(ast.Tuple([part.node for part in parts], ast.Load()), _packed(parts))
            case ast.IfExp():
                return self._choice(node)
            case ast.GeneratorExp():
                return self._terms(node)
        return self._condition(node)

    def _choice(self, node: ast.IfExp) -> Value:
        """Return a choice between two values of the same kind."""
        choices = self._whole(node.body), self._whole(node.orelse)
        kind = shapes.joined([choice.kind for choice in choices])
        if kind is None and None not in (choices[0].kind, choices[1].kind):
            raise self._refusal(node, f"it is {said(choices[0].kind)} or {said(choices[1].kind)}")
        return Value(ast.IfExp(self._whole(node.test).node, *(arithmetic.typed(choice.node, kind) for choice in choices)), kind)

    def _terms(self, node: ast.GeneratorExp) -> Value:
        """Return the terms of a generator over stages or constraints; all are of one kind."""
        (loop,) = node.generators
        before = dict(self.kinds)
        self._bind(loop.target, INDEX, loop.iter)
        term, over = self._whole(node.elt), self._whole(loop.iter).node
        self.kinds = before
        return Value(ast.GeneratorExp(term.node, [ast.comprehension(loop.target, over, loop.ifs, loop.is_async)]), term.kind)

    def _condition(self, node: ast.expr) -> Value:
        """Return a comparison, or a combination of comparisons."""
        match node:
            case ast.Compare(left=left, ops=ops, comparators=others):
                return Value(ast.Compare(self._whole(left).node, ops, [self._whole(other).node for other in others]), None)
            case ast.BoolOp(op=op, values=values):
                return Value(ast.BoolOp(op, [self._whole(value).node for value in values]), None)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return Value(ast.UnaryOp(ast.Not(), self._whole(operand).node), None)
        raise self._refusal(node, "expressions of this form are not supported in a scheme")

    def _negated(self, node: ast.expr, operand: Value) -> Value:
        if operand.kind == INDEX:
            return Value(ast.UnaryOp(ast.USub(), operand.node), INDEX)
        if operand.kind in NUMBERS:
            return Value(arithmetic.minus(operand.node), NUMBER)
        self._known(node, operand)
        return replace(operand, weight=arithmetic.minus(operand.weight))

    def _transposed(self, node: ast.expr, operand: Value) -> Value:
        kind = shapes.wider(operand.kind)
        if kind not in (ROWS, MATRIX, shapes.VECTOR):
            raise self._refusal(node, f"{said(operand.kind)} has no transpose")
        return Value(operand.node, operand.kind, operand.weight, not operand.turned)

    def _known(self, node: ast.expr, *parts: Value) -> None:
        """Refuse an operator on an operand of unknown kind."""
        for part in parts:
            if not isinstance(part.kind, str):
                raise self._refusal(node, f"{ast.unparse(part.node)} is {said(part.kind)}, which no operator takes; annotate it")

    # ---- calls -----------------------------------------------------------------------------------------------------------

    def _called(self, node: ast.Call) -> Value:
        """Return a call with its arguments in terms of the algebra, and the operation that its name stands for."""
        if not isinstance(node.func, ast.Name):
            raise self._refusal(node, "a scheme must call functions by name")
        name = node.func.id
        parts = [self._whole(argument) for argument in node.args]
        if len(parts) == 1 and isinstance(parts[0].node, ast.GeneratorExp):
            return self._gathered(node, name, parts[0])
        if name in shapes.OVERLOADS:
            return self._overloaded(node, name, parts)
        signature = self.kinds[name] if name in self.kinds else self.scope.kind(name)
        if isinstance(signature, Function):
            return self._checked(node, name, parts, signature)
        return Value(call(name, [part.node for part in parts]), _of_builtin(name, parts))

    def _gathered(self, node: ast.Call, name: str, terms: Value) -> Value:
        """Return a tuple, a sum, a minimum or a maximum over stages or constraints."""
        if name == "multiplier":
            return Value(call("tuple", [terms.node]), shapes.MULTIPLIER)
        if name == "sum" and terms.kind not in NUMBERS:
            raise self._refusal(node, f"sum adds numbers, but a term is {said(terms.kind)}; add the terms in a loop")
        return Value(call(name, [terms.node]), Stages(terms.kind) if name == "tuple" else terms.kind)

    def _overloaded(self, node: ast.Call, name: str, parts: Sequence[Value]) -> Value:
        rules = shapes.OVERLOADS[name]
        for kinds in (tuple(part.kind for part in parts), tuple(shapes.wider(part.kind) for part in parts)):
            if kinds in rules:
                operation, result = rules[kinds]
                return Value(self._call(operation, *(part.node for part in parts)), result)
        raise self._refusal(node, f"there is no {name} of {', '.join(said(part.kind) for part in parts)}")

    def _checked(self, node: ast.Call, name: str, parts: Sequence[Value], signature: Function) -> Value:
        """Return the call of a function with declared kinds. The arguments determine the type variables in the kind of its result."""
        known: dict[str, Kind] = {}
        arguments = [part.node for part in parts]
        for place, (part, wanted) in enumerate(zip(parts, signature.parameters, strict=False)):
            if not shapes.fits(part.kind, wanted):
                raise self._refusal(node, f"{ast.unparse(node.args[place])} is {said(part.kind)}, but {name} takes {said(wanted)} there")
            shapes.settled(wanted, part.kind, known)
            arguments[place] = arithmetic.typed(part.node, wanted)
        return Value(call(name, arguments), signature.result if name in self.kinds else shapes.filled(signature.result, known))

    # ---- operators -------------------------------------------------------------------------------------------------------

    def _operation(self, node: ast.BinOp) -> Value:
        left, right = self._value(node.left), self._value(node.right)
        if isinstance(node.op, ast.Add) and (concatenated := _concatenated(left, right)) is not None:
            return Value(ast.BinOp(left.node, node.op, right.node), concatenated)
        self._known(node, left, right)
        if left.kind in NUMBERS and right.kind in NUMBERS:
            return self._arithmetic(node, left, right)
        match node.op:
            case ast.Mult() if left.kind in NUMBERS or right.kind in NUMBERS:
                number, other = (left, right) if left.kind in NUMBERS else (right, left)
                return replace(other, weight=arithmetic.times(self._real(node, number), other.weight))
            case ast.Div() if right.kind in NUMBERS:
                return replace(left, weight=arithmetic.over(left.weight or ast.Constant(1.0), self._real(node, right)))
            case ast.MatMult():
                return self._product(node, left, right)
            case ast.Add() | ast.Sub():
                return self._sum(node, left, right)
        raise self._refusal(node, f"{said(left.kind)} and {said(right.kind)} have no such operation")

    def _real(self, node: ast.expr, number: Value) -> ast.expr:
        """Return a number of the run's type. An integer index would change the type of a product."""
        if number.kind == INDEX and not isinstance(number.node, ast.Constant):
            raise self._refusal(node, f"{ast.unparse(number.node)} is an integer, not a number of the run's type")
        return arithmetic.typed(number.node, NUMBER)

    def _arithmetic(self, node: ast.BinOp, left: Value, right: Value) -> Value:
        """Return an operation on two numbers; an operation on two integers gives an integer."""
        match node.op:
            case ast.MatMult():
                raise self._refusal(node, "use * to multiply numbers")
            case ast.Pow() if right.kind == INDEX:
                return Value(arithmetic.power(left.node, right.node), left.kind)
            case ast.Div():
                return Value(arithmetic.over(self._real(node, left), self._real(node, right)), NUMBER)
        if left.kind == right.kind == INDEX:
            return Value(ast.BinOp(left.node, node.op, right.node), INDEX)
        return Value(ast.BinOp(self._real(node, left), node.op, self._real(node, right)), NUMBER)

    def _product(self, node: ast.expr, left: Value, right: Value) -> Value:
        weight = arithmetic.times(left.weight, right.weight)
        if left.kind == shapes.MULTIPLIER and right.shape == "Vector.T" and weight is None:
            return Value(left.node, ROWS, outer=right.node)
        for one, other in ((left, right), (self._flipped(left), right), (left, self._flipped(right))):
            rule = shapes.product_of(one.shape, other.shape)
            if rule is not None and one.outer is None and other.outer is None:
                self.used |= set() if (one, other) == (left, right) else {"transpose"}
                factors = (other.node, one.node) if rule.swapped else (one.node, other.node)
                return Value(self._call(rule.call, *factors), rule.kind, weight, rule.turned)
        raise self._refusal(node, f"there is no product of {left.shape} and {right.shape}")

    def _flipped(self, factor: Value) -> Value:
        """Return S for the transpose of S^T, and S^T as a new matrix for that of S; anything else unchanged."""
        if shapes.wider(factor.kind) != MATRIX:
            return factor
        return Value(call("transpose", [factor.node]), MATRIX, factor.weight, not factor.turned)

    def _sum(self, node: ast.BinOp, left: Value, right: Value) -> Value:
        """Return left + right or left - right as one operation w x + y."""
        subtracted = isinstance(node.op, ast.Sub)
        weight = arithmetic.minus(right.weight) if subtracted else right.weight
        if left.kind == IDENTITY and left.weight is None:
            return self._identity_plus(node, right, weight)
        if right.outer is not None and weight is None and left.outer is None:
            return Value(self._call("outer_md", right.node, right.outer, self._finished(left, node).node), ROWS)
        kind = shapes.wider(left.kind)
        if kind != shapes.wider(right.kind):
            raise self._refusal(node, f"{said(left.kind)} and {said(right.kind)} have different shapes")
        if kind == GRAM and not subtracted:
            return Value(self._call("plus_mm", self._finished(left, node).node, self._finished(right, node).node), GRAM)
        if kind == ROWS and subtracted:
            return Value(self._call("minus_md", self._finished(left, node).node, self._finished(right, node).node), ROWS)
        if not isinstance(kind, str) or kind not in shapes.ADD:
            raise self._refusal(node, f"{said(left.kind)} and {said(right.kind)} have no such sum")
        operation = shapes.ADD[kind]
        if left.weight is not None and weight is None and not left.turned:
            return Value(self._call(operation, left.weight, left.node, self._finished(right, node).node), kind)
        other = self._finished(Value(right.node, right.kind, turned=right.turned), node).node
        return Value(self._call(operation, weight or ast.Constant(1.0), other, self._finished(left, node).node), kind)

    def _identity_plus(self, node: ast.expr, X: Value, weight: ast.expr | None) -> Value:
        """Return I + w X."""
        if X.kind == HALF_MATRIX:
            return Value(self._call("identity_minus", arithmetic.minus(weight), X.node), HALF_MATRIX)
        if shapes.wider(X.kind) != MATRIX:
            raise self._refusal(node, f"the identity and {said(X.kind)} have different shapes")
        plain = self._finished(Value(X.node, X.kind, turned=X.turned), node).node
        return Value(self._call("identity_plus", weight or ast.Constant(1.0), plain), MATRIX)


def _literal(node: ast.expr) -> int | None:
    """Return the value of an integer literal used as an index; None for a computed index."""
    try:
        return int(ast.literal_eval(node))
    except ValueError:
        return None


def _entry(kind: Kind, place: int | None) -> Kind:
    """Return the kind of an entry; ``place`` is None if it is computed."""
    if isinstance(kind, Pack):
        inside = place is not None and -len(kind.kinds) <= place < len(kind.kinds)
        return kind.kinds[place] if inside and place is not None else shapes.joined([*kind.kinds]) if kind.kinds else None
    if isinstance(kind, Stages):
        return kind.kind
    return shapes.ENTRY.get(kind) if isinstance(kind, str) else None


def _packed(parts: Sequence[Value]) -> Kind:
    """Return the kind of a tuple; values at the stages can be concatenated in it."""
    if not any(isinstance(part.node, ast.Starred) for part in parts):
        return Pack(tuple(part.kind for part in parts))
    entries = [part.kind.kind if isinstance(part.kind, Stages) else part.kind for part in parts]
    return Stages(shapes.joined(entries))


def _concatenated(left: Value, right: Value) -> Kind:
    """Return the kind of two concatenated tuples; None if one of the two is not a tuple."""
    if isinstance(left.kind, Pack) and isinstance(right.kind, Pack):
        return Pack(left.kind.kinds + right.kind.kinds)
    if isinstance(left.kind, Stages) and isinstance(right.kind, Stages):
        return Stages(shapes.joined([left.kind.kind, right.kind.kind]))
    return None


def _of_builtin(name: str, parts: Sequence[Value]) -> Kind:
    """Return the kind of the result of a Python function."""
    if name in ("abs", "min", "max"):
        return shapes.joined([part.kind for part in parts])
    return INDEX if name in ("len", "int", "range") else None
