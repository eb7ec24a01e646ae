"""Loops over the nodes of a chain. Each field is computed once per node, and held as long as its neighbours need it.

A loop runs up or down the chain. In a loop that runs up, a field is computed at the farthest place ahead at which it is needed. Entries
needed farther behind come from earlier turns, moved from variable to variable. A loop that runs down works likewise.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from daebench.compiler.chain.fields import At, Field, zeros
from daebench.compiler.syntax import Lines, pack


@dataclass(frozen=True, kw_only=True)
class Demand:
    """Lines that a loop executes at each node."""

    needs: Sequence[tuple[Field, int]]
    """Fields that are needed, each with the place of the node, counted from the present one."""
    write: Callable[[At], Sequence[str]]
    """``write(at)`` returns the lines; the present node's number is k."""

    @property
    def stage(self) -> int:
        """Number of the last linear solve or iteration that it depends on."""
        return max((part.stage for part, _ in self.needs), default=0)


class Loop:
    """One loop over all nodes."""

    def __init__(self, name: str, nodes: int, demands: Sequence[Demand], *, up: bool = True, head: Sequence[str] = ()) -> None:
        self.name, self.nodes, self.demands, self.up, self.head = name, nodes, demands, up, head
        self.sign = 1 if up else -1
        self.wanted: dict[Field, set[int]] = {}
        self.front: dict[Field, int] = {}
        self._plan()

    def _plan(self) -> None:
        """Choose where each field is computed: ahead of all places where it is needed, and of the fields that depend on it."""
        ahead: dict[Field, int] = {}

        def want(part: Field, place: int, front: int) -> None:
            self.wanted.setdefault(part, set()).add(self.sign * place)
            ahead[part] = max(ahead.get(part, 0), front, self.sign * place)

        for demand in self.demands:
            for part, place in demand.needs:
                want(part, place, 0)
        while len(self.front) < len(self.wanted):
            part = max((field for field in self.wanted if field not in self.front), key=lambda field: field.number)
            self.front[part] = ahead[part]
            for child, place in part.needs:
                want(child, self.sign * ahead[part] + place, ahead[part])
        self.fields = sorted(self.front, key=lambda field: field.number)
        self.index = {part: i for i, part in enumerate(self.fields)}

    def lines(self) -> Lines:
        """Return the source of the loop."""
        if not self.demands and not self.head:
            return []
        lead = max(self.front.values(), default=0)
        lines = [f"{self._name(part, place)} = {self._beyond(part, first=self.up)}" for part in self.fields for place in self._behind(part)]
        span = f"range({-lead}, {self.nodes})" if self.up else f"range({self.nodes - 1 + lead}, -1, -1)"
        fronts = sorted({*self.front.values(), 0}, reverse=True)
        body = [line for front in fronts for line in self._begun(front, lead, self._turn(front))]
        body += [line for front in fronts for line in self._begun(front, lead, self._handed_down(front))]
        return [*lines, f"for k in {span}:", *_indented(body)]

    def _turn(self, front: int) -> Lines:
        """Source of the fields that are computed this far ahead, and of the demands if they are due at this turn."""
        parts = [part for part in self.fields if self.front[part] == front]
        k = self._ahead(front)

        def at(part: Field, place: int) -> str:
            return self._name(part, front + self.sign * place)

        written = [part.write(at, k) for part in parts]
        values = [source if isinstance(source, str) else pack(source) for source in written]
        body = [f"{self._name(part, front)} = {value}" for part, value in zip(parts, values, strict=True)]
        if front == 0:
            return [*self.head, *body, *(line for demand in self.demands for line in demand.write(at))]
        beyond = [f"{self._name(part, front)} = {self._beyond(part, first=not self.up)}" for part in parts]
        return [f"if {k} < {self.nodes}:" if self.up else f"if {k} >= 0:", *_indented(body), "else:", *_indented(beyond)]

    def _handed_down(self, front: int) -> Lines:
        """Source that moves the values on by one node, for the fields that are computed this far ahead."""
        parts = [(part, place) for part in self.fields if self.front[part] == front for place in self._behind(part)]
        return [f"{self._name(part, place)} = {self._name(part, place + 1)}" for part, place in parts]

    def _begun(self, front: int, lead: int, lines: Sequence[str]) -> Lines:
        """Source of the lines, executed only in turns in which the node this far ahead belongs to the chain."""
        if front == lead or not lines:
            return list(lines)
        k = self._ahead(front)
        return [f"if {k} >= 0:" if self.up else f"if {k} < {self.nodes}:", *_indented(lines)]

    def _ahead(self, front: int) -> str:
        return f"k {'+' if self.up else '-'} {front}" if front else "k"

    def _name(self, part: Field, place: int) -> str:
        return f"{self.name}_{self.index[part]}_{'m' if place < 0 else ''}{abs(place)}"

    def _behind(self, part: Field) -> range:
        """Places behind the one where a field is computed, from the farthest on."""
        return range(min(self.wanted[part]), self.front[part])

    def _beyond(self, part: Field, *, first: bool) -> str:
        """Source of the entries beyond an end of the chain: those of node -1 if it is the first."""
        return pack(part.ghost if first else zeros(part.width))


def _indented(lines: Sequence[str]) -> Lines:
    return [f"    {line}" for line in lines]
