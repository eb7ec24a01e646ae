"""Functions that steer, followed: runs of simple statements are executed by Python, and branches, loops and returns are recorded."""

import ast
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from daebench.compiler.trace.arrays import Array, empty
from daebench.compiler.trace.ir import INTEGER, POINTER, TRUTH, Code, If, Leave, Loop, Region, Value, common, kind_of
from daebench.compiler.trace.statements import Statement, leaves_loop, returns_early, statements
from daebench.compiler.trace.structure import (
    Mismatch,
    arrays_of,
    converted,
    parts_of,
    pattern_of,
    rebuilt,
    same,
    sized,
    united,
    unset,
)

if TYPE_CHECKING:
    from daebench.compiler.trace.program import Program

Names = dict[str, Any]


class Unknown(Exception):
    """A name that is carried through a loop has a form that was not known when the loop was begun."""

    def __init__(self, name: str, structure: Any) -> None:
        super().__init__(name)
        self.name, self.structure = name, structure


@dataclass(frozen=True)
class Ways:
    """Where ``return``, ``break`` and ``continue`` lead.

    Parameters
    ----------
    returned : list
        What a function without early returns returns.
    function : Region, optional
        What an early return leaves.
    broken, continued : (Region, sequence of str), optional
        What ``break`` and ``continue`` leave, with names whose values they hand on.
    missing : set of str
        Names that the loops around carry without a value yet.
    """

    returned: list[Any]
    function: Region | None = None
    broken: tuple[Region, Sequence[str]] | None = None
    continued: tuple[Region, Sequence[str]] | None = None
    missing: frozenset[str] = frozenset()


@dataclass
class Steered:
    """A function that steers.

    Parameters
    ----------
    program : Program
        What it belongs to.
    name, text : str
        Its name and its source.
    """

    program: "Program"
    name: str
    text: str
    parameters: Sequence[str] = ()
    body: Sequence[Statement] | None = field(default=None, repr=False)
    early: bool = False

    def __call__(self, *args: Any) -> Any:
        return self.program.called(self, args)

    def _read(self) -> None:
        node = ast.parse(self.text).body[-1]
        assert isinstance(node, ast.FunctionDef)
        self.parameters = [argument.arg for argument in node.args.args]
        self.body = statements(node, self.name)
        self.early = returns_early(self.body)

    def inlined(self, args: Sequence[Any]) -> Any:
        """Record the function where it is called; return its result."""
        if self.body is None:
            self._read()
        assert self.body is not None
        code, names = self.program.code, dict(zip(self.parameters, args, strict=True))
        if not self.early:
            ways = Ways([])
            _Follower(self.program).followed(self.body, names, ways)
            return ways.returned[0] if ways.returned else ()
        region = Region(code)
        with code.inside(region.block):
            if _Follower(self.program).followed(self.body, names, Ways([], region)):
                _leave(code, region, ())
        code.block.append(region)
        return _behind(code, region)


def _leave(code: Code, region: Region, structure: Any) -> None:
    leave = Leave(region, structure, code.block)
    region.leaves.append(leave)
    code.block.append(leave)


def _behind(code: Code, region: Region) -> Any:
    """Return the value of a region, put together of those with which it is left."""
    leaves = region.leaves
    return united(code, [leave.structure for leave in leaves], [(leave.block, True) for leave in leaves], region.results, [leave.values for leave in leaves])


class _Follower:
    """Follows the statements of one function."""

    def __init__(self, program: "Program") -> None:
        self.code, self.space = program.code, program.space

    def _value(self, code: Any, names: Names) -> Any:
        return eval(code, self.space, names)

    def followed(self, body: Sequence[Statement], names: Names, ways: Ways) -> bool:
        """Record statements; return whether what comes behind them is reached."""
        for statement in body:
            if statement.kind == "run":
                exec(statement.code[0], self.space, names)
            elif not getattr(self, f"_{statement.kind}")(statement, names, ways):
                return False
        return True

    def _return(self, statement: Statement, names: Names, ways: Ways) -> bool:
        value = self._value(statement.code[0], names)
        if ways.function is None:
            ways.returned.append(value)
        else:
            _leave(self.code, ways.function, value)
        return False

    def _break(self, statement: Statement, names: Names, ways: Ways) -> bool:
        assert ways.broken
        _leave(self.code, ways.broken[0], {name: names[name] for name in ways.broken[1] if name in names})
        return False

    def _continue(self, statement: Statement, names: Names, ways: Ways) -> bool:
        assert ways.continued
        _leave(self.code, ways.continued[0], {name: names[name] for name in ways.continued[1] if name in names})
        return False

    def _if(self, statement: Statement, names: Names, ways: Ways) -> bool:
        test = self._value(statement.code[0], names)
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
            self._join(node, sorted(statement.binds & statement.after), sides, names)
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

    def _join(self, node: If, bound: Sequence[str], sides: Sequence[Names], names: Names) -> None:
        """Note the values behind a branch that both sides reach the end of."""
        ends = [(block, False) for block in node.blocks]
        for name in bound:
            there = [side[name] for side in sides if name in side]
            if len(there) == 1:
                there.insert(name in sides[0], unset(self.code, there[0]))
            if there:
                names[name] = united(self.code, there, ends, node.results, node.yields)

    def _each(self, statement: Statement, names: Names, ways: Ways) -> bool:
        over = self._value(statement.code[0], names)
        if isinstance(over, Array):
            return _Turns(self, statement, names, ways, (0, over.shape[0], 1), over).recorded()
        if leaves_loop(statement.body):
            raise TypeError(f"break or continue in a loop over a tuple, in line {statement.line}")
        for x in over:
            names[statement.target] = x
            if not self.followed(statement.body, names, ways):
                return False
        return True

    def _for(self, statement: Statement, names: Names, ways: Ways) -> bool:
        given = [self._value(code, names) for code in statement.code]
        first, last, step = (0, given[0], 1) if len(given) == 1 else (*given, 1)[:3]
        if not isinstance(step, int) or step == 0:
            raise TypeError(f"a step of range that is not known, in line {statement.line}")
        if isinstance(first, int) and isinstance(last, int) and not range(first, last, step):
            return True
        return _Turns(self, statement, names, ways, (first, last, step)).recorded()

    def _while(self, statement: Statement, names: Names, ways: Ways) -> bool:
        return _Turns(self, statement, names, ways).recorded()


class _Turns:
    """The turns of a loop: what is carried from one to the next is found by recording a turn, again where it was not as expected."""

    def __init__(
        self, follower: _Follower, statement: Statement, names: Names, ways: Ways, bounds: tuple[Any, Any, int] | None = None, over: Array | None = None
    ) -> None:
        self.follower, self.statement, self.names, self.ways = follower, statement, names, ways
        self.bounds, self.over, self.code = bounds, over, follower.code
        read = statement.head | statement.after
        self.carried = sorted(name for name in statement.binds & read if name != statement.target)
        if statement.target in statement.after:
            raise TypeError(f"{statement.target} is read behind the loop that binds it, in line {statement.line}")
        self.begun: Names = {name: names[name] for name in self.carried if name in names}
        self.kinds: dict[tuple[str, int], str] = {}

    ATTEMPTS = 50

    def recorded(self) -> bool:
        """Record the loop; return whether what comes behind it is reached."""
        returns = self.ways.function.leaves if self.ways.function else []
        made = len(returns)
        for _ in range(self.ATTEMPTS):
            del returns[made:]
            try:
                reached = self._attempt()
            except Unknown as unknown:
                if unknown.name not in self.carried or unknown.name in self.begun:
                    raise
                self.begun[unknown.name] = unset(self.code, unknown.structure)
            else:
                if reached is not None:
                    return reached
        raise TypeError(f"the values that a loop carries have no fixed form, in line {self.statement.line}")

    def _attempt(self) -> bool | None:
        """Record a turn; return None where it has to be recorded again."""
        code, statement = self.code, self.statement
        region, loop = Region(code), Loop()
        names = {**self.names, **self._parameters(loop)}
        missing = self.ways.missing | {name for name in self.carried if name not in self.begun}
        allocated = code.allocated
        with code.inside(region.block):
            code.block.append(loop)
            with code.inside(loop.block):
                index = self._head(loop, region, names)
                ways = replace(self.ways, broken=(region, self.carried), missing=missing)
                goes_on = self._turn(names, ways)
                if goes_on and not self._expected(names, loop):
                    return None
                if goes_on:
                    self._next(loop, region, names, index, kept=code.allocated != allocated)
                else:
                    loop.nexts = None
            if not self._known_behind(region):
                return None
        code.block.append(region)
        return self._end(region)

    def _parameters(self, loop: Loop) -> Names:
        """Make the parameters of the loop; return the names that stand for them."""
        found: Names = {}
        self.places: list[tuple[str, int, Value]] = []
        for name, structure in self.begun.items():
            new: list[Value] = []
            for k, part in enumerate(parts_of(structure)):
                kind = self.kinds.get((name, k), kind_of(part))
                parameter = Value(self.code, "parameter", kind)
                loop.parameters.append(parameter)
                loop.initial.append(self.code.as_kind(part, kind))
                new.append(parameter)
                self.places.append((name, k, parameter))
            found[name] = rebuilt(structure, iter(new))
        self.at_head = found
        return found

    def _head(self, loop: Loop, region: Region, names: Names) -> Any:
        """Record the test at the beginning of a turn over a range; return its index."""
        if self.bounds is None:
            return None
        first, last, step = self.bounds
        index = Value(self.code, "parameter", INTEGER)
        loop.parameters.append(index)
        loop.initial.append(self.code.as_kind(first, INTEGER))
        test = If(index < last if step > 0 else index > last)
        test.falls[1] = False
        leave = Leave(region, dict(self.at_head), test.blocks[1])
        test.blocks[1].append(leave)
        region.leaves.append(leave)
        self.code.block.append(test)
        names[self.statement.target] = index if self.over is None else self.over[index]
        return index

    def _turn(self, names: Names, ways: Ways) -> bool:
        """Record the statements of a turn; return whether another follows."""
        if not _continues(self.statement.body):
            return self.follower.followed(self.statement.body, names, ways)
        region = Region(self.code)
        with self.code.inside(region.block):
            if self.follower.followed(self.statement.body, names, replace(ways, continued=(region, self.carried))):
                _leave(self.code, region, {name: names[name] for name in self.carried if name in names})
        self.code.block.append(region)
        if not region.leaves:
            return False
        names.update(self._values_behind(region))
        return True

    def _expected(self, names: Names, loop: Loop) -> bool:
        """Return whether the values at the end of a turn are of the form and kinds that were expected; expect others if not."""
        good = True
        for name in self.carried:
            if name not in names:
                continue
            if name not in self.begun:
                self.begun[name] = unset(self.code, names[name])
                good = False
            elif pattern_of(sized(self.code, names[name])) == pattern_of(self.begun[name]):
                names[name] = sized(self.code, names[name])
            elif pattern_of(names[name]) != pattern_of(self.begun[name]):
                self._expect_form(name, names[name])
                good = False
        for name, k, parameter in self.places:
            if good and parameter.kind != POINTER:
                kind = common(parameter.kind, kind_of(parts_of(names[name])[k]))
                if kind != parameter.kind:
                    self.kinds[name, k] = kind
                    good = False
        return good

    def _expect_form(self, name: str, found: Any) -> None:
        """Expect the lengths of arrays to change, or a name without a value yet to be of another form."""
        lengths = sized(self.code, self.begun[name])
        if pattern_of(lengths) == pattern_of(sized(self.code, found)) != pattern_of(self.begun[name]):
            self.begun[name] = lengths
        elif name not in self.names:
            self.begun[name] = unset(self.code, found)
        else:
            raise Mismatch(f"{name} is of one form before a loop, and of another after a turn of it, in line {self.statement.line}")

    def _next(self, loop: Loop, region: Region, names: Names, index: Any, *, kept: bool) -> None:
        """Note the values of the parameters in the next turn. What is carried of new arrays is copied, and all other memory given back."""
        nexts = {parameter: parts_of(names[name])[k] for name, k, parameter in self.places}
        moved = [p for p in nexts if p.kind == POINTER and nexts[p] is not p]
        if moved or kept:
            self._keep(region, names, nexts, moved)
        end = self.code.block, False
        loop.nexts = [converted(self.code, nexts[p], p.kind, end) for _, _, p in self.places]
        if self.bounds is not None:
            loop.nexts.append(self.code.as_kind(index + self.bounds[2], INTEGER))

    def _keep(self, region: Region, names: Names, nexts: dict[Value, Any], moved: Sequence[Value]) -> None:
        code = self.code
        ends = {array.pointer: array for name in self.carried if name in names for array in arrays_of(names[name])}
        starts = {array.pointer: before for name in self.begun for array, before in zip(arrays_of(self.at_head[name]), arrays_of(self.begun[name]), strict=True)}
        before: list[Any] = []
        with code.inside(before):
            buffers = {p: empty(code, (self._size(ends[nexts[p]], starts[p]),), starts[p].kind).pointer for p in moved}
            mark = code.effect("mark", POINTER, ())
        if any(nexts[p].op == "parameter" for p in moved):  # one array takes the place of another: all are copied away first
            for p in moved:
                spare = empty(code, (ends[nexts[p]].size,), starts[p].kind).pointer
                self._move(spare, nexts[p], ends[nexts[p]])
                ends[spare], nexts[p] = ends[nexts[p]], spare
        for p in moved:
            self._move(buffers[p], nexts[p], ends[nexts[p]])
            nexts[p] = buffers[p]
        code.effect("release", "", (mark,))
        region.block[0:0] = before

    def _move(self, to: Value, of: Value, array: Array) -> None:
        self.code.effect("move", "", (to, of, self.code.as_kind(array.size, INTEGER), array.kind))

    @staticmethod
    def _size(end: Array, start: Array) -> Any:
        return end.size if isinstance(end.size, int) else start.size

    def _known_behind(self, region: Region) -> bool:
        """Return whether each name that is read behind the loop, and bound where it is left, was carried; expect it to be if not."""
        good = True
        for name in self.statement.binds & self.statement.after:
            forms = [leave.structure[name] for leave in region.leaves if name in leave.structure]
            if name not in self.begun and 0 < len(forms) < len(region.leaves):
                self.begun[name] = unset(self.code, forms[0])
                good = False
        return good

    def _end(self, region: Region) -> bool:
        if not region.leaves:
            return False
        self.names.update(self._values_behind(region, self.statement.after))
        return True

    def _values_behind(self, region: Region, wanted: Any = None) -> Names:
        """Return the values of names behind a region, of those that all its departures bind."""
        leaves = region.leaves
        names = [n for n in self.carried if (wanted is None or n in wanted) and all(n in leave.structure for leave in leaves)]
        for leave in leaves:
            leave.structure = tuple(leave.structure[name] for name in names)
        return dict(zip(names, _behind(self.code, region), strict=True))


def _continues(body: Sequence[Statement]) -> bool:
    return any(s.kind == "continue" or (s.kind == "if" and (_continues(s.body) or _continues(s.otherwise))) for s in body)


def unchanged(loop: Loop) -> Mapping[Value, Value]:
    """Return the parameters of a loop that no turn changes, with their values."""
    if loop.nexts is None:
        return dict(zip(loop.parameters, loop.initial, strict=True))
    return {p: first for p, first, then in zip(loop.parameters, loop.initial, loop.nexts, strict=True) if then is p or same(then, first)}
