"""A scheme executed on symbols: its operations on vectors, Jacobians and linear systems become a few loops over the nodes of a chain.

The files of schemes and kernels are executed unchanged, with the constants of the language settled and every name bound to a
method of :class:`daebench.compiler.chain.algebra.ChainLanguage`. Vectors are fields, computed where a loop needs them. A linear system is
a loop up the chain and one down. An iteration is that of ``kernels/newton.py``, with its update as a separate function.
"""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import count
from typing import TYPE_CHECKING, Any

from daebench.compiler import values
from daebench.compiler.chain.algebra import ChainLanguage
from daebench.compiler.chain.band import Iteration, Program, of_width
from daebench.compiler.chain.fields import At, Field, Scalar, applied, say, selected, stored
from daebench.compiler.chain.loops import Demand
from daebench.compiler.chain.nodes import Nodes
from daebench.compiler.chain.systems import Rows
from daebench.compiler.files import Files, Function
from daebench.compiler.shapes import OVERLOADS
from daebench.compiler.syntax import RUN_TIME, function, pack
from daebench.errors import InvalidProblem

if TYPE_CHECKING:
    from daebench.compiler.link import Linker

NEWTON = "daebench.schemes.kernels.newton"
BRANCH = "daebench.schemes.kernels.branch"
ITERATIONS = ((NEWTON, "newton"), ("daebench.schemes.kernels.relax", "until_met"), (BRANCH, "walked"))
"""Iterations, as files and names: functions of an update, the unknowns, data, and perhaps numbers."""

OF_REPORTS = ((NEWTON, "judge"), (NEWTON, "both"), (BRANCH, "landed"))
"""Functions of numbers and reports, which are called as they are."""

ARGUMENTS: dict[str, tuple[str, ...]] = dict.fromkeys(("H", "H_p", "H_q", "Gv", "lam", "independence", "row_moduli"), ("p", "q")) | {
    "g": ("q",)
}
ARGUMENTS |= dict.fromkeys(("step", "increment", "start"), ("p0", "q0", "h"))
"""Functions that are written from loops over nodes, and their arguments."""

HOMES = {"H": "mechanical"}
"""Files that compose functions of the scheme language from others; any other such function is in ``composed``."""


class Symbols:
    """Runs functions of files as Python does, on symbols."""

    def __init__(self) -> None:
        self.names = {name: partial(_chosen, name) for name in ("min", "max")} | {"abs": partial(applied, "abs"), "selected": _selected}
        self.space: dict[str, Any] = {}

    def add(self, text: str) -> None:
        """Add functions to a generated module."""
        exec(text, self.space)

    def take(self, name: str, operation: Callable[..., Any]) -> None:
        """Add an operation to a generated module."""
        self.space[name] = operation

    def body(self, function: Function) -> Callable[..., Any]:
        """Return the function itself."""
        return function.plain


class ChainFiles(Files):
    """The files of a scheme, run on the symbols of a chain."""

    deferred = True

    def __init__(self, tracer: "Tracer") -> None:
        linker = tracer.linker
        super().__init__({"constants": linker.constants, "states": "constrained", "homes": {}, "single": False}, Symbols())
        self.tracer, self.linker = tracer, linker

    def names_of(self, module: str) -> dict[str, Any]:
        """Return the names of a file. Iterations are written; what a chain has of its own takes the place of what is composed."""
        if module in self.read:
            return self.read[module]
        space = super().names_of(module)
        for name in [name for name, value in space.items() if isinstance(value, Function)]:
            if (module, name) in ITERATIONS:
                space[name] = partial(self.tracer.iterated, module, name)
            elif (module, name) in OF_REPORTS:
                space[name] = partial(self._reported, module, name)
            elif module.rpartition(".")[2] in ("mechanical", "composed") and hasattr(self.tracer.language, name):
                space[name] = partial(self._of_chain, name)
        return space

    def _reported(self, module: str, name: str, *arguments: Any) -> Scalar:
        return applied(self.linker.resolve(module, name), *values.held(arguments), Scalar("par"))

    def _of_chain(self, name: str, *args: Any) -> Any:
        return self.called(name, args)

    def operation(self, name: str) -> Any:
        """Return an operation of the chain, or a constant of the type of numbers."""
        return Scalar(name) if name in ("EPS", "INF") else getattr(self.tracer.language, name)

    def bare(self, name: str) -> bool:
        """Whether a function is called without the parameters of the problem, as all are."""
        return True

    def _run_time(self, name: str) -> Any:
        if name in self.plan["constants"]:
            return self.plan["constants"][name]
        place, *inside = RUN_TIME[name]
        return Scalar("par" + "".join(f"[{i}]" for i in (len(self.tracer.nodes.parameters) + place, *inside)))

    def called(self, name: str, args: Sequence[Any]) -> Any:
        """Return the value of a call of a function of the scheme language, and count its work."""
        if name in OVERLOADS or hasattr(self.tracer.language, name):
            work, program = self.linker.work_of("", name), self.tracer.programs[-1]
            program.work = [mine + more for mine, more in zip(program.work or [0] * len(work), work, strict=True)]
            return super().called(name, args)
        module, name = self.linker.filled(name) or (f"daebench.schemes.kernels.{HOMES.get(name, 'composed')}", name)
        if name not in self.names_of(module):
            raise InvalidProblem(
                f"a scheme asks for {name}, which long chains do not support; take a shorter chain, or another scheme.",
                "chain-unsupported-request",
            )
        return self.function(module, name)(*args)


def _selected(test: Any, one: Callable[[], Any], other: Callable[[], Any]) -> Any:
    """Return a choice between two values, which may be elements."""
    if not isinstance(test, Scalar):
        return one() if test else other()
    x, y = one(), other()
    if isinstance(x, values.Element):
        return x.merged(y, lambda a, b: selected(test, lambda: a, lambda: b))
    return selected(test, lambda: x, lambda: y)


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

        def write(at: At) -> list[str]:
            lines = [f"{array}[{results.width} * k + {i - missing}] = {at(results, 0)}[{i}]" for i in range(results.width)]
            return [f"if k > 0: {line}" if i < missing else line for i, line in enumerate(lines)]

        program.wishes.append((Demand(needs=[(results, 0)], write=write), [f"{array} = numpy.empty({size}, dtype=DTYPE)"]))
        return array

    def iterated(self, module: str, iteration: str, update: Callable[..., Any], x: Any, data: Any, *numbers: Scalar) -> Any:
        """Emit an iteration of a file with this update; return the unknowns after it and its report."""
        outer, starts = self.programs[-1], _flat(values.held(x))
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

    def _update(self, outer: Program, update: Callable[..., Any], x: Any, data: Any, places: Sequence[tuple[int, int] | None]) -> str:
        """Emit one update. It reads fields from one half of their columns of the slab and writes new ones into the other half."""
        inner = Program(outer.nodes, outer)
        self.programs.append(inner)
        now = [_recalled(part, f"now_{i}", 0) for i, part in enumerate(_flat(values.held(x)))]
        then, *judged = values.held(update(_shaped(x, now), data))
        following = _flat(then)
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
    def _shared(outer: Program) -> list[str]:
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


def _flat(x: Any) -> list[Any]:
    """Return the fields and numbers of a nested tuple."""
    return [field for part in x for field in _flat(part)] if isinstance(x, tuple) else [x]


def _shaped(x: Any, parts: Sequence[Any]) -> Any:
    """Return fields and numbers in the nested tuple form of x, as elements where it has elements."""
    left = iter(parts)

    def shaped(branch: Any) -> Any:
        return tuple(map(shaped, branch)) if isinstance(branch, tuple) else values.like(branch, next(left))

    return shaped(x)


def _chosen(name: str, *numbers: Any) -> Any:
    """Return the source of the least or the greatest of some numbers, or of those in a tuple."""
    numbers = tuple(numbers[0]) if len(numbers) == 1 else numbers
    return numbers[0] if len(numbers) == 1 else applied(name, *numbers)
