"""A scheme linked to a problem as recorded functions of arrays: a step, what goes before it, and functions of a state.

Arrays hold numbers of one precision. ``X`` has the state that the scheme computes in, and behind it the memory of the scheme; ``V``
vectors of the problem; ``P`` the parameters of the problem, and behind them the scales of its start; ``L`` the stage multipliers; ``R``
status, residual and smallest relative pivot; ``O`` what a function returns.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import Any, NamedTuple

import numpy as np

from daebench.compiler.trace.arrays import Array
from daebench.compiler.trace.code import Code
from daebench.compiler.trace.ir import FLOAT32, POINTER, Function, Value
from daebench.compiler.trace.program import Program, operations

LONG, LONGEST = 300, 10**9
"""Operations of the longest function whose calls are written out; of functions with arrays all are, which belong to their call."""

FLAT = 10**9
"""Length of arrays whose lengths nobody asks for."""


class Data(NamedTuple):
    """Run-time data ``par`` in nested tuples, of which P has the first ``given`` and others are constant, and the kind of numbers."""

    par: Any
    given: int
    real: str


@dataclass(frozen=True)
class Recorded:
    """Recorded functions."""

    functions: dict[str, tuple[Function, Sequence[str]]]
    """The functions, with the names of their parameters."""
    called: list[Function]
    """Functions that these call, each of which calls only those before it."""
    state: int = 0
    memory: int = 0
    multipliers: int = 0
    """Numbers of a state, of the memory of the scheme, and of stage multipliers."""

    @property
    def longest(self) -> int:
        """Operations of the longest function."""
        return max(operations(recorded.block) for recorded in (*self.called, *(function for function, _ in self.functions.values())))


def taken(array: Array, like: Any, index: Iterator[int]) -> Any:
    """Return numbers of an array in the form of nested tuples of numbers and arrays."""
    if isinstance(like, tuple):
        return tuple([taken(array, entry, index) for entry in like])
    if not isinstance(like, Array | np.ndarray):
        return array[next(index)]
    first = next(index)
    for _ in range(like.shape[0] - 1):
        next(index)
    return array[first : first + like.shape[0]]


def put(array: Array, index: int, x: Any) -> int:
    """Write nested tuples of numbers and arrays into an array from an index on; return the index after them."""
    if isinstance(x, tuple):
        for entry in x:
            index = put(array, index, entry)
        return index
    if isinstance(x, Array):
        array[index : index + x.shape[0]] = x
        return index + int(x.shape[0])
    array[index] = x
    return index + 1


def table(code: Code, numbers: Sequence[float], kind: str) -> Array:
    """Return an array of constants of a kind."""
    return Array(Value(code, "table", POINTER, (tuple(numbers), kind)), kind, (len(numbers),), (1,), tuple(numbers))


def length(x: Any) -> int:
    """Return how many numbers there are in nested tuples of numbers and arrays."""
    return sum(map(length, x)) if isinstance(x, tuple) else x.shape[0] if isinstance(x, Array | np.ndarray) else 1


def _arrays_in(x: Any) -> bool:
    return any(map(_arrays_in, x)) if isinstance(x, tuple) else isinstance(x, Array | np.ndarray)


@dataclass
class _Recorder:
    """Records functions of one linked module."""

    source: str
    """The module."""
    like: Any
    """A state."""
    data: Data
    """The parameters of the problem, and the scales of its start; constants behind them."""
    alone: int = 0
    """Operations of the longest function that is recorded where its one call is; 0 for any."""
    functions: dict[str, tuple[Function, Sequence[str]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if _arrays_in(self.like):
            self.program = Program(self.source, inlined=LONGEST)
        else:
            self.program = Program(self.source, inlined=LONG, alone=self.alone)
        self.space = self.program.space

    def par(self, P: Array) -> Any:
        """Return the run-time data."""
        par, given, _ = self.data
        return (*taken(P, par[:given], count()), *self.known(par[given:]))

    def known(self, x: Any) -> Any:
        """Return constants, which are rounded where numbers are of single precision."""
        if isinstance(x, tuple):
            return tuple(map(self.known, x))
        return self.program.code.constant(x, FLOAT32) if self.data.real == FLOAT32 else x

    def function(self, name: str, parameters: str, make: Callable[..., None]) -> None:
        """Record the operations of ``make``, given arrays and numbers of these names, as a function."""
        given = parameters.split(",")

        def parameter(made: Function, each: str) -> Any:
            if not each.isupper():
                return self.program.parameter(made, self.data.real)
            return Array(self.program.parameter(made, POINTER), self.data.real, (FLAT,), (1,))

        made, _ = self.program.recorded(name, lambda made: make(*(parameter(made, each) for each in given)))
        self.functions[name] = made, given

    @property
    def called(self) -> list[Function]:
        """Functions that others call."""
        return [recorded for recorded, _ in self.program.instances.values()]


def of_scheme(source: str, state: Any, data: Data, weights: tuple[float, ...], alone: int = 0) -> Recorded:
    """Return the functions of a scheme: ``start(X,h,P,R)`` where it remembers, ``step(X,h,P,L,R)``, and ``output(X,P,V)``."""
    recorder = _Recorder(source, state, data, alone)
    space, memory, multipliers = recorder.space, (), 0
    substeps: Any = table(recorder.program.code, weights, data.real) if weights else ()  # of a tuple, each substep would be written out

    def start(X: Array, h: Value, P: Array, R: Array) -> None:
        nonlocal memory
        memory, report = space["initialise"](taken(X, state, count()), h, recorder.par(P))
        put(R, 0, report[:3])
        put(X, length(state), memory)

    def step(X: Array, h: Value, P: Array, L: Array, R: Array) -> None:
        nonlocal multipliers
        index = count()
        x, carried = taken(X, state, index), taken(X, memory, index)
        x1, memory1, lam, report = space["alone_alone"](x, carried, h, substeps, recorder.par(P))
        put(X, 0, (x1, memory1))
        put(R, 0, report[:3])
        multipliers = put(L, 0, lam)

    def output(X: Array, P: Array, V: Array) -> None:
        put(V, 0, space["output"](taken(X, state, count()), recorder.par(P)))

    if "initialise" in space:
        recorder.function("start", "X,h,P,R", start)
    recorder.function("step", "X,h,P,L,R", step)
    if "output" in space:
        recorder.function("output", "X,P,V", output)
    return Recorded(recorder.functions, recorder.called, length(state), length(memory), multipliers)


def of_problem(source: str, vectors: tuple[Any, ...], data: Data, names: Sequence[str], alone: int = 0) -> Recorded:
    """Return functions ``NAME(V,P,O)`` of a problem at vectors V in its own coordinates."""
    recorder = _Recorder(source, vectors, data, alone)

    def function(name: str) -> Callable[[Array, Array, Array], None]:
        def made(V: Array, P: Array, O: Array) -> None:  # noqa: E741
            put(O, 0, recorder.space[name](*taken(V, vectors, count()), recorder.par(P)))

        return made

    for name in names:
        recorder.function(name.removeprefix("alone_"), "V,P,O", function(name))
    for each in recorder.called:
        each.name = f"own_{each.name}"  # functions of the scheme may have the same
    return Recorded(recorder.functions, recorder.called)
