"""A fixed-step method on a problem, linked and recorded as functions of arrays: a step, what goes before it, and functions of a state.

Arrays hold numbers of one precision. ``X`` has the state that the scheme computes in, and behind it the memory of the scheme; ``V``
vectors of the problem; ``P`` the parameters of the problem, and behind them the scales of its start; ``L`` the stage multipliers; ``R``
status, residual and smallest relative pivot; ``O`` what a function returns.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import Any, NamedTuple

import numpy as np

from daebench.compiler.facts import in_loops
from daebench.compiler.link import Linker, Options
from daebench.compiler.syntax import LANGUAGE
from daebench.compiler.trace.arrays import Array
from daebench.compiler.trace.code import Code
from daebench.compiler.trace.ir import FLOAT32, FLOAT64, POINTER, Function, Value
from daebench.compiler.trace.program import Program, operations
from daebench.methods.fixed_step.base import FixedStepMethod
from daebench.runs.ivp import InitialValueProblem
from daebench.schemes.kernels.claims import MAPPED

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

        def parameter(recorded: Function, word: str) -> Any:
            if not word.isupper():
                return self.program.parameter(recorded, self.data.real)
            return Array(self.program.parameter(recorded, POINTER), self.data.real, (FLAT,), (1,))

        recorded, _ = self.program.recorded(name, lambda function: make(*(parameter(function, word) for word in given)))
        self.functions[name] = recorded, given

    @property
    def called(self) -> list[Function]:
        """Functions that others call."""
        return [recorded for recorded, *_ in self.program.instances.values()]


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
    for inner in recorder.called:
        inner.name = f"own_{inner.name}"  # functions of the scheme may have the same
    return Recorded(recorder.functions, recorder.called)


ALONE = "daebench.schemes.kernels.alone"

PART = 4000
"""Operations of the longest part that is no function of its own, where functions are divided."""

ENTERING = {"local": "inverse_chart", "canonical": "inverse_chart", "darboux": "canonical"}
"""Functions into the coordinates in which a scheme computes, by the form of the system."""


@dataclass(frozen=True)
class Linked:
    """Recorded functions, and the numbers that belong to them."""

    scheme: Recorded
    """Functions of the scheme."""
    problem: tuple[Recorded, ...]
    """Functions of the problem."""
    state: Any
    """What the scheme computes in, at the start."""
    scales: tuple[float, ...]
    """The length and the rate of the start."""
    entering: str
    """Function into the coordinates of the scheme; "" if these are the problem's."""
    real: str
    """Kind of the numbers of a state: double or single precision."""


def linked(ivp: InitialValueProblem, method: FixedStepMethod[Any, Any], h: float, longest: int = 0, precision: str = "float64") -> Linked:
    """Return a method on a problem, recorded; what has functions of more than ``longest`` operations is divided, unless that is 0."""
    source, state, par = method.printable(ivp, h, precision)
    weights, real = tuple(map(float, method.weights)), FLOAT32 if precision == "float32" else FLOAT64
    data = Data(par, len(ivp.par) + 1, real)
    scheme = _divided(lambda alone: of_scheme(source, state, data, weights, alone), longest)
    entering = ENTERING[method.form] if method.form in MAPPED else ""
    functions = [_divided(lambda alone: _functions(ivp, data, alone), longest)]
    if entering:
        options = Options(form=method.form, precision=precision)
        text = Linker(ivp.source.form(method.form), options).module("Coordinates.", [(LANGUAGE, entering)])
        functions.append(of_problem(text, _vectors(ivp, loops=False), data, [entering]))
    return Linked(scheme, tuple(functions), state, par[len(ivp.par)], entering, real)


def _divided(record: Callable[[int], Recorded], longest: int) -> Recorded:
    """Return recorded functions, with parts of them as functions of their own if they are too long."""
    whole = record(0)
    return record(PART) if 0 < longest < whole.longest else whole


def _functions(ivp: InitialValueProblem, data: Data, alone: int) -> Recorded:
    """Return the functions of a problem in its own coordinates; in mixed precision, too, they are of double precision."""
    precision = "float32" if data.real == FLOAT32 else "float64"
    loops = in_loops(ivp.facts, precision)
    names = ["H"]
    if ivp.facts.KIND == "constrained":
        momenta = ["alone_momenta"] if ivp.source.derivation.mechanical else []
        names += ["H_p", "lam", "alone_residuals", "alone_projected", *momenta]
    roots = [(ALONE, name.removeprefix("alone_")) if name.startswith("alone_") else (LANGUAGE, name) for name in names]
    options = Options(singular=ivp.singular, loops=loops, precision=precision)
    text = Linker(ivp.source.derivation, options).module(f"Functions of {ivp.problem}.", roots)
    return of_problem(text, _vectors(ivp, loops=loops), data, names, alone)


def _vectors(ivp: InitialValueProblem, *, loops: bool) -> tuple[Any, ...]:
    held = (lambda x: x) if ivp.arrays or loops else lambda x: tuple(map(float, x))
    return tuple(held(vector) for vector in ivp.start)
