"""A function of a chain under construction: linear systems and iterations one after another, in as few loops over nodes as serve them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count

from daebench.compiler.chain.band import Band
from daebench.compiler.chain.loops import Demand, Loop
from daebench.compiler.syntax import Lines


@dataclass(eq=False)
class Iteration:
    """Newton's iteration: the demands that set its unknowns at the start, and the lines that call it."""

    starts: list[Demand]
    call: Lines


class Program:
    """The function under construction: its linear systems and iterations in order, and the results that it returns.

    ``outer`` is the function that calls this one, whose slab and arrays it shares. Names are distinguished by numbers that begin with 1, so
    that the text of a function is the same in all modules.
    """

    def __init__(self, nodes: int, outer: "Program | None" = None) -> None:
        self.nodes = nodes
        self.top: Program = outer.top if outer else self
        self.first: int = outer.first + len(outer.events) if outer else 0
        self.events: list[Band | Iteration] = []
        self.wishes: list[tuple[Demand, Lines]] = []
        self.work: list[int] = []
        self.arguments: Sequence[str] = ()
        if not outer:
            self.columns, self.scratch, self.numbers = 0, (0, 0), count(1)

    @property
    def stage(self) -> int:
        """Number of the last event so far."""
        return self.first + len(self.events)

    def name(self, stem: str) -> str:
        """Return a name that is unique in the function."""
        return f"{stem}{next(self.top.numbers)}"

    def reserve(self, columns: int) -> int:
        """Return the first of this many new columns of the slab."""
        self.top.columns += columns
        return self.top.columns - columns

    def scratches(self, columns: int) -> int:
        """Return the first of this many columns of the slab that each system may use until it is solved."""
        first, most = self.top.scratch
        if columns > most:
            first = self.reserve(columns)
            self.top.scratch = first, columns
        return first

    def lines(self) -> Lines:
        """Return the body. Each demand is written in the first loop that can serve it."""
        waiting = list(self.wishes)
        lines = [line for _, before in waiting for line in before]

        def due(stage: int) -> list[Demand]:
            ready = [wish for wish in waiting if wish[0].stage <= stage]
            waiting[:] = [wish for wish in waiting if wish not in ready]
            return [demand for demand, _ in ready]

        for number, event in enumerate(self.events, self.first + 1):
            if isinstance(event, Iteration):
                lines += Loop(self.name("f"), self.nodes, [*event.starts, *due(number - 1)]).lines() + event.call
                continue
            lines += event.begin
            lines += Loop(self.name("f"), self.nodes, [*event.elimination(), *due(number - 1)]).lines() + event.between
            lines += event.again(self._again)
            fitting: list[Demand] = []
            for wish in [wish for wish in waiting if wish[0].stage <= number]:
                down = Loop(self.name("f"), self.nodes, [*fitting, wish[0]], up=False)
                if all(front == 0 for part, front in down.front.items() if part.stage == number and not part.needs):
                    fitting.append(wish[0])
                    waiting.remove(wish)
            lines += Loop(self.name("f"), self.nodes, fitting, up=False, head=event.substitution).lines()
        return lines + Loop(self.name("f"), self.nodes, [demand for demand, _ in waiting]).lines()

    def _again(self, demands: Sequence[Demand]) -> Lines:
        return Loop(self.name("f"), self.nodes, demands).lines()
