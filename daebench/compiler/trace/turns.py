"""The turns of a loop, recorded: what passes from one to the next is found by recording a turn, again where it was not as expected."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from daebench.compiler.trace.arrays import Array, empty
from daebench.compiler.trace.ir import INTEGER, POINTER, If, Loop, Region, Value, common, kind_of
from daebench.compiler.trace.statements import Statement, has
from daebench.compiler.trace.structure import (
    Mismatch,
    arrays_of,
    converted,
    parts_of,
    pattern_of,
    promoted,
    rebuilt,
    sized,
    unset,
)
from daebench.compiler.trace.ways import Names, Ways, behind, leave

ATTEMPTS = 50
"""Times that a loop is recorded, at most: each name that is carried may need a few."""


class Unknown(Exception):
    """A name that is carried through a loop has a form that was not known when the loop was begun."""

    def __init__(self, name: str, structure: Any) -> None:
        super().__init__(name)
        self.name, self.structure = name, structure


class Wider(Exception):
    """Something that is kept in memory is of a wider kind than was known when the loop was begun."""


class Turns:
    """The turns of a loop: what is carried from one to the next is found by recording a turn, again where it was not as expected."""

    def __init__(
        self,
        follower: Any,
        statement: Statement,
        names: Names,
        ways: Ways,
        bounds: tuple[Any, Any, int] | None = None,
        over: Array | None = None,
    ) -> None:
        self.follower, self.statement, self.names, self.ways = follower, statement, names, ways
        self.bounds, self.over, self.code = bounds, over, follower.code
        self.carried = sorted(name for name in statement.binds & statement.head if name != statement.target)
        self.left = sorted(name for name in statement.binds & (statement.head | statement.after) if name != statement.target)
        if statement.target in statement.after:
            raise TypeError(f"{statement.target} is read behind the loop that binds it, {statement.place}")
        self.hidden = [name for name in follower.hidden(statement) if name in names]
        self.carried += self.hidden
        self.left += self.hidden
        self.begun: Names = {name: names[name] for name in self.carried if name in names}
        self.kinds: dict[tuple[str, int], str] = {}

    def recorded(self) -> bool:
        """Record the loop; return whether what comes behind it is reached."""
        returns = self.ways.function.leaves if self.ways.function else []
        count = len(returns)
        for _ in range(ATTEMPTS):
            # Early returns of an attempt that failed are in blocks that have been dropped.
            del returns[count:]
            try:
                reached = self._attempt()
            except Unknown as unknown:
                if unknown.name not in self.left or unknown.name in self.begun:
                    raise
                self.begun[unknown.name] = unset(self.code, unknown.structure)
            except Wider:
                continue
            else:
                if reached is not None:
                    return reached
        raise TypeError(f"the values that a loop carries have no fixed form, {self.statement.place}")

    def _attempt(self) -> bool | None:
        """Record a turn; return None where it has to be recorded again."""
        code = self.code
        region, loop = Region(), Loop()
        names = {**self.names, **self._parameters(loop)}
        missing = self.ways.missing | {name for name in self.carried if name not in self.begun}
        allocated = code.allocated
        with code.inside(region.block):
            code.block.append(loop)
            with code.inside(loop.block):
                index = self._head(loop, region, names)
                ways = replace(self.ways, left={"break": (region, self.left)}, missing=missing)
                goes_on = self._turn(names, ways)
                if goes_on and not (self._of_form(names) and self._of_kind(names)):
                    return None
                if goes_on:
                    self._next(loop, region, names, index, keeps=code.allocated != allocated)
                else:
                    loop.nexts = None
            if not self._known_behind(region):
                return None
        code.block.append(region)
        return self._end(region)

    def _parameters(self, loop: Loop) -> Names:
        """Make the parameters of the loop; return the names that stand for them."""
        names: Names = {}
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
            names[name] = rebuilt(structure, iter(new))
        self.at_head = names
        return names

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
        with self.code.inside(test.blocks[1]):
            ended = dict(names)
            if self.follower.followed(self.statement.otherwise, ended, self.ways):
                leave(self.code, region, {name: ended[name] for name in self.left if name in ended})
        self.code.block.append(test)
        names[self.statement.target] = index if self.over is None else self.over[index]
        return index

    def _turn(self, names: Names, ways: Ways) -> bool:
        """Record the statements of a turn; return whether another follows."""
        if not has(self.statement.body, "continue", within_loops=False):
            return self.follower.followed(self.statement.body, names, ways)  # type: ignore[no-any-return]
        region = Region()
        with self.code.inside(region.block):
            if self.follower.followed(self.statement.body, names, replace(ways, left={**ways.left, "continue": (region, self.carried)})):
                leave(self.code, region, {name: names[name] for name in self.carried if name in names})
        self.code.block.append(region)
        if not region.leaves:
            return False
        names.update(self._values_behind(region))
        return True

    def _of_form(self, names: Names) -> bool:
        """Return whether the values at the end of a turn are of the forms that were expected; expect others if not."""
        good = True
        for name in self.carried:
            if name not in names:
                continue
            if name not in self.begun:
                self.begun[name] = unset(self.code, names[name])
                good = False
                continue
            form = pattern_of(self.begun[name])
            if pattern_of(names[name]) != form:
                names[name] = sized(self.code, promoted(self.code, names[name], self.begun[name]))
            if pattern_of(names[name]) != form:
                self._expect_form(name, names[name])
                good = False
        return good

    def _of_kind(self, names: Names) -> bool:
        """Return whether the numbers at the end of a turn are of the kinds that were expected; expect wider ones if not."""
        good = True
        for name, k, parameter in self.places:
            kind = POINTER if parameter.kind == POINTER else common(parameter.kind, kind_of(parts_of(names[name])[k]))
            if kind != parameter.kind:
                self.kinds[name, k] = kind
                good = False
        return good

    def _expect_form(self, name: str, value: Any) -> None:
        """Expect the lengths of arrays to change, or a name without a value yet to be of another form."""
        lengths = sized(self.code, promoted(self.code, self.begun[name], value))
        if pattern_of(lengths) == pattern_of(value):
            self.begun[name] = lengths
        elif name not in self.names:
            self.begun[name] = unset(self.code, value)
        else:
            raise Mismatch(f"{name} is of one form before a loop, and of another after a turn of it, {self.statement.place}")

    def _next(self, loop: Loop, region: Region, names: Names, index: Any, *, keeps: bool) -> None:
        """Note the values of the parameters in the next turn. What is carried of new arrays is copied, and all other memory given back."""
        nexts = {parameter: parts_of(names[name])[k] for name, k, parameter in self.places}
        moved = [p for p in nexts if p.kind == POINTER and nexts[p] is not p]
        if moved or keeps:
            self._keep(region, names, nexts, moved)
        end = self.code.block, False
        loop.nexts = [converted(self.code, nexts[p], p.kind, end) for _, _, p in self.places]
        if self.bounds is not None:
            loop.nexts.append(self.code.as_kind(index + self.bounds[2], INTEGER))

    def _keep(self, region: Region, names: Names, nexts: dict[Value, Any], moved: Sequence[Value]) -> None:
        code = self.code
        ends = {array.pointer: array for name in self.carried if name in names for array in arrays_of(names[name])}
        starts = {
            array.pointer: before
            for name in self.begun
            for array, before in zip(arrays_of(self.at_head[name]), arrays_of(self.begun[name]), strict=True)
        }
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
        words = array.size * array.wide
        self.code.effect("move", "", (to, of, self.code.as_kind(words, INTEGER), array.kind[0]))

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
        self.names.update(self._values_behind(region, self.statement.after | {*self.hidden}))
        return True

    def _values_behind(self, region: Region, wanted: Any = None) -> Names:
        """Return the values of names behind a region, of those that all its departures bind."""
        leaves = region.leaves
        names = [n for n in self.left if (wanted is None or n in wanted) and all(n in leave.structure for leave in leaves)]
        for departure in leaves:
            departure.structure = tuple(departure.structure[name] for name in names)
        return dict(zip(names, behind(self.code, region), strict=True))
