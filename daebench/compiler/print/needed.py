"""The operations of a recorded function that have to be computed: those that its results and its effects on memory depend on."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from daebench.compiler.trace.ir import Call, Function, If, Leave, Loop, Region, Value, Values, flows, inner
from daebench.compiler.trace.structure import unchanged

EFFECTS = frozenset(("store", "move", "release", "ccall", "seen"))
"""Operations that are needed though nothing reads their result."""


NODES = {kind: f"_{kind.__name__.lower()}" for kind in (Value, If, Region, Loop, Leave, Call)}
"""Names of the methods for the nodes of a block."""


class Needed:
    """The values, calls and branches of a function that have to be computed, and whether it changes memory."""

    def __init__(self, function: Function, effective: set[Function]) -> None:
        self._effective = effective
        self.sources: dict[Value, Sequence[Any]] = {}
        self.same: dict[Value, Value] = {}
        self.needed: set[Any] = set()
        self.steering: set[Any] = set()
        self._roots: list[Any] = [*function.results]
        self.changes = self._acts(function.block)
        self._mark()

    def _acts(self, block: Sequence[Any]) -> bool:
        """Note where results come from, and what is needed in any case; return whether a block writes to memory or leaves."""
        return True in [self._act(node) for node in block]

    def _act(self, node: Any) -> bool:
        if type(node) is Leave:
            return True
        if type(node) in (Value, Call):
            acts = node.op in EFFECTS if type(node) is Value else node.function in self._effective
            self._roots += [node] * acts
            return acts
        acts, test = True in [self._acts(block) for block in inner(node)], []
        if type(node) is If:
            acts = acts or not all(node.falls)
            self._roots += [node.test] * acts
            self.steering |= {node} if acts else set()
            test = [node.test] * (not acts)
        elif type(node) is Loop:
            self.same |= unchanged(node)
        targets, rows = flows(node)
        self.sources |= {target: [*(row[k] for row in rows), *test] for k, target in enumerate(targets)}
        return acts

    def _mark(self) -> None:
        waiting = self._roots
        while waiting:
            node = waiting.pop()
            if node not in self.needed:
                self.needed.add(node)
                waiting += self._arguments(node)

    def wants(self, node: Any) -> bool:
        """Return whether a node of a block has to be printed."""
        if type(node) is If:
            return node in self.steering or not self.needed.isdisjoint(node.results)
        return type(node) not in (Value, Call) or node in self.needed

    def _arguments(self, node: Any) -> Sequence[Any]:
        """Return the values and calls that a value or call is computed from."""
        if node in self.same:
            return [self.same[node]]
        if type(node) is Value and node.op in ("result", "parameter"):
            return self.sources.get(node, ())
        return [x for x in node.args if isinstance(x, Value | Call)]


Place = tuple[int, ...]
"""A block, as the path to it from the outermost."""


@dataclass
class Use:
    """Where a value is made and read, and how often."""

    home: Place = ()
    times: int = 0
    places: list[Place] = field(default_factory=list)

    @property
    def once(self) -> bool:
        """Whether it is read once, in the block where it is made."""
        return self.times == 1 and self.places == [self.home]

    @property
    def outside(self) -> bool:
        """Whether it is read behind the block where it is made."""
        return any(place[: len(self.home)] != self.home for place in self.places)


class Uses:
    """The uses of all values of a function that are needed."""

    def __init__(self, function: Function, need: Needed) -> None:
        self.need = need
        self._uses: dict[Value, Use] = {}
        self._look(function.block, ())
        for result in function.results:
            self._used(result, ())

    def __getitem__(self, value: Value) -> Use:
        """Return the use of a value."""
        return self._uses.get(value) or Use()

    def same(self, value: Value) -> Value:
        """Return the value before the loop for a parameter that no turn changes; any other value itself."""
        while value in self.need.same:
            value = self.need.same[value]
        return value

    def _used(self, value: Value, place: Place, times: int = 1) -> None:
        use = self._uses.setdefault(self.same(value), Use())
        use.times += times
        use.places.append(place)

    def _made(self, values: Values, place: Place) -> None:
        for value in values:
            self._uses.setdefault(value, Use()).home = place

    def _look(self, block: Sequence[Any], place: Place) -> None:
        """Note where values are made and read; a block within another has the place of its node at the end of its own."""
        for k, node in enumerate(block):
            if self.need.wants(node):
                getattr(self, NODES[type(node)])(node, place, k)

    def _value(self, node: Value, place: Place, k: int) -> None:
        self._made([node], place)
        for x in node.args:
            if isinstance(x, Value):
                self._used(x, place, width(node) if width(x) < width(node) else 1)

    def _call(self, node: Call, place: Place, k: int) -> None:
        self._made(node.results, place)
        for x in node.args:
            self._used(x, place)

    def _if(self, node: If, place: Place, k: int) -> None:
        self._made(node.results, place)
        self._used(node.test, place)
        for side, block in enumerate(node.blocks):
            self._look(block, (*place, k, side))
            self._given(node.results, node.yields[side], (*place, k, side))

    def _region(self, node: Region, place: Place, k: int) -> None:
        self._made(node.results, place)
        self._look(node.block, (*place, k))

    def _loop(self, node: Loop, place: Place, k: int) -> None:
        self._made(node.parameters, (*place, k))
        self._given(node.parameters, node.initial, place)
        self._look(node.block, (*place, k))
        self._given(node.parameters, node.nexts or (), (*place, k))

    def _leave(self, node: Leave, place: Place, k: int) -> None:
        self._given(node.region.results, node.values, place)

    def _given(self, targets: Values, values: Values, place: Place) -> None:
        for target, value in zip(targets, values, strict=False):
            if self.changes(target):
                self._used(value, place)

    def changes(self, target: Value) -> bool:
        """Return whether a result, or a parameter of a loop, is a variable."""
        return target in self.need.needed and target not in self.need.same


def width(value: Value) -> int:
    """Return the number of entries."""
    return int(value.kind[1:] or 1)


class Walker:
    """Goes through the nodes of blocks that have to be printed."""

    need: Needed

    def _block(self, block: Sequence[Any]) -> None:
        for node in block:
            if self.need.wants(node):
                getattr(self, NODES[type(node)])(node)


def leaves(block: Sequence[Any]) -> Iterator[Any]:
    """Return the values and calls of a block."""
    for node in block:
        if type(node) in (Value, Call):
            yield node
        for inside in inner(node):
            yield from leaves(inside)
