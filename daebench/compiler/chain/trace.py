"""A scheme executed on symbols: its operations on vectors, Jacobians and linear systems become a few loops over the nodes of a chain.

Vectors are fields, computed where a loop needs them. A linear system is a loop up the chain and one down. An iteration is that of
``kernels/newton.py``, with its update as a separate function.
"""

from collections.abc import Sequence
from itertools import count
from typing import TYPE_CHECKING, Any

from daebench.compiler import values
from daebench.compiler.chain.algebra import ChainLanguage
from daebench.compiler.chain.band import of_width
from daebench.compiler.chain.fields import At, Field, Scalar, say, stored
from daebench.compiler.chain.files import ChainFiles
from daebench.compiler.chain.loops import Demand
from daebench.compiler.chain.nodes import Nodes
from daebench.compiler.chain.program import Iteration, Program
from daebench.compiler.chain.systems import Rows
from daebench.compiler.files import Operation
from daebench.compiler.syntax import Lines, function, pack
from daebench.errors import InvalidProblem

if TYPE_CHECKING:
    from daebench.compiler.link import Linker

ARGUMENTS: dict[str, tuple[str, ...]] = dict.fromkeys(("H", "H_p", "H_q", "Gv", "lam", "independence", "row_moduli"), ("p", "q")) | {
    "g": ("q",)
}
ARGUMENTS |= dict.fromkeys(("step", "increment", "start"), ("p0", "q0", "h"))
"""Functions that are written from loops over nodes, and their arguments."""


class Tracer:
    """Writes the functions of a chain that a linker asks for. The linker joins them with the loop over steps."""

    def __init__(self, linker: "Linker", nodes: Nodes) -> None:
        self.linker, self.nodes = linker, nodes
        self.language = ChainLanguage(self)
        self.files = ChainFiles(self)
        self.programs: list[Program] = []
        self.companions: dict[tuple[Rows, Field], Field] = {}
        self.momenta: dict[Field, Field] = {}
        self.memory: Any = ()
        self.updates = count(1)

    # ---- what generated functions call

    def node(self, name: str) -> None:
        """Emit a function of one node."""
        if f"node_{name}" not in self.linker.emitted:
            self.linker.emitted[f"node_{name}"] = self.nodes.source(name)

    def ended(self, name: str, width: int, masked: Sequence[int]) -> str:
        """Emit the function that sets some entries at node 0 to zero and gives all the run's type; return its name, or ""."""
        promoted = self.linker.options.precision == "complex128"
        if not masked and not promoted:
            return ""
        typed = "ZERO + x[{i}]" if promoted else "x[{i}]"
        entries = [f"{typed.format(i=i)} if k > 0 else ZERO" if i in masked else typed.format(i=i) for i in range(width)]
        self.linker.emitted.setdefault(f"ended_{name}", function(f"ended_{name}(x, k)", f"return {pack(entries)}"))
        return f"ended_{name}"

    def banded(self, width: int) -> None:
        """Emit the elimination of matrices of this half-bandwidth."""
        self.linker.emitted |= of_width(width)

    # ---- writing functions

    def written(self, name: str) -> bool:
        """Emit a function if the tracer writes it; return whether it does."""
        if name in ARGUMENTS and name not in self.linker.emitted:
            several = name == "step" and self.linker.constants["MULTISTEP"]
            self._write(name, ("p0", "q0", "memory", "h") if several else ARGUMENTS[name])
        return name in ARGUMENTS

    def _run(self, name: str, arguments: Sequence[str]) -> Any:
        """Return the results of a function of the scheme language, without stage multipliers if they are not stored."""
        handed = [self._argument(argument) for argument in arguments]
        results = values.held(self.files.called(name, handed))
        if name == "start":
            self.memory = results[0]
        if name in ("step", "increment") and not self.linker.options.stage_multipliers:
            return (*results[:-2], (), results[-1])
        return results

    def _argument(self, name: str) -> Any:
        """Return an argument of a function: the step size, a state, or the memory of a scheme, which ``start`` made."""
        if name == "h":
            return Scalar(name)
        if name != "memory":
            return self._state(name)
        self.written("start")
        return self._remembered(self.memory, name)

    def _remembered(self, like: Any, text: str) -> Any:
        if isinstance(like, tuple):
            return tuple(self._remembered(part, f"{text}[{i}]") for i, part in enumerate(like))
        missing = self.nodes.chain.missing if like.kind == "m" else 0
        entry = f"{text}[{like.width} * {{k}} + {{i}} - {missing}]" if missing else f"{text}[{like.width} * {{k}} + {{i}}]"
        return stored(like.kind, like.width, entry, 0, like.ghost, missing)

    def _state(self, array: str) -> Field:
        """Return the field of an argument; positions continue to the anchor."""
        b, anchor = self.nodes.chain.b, self.nodes.chain.anchor
        if array.startswith("p") or anchor is None:
            return stored("d", b, f"{array}[{b} * {{k}} + {{i}}]", 0)
        self.node("anchor")
        return stored("d", b, f"{array}[{b} * {{k}} + {{i}}]", 0, [f"(ZERO + node_anchor(par)[{i}])" for i in range(b)])

    def _write(self, name: str, arguments: Sequence[str]) -> None:
        """Emit a function that is not nested in another."""
        self.linker.emitted[name] = ""
        program = Program(self.nodes.chain.nodes)
        program.arguments = arguments
        self.programs.append(program)
        returned = self._returned(self._run(name, arguments))
        body = program.lines()
        self.programs.pop()
        self.linker.work[name] = program.work or [0] * len(self.linker.kinds)
        allocations = [f"slab = numpy.empty(({program.nodes}, {program.columns}), dtype=DTYPE)"] if program.columns else []
        del self.linker.emitted[name]
        self._emit(name, arguments, [*allocations, *body, f"return {returned}"])

    def _emit(self, name: str, arguments: Sequence[str], lines: Sequence[str]) -> None:
        """Emit a function with these lines as its body."""
        self.linker.emitted[name] = _written(f"{name}({', '.join([*arguments, 'par'])})", lines)

    def _returned(self, results: Any) -> str:
        """Return the source of results; fields become new arrays."""
        if isinstance(results, tuple):
            return pack(map(self._returned, results))
        if not isinstance(results, Field):
            return say(results)
        program, missing = self.programs[-1], self.nodes.chain.missing if results.kind == "m" else 0
        array, size = program.name("out"), program.nodes * results.width - missing

        def write(at: At) -> Lines:
            lines = [f"{array}[{results.width} * k + {i - missing}] = {at(results, 0)}[{i}]" for i in range(results.width)]
            return [f"if k > 0: {line}" if i < missing else line for i, line in enumerate(lines)]

        program.wishes.append((Demand(needs=[(results, 0)], write=write), [f"{array} = numpy.empty({size}, dtype=DTYPE)"]))
        return array

    def iterated(self, module: str, iteration: str, update: Operation, x: Any, data: Any, *numbers: Scalar) -> Any:
        """Emit an iteration of a file with this update; return the unknowns after it and its report."""
        outer, starts = self.programs[-1], values.flat(x)
        if outer.top is not outer:
            raise InvalidProblem("a scheme iterates within an iteration, which long chains do not support.", "chain-nested-iteration")
        places = [(outer.reserve(part.width), outer.reserve(part.width)) if isinstance(part, Field) else None for part in starts]
        updating = self._update(outer, update, x, data, places)
        name = outer.name("after")
        iterating = self.linker.resolve(module, iteration, {"update": updating})
        first = pack(say(part) if place is None else str(place[0]) for part, place in zip(starts, places, strict=True))
        handed = ", ".join([updating, first, pack(self._shared(outer)), *map(say, numbers), "par"])
        call = f"{name}, report_{name} = {iterating}({handed})"
        starting = [_kept(part, f"slab[k, {place[0]} + {{i}}]") for part, place in zip(starts, places, strict=True) if place]
        outer.events.append(Iteration(starting, [call]))
        outer.arguments = [*outer.arguments, name]
        after = [_recalled(part, f"{name}[{i}]", outer.stage) for i, part in enumerate(starts)]
        return _shaped(x, after), Scalar(f"report_{name}", late=True)

    def _update(self, outer: Program, update: Operation, x: Any, data: Any, places: Sequence[tuple[int, int] | None]) -> str:
        """Emit one update. It reads fields from one half of their columns of the slab and writes new ones into the other half."""
        inner = Program(outer.nodes, outer)
        self.programs.append(inner)
        now = [_recalled(part, f"now_{i}", 0) for i, part in enumerate(values.flat(x))]
        then, *judged = values.held(update(_shaped(x, now), data))
        following = values.flat(then)
        inner.wishes += [(_kept(part, f"slab[k, then_{i} + {{i}}]"), []) for i, part in enumerate(following) if places[i]]
        body = inner.lines()
        self.programs.pop()
        name = f"update{next(self.updates)}"
        self.linker.work[name] = inner.work or [0] * len(self.linker.kinds)
        turns = [f"now_{i} = x[{i}]" for i in range(len(places))]
        turns += [f"then_{i} = {sum(place)} - now_{i}" for i, place in enumerate(places) if place]
        back = pack(f"then_{i}" if place else say(following[i]) for i, place in enumerate(places))
        lines = [f"{', '.join(self._shared(outer))}, = data", *turns, *body, f"return {', '.join([back, *map(say, judged)])}"]
        self._emit(name, ("x", "data"), lines)
        return name

    @staticmethod
    def _shared(outer: Program) -> Lines:
        """Names of the values that an update shares with the function that calls it."""
        return ["slab", *outer.arguments]


def _written(signature: str, lines: Sequence[str]) -> str:
    return f"def {signature}:\n" + "\n".join(f"    {line}" for line in lines) + "\n"


def _kept(part: Field, entry: str) -> Demand:
    """Return the demand that stores a field."""
    return Demand(needs=[(part, 0)], write=lambda at: [f"{entry.format(i=i)} = {at(part, 0)}[{i}]" for i in range(part.width)])


def _recalled(part: Field | Scalar, name: str, stage: int) -> Field | Scalar:
    """Return an unknown of an iteration: a number by its name, a field in the columns of the slab that begin there."""
    if isinstance(part, Scalar):
        return Scalar(name, late=stage > 0)
    return stored(part.kind, part.width, f"slab[{{k}}, {name} + {{i}}]", stage, part.ghost)


def _shaped(x: Any, parts: Sequence[Any]) -> Any:
    """Return fields and numbers in the nested tuple form of x, as elements where it has elements."""
    left = iter(parts)
    return values.mapped(lambda _: next(left), x)
