"""The largest step size with which a method completes a motion, by bisection."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from daebench.errors import BadInput
from daebench.studies.grid.measure import Row, row_of
from daebench.studies.grid.rows import lost_rank
from daebench.studies.grid.run_specification import GridRun

FINEST = 40
"""Halvings of the first step size after which there is none that gets through."""

PART = 0.01
"""Energy error, in parts of the energy's size, with which a step is still usable."""

SCAN = 8
"""Step sizes between h and 2 h that are tried above the largest that got through: where there are gaps, a bisection may end in one."""


@dataclass(frozen=True)
class Edge:
    """Where a method stops to get through."""

    h: float
    """Largest step size found that gets through, with all smaller ones that were tried above half of it; 0 if there is none."""
    fails: float
    """Smallest step size above it that does not; infinite if there is none."""
    why: str
    """What happened there."""
    gaps: bool
    """Whether a larger step size gets through again."""
    tried: int
    """Runs that this took."""


def largest_step(
    specification: GridRun, passes: Callable[[Row], str], *, largest: float, digits: int = 3, run: Callable[[GridRun], Row] = row_of
) -> Edge:
    """Return the largest h with which a run passes, to so many digits, by a method with fixed steps; the run's own h is not used.

    From the largest down, h is halved until a run passes; between the two it is bisected. ``passes`` returns "" for the row of a run that
    passes, or else what is wrong with it. BadInput is raised if the method has no steps of its own to choose, or nothing is left to bisect.
    """
    if specification.solver.knob != "h":
        raise BadInput(f"{specification.method} chooses its own steps, so it has no largest step; give a fixed-step method.")
    if not 0 < largest <= specification.t_end / 3:
        raise BadInput(
            f"the largest step to begin with must be positive and at most t_end/3 = {specification.t_end / 3:g}, not {largest:g}."
        )
    trials = _Trials(specification, passes, run)
    good, bad = trials.bracket(largest)
    if good == 0 or math.isinf(bad):
        return Edge(good, bad, trials.known.get(bad, ""), False, len(trials.known))
    while bad - good > 0.5 * 10.0**-digits * good:
        middle = (good + bad) / 2
        good, bad = (good, middle) if trials.verdict(middle) else (middle, bad)
    above = [good * (1 + k / SCAN) for k in range(1, SCAN + 1) if good * (1 + k / SCAN) <= largest]
    return Edge(good, bad, trials.known[bad], any(not trials.verdict(h) for h in above), len(trials.known))


class _Trials:
    """Runs with different steps, each made once, and what was wrong with them."""

    def __init__(self, specification: GridRun, passes: Callable[[Row], str], run: Callable[[GridRun], Row]) -> None:
        self.specification, self.passes, self.run = specification, passes, run
        self.known: dict[float, str] = {}

    def verdict(self, h: float) -> str:
        if h not in self.known:
            self.known[h] = self.passes(self.run(self.specification.at(h)))
        return self.known[h]

    def bracket(self, largest: float) -> tuple[float, float]:
        """Return a step that passes, 0 if there is none, and twice that step, which does not; infinity if the largest passes."""
        good, bad = largest, math.inf
        while self.verdict(good):
            good, bad = good / 2, good
            if good < largest * 2.0**-FINEST or self._lost_with_both(bad):
                return 0.0, bad
        return good, bad

    def _lost_with_both(self, h: float) -> bool:
        """Return whether runs with a step and with its double stop where G loses rank."""
        return all(lost_rank({"failure": self.known.get(step, "")}) for step in (h, 2 * h))


def completes(row: Row) -> str:
    """Return why a run did not come to its end; "" if it did: the limit is that of the solvability of its equations."""
    return str(row["failure"])


def keeps_energy(row: Row) -> str:
    """Return why a run did not come to its end with the energy kept within :data:`PART` of its size; "" if it did."""
    off, size = row["energy_error"], row["energy_scale"]
    return completes(row) or ("" if off <= PART * size else f"its energy error is {off:.2g}, and the size of the energy is {size:.3g}")
