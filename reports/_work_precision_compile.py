"""Kernels of a study compiled before anything is timed, on two cores: timed runs are alone."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from daebench.errors import DaebenchError
from daebench.method import Request
from daebench.reports._tolerances_numbers import computed
from daebench.studies.cell import Cell

STEPS = 3


def compile_ahead(cells: Iterable[Cell], tell: Callable[[float, str], None]) -> None:
    """Make what the cells of studies need compiled, once for each method on each problem, in two processes."""
    needed = {(each.problem, each.case, each.method): each for each in cells}
    for _ in computed([(warm, (cell,)) for cell in needed.values()], lambda done, _: tell(done, "kernels")):
        pass


def warm(cell: Cell) -> None:
    """Take a few steps of no consequence, watched and counted, and then bare as they are timed.

    What cannot be run fails here as it does in its study, which says why.
    """
    solver = cell.solver
    for request in _requests(solver, cell):
        try:
            solver.solve(cell.scene, request)
        except DaebenchError:
            return


def _requests(solver: Any, cell: Cell) -> list[Request]:
    if solver.knob == "h":
        one = Request(value=cell.value, steps=STEPS, every=1)
        return [one, replace(one, watch=(), count=False)]
    return [Request(value=cell.value, t_end=cell.t_end / 1000, points=STEPS)]
