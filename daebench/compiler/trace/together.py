"""Functions that steer, followed for several runs at once: where runs would take different branches, both are computed.

Statements under a test that differs from run to run are followed for all of them, and their values are selected behind it. An iteration
goes on until all runs have returned. Mostly they return at once; the results of runs that return earlier are stored in memory. Tests of
numbers that are common to all runs, such as the number of steps, stay branches.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from daebench.compiler.trace.follow import Follower, Steered
from daebench.compiler.trace.ir import TRUTH, If, Region, Value
from daebench.compiler.trace.lanes import Slot, anyof, spoiled
from daebench.compiler.trace.statements import Statement, has, loops
from daebench.compiler.trace.structure import united
from daebench.compiler.trace.ways import Names, Ways, behind, leave

LIVE = "runs that have not returned"
"""The name, which no function has, of a truth value."""

STEPPING = ("integrate", "advance")
"""Functions whose loops take steps. A run that has returned continues with NaN there, on which no iteration goes on."""

MOVED = ("x", "x1")
"""Variables that are set to NaN then."""


class Together(Follower):
    """Follows the statements of one function for several runs."""

    def __init__(self, function: Steered) -> None:
        super().__init__(function)
        self.mask: Value | None = None
        self.exits: list[tuple[Any, Any]] = []
        self.slot = Slot(self.code, int(self.code.together))
        self.inside_loop = False

    def result(self, names: Names) -> Any:
        """Record the function, given its arguments by name; return its result."""
        code, body = self.code, self.function.body
        outer, code.mask = code.mask, None
        names[LIVE] = True
        if not any(loops([statement]) and has(statement.body, "return") for statement in body):
            ways = Ways([])
            self.followed(body, names, ways)
            result = ways.returned[0] if ways.returned else self._last()
        else:
            region = Region()
            with code.inside(region.block):
                self.followed(body, names, Ways([], region))
            code.block.append(region)
            result, gone = behind(code, region)
            if self.slot.pointer is not None:
                result = self._where(gone, result, self.slot.recalled)
        code.mask = outer
        return result

    def hidden(self, statement: Statement) -> Sequence[str]:
        """Return which runs have not returned, if some may."""
        return (LIVE,) if has([statement], "return") else ()

    def _where(self, test: Any, otherwise: Any, make: Callable[[], Any]) -> Any:
        """Return a value where no run passes a test, else what is made in the runs that do."""
        if not isinstance(test, Value):
            return otherwise
        return self._branched(anyof(test), lambda: self.code.select(test, make(), otherwise), otherwise)

    def _branched(self, test: Value, make: Callable[[], Any], otherwise: Any) -> Any:
        """Return the value of ``make`` if a test is true, else another; operations of ``make`` are recorded in a branch."""
        node = If(test)
        with self.code.inside(node.blocks[0]):
            value = make()
        self.code.block.append(node)
        return united(self.code, [value, otherwise], [(block, False) for block in node.blocks], node.results, node.yields)

    @contextmanager
    def _masked(self, mask: Value) -> Iterator[None]:
        """Follow statements for some runs only, those of a mask."""
        outer = self.mask, self.code.mask
        self.mask = self.code.mask = mask if self.mask is None else self.code.both(self.mask, mask)
        try:
            yield
        finally:
            self.mask, self.code.mask = outer

    # ---- branches --------------------------------------------------------------------------------------------------------

    def _if(self, statement: Statement, names: Names, ways: Ways) -> bool:
        test = self._value(statement.code[0], names)
        returns = isinstance(test, Value) and has([statement], "return")
        if returns and len(test.kind) == 1 and (self.mask is not None or not self.inside_loop):
            test = self.code.as_kind(test, TRUTH + self.code.together)
        if not isinstance(test, Value) or len(test.kind) == 1:
            return self._tested(test, statement, names, ways)
        test = self.code.truth(test)
        if returns or not statement.costly or not statement.binds & statement.after <= names.keys():
            return self._selected(test, statement, names, ways)
        sides = [(test, statement.body), (self.code.negated(test), statement.otherwise)]
        for mask, body in sides:
            if body:
                self._passed_over(mask, body, statement, names, ways)
        return True

    def _selected(self, test: Value, statement: Statement, names: Names, ways: Ways) -> bool:
        """Follow both sides of a branch, and select the values of names."""
        falls, sides = [], []
        for mask, body in ((test, statement.body), (self.code.negated(test), statement.otherwise)):
            side = dict(names)
            with self._masked(mask):
                falls.append(self.followed(body, side, ways))
            names[LIVE] = side[LIVE]
            sides.append(side)
        live = names[LIVE]
        if not any(falls) and self.inside_loop:
            raise TypeError(f"all runs return from a branch within a loop, {statement.place}")
        if not any(falls):
            return False
        if not all(falls):
            names.update(sides[falls.index(True)])
        else:
            for name in statement.binds & statement.after:
                if there := self.at_ends(name, sides, statement, ways):
                    names[name] = self.code.select(test, *there) if len(there) == 2 else there[0]
        names[LIVE] = live
        return True

    def _passed_over(self, mask: Value, body: Sequence[Statement], statement: Statement, names: Names, ways: Ways) -> None:
        """Follow statements, without a return among them, that are passed over if no run needs them."""
        bound = sorted(statement.binds & statement.after)

        def side_values() -> Any:
            side = dict(names)
            with self._masked(mask):
                self.followed(body, side, ways)
            return tuple([self.code.select(mask, side[name], names[name]) for name in bound])

        before = tuple([names[name] for name in bound])
        names.update(zip(bound, self._branched(anyof(mask), side_values, before), strict=True))

    # ---- returns ---------------------------------------------------------------------------------------------------------

    def _return(self, statement: Statement, names: Names, ways: Ways) -> bool:
        if self.mask is None:
            value = self._merged(self._value(statement.code[0], names), names)
            if ways.function is None:
                ways.returned.append(value)
            else:
                leave(self.code, ways.function, (value, self.code.negated(names[LIVE])))
            return False
        now = self.code.both(names[LIVE], self.mask)
        if not self.inside_loop:
            if ways.function is not None:
                raise TypeError(f"a return before an iteration that others return from, {statement.place}")
            self.exits.append((now, self._value(statement.code[0], names)))
            names[LIVE] = self.code.both(names[LIVE], self.code.negated(now))
            return False
        moved = [name for name in MOVED if name in names] if self.function.name.rpartition(".")[2] in STEPPING else []

        def departed() -> Any:
            assert ways.function is not None
            value, before = self._value(statement.code[0], names), names[LIVE]
            live = self.code.both(before, self.code.negated(now))
            last = If(self.code.negated(anyof(live)))
            last.falls[0] = False
            with self.code.inside(last.blocks[0]):
                leave(self.code, ways.function, (value, self.code.negated(before)))
            self.code.block.append(last)
            self.slot.note(now, value)
            return live, *(spoiled(live, names[name]) for name in moved)

        before = (names[LIVE], *(names[name] for name in moved))
        names.update(zip((LIVE, *moved), self._branched(anyof(now), departed, before), strict=True))
        return False

    def _last(self) -> Any:
        """Return the result of a function from which all runs return elsewhere than at its end."""
        if not self.exits:
            return ()
        (_, result), *others = reversed(self.exits)
        for place, value in others:
            result = self.code.select(place, value, result)
        return result

    def _merged(self, last: Any, names: Names) -> Any:
        """Return the result of a function: the last, and for runs that returned elsewhere theirs."""
        return self._where(self.code.negated(names[LIVE]), last, self._last) if self.exits else last

    # ---- loops -----------------------------------------------------------------------------------------------------------

    def _for(self, statement: Statement, names: Names, ways: Ways) -> bool:
        outer, self.inside_loop = self.inside_loop, self.inside_loop or has(statement.body, "return")
        try:
            if outer and has(statement.body, "return"):
                raise TypeError(f"a return from a loop within a loop, {statement.place}")
            return super()._for(statement, names, ways)
        finally:
            self.inside_loop = outer
