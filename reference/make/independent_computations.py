"""Several computations of the same motion: closed form, Taylor series in quadruple precision in the first coordinates, and in others."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import mpmath as mp
import numpy as np

from daebench.errors import RunFailed
from daebench.methods.solvers.taylor_equations import Equations, multiple, quad
from daebench.reference.keep.definition import Definition
from daebench.reference.make.coordinates import Along, Local, Own
from daebench.reference.make.mathematics import Mathematics, mathematics
from daebench.reference.make.poisson import Mapped
from daebench.reference.make.stages import Rows
from daebench.runs.ivp import Array
from daebench.systems.lazily import heyoka as hy

MOST_STEPS = 100_000
"""Largest number of steps from output to output."""


def integrated(
    equations: Equations,
    start: Sequence[Any],
    times: Sequence[Any],
    *,
    tolerance: str = "1e-34",
    parts: int = 1,
    pieces: Along | None = None,
) -> list[list[Any]]:
    """Return the unknowns at ascending times as mpmath numbers, shape(n, unknowns).

    The step never exceeds the distance of outputs. heyoka's step control reads the last two Taylor coefficients, which vanish for
    symmetric starts at rest; it would then silently take a step that is far too long. Two runs whose steps end at the same times
    have the same rounding, so their difference does not show it.
    """
    begun, parameters = (list(start), []) if pieces is None else pieces.begun(list(start))
    initial, settings = [quad(x) for x in begun], {"pars": [quad(x) for x in parameters]} if parameters else {}
    solver = hy.taylor_adaptive(equations, initial, fp_type=hy.real128, tol=hy.real128(tolerance), compact_mode=True, **settings)
    solver.time = quad(times[0])
    rows = [list(start)]
    for last, t in pairwise(times):
        if pieces is not None:
            begun, parameters = pieces.begun(rows[-1])
            _put(solver.state, begun)
            _put(solver.pars, parameters)
        outcome = solver.propagate_until(quad(t), max_delta_t=quad((t - last) / parts), max_steps=MOST_STEPS)[0]
        if outcome != hy.taylor_outcome.time_limit or not all(math.isfinite(float(x)) for x in solver.state):
            where = f"between t = {mp.nstr(last, 9)} and {mp.nstr(t, 9)}"
            raise RunFailed(f"the Taylor series stopped {where}: {outcome}; choose a shorter end time.", "taylor-series-stopped")
        row = [multiple(x) for x in solver.state]
        rows.append(row if pieces is None else pieces.ended(row, parameters))
    return rows


def _put(array: Any, values: Sequence[Any]) -> None:
    """Write numbers into an array of heyoka."""
    for k, x in enumerate(values):
        array[k] = quad(x)


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

    def _series(self, coordinates: Own | Local | Along | Mapped, start: list[Any], **options: Any) -> Rows:
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
