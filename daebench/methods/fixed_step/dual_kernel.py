"""A scheme with the derivatives of its steps: the discrete tangent, by dual numbers."""

import types
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from daebench.runs.directions import STEP, Directions, imaginary, moved_by, number_of_directions
from daebench.runs.ivp import Ivp
from daebench.runs.trajectory import Array


@dataclass(frozen=True)
class Seeds:
    """Derivatives that a run begins with, as a kernel takes them: k of them in a tuple for each number, or None."""

    x: Any
    """Derivatives of the state that the scheme computes in."""
    par: tuple[Any, ...]
    """Derivatives of the run-time data."""


def width(ivp: Ivp, names: Sequence[str]) -> int:
    """Return the number of directions of a kernel's derivatives: 1, 2, or a multiple of 4, the width of the processor's vectors."""
    needed = number_of_directions(ivp, names)
    # Other widths leave lanes of the processor's vectors empty; directions of zeros fill them at no cost.
    return needed if needed < 3 else -(-needed // 4) * 4


def seeds(ivp: Ivp, chosen: Directions, enter: Any, data: int) -> Seeds:
    """Return the derivatives that a run begins with."""
    start = np.concatenate(ivp.start)
    columns = []
    for par, moved in zip(chosen.par.T, chosen.start.T, strict=True):
        # The map into the scheme's coordinates may depend on parameters, so that it is differentiated with the start.
        columns.append(enter(moved_by(ivp, par))(ivp.vectors(start + 1j * STEP * moved)))
    form = enter(ivp)(ivp.start)
    if np.ndim(form[0]) == 0:
        x: Any = _entries(np.array([imaginary(column) for column in columns]))
    else:
        x = tuple(_entries(np.array([imaginary(column[i]) for column in columns])) for i in range(len(form)))
    return Seeds(x, (*(tuple(map(float, row)) if np.any(row) else None for row in chosen.par), *[None] * data))


def _entries(columns: Array) -> tuple[tuple[float, ...], ...]:
    """Return the derivatives of each number, given those of all numbers in each direction."""
    return tuple(tuple(map(float, row)) for row in columns.T)


class DualKernel:
    """A generated module of dual numbers, called as one of real numbers is: it keeps the derivatives from call to call."""

    def __init__(self, module: types.ModuleType, begin: Seeds, rows: int, chosen: Directions) -> None:
        self.module, self.x, self.par, self.memory = module, begin.x, begin.par, ()
        self.chosen, self.end = chosen, chosen.start
        size, k = chosen.start.shape
        # The start before the outputs, and the end after them.
        self.rows = np.zeros((k, rows + 2, size))
        self.rows[:, 0] = chosen.start.T
        if hasattr(module, "initialise_dual"):
            self.initialise = self._initialise

    def __getattr__(self, name: str) -> Any:
        return getattr(self.module, name)

    def _initialise(self, x: Any, h: float, par: Any) -> Any:
        memory, report, self.memory = self.module.initialise_dual(x, h, par, self.x, self.par)
        return memory, report

    def integrate(self, x: Any, memory: Any, *loop: Any) -> Any:
        """Take steps as ``integrate`` of a generated module does, and store the derivatives of a state where the state is."""
        *progress, states, stage_lams, par = loop
        last = self.rows.shape[1] - 1
        # The loop is called with the rest of the outputs: the rows of derivatives that belong to it end where the outputs end.
        outputs = (states, self.rows[:, last - len(states) : last])
        result, (self.x, self.memory, end) = self.module.integrate_dual(
            x, memory, *progress, outputs, stage_lams, par, self.x, self.memory, self.par
        )
        self.end = np.array(end).reshape(self.end.shape)
        return result

    def sensitivities(self, stored: int, n: int, parts: Mapping[str, slice]) -> dict[str, dict[str, Array]]:
        """Return the derivatives of n states, by the name of a parameter or initial value and of the part; ``parts`` has places in a state.

        The states are the start, those that were stored, and the end where that is not one of them.
        """
        rows = self.rows[:, :n]
        rows[:, stored + 1 :] = self.end.T[:, None]
        return self.chosen.results(rows, parts)
