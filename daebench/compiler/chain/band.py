"""Source of the solution of banded systems, node by node: elimination in a loop up the chain, back substitution in a loop down the chain.

Rows are not exchanged: this takes half the time and fills half the entries. If a pivot is small, the system is set up again and solved
with row exchanges by ``kernels/band.py``.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal

from daebench.compiler.chain.blocks import Block, Blocks, Entries, Places
from daebench.compiler.chain.fields import At, Field, Term, written
from daebench.compiler.chain.loops import Demand
from daebench.compiler.linear.kernels import kernel
from daebench.compiler.syntax import Lines

SMALL = 1e-3
"""Relative pivot below which rows are exchanged. Larger pivots lose at most three digits of the solution."""


@dataclass(eq=False)
class Row:
    """One equation of a node."""

    right: Term
    """Its right side."""
    terms: dict[tuple[int, int], list[Term]] = field(default_factory=dict)
    """Terms of its entries. A key is the place of the node, counted from the present one, and the number of the unknown there."""
    forms: dict[tuple[int, int], str] = field(default_factory=dict)
    """Forms of entries that are more than the sum of their terms."""

    def add(self, key: tuple[int, int], form: str, *entries: tuple[Field, int, int]) -> None:
        """Add a term to an entry."""
        self.terms.setdefault(key, []).append((form, entries))

    @property
    def needs(self) -> list[tuple[Field, int]]:
        """Fields that its entries and its right side depend on."""
        terms = [self.right, *(term for several in self.terms.values() for term in several)]
        return [(part, place) for _, entries in terms for part, place, _ in entries]

    def entries(self, at: At) -> Entries:
        """Return the sources of its entries."""
        sums = {key: " + ".join(written(at, term) for term in terms) for key, terms in self.terms.items()}
        return {key: self.forms.get(key, "{}").format(text) for key, text in sums.items()}


@dataclass(kw_only=True)
class Band:
    """A banded system of a chain."""

    name: str
    """Prefix of the names that its source uses."""
    nodes: int
    """Number of nodes n."""
    rows: Sequence[Row]
    """Equations of a node, as many as its unknowns, u."""
    order: Sequence[Block] = ()
    """Unknowns in an order in which they can be eliminated without row exchanges, see :class:`Blocks`; empty if there is none."""
    asked: Literal["", "solution", "pivot"] = ""
    """Requested results: "" for both the solution and the smallest relative pivot; "solution" or "pivot" for one of them, of a positive
    definite matrix, which needs no row exchanges.
    """
    base: int = 0
    """First column of the slab, shape(n, ...), for its unknowns."""
    scratch: int = 0
    """First column of the slab for temporary values, which are not read after its loops."""
    width: int = field(init=False)
    blocks: Blocks | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        self.width = max(abs(place * self.u + unknown - row) for row, place, unknown in self.places) or 1
        if self.order and not self.tridiagonal:
            self.blocks = Blocks(name=self.name, u=self.u, places=self.places, order=self.order, judged=self.asked != "solution")

    @property
    def places(self) -> Places:
        """Entries that may be nonzero; numbers that only stand in for missing constraints are not among them."""
        rows = enumerate(self.rows)
        return [(r, *key) for r, row in rows for key, terms in row.terms.items() if any(entries for _, entries in terms)]

    @property
    def u(self) -> int:
        """Number of unknowns of a node."""
        return len(self.rows)

    @property
    def tridiagonal(self) -> bool:
        """Whether a node has one unknown, so that all values stay in registers."""
        return self.u == 1 and self.width == 1

    @property
    def scratches(self) -> int:
        """Number of columns of the slab for the values that back substitution needs, from ``scratch`` on."""
        if not self.blocks:
            return 4 if self.tridiagonal else 0
        return 0 if self.asked == "pivot" else len(self.blocks.kept)

    @property
    def begin(self) -> Lines:
        """Lines before the loop up the chain."""
        return self.blocks.begin if self.blocks else [f"{self.name}_pivot = INF"] if self.tridiagonal else self._emptied

    def elimination(self) -> list[Demand]:
        """Return the demands of its equations on the loop up the chain."""
        if self.blocks:
            return [Demand(needs=[need for row in self.rows for need in row.needs], write=self._blockwise)]
        return [Demand(needs=self.rows[0].needs, write=self._one)] if self.tridiagonal else self.set_up()

    def _blockwise(self, at: At) -> Lines:
        assert self.blocks is not None
        lines = self.blocks.elimination([row.entries(at) for row in self.rows], [written(at, row.right) for row in self.rows])
        return lines if self.asked == "pivot" else lines + self.blocks.keep(f"slab[k, {self.scratch} + {{i}}]")

    @property
    def _emptied(self) -> Lines:
        return [f"{self.name}_rows = numpy.zeros(({self.nodes * self.u}, {2 * self.width + 2}), dtype=DTYPE)"]

    def set_up(self) -> list[Demand]:
        """Return the demands that write its rows into an array, each centred at its diagonal."""

        def of_row(r: int) -> Callable[[At], Lines]:
            row, last = f"{self.name}_rows[{self.u} * k + {r}", 2 * self.width + 1

            def write(at: At) -> Lines:
                entries = self.rows[r].entries(at).items()
                lines = [f"{row}, {self.width + place * self.u + unknown - r}] = {text}" for (place, unknown), text in entries]
                return [*lines, f"{row}, {last}] = {written(at, self.rows[r].right)}"]

            return write

        return [Demand(needs=row.needs, write=of_row(r)) for r, row in enumerate(self.rows)]

    @property
    def solution(self) -> Lines:
        """Lines that solve the system in the array, with row exchanges."""
        b, u = self.name, self.u
        lines = [f"{b}_x, {b}_pivot = band{self.width}_solve({b}_rows)", f"for k in range({self.nodes}):"]
        return lines + [f"    slab[k, {self.base + i}] = {b}_x[{u} * k + {i}]" for i in range(u)]

    def again(self, loop: Callable[[Sequence[Demand]], Lines]) -> Lines:
        """Return the lines that solve the system with row exchanges if needed; ``loop`` turns demands into a loop."""
        if self.tridiagonal:
            return []
        if not self.blocks:
            return self.solution
        still = [f"{' = '.join(self.blocks.unknowns)} = ZERO"]
        if self.asked:
            return still if self.asked == "solution" else []
        test = f"{self.name}_exchanged = not {self.name}_pivot >= {SMALL}"
        lines = [*self._emptied, *loop(self.set_up()), *self.solution]
        return [test, f"if {self.name}_exchanged:", *(f"    {line}" for line in lines), *still]

    def _one(self, at: At) -> Lines:
        """Source of the elimination of one column between a pending row and the next row, as in ``kernels/band.py``."""
        b = self.name
        entries = self.rows[0].entries(at)
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
            f"{b}_l, {b}_d, {b}_r, {b}_y = {left}, {here}, {right}, {written(at, self.rows[0].right)}",
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

    def _kept(self, k: str) -> Lines:
        """Lines that test a pivot row and store it."""
        b = self.name
        return [
            f"if not abs({b}_p) >= {b}_pivot * {b}_sp or {b}_sp == 0.0:",
            f"    {b}_pivot = abs({b}_p) / {b}_sp if {b}_sp > 0.0 else 0.0 * {b}_sp",
            f"{b}_i = 1.0 / {b}_p",
            *(f"slab[{k}, {self.scratch + i}] = {b}_{name}" for i, name in enumerate("iuvz")),
        ]

    @property
    def between(self) -> Lines:
        """Lines after the loop up the chain, which eliminate the remaining rows."""
        b = self.name
        if not self.tridiagonal:
            return []
        last = f"{b}_p, {b}_u, {b}_v, {b}_z, {b}_sp = {b}_a, ZERO, ZERO, {b}_c, {b}_sa"
        return [last, *self._kept(str(self.nodes - 1)), f"{b}_x1, {b}_x2 = ZERO, ZERO"]

    @property
    def substitution(self) -> Lines:
        """Lines that begin each turn of the loop down the chain: the unknowns of node k."""
        b = self.name
        if self.tridiagonal:
            i, u_, v, z = (f"slab[k, {self.scratch + i}]" for i in range(4))
            return [f"{b}_x1, {b}_x2 = ({z} - {u_} * {b}_x1 - {v} * {b}_x2) * {i}, {b}_x1", f"slab[k, {self.base}] = {b}_x1"]
        if not self.blocks or self.asked == "pivot":
            return []
        lines = self.blocks.substitution(f"slab[k, {self.scratch} + {{i}}]")
        lines += [f"slab[k, {self.base + i}] = {name}" for i, name in enumerate(self.blocks.unknowns)]
        return lines if self.asked else [f"if not {b}_exchanged:", *(f"    {line}" for line in lines)]

    def unknowns(self, kind: str, which: Sequence[int], stage: int) -> Field:
        """Return the field of some of the unknowns of each node."""

        def write(at: At, k: str) -> Lines:
            return [f"slab[{k}, {self.base + i}]" for i in which]

        return Field(kind=kind, width=len(which), stage=stage, needs=(), write=write, ghost=["ZERO"] * len(which))


def of_width(width: int) -> dict[str, str]:
    """Return the source of ``solve`` of ``kernels/band.py`` for one half-bandwidth, so that its loops have known bounds."""
    name = f"band{width}_solve"
    return {name: kernel("band", name, {"WIDTH": str(width)})}
