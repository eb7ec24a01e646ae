"""The statements of a function that steers: runs of simple statements as code of Python, and tests, loops and returns as objects."""

import ast
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import CodeType
from typing import Any

_CHEAP = "abs max min sqrt bool float int REAL DTYPE float64 float32 len CHOSEN BOTH EITHER NEGATED _whole _run_time"
CHEAP = frozenset(_CHEAP.split())
"""Functions whose values may be computed where they are not needed."""

Names = frozenset[str]

CHOSEN, BOTH, EITHER, NEGATED = "CHOSEN", "BOTH", "EITHER", "NEGATED"
"""Names of what stands for ``if else``, ``and``, ``or``, ``not`` in an expression."""


@dataclass(kw_only=True)
class Statement:
    """One statement, or a run of simple ones."""

    kind: str
    """"run", "if", "for", "each", "while", "return", "break" or "continue"."""
    node: ast.stmt
    code: tuple[CodeType, ...] = ()
    """Code of the run, of the test, of the bounds of a range, of what is iterated over, or of what is returned."""
    reads: Names = frozenset()
    binds: Names = frozenset()
    """Names that it reads before it binds them, and names that it may bind."""
    target: str = ""
    """Name that a loop binds."""
    costly: bool = False
    """Whether statements under a test are passed over if none of several runs needs them: they contain loops, or treat failures."""
    body: Sequence["Statement"] = ()
    otherwise: Sequence["Statement"] = ()
    """Statements inside; the second are those where a test is false, or where a loop comes to its end."""
    after: Names = frozenset()
    head: Names = frozenset()
    """Names that are read after it, and of a loop those that are read after a turn."""

    @property
    def place(self) -> str:
        """Where it is, by its first line."""
        return _said(self.node)


def statements(function: ast.FunctionDef, file: str) -> list[Statement]:
    """Return the statements of a function, with the names that are read after each."""
    body = _Reader(file).body(function.body)
    _note_live(body, frozenset(), {"return": frozenset()})
    return body


def returns_early(body: Sequence[Statement]) -> bool:
    """Return whether a function returns elsewhere than at its end."""
    return has(body[:-1], "return") or bool(body and body[-1].kind != "return" and has(body[-1:], "return"))


def has(body: Iterable[Statement], *kinds: str, within_loops: bool = True) -> bool:
    """Return whether there is a statement of some kinds among these and in them."""
    return any(
        statement.kind in kinds
        or ((within_loops or statement.kind == "if") and has((*statement.body, *statement.otherwise), *kinds, within_loops=within_loops))
        for statement in body
    )


def loops(body: Iterable[Statement]) -> bool:
    """Return whether statements contain loops."""
    return has(body, "for", "while", "each")


def _of_status(node: ast.If) -> bool:
    """Return whether a test concerns the status of a report, as the treatment of failures does."""
    return not node.orelse and any(
        isinstance(part, ast.Compare) and isinstance(part.ops[0], ast.Eq | ast.NotEq) and isinstance(part.comparators[0], ast.Constant)
        for part in ast.walk(node.test)
    )


def leaves_loop(body: Iterable[Statement]) -> bool:
    """Return whether statements of a loop contain ``break`` or ``continue`` of this loop."""
    return has(body, "break", "continue", within_loops=False)


def _names(node: ast.AST, context: type) -> Names:
    return frozenset(part.id for part in ast.walk(node) if isinstance(part, ast.Name) and isinstance(part.ctx, context))


def _call(name: str, *args: ast.expr) -> ast.Call:
    return ast.Call(ast.Name(name, ast.Load()), list(args), [])


def _costly(node: ast.expr) -> bool:
    """Return whether an expression may only be computed where it is needed: it calls a function, or reads an entry by a variable index."""
    for part in ast.walk(node):
        if isinstance(part, ast.Call) and not (isinstance(part.func, ast.Name) and part.func.id in CHEAP):
            return True
        if isinstance(part, ast.Subscript) and not isinstance(part.slice, ast.Constant | ast.Slice):
            return True
    return False


class _Lowered(ast.NodeTransformer):
    """Replaces branches inside expressions; a costly part that may only be computed if it is needed becomes a statement before."""

    def __init__(self) -> None:
        self.before: list[ast.stmt] = []
        self.made = 0

    def taken(self) -> list[ast.stmt]:
        """Return the statements that come before, and forget them."""
        taken, self.before = self.before, []
        return taken

    def _branch(self, test: ast.expr, then: ast.expr | None, otherwise: ast.expr | None, given: str = "") -> ast.Name:
        """Return a name that a branch binds; one side None leaves it as it was."""
        self.made += 1
        name = given or f"_chosen{self.made}"
        sides: list[list[ast.stmt]] = []
        outer = self.before
        for value in (then, otherwise):
            self.before = []
            if value is None:
                sides.append([])
                continue
            lowered = self.visit(value)
            sides.append([*self.before, ast.Assign([ast.Name(name, ast.Store())], lowered)])
        self.before = [*outer, ast.If(test, *sides)]
        return ast.Name(name, ast.Load())

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        test = self.visit(node.test)
        if _costly(node.body) or _costly(node.orelse):
            return self._branch(test, node.body, node.orelse)
        return _call(CHOSEN, test, self.visit(node.body), self.visit(node.orelse))

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        name = BOTH if isinstance(node.op, ast.And) else EITHER
        expression: ast.expr = self.visit(node.values[0])
        for value in node.values[1:]:
            if _costly(value):
                self.made += 1
                target = f"_chosen{self.made}"
                self.before.append(ast.Assign([ast.Name(target, ast.Store())], _call("bool", expression)))
                then, otherwise = (value, None) if name == BOTH else (None, value)
                expression = self._branch(ast.Name(target, ast.Load()), then, otherwise, target)
            else:
                expression = _call(name, expression, self.visit(value))
        return expression

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        operand = self.visit(node.operand)
        return _call(NEGATED, operand) if isinstance(node.op, ast.Not) else ast.UnaryOp(node.op, operand)

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        self.generic_visit(node)
        if len(node.ops) == 1:
            return node
        conjunction: ast.expr | None = None
        left = node.left
        for op, right in zip(node.ops, node.comparators, strict=True):
            # An operand in the middle stands twice; equal operations are recorded once.
            one = ast.Compare(left, [op], [right])
            conjunction, left = one if conjunction is None else _call(BOTH, conjunction, one), right
        assert conjunction is not None
        return conjunction


SIMPLE = (ast.Assign, ast.AugAssign, ast.AnnAssign, ast.Expr)


class _Reader:
    """Turns syntax into statements."""

    def __init__(self, file: str) -> None:
        self.file, self.lowered = file, _Lowered()

    def body(self, nodes: Sequence[ast.stmt], *, raw: bool = True) -> list[Statement]:
        """Return the statements of a body; ``raw`` ones have expressions that steer."""
        body: list[Statement] = []
        run: list[ast.stmt] = []
        for node in nodes:
            if isinstance(node, ast.Pass) or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
                continue
            if isinstance(node, SIMPLE):
                lowered = self.lowered.visit(node) if raw else node
                if before := self.lowered.taken():
                    self._flush(run, body)
                    body += self.body(before, raw=False)
                run.append(lowered)
                continue
            self._flush(run, body)
            body += self._steering(node, raw=raw)
        self._flush(run, body)
        return body

    def _flush(self, run: list[ast.stmt], body: list[Statement]) -> None:
        if not run:
            return
        reads = binds = Names()
        for node in run:
            reads |= _names(node, ast.Load) - binds
            if isinstance(node, ast.AugAssign):
                reads |= _names(node.target, ast.Store) - binds
            binds |= _names(node, ast.Store)
        body.append(Statement(kind="run", node=run[0], code=(self._compiled(ast.Module(list(run), []), "exec"),), reads=reads, binds=binds))
        run.clear()

    def _compiled(self, node: Any, mode: str) -> CodeType:
        ast.fix_missing_locations(node)
        code = compile(node, self.file, mode)
        assert isinstance(code, CodeType)
        return code

    def _value(self, node: ast.expr, *, raw: bool) -> tuple[CodeType, Names, list[Statement]]:
        """Return the code of an expression, the names that it reads, and what comes before."""
        lowered = self.lowered.visit(node) if raw else node
        before = self.body(self.lowered.taken(), raw=False)
        return self._compiled(ast.Expression(lowered), "eval"), _names(lowered, ast.Load), before

    def _steering(self, node: ast.stmt, *, raw: bool) -> list[Statement]:
        """Return a statement that steers, after those that have to come before."""
        if isinstance(node, ast.If):
            code, reads, before = self._value(node.test, raw=raw)
            body, otherwise = self.body(node.body, raw=raw), self.body(node.orelse, raw=raw)
            branch = Statement(kind="if", node=node, code=(code,), reads=reads, binds=_bound(body) | _bound(otherwise), body=body)
            branch.otherwise, branch.costly = otherwise, loops(body) or loops(otherwise) or _of_status(node)
            return [*before, branch]
        if isinstance(node, ast.Return):
            code, reads, before = self._value(node.value or ast.Tuple([], ast.Load()), raw=raw)
            return [*before, Statement(kind="return", node=node, code=(code,), reads=reads)]
        if isinstance(node, ast.While) and not node.orelse:
            test = ast.If(ast.UnaryOp(ast.Not(), node.test), [ast.Break()], [])
            body = self.body([test, *node.body])
            return [Statement(kind="while", node=node, binds=_bound(body), body=body)]
        if isinstance(node, ast.For) and isinstance(node.target, ast.Name):
            return self._for(node, node.target.id)
        if isinstance(node, ast.Break | ast.Continue):
            return [Statement(kind="break" if isinstance(node, ast.Break) else "continue", node=node)]
        raise TypeError(f"{type(node).__name__.lower()}, {_said(node)}")

    def _for(self, node: ast.For, target: str) -> list[Statement]:
        over = node.iter
        ranged = isinstance(over, ast.Call) and isinstance(over.func, ast.Name) and over.func.id == "range"
        values = [self._value(argument, raw=True) for argument in (over.args if ranged else [over])]  # type: ignore[attr-defined]
        body, otherwise = self.body(node.body), self.body(node.orelse)
        before = [statement for value in values for statement in value[2]]
        reads = Names().union(*(value[1] for value in values))
        code, binds = tuple(value[0] for value in values), _bound(body) | _bound(otherwise) | {target}
        loop = Statement(kind="for" if ranged else "each", node=node, code=code, reads=reads, binds=binds, target=target, body=body)
        loop.otherwise = otherwise
        return [*before, loop]


def _said(node: ast.stmt) -> str:
    """Return where a statement is, by its first line."""
    return f"at {ast.unparse(node).partition(chr(10))[0]!r}"


def _bound(body: Iterable[Statement]) -> Names:
    return Names().union(*(statement.binds for statement in body))


def _note_live(body: Sequence[Statement], live: Names, ways: Mapping[str, Names]) -> Names:
    """Note the names that are read after each statement; return those that are read before the first.

    ``live`` are read after the last, and ``ways`` after "return", "break" and "continue".
    """
    for statement in reversed(body):
        statement.after = live
        if statement.kind == "run":
            live = (live - statement.binds) | statement.reads
        elif statement.kind in ways:
            live = ways[statement.kind] | statement.reads
        elif statement.kind == "if":
            live = statement.reads.union(*(_note_live(side, live, ways) for side in (statement.body, statement.otherwise)))
        else:
            live = _note_loop(statement, live, ways)
    return live


def _note_loop(loop: Statement, live: Names, ways: Mapping[str, Names]) -> Names:
    head = _note_live(loop.otherwise, live, ways) if loop.kind != "while" else frozenset[str]()
    # A turn may read what the one before has bound: repeated until no name is added.
    while True:
        more = head | (_note_live(loop.body, head, {**ways, "break": live, "continue": head}) - {loop.target})
        if more == head:
            break
        head = more
    loop.head = head
    return head | loop.reads
