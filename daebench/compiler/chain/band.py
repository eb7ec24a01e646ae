"""Source of the solution of banded systems, node by node: elimination in a loop up the chain, substitution in one down the chain."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

from daebench.compiler.chain.fields import At, Field
from daebench.compiler.chain.loops import Demand
from daebench.compiler.codegen import function
from daebench.compiler.linear import kernels

Entries = Mapping[tuple[int, int], str]
"""Sources of the entries of a row by place of the node, counted from the present one, and number of the unknown there."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """One equation of a node.

    Parameters
    ----------
    needs : sequence of (Field, int)
        Fields that its entries and its right side are made of.
    entries : callable
        ``entries(at)`` returns its entries.
    right : callable
        ``right(at)`` returns the source of its right side.
    """

    needs: Sequence[tuple[Field, int]]
    entries: Callable[[At], Entries]
    right: Callable[[At], str]


@dataclass(frozen=True, kw_only=True)
class Band:
    """A banded system of a chain.

    Parameters
    ----------
    name : str
        Beginning of the names that its source uses.
    nodes : int
        Number of nodes n.
    rows : sequence of Row
        Equations of a node, as many as it has unknowns, u.
    places : sequence of (int, int, int)
        Number of the row, place of the node and number of the unknown of entries that may not be zero.
    base : int
        First column of the slab, shape(n, ...), that it may use.
    """

    name: str
    nodes: int
    rows: Sequence[Row]
    places: Sequence[tuple[int, int, int]]
    base: int = 0
    width: int = field(init=False)

    def __post_init__(self) -> None:
        u = self.u
        object.__setattr__(self, "width", max(abs(place * u + unknown - row) for row, place, unknown in self.places) or 1)

    @property
    def u(self) -> int:
        """Number of unknowns of a node."""
        return len(self.rows)

    @property
    def tridiagonal(self) -> bool:
        """Whether a node has one unknown, so that everything stays in registers."""
        return self.u == 1 and self.width == 1

    @property
    def columns(self) -> int:
        """Number of columns of the slab that it uses, from ``base`` on: pivot rows, right sides and unknowns, where they are few."""
        return 5 if self.tridiagonal else 0

    @property
    def arrays(self) -> dict[str, str]:
        """Sources of the arrays that it uses, by name."""
        if self.tridiagonal:
            return {}
        b, unknowns, w = self.name, self.nodes * self.u, self.width
        return {
            f"{b}_window": f"numpy.empty(({w + 1}, {2 * w + 2}), dtype=DTYPE)",
            f"{b}_size": f"numpy.empty(({w + 2}, {2 * w + 1}), dtype=REAL)",
            f"{b}_scale": f"numpy.empty({w + 1}, dtype=REAL)",
            f"{b}_U": f"numpy.empty(({unknowns}, {2 * w + 2}), dtype=DTYPE)",
            f"{b}_x": f"numpy.zeros({unknowns + 2 * w}, dtype=DTYPE)",
        }

    @property
    def begin(self) -> list[str]:
        """Lines before the loop up the chain."""
        b = self.name
        return [f"{b}_pivot = INF"] if self.tridiagonal else [f"{b}_rows, {b}_column, {b}_pivot = 0, 0, INF"]

    def elimination(self) -> list[Demand]:
        """Return what the loop up the chain does for each equation."""
        write = self._one if self.tridiagonal else self._many
        return [Demand(needs=row.needs, write=partial(write, r)) for r, row in enumerate(self.rows)]

    def _many(self, r: int, at: At) -> list[str]:
        b, w, row = self.name, self.width, self.rows[r]
        lines = [f"for j in range({2 * w + 2}): {b}_window[{b}_rows, j] = 0.0"]
        for (place, unknown), text in row.entries(at).items():
            ahead = place * self.u + unknown - r
            line = f"{b}_window[{b}_rows, {b}_rows + {ahead}] = {text}" if ahead else f"{b}_window[{b}_rows, {b}_rows] = {text}"
            lines.append(f"if {b}_rows >= {-ahead}: {line}" if ahead < 0 else line)
        lines.append(f"{b}_window[{b}_rows, {2 * w + 1}] = {row.right(at)}")
        lines += [f"band{w}_push({b}_window, {b}_size, {b}_scale, {b}_rows)", f"{b}_rows += 1", f"if {b}_rows == {w + 1}:"]
        return lines + [f"    {line}" for line in self._settled()]

    def _settled(self) -> list[str]:
        b = self.name
        arrays = f"{b}_window, {b}_size, {b}_scale, {b}_rows, {b}_U, {b}_column, {b}_pivot"
        return [f"{b}_pivot = band{self.width}_settle({arrays})", f"{b}_rows -= 1", f"{b}_column += 1"]

    def _one(self, r: int, at: At) -> list[str]:
        """Source of the elimination of one column between a pending row and the row that comes, as ``kernels/band.py`` does it."""
        b = self.name
        entries = self.rows[r].entries(at)
        left, here, right = (entries.get((place, 0), "ZERO") for place in (-1, 0, 1))
        swapped = [
            f"{b}_p, {b}_u, {b}_v, {b}_z, {b}_sp, {b}_su, {b}_sv = {b}_l, {b}_d, {b}_r, {b}_y, abs({b}_l), abs({b}_d), abs({b}_r)",
            f"{b}_o, {b}_q, {b}_e, {b}_g, {b}_sq, {b}_se, {b}_scale = {b}_a, {b}_b, ZERO, {b}_c, {b}_sb, 0.0 * {b}_sb, {b}_scale",
        ]
        unswapped = [
            f"{b}_p, {b}_u, {b}_v, {b}_z, {b}_sp, {b}_su, {b}_sv = {b}_a, {b}_b, ZERO, {b}_c, {b}_sa, {b}_sb, 0.0 * {b}_sb",
            f"{b}_o, {b}_q, {b}_e, {b}_g, {b}_sq, {b}_se, {b}_scale = {b}_l, {b}_d, {b}_r, {b}_y, abs({b}_d), abs({b}_r), {b}_new",
        ]
        return [
            f"{b}_l, {b}_d, {b}_r, {b}_y = {left}, {here}, {right}, {self.rows[r].right(at)}",
            "if k == 0:",
            f"    {b}_a, {b}_b, {b}_c, {b}_sa, {b}_sb = {b}_d, {b}_r, {b}_y, abs({b}_d), abs({b}_r)",
            f"    {b}_scale = max({b}_sa, {b}_sb)",
            "else:",
            f"    {b}_new = max(abs({b}_l), max(abs({b}_d), abs({b}_r)))",
            f"    if abs({b}_l) * {b}_scale > abs({b}_a) * {b}_new:",
            *(f"        {line}" for line in swapped),
            "    else:",
            *(f"        {line}" for line in unswapped),
            *(f"    {line}" for line in self._kept("k - 1")),
            f"    {b}_f = {b}_o * {b}_i",
            f"    {b}_a, {b}_b, {b}_c = {b}_q - {b}_f * {b}_u, {b}_e - {b}_f * {b}_v, {b}_g - {b}_f * {b}_z",
            f"    {b}_sa, {b}_sb = {b}_sq + abs({b}_f) * {b}_su, {b}_se + abs({b}_f) * {b}_sv",
        ]

    def _kept(self, k: str) -> list[str]:
        """Lines that judge a pivot row and keep it."""
        b = self.name
        return [
            f"if not abs({b}_p) >= {b}_pivot * {b}_sp or {b}_sp == 0.0:",
            f"    {b}_pivot = abs({b}_p) / {b}_sp if {b}_sp > 0.0 else 0.0 * {b}_sp",
            f"{b}_i = 1.0 / {b}_p",
            *(f"slab[{k}, {self.base + i}] = {b}_{name}" for i, name in enumerate("iuvz")),
        ]

    @property
    def between(self) -> list[str]:
        """Lines between the loops: what is left is eliminated."""
        b = self.name
        if not self.tridiagonal:
            return [f"while {b}_rows > 0:", *(f"    {line}" for line in self._settled())]
        last = f"{b}_p, {b}_u, {b}_v, {b}_z, {b}_sp = {b}_a, ZERO, ZERO, {b}_c, {b}_sa"
        return [last, *self._kept(str(self.nodes - 1)), f"{b}_x1, {b}_x2 = ZERO, ZERO"]

    @property
    def substitution(self) -> list[str]:
        """Lines that begin each turn of the loop down the chain: the unknowns of node k."""
        b, u, w = self.name, self.u, self.width
        if self.tridiagonal:
            i, u_, v, z, x = (f"slab[k, {self.base + i}]" for i in range(5))
            return [f"{b}_x1, {b}_x2 = ({z} - {u_} * {b}_x1 - {v} * {b}_x2) * {i}, {b}_x1", f"{x} = {b}_x1"]
        lines = []
        for r in reversed(range(u)):
            lines += [f"{b}_t = {b}_U[{u} * k + {r}, {2 * w + 1}]"]
            lines += [f"for j in range(1, {2 * w + 1}): {b}_t -= {b}_U[{u} * k + {r}, j] * {b}_x[{u} * k + {r} + j]"]
            lines += [f"{b}_x[{u} * k + {r}] = {b}_t * {b}_U[{u} * k + {r}, 0]"]
        return lines

    def unknowns(self, kind: str, which: Sequence[int], stage: int) -> Field:
        """Return the field of some of the unknowns of each node."""
        b, u = self.name, self.u

        def write(at: At, k: str) -> list[str]:
            if self.tridiagonal:
                return [f"slab[{k}, {self.base + 4}]"]
            return [f"{b}_x[{u} * ({k}) + {i}]" for i in which]

        return Field(kind=kind, width=len(which), stage=stage, needs=(), write=write, ghost=["ZERO"] * len(which))


def of_width(width: int) -> dict[str, str]:
    """Return the sources of the functions of ``kernels/band.py`` for one half-bandwidth, so that their loops have known ends."""
    arguments = {"push": "window, size, scale, row", "settle": "window, size, scale, rows, U, column, smallest"}
    constants = {"WIDTH": str(width)}
    return {
        f"band{width}_{name}": function(f"band{width}_{name}({given})", *kernels.lines("band", constants, name))
        for name, given in arguments.items()
    }
