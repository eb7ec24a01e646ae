"""Passes over statements before they are written: removal of statements on which no result depends, and inlining of values read once."""

from collections import Counter
from typing import Any

from daebench.compiler.javascript.statements import Expression, For, If, Label, Let, Put, Set, Variables, blocks, every, heads, names_of


def pruned(block: list[Any]) -> list[Any]:
    """Return a block without statements on which no array and no branch depends. Blocks that become empty are removed too."""
    while True:
        values: dict[str, list[Expression]] = {}
        pending: list[str] = []
        for statement in every(block):
            if isinstance(statement, Let | Set):
                values.setdefault(statement.name, []).append(statement.value)
            else:
                pending += [name for head in heads(statement) for name in names_of(head)]
        needed: set[str] = set()
        while pending:
            name = pending.pop()
            if name not in needed:
                needed.add(name)
                pending += [inner for value in values.get(name, []) for inner in names_of(value)]
        shorter, changed = _without(block, needed)
        block = shorter
        if not changed:
            return block


def _without(block: list[Any], needed: set[str]) -> tuple[list[Any], bool]:
    """Return a block without the statements that are not needed, and whether any was removed."""
    left: list[Any] = []
    changed = False
    for statement in block:
        if isinstance(statement, Let | Set) and statement.name not in needed:
            changed = True
            continue
        if isinstance(statement, Variables):
            names = [name for name in statement.names if name in needed]
            changed |= len(names) < len(statement.names)
            left += [Variables(names)] if names else []
            continue
        inner = [_without(part, needed) for part in blocks(statement)]
        changed |= any(part[1] for part in inner)
        if inner and not any(part for part, _ in inner):
            changed = True
            continue
        match statement, [part for part, _ in inner]:
            case If(), [then, other]:
                left.append(If(statement.test, then, other) if then else If(("!", statement.test), other, []))
            case For(), [body]:
                left.append(For(statement.name, statement.start, statement.stop, body))
            case Label(), [body]:
                left.append(Label(statement.name, body))
            case _:
                left.append(statement)
    return left, changed


def inlined(block: list[Any]) -> list[Any]:
    """Return a block in which each value that is read once, in the block where it is made, is inlined."""
    uses = Counter(name for statement in every(block) for head in heads(statement) for name in names_of(head))
    return _inlined(block, uses)


def _inlined(block: list[Any], uses: Counter[str]) -> list[Any]:  # noqa: C901 - a case a kind of statement
    made: list[Any] = []
    pending: dict[str, Expression] = {}

    def put_back(others: set[str]) -> None:
        """Write out, in their order, pending values that depend on changed names, and the pending values in which they occur."""
        for name in [name for name, value in pending.items() if others & {name, *names_of(value)}]:
            made.append(Let(name, pending.pop(name)))

    for statement in block:
        inner = blocks(statement)
        if inner:
            inside = {name for part in inner for deep in every(part) for head in heads(deep) for name in names_of(head)}
            if isinstance(statement, For):
                inside |= set(names_of(statement.stop))
            put_back(inside | {changed(deep) for part in inner for deep in every(part) if isinstance(deep, Set | Put)})
        match statement:
            case Let(name, value):
                value = _replaced(value, pending)
                if uses[name] == 1:
                    pending[name] = value
                else:
                    made.append(Let(name, value))
            case Set(name, value):
                value = _replaced(value, pending)
                put_back({name})
                made.append(Set(name, value))
            case Put(array, index, value):
                index, value = _replaced(index, pending), _replaced(value, pending)
                put_back({array})
                made.append(Put(array, index, value))
            case If(test, then, other):
                made.append(If(_replaced(test, pending), _inlined(then, uses), _inlined(other, uses)))
            case For(name, start, stop, body):
                made.append(For(name, _replaced(start, pending), stop, _inlined(body, uses)))
            case Label(name, body):
                made.append(Label(name, _inlined(body, uses)))
            case _:
                made.append(statement)
    put_back(set(pending))
    return made


def changed(statement: Set | Put) -> str:
    """Return the name that a statement changes."""
    return statement.name if isinstance(statement, Set) else statement.array


def _replaced(expression: Expression, pending: dict[str, Expression]) -> Expression:
    """Return an expression in which names of pending values are replaced by these values, which are then no longer pending."""
    if isinstance(expression, str):
        return pending.pop(expression, expression)
    if isinstance(expression, tuple):
        return (expression[0], *(_replaced(operand, pending) for operand in expression[1:]))
    return expression
