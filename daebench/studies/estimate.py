"""About how long the cells of a study will take: as long as those like them took, or where there are none, what is usual."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from daebench.studies.cell import Cell
from daebench.studies.store import Kept, Store

STEP_SECONDS = 1e-6
"""What a fixed step usually costs: between 1e-7 for RATTLE on a pendulum and 1e-5 for long compositions on large problems."""

TOLERANCE_SECONDS = 0.005
"""What a second of motion usually costs a tolerance-driven method, between 1e-3 and 0.05."""

LEAST_SECONDS = 0.002
"""What a run costs at least."""


@dataclass(frozen=True)
class Estimate:
    """About how long cells take.

    Parameters
    ----------
    seconds : float
        In one process, s; compilation, some seconds for each method that never ran here, is not in it.
    like : int
        Cells that it knows kept ones like, of the same method on the same problem.
    cells : int
        All of them.
    """

    seconds: float
    like: int
    cells: int

    def sentence(self, processes: int, where: str) -> str:
        """Return it in words, for so many processes, which are there."""
        whose = f"from kept runs for {self.like} of them, from what is usual for the others"
        if self.like in (0, self.cells):
            whose = "from kept runs of the same methods" if self.like else "from what is usual, for none of these methods was run before"
        return f"about {duration(self.seconds / processes)} {where} (an estimate {whose}; compilation not counted)"


def estimate(cells: Sequence[Cell], store: Store) -> Estimate:
    """Return about how long cells will take, by what the store has of their methods on their problem."""
    kept: dict[tuple[str, str], list[Cell]] = {}
    took: dict[Cell, float] = {}
    for each in _whole(store.all()):
        cell = Cell.of_plain(each.cell)
        kept.setdefault((cell.problem, cell.method), []).append(cell)
        took[cell] = each.took
    knobs: dict[tuple[str, str], str] = {}
    seconds, like = 0.0, 0
    for cell in cells:
        others = kept.get((cell.problem, cell.method), [])
        if (cell.problem, cell.method) not in knobs:
            knobs[cell.problem, cell.method] = cell.solver.knob
        knob = knobs[cell.problem, cell.method]
        usual = STEP_SECONDS if knob == "h" else TOLERANCE_SECONDS
        rate = min((took[other] / _work(other, knob) for other in _nearest(cell, knob, others)), default=usual)
        seconds += max(LEAST_SECONDS, rate * _work(cell, knob))
        like += bool(others)
    return Estimate(seconds, like, len(cells))


def _nearest(cell: Cell, knob: str, others: Sequence[Cell]) -> Sequence[Cell]:
    """Return the cells to whose time that of this one is in proportion: with fixed steps all, and else those with the nearest tol."""
    if knob == "h" or not others:
        return others
    distances = [abs(math.log(other.value / cell.value)) for other in others]
    least = min(distances)
    return [other for other, distance in zip(others, distances, strict=True) if distance == least]


def _whole(rows: Iterable[Kept]) -> Iterable[Kept]:
    """Give those that came to their end: one that failed soon tells nothing of another that does not."""
    return (each for each in rows if not each.row.get("failure"))


def _work(cell: Cell, knob: str) -> float:
    """Return to what the time of a cell is taken as proportional: its runs times their steps, or their length where steps are chosen."""
    return (1 + max(0, cell.repeat)) * (cell.t_end / cell.value if knob == "h" else cell.t_end)


def duration(seconds: float) -> str:
    """Return about how long something lasts, in words."""
    if seconds < 90:
        return f"{max(1, round(seconds))} s"
    if seconds < 5400:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h" if seconds < 2 * 86400 else f"{seconds / 86400:.3g} days"
