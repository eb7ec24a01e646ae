"""Source of the elimination of banded systems of a chain without row exchanges: node by node, within a node in blocks of one or two.

::

    L_k x_{k-1} + A_k x_k + R_k x_{k+1} = r_k
    (Y_k, y_k) = (A_k - L_k Y_{k-1})^-1 (R_k, r_k - L_k y_{k-1}),       x_k = y_k - Y_k x_{k+1}

Entries are scalars with names; entries that are zero at every node are left out. The results at a node are passed to the next node in
local variables, so that no operation waits for memory.
"""

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field

from daebench.compiler.syntax import Lines

Block = tuple[int, ...]
Reach = Mapping[int, Set[int]]

Entries = Mapping[tuple[int, int], str]
"""Sources of the entries of a row. A key is the place of the node, counted from the present one, and the number of the unknown there."""

Places = Sequence[tuple[int, int, int]]
"""Entries of rows that may be nonzero: number of the row, place of the node, number of the unknown."""

MOST = 8
"""Number of unknowns of a node up to which its elimination is written out."""


def pairs(unknowns: Sequence[int]) -> list[Block]:
    """Return the unknowns in pairs; the last one stays alone if their number is odd."""
    return [tuple(unknowns[i : i + 2]) for i in range(0, len(unknowns), 2)]


@dataclass(kw_only=True)
class Blocks:
    """An order of elimination and the entries that it fills in."""

    name: str
    """Prefix of the names that its source uses."""
    u: int
    """Number of unknowns of a node."""
    places: Places
    order: Sequence[Block]
    """Unknowns in the order of their elimination, by the rows of the same numbers. A pair is eliminated at once, by Cramer's rule."""
    judged: bool = True
    """Whether the smallest relative pivot is computed."""
    reach: Reach = field(init=False)
    """For each unknown, the unknowns of the next node on which it depends."""

    def __post_init__(self) -> None:
        entries: list[dict[tuple[int, int], str]] = [{} for _ in range(self.u)]
        for row, place, unknown in self.places:
            entries[row][place, unknown] = "a"
        self.reach = {}
        while True:
            node = Node(self)
            node.write(entries, ["b"] * self.u)
            if node.reach == self.reach:
                break
            self.reach = node.reach

    @property
    def kept(self) -> list[tuple[int, int]]:
        """Unknowns and columns of the values of a node that back substitution needs."""
        return [(i, column) for i in range(self.u) for column in (*(self.u + j for j in sorted(self.reach[i])), 2 * self.u)]

    @property
    def begin(self) -> Lines:
        """Lines before the loop up the chain."""
        b = self.name
        return [f"{b}_pivot = INF"] * self.judged + [*(f"{b}_y{i}_{column} = ZERO" for i, column in self.kept)]

    def elimination(self, entries: Sequence[Entries], rights: Sequence[str]) -> Lines:
        """Return the lines for a node, given the sources of its entries and right sides."""
        return Node(self).write(entries, rights)

    def keep(self, place: str) -> Lines:
        """Return the lines that store the values needed by back substitution; {i} in ``place`` stands for the number of a value."""
        return [f"{place.format(i=n)} = {self.name}_y{i}_{column}" for n, (i, column) in enumerate(self.kept)]

    def substitution(self, place: str) -> Lines:
        """Return the line for a node in the loop down the chain, from the stored values."""
        b, texts = self.name, [""] * self.u
        for n, (i, column) in enumerate(self.kept):
            value = place.format(i=n)
            texts[i] = value + texts[i] if column == 2 * self.u else f"{texts[i]} - {value} * {b}_x{column - self.u}"
        return [f"{', '.join(self.unknowns)} = {', '.join(texts)}"]

    @property
    def unknowns(self) -> Lines:
        """Names of the unknowns of a node in the loop down the chain; zero before the loop."""
        return [f"{self.name}_x{i}" for i in range(self.u)]


class Node:
    """Lines of the elimination at a node, under construction.

    Entries of the node's rows are called name_a{row}_{column}; after elimination those of an unknown are name_y{unknown}_{column}. The
    columns are the node's unknowns, then from u on the unknowns of the next node, and last the right side, 2 u.
    """

    def __init__(self, blocks: Blocks) -> None:
        self.b, self.u, self.order, self.before = blocks.name, blocks.u, blocks.order, blocks.reach
        self.judged = {(i, i) for block in blocks.order for i in block if blocks.judged}
        self.lines: Lines = []
        self.rows: list[dict[int, str]] = [{} for _ in range(self.u)]
        self.solved: dict[int, list[int]] = {}

    @property
    def reach(self) -> dict[int, set[int]]:
        """For each unknown, the unknowns of the next node on which it depends."""
        return {i: {column - self.u for column in self.solved[i] if self.u <= column < 2 * self.u} for i in range(self.u)}

    def write(self, entries: Sequence[Entries], rights: Sequence[str]) -> Lines:
        """Return the lines, given the sources of the node's entries and right sides."""
        for i in range(self.u):
            self._assemble(i, entries[i], rights[i])
        for block in self.order:
            coupled = len(block) == 2 and any(block[1 - n] in self.rows[block[n]] for n in (0, 1))
            for part in [block] if coupled else [(i,) for i in block]:
                self._eliminate(part)
        for i in reversed([i for block in self.order for i in block]):
            self._substitute(i)
        return self.lines

    def _assemble(self, i: int, entries: Entries, right: str) -> None:
        """Set up row i, minus the contributions of the node before."""
        for (place, unknown), text in entries.items():
            if place >= 0:
                self._set(i, unknown + place * self.u, text)
        if right != "ZERO":
            self._set(i, 2 * self.u, right)
        for (place, unknown), text in entries.items():
            if place < 0:
                self.lines.append(f"{self.b}_l = {text}")
                for j in sorted(self.before.get(unknown, ())):
                    self._subtract(i, j, [f"{self.b}_l * {self.b}_y{unknown}_{self.u + j}"])
                self._subtract(i, 2 * self.u, [f"{self.b}_l * {self.b}_y{unknown}_{2 * self.u}"])

    def _set(self, i: int, column: int, text: str) -> None:
        name = self.rows[i][column] = f"{self.b}_a{i}_{column}"
        self.lines.append(f"{name} = {text}")
        if (i, column) in self.judged:
            self.lines.append(f"{name}_s = abs({name})")

    def _subtract(self, i: int, column: int, products: Sequence[str]) -> None:
        """Subtract products from an entry. For a diagonal entry whose pivot is tested, also sum the moduli of all terms."""
        b, present, name = self.b, column in self.rows[i], f"{self.b}_a{i}_{column}"
        self.rows[i][column] = name
        if (i, column) not in self.judged:
            self.lines.append(f"{name} = {name if present else ''} - {' - '.join(products)}".replace("=  -", "= -"))
            return
        for product in products:
            self.lines.append(f"{b}_q = {product}")
            self.lines.append(f"{name}, {name}_s = " + (f"{name} - {b}_q, {name}_s + abs({b}_q)" if present else f"-{b}_q, abs({b}_q)"))
            present = True

    def _eliminate(self, block: Block) -> None:
        """Solve the rows of a block for its unknowns, and substitute these in the remaining rows."""
        columns = sorted({column for i in block for column in self.rows[i]} - {*block} - self.solved.keys())
        inverse = self._inverse(block)
        for i in block:
            for column in columns:
                terms = [f"{inverse[i, j]} * {self.rows[j][column]}" for j in block if column in self.rows[j] and (i, j) in inverse]
                if terms:
                    self.lines.append(f"{self.b}_y{i}_{column} = {' + '.join(terms)}")
                    self.solved.setdefault(i, []).append(column)
        for row in sorted(set(range(self.u)) - self.solved.keys()):
            met = [i for i in block if i in self.rows[row]]
            for column in columns:
                products = [f"{self.rows[row][i]} * {self.b}_y{i}_{column}" for i in met if column in self.solved[i]]
                if products:
                    self._subtract(row, column, products)

    def _inverse(self, block: Block) -> dict[tuple[int, int], str]:
        """Test the pivot of a block; return the entries of its inverse."""
        b, p, q = self.b, block[0], block[-1]
        paths = [((p, p), (q, q)), ((p, q), (q, p))] if len(block) == 2 else [((p, p),)]
        terms = [[self.rows[i].get(j, "ZERO") for i, j in path] for path in paths]
        self.lines.append(f"{b}_p = {' - '.join(' * '.join(factors) for factors in terms)}")
        if (p, p) in self.judged:
            sizes = [f"{self.rows[i][i]}_s" if i in self.rows[i] else "abs(ZERO)" for i in block]
            crossed = [f" + abs({' * '.join(factors)})" for factors in terms[1:]]
            self.lines.append(f"{b}_s = {' * '.join(sizes)}{''.join(crossed)}")
            self.lines.append(f"{b}_share = abs({b}_p) / {b}_s")
            self.lines.append(f"{b}_pivot = {b}_pivot if {b}_share >= {b}_pivot else {b}_share")
        self.lines.append(f"{b}_i = 1.0 / {b}_p")
        if len(block) == 1:
            return {(p, p): f"{b}_i"}
        opposite = {(p, p): ((q, q), ""), (p, q): ((p, q), "-"), (q, p): ((q, p), "-"), (q, q): ((p, p), "")}
        inverse = {place: (i, j, sign) for place, ((i, j), sign) in opposite.items() if j in self.rows[i]}
        self.lines += [f"{b}_i{n}_{m} = {sign}{self.rows[i][j]} * {b}_i" for (n, m), (i, j, sign) in inverse.items()]
        return {(n, m): f"{b}_i{n}_{m}" for n, m in inverse}

    def _substitute(self, i: int) -> None:
        """Eliminate the node's other unknowns from the solution for unknown i."""
        for j in [column for column in self.solved[i] if column < self.u]:
            self.solved[i].remove(j)
            for column in self.solved[j]:
                y, product = f"{self.b}_y{i}_{column}", f"{self.b}_y{i}_{j} * {self.b}_y{j}_{column}"
                if column in self.solved[i]:
                    self.lines.append(f"{y} = {y} - {product}")
                else:
                    self.lines.append(f"{y} = -{product}")
                    self.solved[i].append(column)
