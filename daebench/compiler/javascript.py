"""The loop of a linked module, and functions of a state, as methods of one JavaScript object.

Numbers are passed in arrays that the page allocates once. ``S`` holds the state, the memory of the scheme, the largest errors, the record
of pivots and the conserved quantities, each dual number as its value and its derivatives. ``P`` holds the run-time data, ``W`` the weights
of a composition, and ``R`` the steps done, the rows stored, the steps left until the next row, the substeps tried, status and residual.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any

from daebench.compiler.print.javascript import method
from daebench.compiler.trace.arrays import Array
from daebench.compiler.trace.dual import Dual
from daebench.compiler.trace.ir import FLOAT64, INTEGER, POINTER, Function, Value, entries_of
from daebench.compiler.trace.program import Program, parameters_in
from daebench.compiler.trace.structure import parts_of
from daebench.errors import BadInput

INFINITY = float("inf")

LONGEST = 10**9
"""Operations of the longest function whose calls are written out: all of them, since a page has one function."""


@dataclass(frozen=True)
class Layout:
    """Contents of the arrays of a kernel."""

    state: Any
    """A state that the scheme computes in."""
    par: Any
    """The run-time data."""
    rows: int
    """Number of entries in a row of stored states."""
    directions: int = 0
    """Number of directions in which states have derivatives."""
    monitored: int = 0
    """Number of monitored errors."""
    rank: bool = False
    """Whether the rank of G is monitored: the record of pivots has two more numbers then."""

    @property
    def pivots(self) -> Any:
        """The record of pivots at the start."""
        return (INFINITY, 0.0, 0.0) if self.rank else INFINITY


def read(array: Array, form: Any, index: Iterator[int], directions: int = 0) -> Any:
    """Return numbers of an array in the form of a nested tuple. They are dual where it has dual ones, or in this many directions."""
    if isinstance(form, tuple):
        return tuple([read(array, entry, index, directions) for entry in form])
    k, value = int(form.kind[1:]) if isinstance(form, Dual) else directions, array[next(index)]
    return Dual(array.code, value, array.code.emit("vset", f"{FLOAT64}{k}", tuple(array[next(index)] for _ in range(k)))) if k else value


def put(array: Array, index: int, value: Any) -> int:
    """Write the numbers of a nested tuple into an array from an index on; return the index after them."""
    for part in parts_of(value):
        for entry in entries_of(part) if isinstance(part, Value) else [part]:
            array[index] = entry
            index += 1
    return index


class _Page:
    """A linked module whose functions are recorded as methods."""

    def __init__(self, source: str) -> None:
        self.program = Program(source, inlined=LONGEST)
        self.program.space["spread"] = lambda *_: None

    def __call__(self, name: str, *args: Any) -> Any:
        """Return the value of a call of a function of the module."""
        return self.program.space[name](*args)

    def method(self, name: str, parameters: str, make: Callable[..., None]) -> str:
        """Return the text of a method: the operations that ``make`` records, given arrays and numbers of these names."""
        names = parameters.split(",")

        def given(recording: Function, parameter: str) -> Any:
            if not parameter.isupper():
                return self.program.parameter(recording, FLOAT64 if parameter == "h" else INTEGER)
            pointer = self.program.parameter(recording, POINTER)
            return Array(pointer, FLOAT64, (self.program.code.emit("length", INTEGER, (pointer,)),), (1,))

        try:
            function, _ = self.program.recorded(name, lambda recording: make(*(given(recording, parameter) for parameter in names)))
        except (AttributeError, TypeError, NameError) as error:
            what = getattr(error, "name", None) or f"this: {error}"
            raise BadInput(f"a page cannot compute {what}; choose another problem or method for it.", "page-cannot-compute") from error
        return method(function, names)


def kernel(source: str, layout: Layout) -> str:
    """Return a linked module's loop as an object with ``start(S, h, P, R)`` and ``integrate(S, h, steps, ..., R)``.

    ``start`` computes the memory of the scheme and the conserved quantities from the state at the start of S; its status is R[4].
    ``integrate`` is :func:`daebench.schemes.kernels.loop.integrate`. It stores a state in T after ``left`` steps, then every ``every``.
    S has ``size`` numbers; the largest errors start at ``errors``.
    """
    page, forms = _Page(source), dict[str, Any]()
    zero = (0.0,) * layout.monitored

    def start(S: Array, h: Value, P: Array, R: Array) -> None:
        index = count()
        x, par = read(S, layout.state, index, layout.directions), read(P, layout.par, count())
        memory, status = (), 0
        if "initialise" in page.program.space and "EACH_INITIALISE" in page.program.space:
            memory, report = page("initialise", x, h, par)
            status = report[0]
        conserved = page("first", x, par) if "first" in page.program.space else ()
        errors = put(S, next(index), memory)
        forms.update(memory=memory, conserved=conserved, errors=errors, size=put(S, errors, (zero, layout.pivots, conserved)))
        R[4] = status

    def integrate(S: Array, h: Value, steps: Value, left: Value, every: Value, T: Array, P: Array, W: Array, R: Array) -> None:
        index = count()
        x, memory = read(S, layout.state, index, layout.directions), read(S, forms["memory"], index)
        maxima, pivots, conserved = (read(S, form, index) for form in (zero, layout.pivots, forms["conserved"]))
        rows = Array(T.pointer, FLOAT64, (*T.shape, layout.rows), (layout.rows, 1))
        states = (rows, None) if layout.directions else rows
        par = read(P, layout.par, count())
        ends = page("integrate", x, memory, conserved, maxima, pivots, h, W, steps, left, every, states, (None, None), par)
        put(S, 0, ends[:4])
        done, row, left, _, tried, report = ends[4:]
        put(R, 0, (done, row, left, tried, report[0], report[1]))

    methods = page.method("start", "S,h,P,R", start), page.method("integrate", "S,h,steps,left,every,T,P,W,R", integrate)
    return f"{{size:{forms['size']},errors:{forms['errors']},{','.join(methods)}}}"


def functions(source: str, names: Iterable[str], arguments: Sequence[int], par: Any) -> str:
    """Return functions of a problem as an object whose methods ``name(S, P, O)`` write their values at a state into O."""
    page = _Page(source)

    def text(name: str) -> str:
        def run(S: Array, P: Array, O: Array) -> None:  # noqa: E741
            index = count()
            vectors = [read(S, (0.0,) * n, index) for n in arguments]
            taken = len(parameters_in(source, name)) or page.program.space[name].taken()
            given = vectors if taken == len(vectors) + 1 else vectors[len(vectors) + 1 - taken :]
            put(O, 0, page(name, *given, read(P, par, count())))

        return page.method(name, "S,P,O", run)

    return "{" + ",".join(map(text, names)) + "}"
