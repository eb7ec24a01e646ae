"""Several computations of the same motion: closed form, Taylor series in the first coordinates, and in others."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import mpmath as mp
import numpy as np

from daebench.reference.keep.definition import Definition
from daebench.reference.make.coordinates import Along, Coordinates
from daebench.reference.make.mathematics import Mathematics, mathematics
from daebench.reference.make.stages import Rows
from daebench.reference.make.taylor import integrated
from daebench.runs.ivp import Array

PIECES = 8
"""Number of times from output to output that velocities along the manifold are chosen anew: a crank may turn by more than 90 degrees."""


@dataclass(frozen=True)
class States:
    """States as mpmath numbers, one row for each time; derived quantities are computed when they are asked for."""

    rows: Rows
    mathematics: Mathematics

    @cached_property
    def parts(self) -> dict[str, Rows]:
        """The rows of each part by its name, including multipliers, HLW (1.12)."""
        states = [self.mathematics.parts(row) for row in self.rows]
        return {part: [state[part] for state in states] for part in states[0]}

    def until(self, n: int) -> "States":
        """Return the first n rows."""
        return States(self.rows[:n], self.mathematics)


Keep = Callable[[str, Callable[[], Rows]], Rows]
"""``keep(stage, make)`` returns the rows of a stage, made now or in an earlier run that was interrupted."""


class Computations:
    """Several computations of the same motion, at the same times."""

    def __init__(self, definition: Definition, times: Sequence[Any], keep: Keep) -> None:
        self.definition, self.times, self.keep = definition, times, keep
        self.mathematics = mathematics(definition)

    def closed_form(self, digits: int) -> States:
        """Return the problem's closed form, evaluated with this many digits."""

        def make() -> Rows:
            with mp.workdps(digits):
                return self.mathematics.exact(self.times)

        return self._states(self.keep(f"closed-form-{digits}", make))

    def own(self, shift: Sequence[Any] | None = None, stage: str = "taylor", **options: Any) -> States:
        """Return the Taylor series from the start or from a point near it, computed with the options of :func:`integrated`."""

        def make() -> Rows:
            start = self._start()
            moved = start if shift is None else [x + y for x, y in zip(start, shift, strict=True)]
            return self._series(self.mathematics.first, moved, **options)

        return self._states(self.keep(stage, make))

    def other(self) -> States:
        """Return the Taylor series in other coordinates, which must exist."""

        def make() -> Rows:
            other = self.mathematics.other
            assert other is not None
            return self._series(other, self._start())

        return self._states(self.keep("other", make))

    def _series(self, coordinates: Coordinates, start: list[Any], **options: Any) -> Rows:
        pieces, n = (coordinates, PIECES) if isinstance(coordinates, Along) else (None, 1)
        times = [last + k * (t - last) / n for last, t in pairwise(self.times) for k in range(n)]
        rows = integrated(coordinates.equations, coordinates.entered(start), [*times, self.times[-1]], pieces=pieces, **options)
        return coordinates.left(rows[::n])

    def _start(self) -> list[Any]:
        return [x for part in self.definition.start_numbers() for x in part]

    def _states(self, rows: Rows) -> States:
        return States(rows, self.mathematics)


def differences(a: States, b: States) -> dict[str, Array]:
    """Return the moduli of all differences of two motions."""

    def moduli(x: Rows, y: Rows) -> Array:
        return np.array([[float(abs(u - v)) for u, v in zip(*rows, strict=True)] for rows in zip(x, y, strict=True)])

    return {part: moduli(a.parts[part], b.parts[part]) for part in a.parts}


def sizes(states: States) -> dict[str, float]:
    """Return the largest modulus of each part."""
    return {part: max(float(abs(x)) for row in rows for x in row) for part, rows in states.parts.items()}
