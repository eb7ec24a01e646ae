"""Where the values of a recorded function are made and read, and how often: what is read once can stand where it is read."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from daebench.compiler.print.needed import Needed
from daebench.compiler.trace.ir import Call, Function, If, Leave, Loop, Region, Value


@dataclass
class Use:
    """Where a value is made and read: blocks as paths from the outermost, and how often."""

    home: tuple[int, ...] = ()
    times: int = 0
    places: list[tuple[int, ...]] = field(default_factory=list)

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

    def _used(self, value: Value, place: tuple[int, ...], times: int = 1) -> None:
        use = self._uses.setdefault(self.same(value), Use())
        use.times += times
        use.places.append(place)

    def _made(self, values: Sequence[Value], place: tuple[int, ...]) -> None:
        for value in values:
            self._uses.setdefault(value, Use()).home = place

    def _look(self, block: Sequence[Any], place: tuple[int, ...]) -> None:
        """Note where values are made and read; a block within another has the place of its node at the end of its own."""
        for k, node in enumerate(block):
            _LOOKS[type(node)](self, node, place, k)

    def _look_value(self, node: Value, place: tuple[int, ...], k: int) -> None:
        if node not in self.need.needed:
            return
        self._made([node], place)
        for x in node.args:
            if isinstance(x, Value):
                self._used(x, place, width(node) if width(x) < width(node) else 1)

    def _look_call(self, node: Call, place: tuple[int, ...], k: int) -> None:
        if node in self.need.needed:
            self._made(node.results, place)
            for x in node.args:
                self._used(x, place)

    def _look_if(self, node: If, place: tuple[int, ...], k: int) -> None:
        self._made(node.results, place)
        self._used(node.test, place)
        for side, inner in enumerate(node.blocks):
            self._look(inner, (*place, k, side))
            self._given(node.results, node.yields[side], (*place, k, side))

    def _look_region(self, node: Region, place: tuple[int, ...], k: int) -> None:
        self._made(node.results, place)
        self._look(node.block, (*place, k))

    def _look_loop(self, node: Loop, place: tuple[int, ...], k: int) -> None:
        self._made(node.parameters, (*place, k))
        self._given(node.parameters, node.initial, place)
        self._look(node.block, (*place, k))
        self._given(node.parameters, node.nexts or (), (*place, k))

    def _look_leave(self, node: Leave, place: tuple[int, ...], k: int) -> None:
        self._given(node.region.results, node.values, place)

    def _given(self, targets: Sequence[Value], values: Sequence[Value], place: tuple[int, ...]) -> None:
        for target, value in zip(targets, values, strict=False):
            if self.changes(target):
                self._used(value, place)

    def changes(self, target: Value) -> bool:
        """Return whether a result, or a parameter of a loop, is a variable."""
        return target in self.need.needed and target not in self.need.same


_LOOKS: Mapping[type, Callable[[Uses, Any, tuple[int, ...], int], None]] = {
    Value: Uses._look_value,
    If: Uses._look_if,
    Region: Uses._look_region,
    Loop: Uses._look_loop,
    Leave: Uses._look_leave,
    Call: Uses._look_call,
}


def width(value: Value) -> int:
    """Return the number of entries."""
    return int(value.kind[1:] or 1)
