"""The operations of a recorded function that have to be computed: those that its results and its effects on memory depend on."""

from collections.abc import Mapping, Sequence
from typing import Any

from daebench.compiler.trace.ir import Call, Function, If, Leave, Loop, Region, Value
from daebench.compiler.trace.turns import unchanged

EFFECTS = frozenset(("store", "move", "release", "ccall", "seen"))
"""Operations that are needed though nothing reads their result."""


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
        return True in [_RULES[type(node)](self, node) for node in block]

    def _value(self, node: Value) -> bool:
        if node.op not in EFFECTS:
            return False
        self._roots.append(node)
        return True

    def _branch(self, node: If) -> bool:
        sides = [self._acts(block) for block in node.blocks]
        acts = any(sides) or not all(node.falls)
        if acts:
            self._roots.append(node.test)
            self.steering.add(node)
        for result, *values in zip(node.results, *node.yields, strict=True):
            self.sources[result] = [*values, *[node.test] * (not acts)]
        return acts

    def _region(self, node: Region) -> bool:
        for k, result in enumerate(node.results):
            self.sources[result] = [leave.values[k] for leave in node.leaves]
        return self._acts(node.block)

    def _loop(self, node: Loop) -> bool:
        self.same |= unchanged(node)
        for k, parameter in enumerate(node.parameters):
            self.sources[parameter] = [node.initial[k], *([] if node.nexts is None else [node.nexts[k]])]
        return self._acts(node.block)

    def _leave(self, node: Leave) -> bool:
        return True

    def _call(self, node: Call) -> bool:
        if node.function not in self._effective:
            return False
        self._roots.append(node)
        return True

    def _mark(self) -> None:
        waiting = self._roots
        while waiting:
            node = waiting.pop()
            if node not in self.needed:
                self.needed.add(node)
                waiting += self._arguments(node)

    def _arguments(self, node: Any) -> Sequence[Any]:
        """Return the values and calls that a value or call is computed from."""
        if node in self.same:
            return [self.same[node]]
        if type(node) is Value and node.op in ("result", "parameter"):
            return self.sources.get(node, ())
        return [x for x in node.args if isinstance(x, Value | Call)]


_RULES: Mapping[type, Any] = {
    Value: Needed._value,
    If: Needed._branch,
    Region: Needed._region,
    Loop: Needed._loop,
    Leave: Needed._leave,
    Call: Needed._call,
}
