"""Functions of the loop besides the step: they monitor errors, add up work and store states; written for the requested data only."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import accumulate
from typing import Any, NamedTuple

import sympy as sp

from daebench.compiler.syntax import Lines, one_of, pack


class Quantity(NamedTuple):
    """A quantity that a run may monitor."""

    function: str
    """Name of the function of the problem that returns its values."""
    arguments: str
    """Arguments of the function, parts of a state x."""
    length: int | None = None
    """Number of values in a tuple; None for a function that returns a number."""
    conserved: bool = True
    """Whether the error of each value is its difference from the start. Otherwise the error is the largest modulus of all values."""

    @property
    def call(self) -> str:
        """Source of the call of its function."""
        return f"{self.function}({self.arguments}, par)"

    @property
    def values(self) -> Lines:
        """Source of each value."""
        return [self.call] if self.length is None else [f"{self.call}[{i}]" for i in range(self.length)]


Quantities = Mapping[str, Sequence[Quantity]]
"""Quantities that a run may monitor, by the names in a request; "energy" is always there."""


def of_constrained(m: int, integrals: int) -> Quantities:
    """Return the quantities of a constrained system with m constraints and this many first integrals besides H."""
    return {
        "energy": [Quantity("H", "x[0], x[1]")],
        "manifold": [Quantity("g", "x[1]", m, conserved=False), Quantity("Gv", "x[0], x[1]", m, conserved=False)],
        "integrals": [Quantity("integrals", "x[0], x[1]", integrals)],
    }


def of_poisson(casimirs: int, integrals: int) -> Quantities:
    """Return the quantities of a Poisson system with this many Casimir functions and other first integrals besides H."""
    return {
        "energy": [Quantity("H", "x")],
        "casimirs": [Quantity("casimirs", "x", casimirs)],
        "integrals": [Quantity("integrals", "x", integrals)],
    }


class State(NamedTuple):
    """Layout of a state, and of the stage multipliers of a step."""

    vectors: Sequence[tuple[str, int]]
    """Source and length of each vector of a state x."""
    multipliers: int = 0
    """Length of a multiplier."""
    arrays: bool = False
    """Whether vectors are arrays; otherwise they are tuples."""

    def stored(self, output: str, vectors: Sequence[tuple[str, int]]) -> Lines:
        """Return lines that write vectors, given by source and length, side by side into a row of an output."""
        starts = accumulate((length for _, length in vectors), initial=0)
        places = [(start, vector, length) for start, (vector, length) in zip(starts, vectors, strict=False)]
        if self.arrays:
            return [f"{output}[row, {start}:{start + length}] = {vector}" for start, vector, length in places]
        return [f"{output}[row, {start + i}] = {vector}[{i}]" for start, vector, length in places for i in range(length)]

    def differentiated(self, output: str, vectors: Sequence[tuple[str, int]]) -> Lines:
        """Return lines that write the derivatives of vectors of dual numbers, given by source and length, into a row of an output."""
        entries = [f"{vector}[{i}]" for vector, length in vectors for i in range(length)]
        return [f"spread({output}, row, {place}, {entry})" for place, entry in enumerate(entries)]

    def largest(self, quantity: Quantity) -> str:
        """Return the source of the largest modulus of a quantity's values; if an array contains NaN it is NaN."""
        if self.arrays:
            return f"largest({quantity.call})"
        moduli = [f"abs({value})" for value in quantity.values] or ["0.0"]
        return moduli[0] if len(moduli) == 1 else f"max({', '.join(moduli)})"


LARGEST = ["modulus = abs(x[0])", "for value in x:", "    if not abs(value) <= modulus:", "        modulus = abs(value)", "return modulus"]


class Monitored:
    """Source of the functions that ``kernels/language.py`` declares for Newton's iteration and the loop only."""

    def __init__(
        self, quantities: Quantities, state: State, names: Sequence[str], kinds: int, stage_multipliers: int = 0, *, guarded: bool = False
    ) -> None:
        self.tangents = False
        self.kinds = range(kinds)
        H = quantities["energy"][0].call
        self.guard = H if guarded and "energy" not in names else ""
        self.functions = [quantity.function for several in quantities.values() for quantity in several]
        self.conserved: Lines = []
        self.errors: Lines = []
        for quantity in [quantity for name, several in quantities.items() if name in names for quantity in several]:
            first = len(self.conserved)
            self.conserved += quantity.values * quantity.conserved
            changes = [f"abs({value} - first[{first + i}])" for i, value in enumerate(quantity.values)]
            self.errors += changes if quantity.conserved else [state.largest(quantity)]
        self.stored = state.stored("states", state.vectors) + state.stored(
            "stage_lams", [(f"stage_lam[{k}]", state.multipliers) for k in range(stage_multipliers)]
        )
        self.differentiated = state.differentiated("states[1]", state.vectors)
        if "samples" in names:
            self.conserved, self.stored = [H], [f"states[row, 0] = {H}"]

    def needs(self, name: str) -> Lines:
        """Return the names of the functions that one of these functions calls."""
        sources = {
            "conserved_quantities": self.conserved,
            "monitored_errors": self.errors,
            "store": self.stored,
            "defined": [self.guard],
        }.get(name, [])
        return [needed for needed in (*self.functions, "largest") if any(f"{needed}(" in source for source in sources)]

    def source(self, name: str) -> str | None:
        """Return the source of the function of this name, or None if it is none of these."""
        errors = range(len(self.errors))
        larger = "x[{i}] if x[{i}] != x[{i}] or x[{i}] >= y[{i}] else y[{i}]"
        plain = ["x, par = values(x), values(par)"] * self.tangents
        stored = [*self.differentiated, "states, x, stage_lam = states[0], values(x), values(stage_lam)"] * self.tangents + self.stored
        bodies = {
            "conserved_quantities(x, par)": [*plain, "return " + pack(self.conserved)],
            "monitored_errors(x, first, par)": [*plain, "return " + pack(self.errors)],
            "store(states, stage_lams, row, x, stage_lam, par)": stored,
            "largest(x)": LARGEST,
            "worst(x, y)": ["return " + pack(larger.format(i=i) for i in errors)],
            "total(x)": ["return " + (" + ".join(f"x[{i}]" for i in errors) or "0.0")],
            "defined(x, par)": [*plain, f"return abs(0.0 * {self.guard})" if self.guard else "return 0.0"],
            "no_work()": ["return " + pack("0" for _ in self.kinds)],
            "plus_work(x, y)": ["return " + pack(f"x[{i}] + y[{i}]" for i in self.kinds)],
        }
        return one_of(bodies, name)


TELLING: tuple[type, ...] = (sp.exp, sp.sin, sp.cos, sp.tan, sp.cot, sp.sec, sp.csc, sp.sinh, sp.cosh, sp.tanh, sp.asinh)
TELLING += (sp.atan, sp.atan2, sp.acot, sp.asin, sp.acos)
"""Functions whose derivatives are undefined wherever the functions are. Powers and quotients are of this kind too.

The logarithm is not: log(q) ends at 0, but its derivative 1/q is defined on both sides.
"""


def may_be_left_unseen(expressions: Iterable[Any], state: Collection[sp.Symbol], positive: Collection[Any] = ()) -> bool:
    """Return whether one of the expressions may be undefined at a state where its derivatives are defined."""
    functions = {function for expression in expressions if expression is not None for function in sp.sympify(expression).atoms(sp.Function)}
    unsafe = (function for function in functions if function.free_symbols & set(state) and not isinstance(function, TELLING))
    return any(not isinstance(f, sp.log) or not (f.args[0].is_positive or f.args[0] in positive) for f in unsafe)
