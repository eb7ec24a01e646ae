"""Functions that steer, followed: runs of simple statements are executed by Python, and branches, loops and returns are recorded."""

import ast
import types
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from daebench.compiler.trace.arrays import Array
from daebench.compiler.trace.ir import TRUTH, If, NeedsKnown, Region, Value, kind_of
from daebench.compiler.trace.statements import Statement, leaves_loop, returns_early, statements
from daebench.compiler.trace.structure import united, unset
from daebench.compiler.trace.turns import Turns, Unknown
from daebench.compiler.trace.ways import Names, Ways, behind, leave


@dataclass
class Called:
    """A function of a recorded program."""

    program: Any
    """What it belongs to: its operations, the names that functions read, and the follower of those that steer."""
    name: str

    def __call__(self, *args: Any) -> Any:
        """Return the value of a call."""
        return self.program.called(self, args)

    def called(self, args: Sequence[Any]) -> str:
        """Return its name, by which calls are counted."""
        return self.name


@dataclass
class Steered(Called):
    """A function that steers."""

    text: str = ""
    """Its source unless there is a node."""
    node: ast.FunctionDef | None = field(default=None, repr=False)
    """Its syntax, if it is of a file."""
    space: dict[str, Any] = field(default_factory=dict, repr=False)
    """Names that it reads."""
    parameters: Sequence[str] = ()
    body: Sequence[Statement] = field(default=(), repr=False)
    early: bool | None = None
    """Whether it returns elsewhere than at its end; None where it has not been read."""

    def _read(self) -> None:
        node = self.node or ast.parse(self.text).body[-1]
        assert isinstance(node, ast.FunctionDef)
        self.parameters = [argument.arg for argument in node.args.args]
        self.body = statements(node, self.space["__file__"] if self.node else self.name)
        self.early = returns_early(self.body)

    def inlined(self, args: Sequence[Any]) -> Any:
        """Record the function where it is called; return its result."""
        if self.early is None:
            self._read()
        return self.program.follower(self).result(dict(zip(self.parameters, args, strict=True)))


class Follower:
    """Follows the statements of one function."""

    def __init__(self, function: Steered) -> None:
        self.function, self.code, self.space = function, function.program.code, function.space

    def result(self, names: Names) -> Any:
        """Record the function, given its arguments by name; return its result."""
        function, code = self.function, self.code
        if not function.early:
            ways = Ways([])
            self.followed(function.body, names, ways)
            return ways.returned[0] if ways.returned else ()
        region = Region()
        with code.inside(region.block):
            if self.followed(function.body, names, Ways([], region)):
                leave(code, region, ())
        code.block.append(region)
        return behind(code, region)

    def hidden(self, statement: Statement) -> Sequence[str]:
        """Return names that a branch or a loop may bind though no statement in it does."""
        return ()

    def _value(self, code: Any, names: Names) -> Any:
        return eval(code, {**self.space, **names}) if _scopes(code) else eval(code, self.space, names)

    def _run(self, statement: Statement, names: Names) -> None:
        """Execute simple statements."""
        code = statement.code[0]
        if not _scopes(code):
            exec(code, self.space, names)
            return
        joined = {**self.space, **names}
        exec(code, joined)
        names.update({name: joined[name] for name in statement.binds if name in joined})

    def followed(self, body: Sequence[Statement], names: Names, ways: Ways) -> bool:
        """Record statements; return whether what comes behind them is reached."""
        for statement in body:
            if statement.kind == "run":
                self._run(statement, names)
            elif not getattr(self, f"_{statement.kind}")(statement, names, ways):
                return False
        return True

    def _return(self, statement: Statement, names: Names, ways: Ways) -> bool:
        value = self._value(statement.code[0], names)
        if ways.function is None:
            ways.returned.append(value)
        else:
            leave(self.code, ways.function, value)
        return False

    def _break(self, statement: Statement, names: Names, ways: Ways) -> bool:
        region, handed = ways.left[statement.kind]
        leave(self.code, region, {name: names[name] for name in handed if name in names})
        return False

    _continue = _break

    def _if(self, statement: Statement, names: Names, ways: Ways) -> bool:
        return self._tested(self._value(statement.code[0], names), statement, names, ways)

    def _tested(self, test: Any, statement: Statement, names: Names, ways: Ways) -> bool:
        """Record a branch."""
        if isinstance(test, Value) and test.op == "const":
            test = test.args[0]
        if not isinstance(test, Value):
            return self.followed(statement.body if test else statement.otherwise, names, ways)
        node = If(self.code.as_kind(test, TRUTH))
        sides: list[Names] = []
        for k, body in enumerate((statement.body, statement.otherwise)):
            sides.append(dict(names))
            with self.code.inside(node.blocks[k]):
                try:
                    node.falls[k] = self.followed(body, sides[k], ways)
                except NameError as error:
                    self._find_out(error, (statement.otherwise, statement.body)[k], names, ways)
                    raise
        self.code.block.append(node)
        if not any(node.falls):
            return False
        if all(node.falls):
            self._join(node, statement, sides, names, ways)
        else:
            names.update(sides[node.falls.index(True)])
        return True

    def _find_out(self, error: NameError, other: Sequence[Statement], names: Names, ways: Ways) -> None:
        """Find the form of a name without a value, which the other side of a branch binds in the first turn of a loop."""
        if error.name not in ways.missing:
            return
        there = dict(names)
        with self.code.inside([]):
            self.followed(other, there, ways)
        if error.name in there:
            raise Unknown(str(error.name), there[error.name]) from error

    @staticmethod
    def at_ends(name: str, sides: Sequence[Names], statement: Statement, ways: Ways) -> list[Any]:
        """Return the values that a name, which is read behind a branch, has at the ends of its sides."""
        there = [side[name] for side in sides if name in side]
        if len(there) == 1 and name not in ways.missing:
            raise TypeError(f"{name} is bound where one branch is taken and not where another is, {statement.place}")
        return there

    def _join(self, node: If, statement: Statement, sides: Sequence[Names], names: Names, ways: Ways) -> None:
        """Note the values behind a branch that both sides reach the end of."""
        ends = [(block, False) for block in node.blocks]
        for name in sorted({*(statement.binds & statement.after), *self.hidden(statement)}):
            there = self.at_ends(name, sides, statement, ways)
            if len(there) == 1:
                # Into the place of the side that lacks the name: False and True are the indices 0 and 1.
                there.insert(name in sides[0], unset(self.code, there[0]))
            if there:
                names[name] = united(self.code, there, ends, node.results, node.yields)

    def _each(self, statement: Statement, names: Names, ways: Ways) -> bool:
        over = self._value(statement.code[0], names)
        if isinstance(over, Array):
            return Turns(self, statement, names, ways, (0, over.shape[0], 1), over).recorded()
        if leaves_loop(statement.body):
            raise TypeError(f"break or continue in a loop over a tuple, {statement.place}")
        return self._unrolled(over, statement, names, ways)

    def _unrolled(self, over: Iterable[Any], statement: Statement, names: Names, ways: Ways) -> bool:
        for x in over:
            names[statement.target] = x
            if not self.followed(statement.body, names, ways):
                return False
        return self.followed(statement.otherwise, names, ways)

    def _for(self, statement: Statement, names: Names, ways: Ways) -> bool:
        given = [self._value(code, names) for code in statement.code]
        first, last, step = (0, given[0], 1) if len(given) == 1 else (*given, 1)[:3]
        if any(len(kind_of(x)) > 1 for x in given):
            raise TypeError(f"a loop over a range that differs from run to run, {statement.place}")
        if not isinstance(step, int) or step == 0:
            raise TypeError(f"a step of range that is not known, {statement.place}")
        if isinstance(first, int) and isinstance(last, int) and not range(first, last, step):
            return self.followed(statement.otherwise, names, ways)
        try:
            return Turns(self, statement, names, ways, (first, last, step)).recorded()
        except NeedsKnown:  # an entry of a tuple, say
            if not (isinstance(first, int) and isinstance(last, int)) or leaves_loop(statement.body):
                raise
        return self._unrolled(range(first, last, step), statement, names, ways)

    def _while(self, statement: Statement, names: Names, ways: Ways) -> bool:
        return Turns(self, statement, names, ways).recorded()


def _scopes(code: types.CodeType) -> bool:
    """Whether code has generators, whose own scopes see global names alone."""
    return any(isinstance(constant, types.CodeType) for constant in code.co_consts)
