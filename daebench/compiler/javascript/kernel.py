"""The loop of a linked module, and functions of a state, as methods of one JavaScript object.

Numbers are passed in arrays that the page allocates once. ``S`` holds the state, the memory of the scheme, the largest errors, the record
of pivots and the conserved quantities, each dual number as its value and its derivatives. ``P`` holds the run-time data, ``W`` the weights
of a composition, and ``R`` the steps done, the rows stored, the steps left until the next row, the substeps tried, status and residual.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from daebench.compiler.javascript.follow import Follower, followed
from daebench.compiler.javascript.numbers import Dual, Entries, Real, atom
from daebench.compiler.javascript.passes import inlined, pruned
from daebench.compiler.javascript.statements import Put, written

INFINITY = float("inf")


@dataclass(frozen=True)
class Layout:
    """Contents of the arrays of a kernel.

    Parameters
    ----------
    state : nested tuple of float
        A state that the scheme computes in.
    par : nested tuple of float
        The run-time data.
    directions : int
        Number of directions in which states have derivatives.
    rows : int
        Number of entries in a row of stored states.
    monitored : int
        Number of monitored errors.
    rank : bool
        Whether the rank of G is monitored: the record of pivots has two more numbers then.
    """

    state: Any
    par: Any
    rows: int
    directions: int = 0
    monitored: int = 0
    rank: bool = False

    @property
    def pivots(self) -> Any:
        """The record of pivots at the start."""
        return (INFINITY, 0.0, 0.0) if self.rank else INFINITY


class Reader:
    """Reads numbers from an array, one after the other."""

    def __init__(self, follower: Follower, array: str) -> None:
        self.follower, self.array, self.index = follower, array, 0

    def one(self) -> Real:
        """Return the next number."""
        self.index += 1
        return Real(self.follower.let(("index", self.array, self.index - 1)))

    def like(self, form: Any, directions: int = 0) -> Any:
        """Return numbers in the form of a nested tuple. They are dual where it has dual ones, or in this many directions."""
        if isinstance(form, tuple):
            return tuple(self.like(entry, directions) for entry in form)
        k = len(form.parts) if isinstance(form, Dual) else directions
        value = self.one()
        return Dual(value, tuple(self.one() for _ in range(k))) if k else value


def put(follower: Follower, array: str, index: int, value: Any) -> int:
    """Write the numbers of a nested tuple into an array from an index on; return the index after them."""
    if isinstance(value, tuple):
        for entry in value:
            index = put(follower, array, index, entry)
        return index
    if isinstance(value, Dual):
        return put(follower, array, index, (value.value, *value.parts))
    follower.block.append(Put(array, index, atom(value)))
    return index + 1


def method(name: str, parameters: str, block: list[Any]) -> str:
    """Return a method of an object."""
    return f"{name}({parameters}){{{written(inlined(pruned(block)))}}}"


def kernel(source: str, layout: Layout) -> str:
    """Return a linked module's loop as an object with ``start(S, h, P, R)`` and ``integrate(S, h, steps, ..., R)``.

    ``start`` computes the memory of the scheme and the conserved quantities from the state at the start of S; its status is R[4].
    ``integrate`` is :func:`daebench.schemes.kernels.loop.integrate`. It stores a state in T after ``left`` steps, then every ``every``.
    S has ``size`` numbers; the largest errors start at ``errors``.

    Parameters
    ----------
    source : str
        The linked module of a scheme and a problem.
    layout : Layout
        Contents of its arrays.

    Raises
    ------
    BadInput
        If the module contains an operation that a page cannot compute.
    """
    forms: dict[str, Any] = {}

    def begin(follower: Follower) -> None:
        reader = Reader(follower, "S")
        x, par = reader.like(layout.state, layout.directions), Reader(follower, "P").like(layout.par)
        memory, status = (), 0
        if "initialise" in follower.functions and "EACH_INITIALISE" in follower.constants:
            memory, report = follower.call("initialise", (x, Real("h"), par))
            status = report[0]
        conserved = follower.call("first", (x, par)) if "first" in follower.functions else ()
        zero = (0.0,) * layout.monitored
        errors = put(follower, "S", reader.index, memory)
        forms.update(memory=memory, conserved=conserved, errors=errors, size=put(follower, "S", errors, (zero, layout.pivots, conserved)))
        put(follower, "R", 4, status)

    def run(follower: Follower) -> None:
        reader = Reader(follower, "S")
        x, memory = reader.like(layout.state, layout.directions), reader.like(forms["memory"])
        maxima, pivots = reader.like((0.0,) * layout.monitored), reader.like(layout.pivots)
        conserved = reader.like(forms["conserved"])
        par, rows = Reader(follower, "P").like(layout.par), Entries("T", layout.rows)
        counts = (Real("steps"), Real("left"), Real("every"))
        states = (rows, None) if layout.directions else rows
        arguments = (x, memory, conserved, maxima, pivots, Real("h"), Entries("W"), *counts, states, (None, None), par)
        ends = follower.call("integrate", arguments)
        put(follower, "S", 0, ends[:4])
        done, row, left, _, tried, report = ends[4:]
        put(follower, "R", 0, (done, row, left, tried, report[0], report[1]))

    first, loop = followed(source, begin), followed(source, run)
    methods = method("start", "S,h,P,R", first), method("integrate", "S,h,steps,left,every,T,P,W,R", loop)
    return f"{{size:{forms['size']},errors:{forms['errors']},{','.join(methods)}}}"


def functions(source: str, names: Iterable[str], arguments: Sequence[int], par: Any) -> str:
    """Return functions of a problem as an object whose methods ``name(S, P, O)`` write their values at a state into O.

    Parameters
    ----------
    source : str
        A linked module that contains them.
    names : iterable of str
        Names in the scheme language.
    arguments : sequence of int
        Lengths of the vectors that they take, which S holds one after another.
    par : nested tuple of float
        The parameters of the problem.
    """

    def text(name: str) -> str:
        def run(follower: Follower) -> None:
            reader = Reader(follower, "S")
            vectors = [reader.like((0.0,) * n) for n in arguments]
            taken = [argument.arg for argument in follower.functions[name].args.args]
            given = vectors if len(taken) == len(vectors) + 1 else vectors[len(vectors) + 1 - len(taken) :]
            put(follower, "O", 0, follower.call(name, (*given, Reader(follower, "P").like(par))))

        return method(name, "S,P,O", followed(source, run))

    return "{" + ",".join(map(text, names)) + "}"
