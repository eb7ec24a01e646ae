"""Functions rewritten for several runs at once: where runs would take different branches, values are selected.

Statements under a test that may differ between runs are executed for all of them, and ``select`` assigns their values. An
iteration goes on until all runs have returned. Mostly they return at once; the results of runs that return earlier are stored in memory.
Tests of numbers that are common to all runs, such as the number of steps, stay branches. For example::

    for iteration in range(1, 100):                    live = True
        x, size = update(x)                            for iteration in range(1, 100):
        if size < EPS:                         ->          x, size = update(x)
            return x, 0                                    now = live & (size < EPS)
    return x, 1                                            if anyof(now):
                                                               value, live = (x, 0), live & negated(now)
                                                               if not anyof(live):
                                                                   break
                                                               note(early, now, value)
                                                       return select(live, (x, 1), value), or what was noted

Loops over steps store the results of runs that return in memory: only runs that have failed return early, and these are few.
"""

import ast
from collections.abc import Iterator, Sequence

from daebench.compiler.lanes.common import Common, names
from daebench.compiler.syntax import copied
from daebench.errors import InvalidProblem

STEPPING = ("integrate", "advance")
"""Functions whose loops take steps. A run that has returned continues with NaN there, on which no iteration goes on."""

MOVED = ("x", "x1")
"""Variables that are set to NaN then."""


def straightened(source: str) -> str:
    """Return the source of functions, each rewritten for several runs at once."""
    module = ast.parse(source)
    module.body = [_Straight(node).function() if isinstance(node, ast.FunctionDef) else node for node in module.body]
    return ast.unparse(ast.fix_missing_locations(module))


def _name(name: str) -> ast.Name:
    return ast.Name(name, ast.Load())


def _call(function: str, *arguments: ast.expr) -> ast.Call:
    return ast.Call(_name(function), list(arguments), [])


def _assign(target: str, value: ast.expr) -> ast.Assign:
    return ast.Assign([ast.Name(target, ast.Store())], value)


def _both(a: ast.expr | None, b: ast.expr) -> ast.expr:
    return b if a is None else ast.BinOp(a, ast.BitAnd(), b)


class _Straight(ast.NodeTransformer):
    """Rewrites one function."""

    def __init__(self, node: ast.FunctionDef) -> None:
        self.node, self.common = node, Common(node)
        self.defined = {argument.arg for argument in node.args.args}
        self.loops: list[ast.For] = []
        self.stepping = node.name in STEPPING
        self.arrays: set[str] = set()
        self.iterates = False
        self.exits: list[tuple[str, ast.expr]] = []
        self.counter = 0
        self.noted = self._notes(node.body, apart=False)

    def function(self) -> ast.FunctionDef:
        """Return the function."""
        if ast.get_docstring(self.node) is not None:
            self.node.body = self.node.body[1:]
        *body, last = self.node.body
        if not self.noted:
            self.node.body = self._block(self.node.body, None)
            return self.node
        if not isinstance(last, ast.Return):
            raise InvalidProblem(f"{self.node.name} ends without a return; several runs at once do not support this.")
        self.last = last
        lines = [_assign("live", ast.Constant(True)), *self._block(body, None)]
        assert last.value is not None
        self.node.body = [*lines, *self._result(self.visit(last.value)), ast.Return(_name("value_"))]
        return self.node

    def _notes(self, body: Sequence[ast.stmt], *, apart: bool) -> bool:
        """Whether runs may return at different places."""
        for node in body:
            if isinstance(node, ast.Return) and apart:
                return True
            if isinstance(node, ast.If):
                inside = apart or not self.common(node.test)
                if self._notes(node.body, apart=inside) or self._notes(node.orelse, apart=inside):
                    return True
            elif isinstance(node, ast.For) and self._notes(node.body, apart=apart):
                return True
        return False

    def _block(self, body: Sequence[ast.stmt], mask: str | None) -> list[ast.stmt]:
        return [line for node in body for line in self._statement(node, mask)]

    def _statement(self, node: ast.stmt, mask: str | None) -> list[ast.stmt]:
        rules = {ast.Return: self._return, ast.If: self._if, ast.For: self._for, ast.Assign: self._assignment, ast.AugAssign: self._changed}
        for kind, rule in rules.items():
            if isinstance(node, kind):
                lines: list[ast.stmt] = rule(node, mask)  # type: ignore[operator]
                return lines
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            return [node]
        if isinstance(node, ast.Expr) and mask is None:
            return [ast.Expr(self.visit(node.value))]
        raise InvalidProblem(f"{self.node.name}: {ast.unparse(node)} cannot be done for several runs at once.")

    def _fresh(self, name: str) -> str:
        self.counter += 1
        return f"{name}{self.counter}_"

    # ---- returns ---------------------------------------------------------------------------------------------------------

    def _return(self, node: ast.Return, mask: str | None) -> list[ast.stmt]:
        assert node.value is not None
        if not self.noted:
            return [ast.Return(self.visit(node.value))]
        now = self._fresh("now")
        line = _assign(now, _both(_name("live"), _name(mask)) if mask else _name("live"))
        gone = _assign("live", _both(_name("live"), _call("negated", _name(now))))
        if not self.loops:
            value = self._fresh("exit")
            self.exits.append((now, _name(value)))
            return [line, _assign(value, self.visit(node.value)), gone]
        if not self.stepping:
            inside = [
                _assign("value_", self.visit(node.value)),
                gone,
                self._leave(),
                ast.Expr(_call("note", _name("early_"), _name(now), _name("value_"))),
                _assign("before_", ast.BinOp(_name("before_"), ast.BitOr(), _name(now))),
            ]
            return [line, ast.If(_call("anyof", _name(now)), inside, [])]
        spoilt = [name for name in MOVED if name in self.defined]
        inside = [
            ast.Expr(_call("note", _name("result"), _name(now), self.visit(node.value))),
            gone,
            self._leave(),
            *(_assign(name, _call("spoiled", _name("live"), _name(name))) for name in spoilt),
        ]
        return [line, ast.If(_call("anyof", _name(now)), inside, [])]

    @staticmethod
    def _leave() -> ast.stmt:
        return ast.If(ast.UnaryOp(ast.Not(), _call("anyof", _name("live"))), [ast.Break()], [])

    def _result(self, last: ast.expr) -> list[ast.stmt]:
        """Return statements that set ``value_`` to the last result, and for runs that returned elsewhere to their result there.

        Most runs return from an iteration, all at once; in functions without iterations they reach the end.
        """
        if self.iterates:
            before = _name("before_")
            return [ast.If(_call("anyof", before), [self._replaced(before, _call("recall", _name("early_")))], [])]
        if self.stepping:
            returned: ast.expr = _call("recall", _name("result"))
        else:
            (_, returned), *others = reversed(self.exits)
            for place, value in others:
                returned = _call("select", _name(place), value, returned)
        gone = _call("negated", _name("live"))
        return [_assign("value_", last), ast.If(_call("anyof", gone), [self._replaced(gone, returned)], [])]

    @staticmethod
    def _replaced(mask: ast.expr, value: ast.expr) -> ast.stmt:
        """Return the statement that replaces ``value_`` where a mask is true."""
        return _assign("value_", _call("select", mask, value, _name("value_")))

    # ---- branches and loops ----------------------------------------------------------------------------------------------

    def _if(self, node: ast.If, mask: str | None) -> list[ast.stmt]:
        if self.common(node.test):
            return [ast.If(self.visit(node.test), self._block(node.body, mask) or [ast.Pass()], self._block(node.orelse, mask))]
        test, inside = self._fresh("test"), self._fresh("mask")
        lines: list[ast.stmt] = [_assign(test, self.visit(node.test))]
        lines.append(_assign(inside, _both(_name(mask) if mask else None, _name(test))))
        lines += self._where(inside, node.body, rare=self._of_status(node))
        if node.orelse:
            other = self._fresh("mask")
            lines.append(_assign(other, _both(_name(mask) if mask else None, _call("negated", _name(test)))))
            lines += self._where(other, node.orelse)
        return lines

    def _of_status(self, node: ast.If) -> bool:
        """Whether a test concerns the status of a report, as the handling of failures does, and makes no new variables."""
        asked = any(
            isinstance(part, ast.Compare) and isinstance(part.ops[0], ast.Eq | ast.NotEq) and isinstance(part.comparators[0], ast.Constant)
            for part in ast.walk(node.test)
        )
        plain = all(isinstance(line, ast.Assign) for line in node.body)
        return asked and plain and not node.orelse and names(node.body, stored=True) <= self.defined

    def _where(self, mask: str, body: Sequence[ast.stmt], *, rare: bool = False) -> list[ast.stmt]:
        """Return statements under a mask. They are skipped when no run needs them, if they are rarely needed or contain loops."""
        lines = self._block(body, mask)
        loops = any(isinstance(n, ast.For) for node in body for n in ast.walk(node))
        return [ast.If(_call("anyof", _name(mask)), lines, [])] if loops or rare else lines

    def _for(self, node: ast.For, mask: str | None) -> list[ast.stmt]:
        if not self.common(node.iter):
            raise InvalidProblem(f"{self.node.name} loops over {ast.unparse(node.iter)}, which differs from run to run.")
        if self._notes([node], apart=mask is not None):
            if self.loops or mask:
                raise InvalidProblem(f"{self.node.name} returns from a loop within a loop or a branch; several runs at once cannot.")
            return self._stepping_loop(node) if self.stepping else self._iteration(node)
        self.defined |= names(node.target, stored=True)
        return [ast.For(node.target, node.iter, self._block(node.body, mask), [])]

    def _stepping_loop(self, node: ast.For) -> list[ast.stmt]:
        """Return a loop over steps, in which the results of the few runs that return are stored in memory."""
        assert self.last.value is not None
        lines = self._placed(node, names(self.last.value))
        lines.append(_assign("result", _call("held", self.visit(copied(self.last.value)), _name("LANES"))))
        self.loops.append(node)
        lines.append(ast.For(node.target, node.iter, self._block(node.body, None), []))
        self.loops.pop()
        return lines

    def _iteration(self, node: ast.For) -> list[ast.stmt]:
        """Return an iteration, in which the results of returning runs are stored in memory unless these runs are the last."""
        assert self.last.value is not None
        if self.exits:
            raise InvalidProblem(f"{self.node.name} returns before an iteration and from it; several runs at once do not support this.")
        self.iterates = True
        lines = self._placed(node, names(self.last.value))
        last = self.visit(self.last.value)
        lines += [_assign("early_", _call("held", last, _name("LANES"))), _assign("before_", ast.Constant(False))]
        self.loops.append(node)
        lines.append(ast.For(node.target, node.iter, self._block(node.body, None), [_assign("value_", last)]))
        self.loops.pop()
        return lines

    def _placed(self, node: ast.For, wanted: set[str]) -> list[ast.stmt]:
        """Return assignments of zeros, before a loop, to the wanted variables that are assigned only in it, to fix their form."""
        missing = wanted & (names(node, stored=True) - self.defined)
        index = names(node.target, stored=True)
        self.defined |= index
        lines: list[ast.stmt] = [_assign(name, ast.Constant(0)) for name in sorted(index)]
        for line in node.body:
            if not (isinstance(line, ast.Assign) and missing & names(line.targets[0], stored=True)):
                continue
            if isinstance(line.value, ast.Compare | ast.BoolOp):
                assert isinstance(line.targets[0], ast.Name)
                lines.append(_assign(line.targets[0].id, ast.Constant(False)))
                self.defined.add(line.targets[0].id)
                continue
            assert isinstance(line.value, ast.Call)
            target = copied(line.targets[0])
            for part in ast.walk(target):
                if isinstance(part, ast.Name) and part.id not in missing:
                    part.id = "_"
            arguments = ast.Tuple([self.visit(copied(a)) for a in line.value.args], ast.Load())
            lines.append(ast.Assign([target], _call("absent", line.value.func, arguments)))
            self.defined |= missing & names(line.targets[0], stored=True)
            missing -= names(line.targets[0], stored=True)
        return lines

    # ---- assignments -----------------------------------------------------------------------------------------------------

    def _assignment(self, node: ast.Assign, mask: str | None) -> list[ast.stmt]:
        (target,) = node.targets
        if isinstance(target, ast.Name) and (made := self._array(target.id, node.value)):
            return [_assign(target.id, made)]
        if isinstance(target, ast.Subscript):
            return [self._stored(target, self.visit(node.value), mask)]
        old = names(target, stored=True) & self.defined if mask else set()
        self.defined |= names(target, stored=True)
        if not old and not any(isinstance(part, ast.Subscript) for part in ast.walk(target)):
            return [ast.Assign([target], self.visit(node.value))]
        return list(self._selected(mask, target, self.visit(node.value), old))

    def _array(self, name: str, value: ast.expr) -> ast.expr | None:
        """Return an expression that makes an array of lanes, with the lanes as last axis, where a function makes an array of numbers."""
        function = ast.unparse(value.func) if isinstance(value, ast.Call) else ""
        if function not in ("numpy.empty", "empty"):
            return None
        assert isinstance(value, ast.Call)
        self.arrays.add(name)
        shape = value.args[0].elts if isinstance(value.args[0], ast.Tuple) else [value.args[0], ast.Constant(1)]
        return _call("empty", ast.Tuple([*shape, _name("LANES")], ast.Load()))

    def _selected(self, mask: str | None, target: ast.expr, value: ast.expr, old: set[str]) -> Iterator[ast.stmt]:
        """Return assignments of a value, or of the values of a tuple, that keep the old ones unless a mask is true."""
        pairs = list(zip(target.elts, value.elts, strict=True)) if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple) else []
        pairs = pairs or [(target, value)]
        temporary = [self._fresh("new") for _ in pairs]
        for name, (_, part) in zip(temporary, pairs, strict=True):
            yield _assign(name, part)
        for name, (item, _) in zip(temporary, pairs, strict=True):
            yield from self._leaf(mask, item, _name(name), old)

    def _leaf(self, mask: str | None, target: ast.expr, value: ast.expr, old: set[str]) -> Iterator[ast.stmt]:
        if isinstance(target, ast.Tuple):
            for i, item in enumerate(target.elts):
                yield from self._leaf(mask, item, ast.Subscript(value, ast.Constant(i), ast.Load()), old)
            return
        if isinstance(target, ast.Subscript):
            yield self._stored(target, value, mask)
            return
        assert isinstance(target, ast.Name)
        yield _assign(target.id, _call("select", _name(mask), value, _name(target.id)) if mask and target.id in old else value)

    def _changed(self, node: ast.AugAssign, mask: str | None) -> list[ast.stmt]:
        """Write ``x += y`` as ``x = x + y``."""
        load = copied(node.target)
        load.ctx = ast.Load()
        return self._assignment(ast.Assign([node.target], ast.BinOp(load, node.op, node.value)), mask)

    def _stored(self, target: ast.Subscript, value: ast.expr, mask: str | None) -> ast.stmt:
        """Write lanes into an array."""
        assert isinstance(target.value, ast.Name)
        places = self._places(target)
        if target.value.id in self.arrays:
            value = value if mask is None else _call("select", _name(mask), value, _call("entry_of", target.value, *places, _name("LANES")))
        elif mask or not isinstance(target.slice, ast.Tuple):
            raise InvalidProblem(f"{self.node.name} writes {ast.unparse(target)}; several runs at once do not support this.")
        return ast.Expr(_call("put", target.value, *places, value, _name("LANES")))

    def _places(self, node: ast.Subscript) -> list[ast.expr]:
        """Return row and column of an entry of an array."""
        indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice, ast.Constant(0)]
        return [self.visit(copied(index)) for index in indices]

    # ---- expressions -----------------------------------------------------------------------------------------------------

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        """Select if runs may differ."""
        if self.common(node.test):
            self.generic_visit(node)
            return node
        return _call("select", self.visit(node.test), self.visit(node.body), self.visit(node.orelse))

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        """Evaluate both sides."""
        if self.common(node):
            return node
        first, *others = map(self.visit, node.values)
        for other in others:
            first = ast.BinOp(first, ast.BitAnd() if isinstance(node.op, ast.And) else ast.BitOr(), other)
        return first  # type: ignore[no-any-return]

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        """Negate lane by lane."""
        operand = self.visit(node.operand)
        if isinstance(node.op, ast.Not) and not self.common(node.operand):
            return _call("negated", operand)
        return ast.UnaryOp(node.op, operand)

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        """Accept comparisons of two numbers."""
        if len(node.ops) > 1:
            raise InvalidProblem(f"{self.node.name} compares {ast.unparse(node)}; compare two numbers at a time.")
        self.generic_visit(node)
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        """Return the number itself for its real part: lanes hold only real numbers."""
        return self.visit(node.value) if node.attr == "real" else node

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        """Read lanes from an array."""
        if isinstance(node.value, ast.Name) and node.value.id in self.arrays:
            return _call("entry_of", node.value, *self._places(node), _name("LANES"))
        self.generic_visit(node)
        return node

    def visit_Call(self, node: ast.Call) -> ast.expr:
        """Leave calls on truth values unchanged."""
        if isinstance(node.func, ast.Name) and node.func.id == "bool":
            return self.visit(node.args[0])  # type: ignore[no-any-return]
        node.args = [self.visit(argument) for argument in node.args]
        return node
