"""The time grid of a fixed-step run: the number of steps, and which states are stored."""

import math
import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput, positive
from daebench.runs.request import Request

MOST_STEPS = 2**53
EPS = 2.0**-52


@dataclass(frozen=True)
class Grid:
    """N steps of size h exactly, with a state stored after every ``every`` steps."""

    h: float
    """Step size."""
    steps: int
    """Number of steps."""
    every: int
    """Number of steps between stored states; 0 stores only the end."""
    end: float | None = None
    """Time after the last step, if steps are the intervals between outputs of a method that chooses its own steps."""

    def times(self, steps: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the times after some steps, by their numbers."""
        return np.asarray(steps * self.h if self.end is None else np.linspace(0.0, self.end, self.steps + 1)[steps])

    @cached_property
    def rows(self) -> int:
        """Number of states that the loop stores."""
        return self.steps // self.every if self.every else 0

    @classmethod
    def fixed_step(cls, name: str, request: Request, size: int) -> Self:
        """Return the grid that a request prescribes for a fixed-step method."""
        h = positive("h", request.value)
        if request.points is not None:
            raise BadInput(
                f"points are for tolerance-driven methods; {name} has fixed steps, so give every, the number of steps between stored "
                f"states.",
                "points-of-fixed-steps",
            )
        if request.solver_steps:
            raise BadInput(
                f"{name} has fixed steps without error estimates; a record of steps is for IDA and CVODE, so leave it out.",
                "record-of-fixed-steps",
            )
        if (request.steps is None) == (request.t_end is None):
            raise BadInput(f"{name} needs either a number of steps or an end time, but not both.", "steps-beside-end-time")
        steps = request.steps if request.steps is not None else _whole_steps(positive("t_end", request.t_end), h)
        every = 1 if request.every is None else request.every
        if steps < 1:
            end = f" (t_end = {request.t_end:g} is less than h = {h:g})" if request.t_end is not None else ""
            raise BadInput(f"the run has {_short(steps)} steps{end}; it needs at least one.", "run-without-steps")
        if steps > MOST_STEPS or not math.isfinite(steps * h):
            raise BadInput(
                "the run has more steps than can be counted exactly (2^53), or is endless; shorten it or use a larger h.",
                "too-many-steps-to-count",
            )
        if not 0 <= every <= MOST_STEPS:
            raise BadInput(
                f"every = {_short(every)} must be a number of steps up to 2^53, or 0 to store only the end.", "every-out-of-range"
            )
        grid = cls(h, steps, every)
        require_memory(grid, size)
        return grid


def _whole_steps(t_end: float, h: float) -> int:
    """Return floor(t_end / h) with a tolerance: 1e-9, or a few ulps of the ratio if these are more."""
    ratio = t_end / h
    # t_end / h is rounded: 1 / 0.1 must be 10 steps, and for many steps a few roundings of the ratio are more than 1e-9.
    return math.floor(ratio + max(1e-9, 4 * EPS * ratio)) if math.isfinite(ratio) else MOST_STEPS + 1


def require_memory(grid: Grid, size: int) -> None:
    """Refuse a grid whose states, copied once for output, do not fit into the free memory."""
    need = 2 * 8 * (size + 1) * grid.rows
    free = _free_memory()
    if need > free:
        every = math.ceil(grid.every * need / free) if free else 0
        raise BadInput(
            f"storing {grid.rows} states takes {need / 1e9:.3g} GB, but {free / 1e9:.3g} GB are free; use --every {every} or more, "
            "or --every 0 to store only the end.",
            "states-exceed-memory",
        )


OTHERS = 8
"""Approximate number of states of a member of an ensemble in memory besides the stored ones: start, end, and data for drawing starts."""


def require_memory_of_members(rows: int, size: int, members: int) -> None:
    """Refuse members of an ensemble with ``rows`` stored states of ``size`` numbers each that do not fit into the free memory."""
    need, free = 2 * 8 * size * (rows + OTHERS) * members, _free_memory()
    if need > free:
        raise BadInput(
            f"{_short(members)} members with {_short(rows)} stored states each take {need / 1e9:.3g} GB, but {free / 1e9:.3g} GB are free; "
            "choose fewer.",
            "members-exceed-memory",
        )


def _free_memory() -> float:
    """Return the available memory in bytes; a cautious 2 GB if the system does not report it."""
    meminfo = Path("/proc/meminfo")
    if meminfo.is_file():
        for line in meminfo.read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * int(line.split()[1])
    try:
        return float(os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, ValueError, OSError):
        return 2e9


def _short(whole: int) -> str:
    """Return a whole number in at most a dozen characters."""
    return str(whole) if abs(whole) < 10**12 else "a number beyond 1e12"
