"""The same motion made in several ways: closed form, Taylor series in the problem's own coordinates, and in its chart."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mpmath as mp
import numpy as np
from numpy.typing import NDArray

from daebench.reference.certified.definition import Definition
from daebench.reference.certified.index_reduced import own_coordinates
from daebench.reference.certified.local import Local
from daebench.reference.certified.multiprecision import Functions
from daebench.reference.certified.stages import Rows
from daebench.reference.certified.taylor import Equations, integrated

Array = NDArray[np.float64]


@dataclass(frozen=True)
class States:
    """Positions, momenta and multipliers lam(p, q) as mpmath numbers, one row a time; the multipliers are worked out when asked for."""

    q: Rows
    p: Rows
    functions: Functions

    @cached_property
    def lam(self) -> Rows:
        """Multipliers, HLW (1.12)."""
        return [self.functions.lam(q, p) for q, p in zip(self.q, self.p, strict=True)]

    def until(self, n: int) -> "States":
        """Return the first n rows."""
        return States(self.q[:n], self.p[:n], self.functions)

    def parts(self) -> Mapping[str, Rows]:
        """Return the rows by name."""
        return {"q": self.q, "p": self.p, "lam": self.lam}


Keep = Callable[[str, Callable[[], Rows]], Rows]
"""``keep(stage, make)`` returns the rows of a stage, made now or in an earlier run that was interrupted."""


class Motions:
    """The same motion made in several ways, at the same times.

    Parameters
    ----------
    definition : Definition
        What moves.
    times : sequence of mpmath number
        Output times, the first 0.
    keep : callable
        Keeps the rows of each stage.
    """

    def __init__(self, definition: Definition, times: Sequence[Any], keep: Keep) -> None:
        self.definition, self.times, self.keep = definition, times, keep
        self.functions = Functions(definition)

    @cached_property
    def equations(self) -> Equations:
        """The index-reduced equation, which the motion and all its neighbours share."""
        return own_coordinates(self.definition)

    def closed_form(self, digits: int) -> States:
        """Return the problem's closed form, worked out with so many digits."""

        def make() -> Rows:
            form = self.definition.derivation.problem.closed_form
            assert form is not None
            with mp.workdps(digits):
                q0, p0 = self.definition.start_numbers()
                values = {str(symbol): mp.mpf(value.p) / value.q for symbol, value in self.definition.parameters.items()}
                return [[*q0, *p0], *([*q, *p] for q, p in (form(t, q0, p0, values) for t in self.times[1:]))]

        return self._states(self.keep(f"closed-form-{digits}", make))

    def own(self, shift: Sequence[Any] | None = None, stage: str = "taylor", **options: Any) -> States:
        """Return the Taylor series of (1.18) from the start or beside it, made with the options of :func:`integrated`."""

        def make() -> Rows:
            start = [x for part in self.definition.start_numbers() for x in part]
            moved = start if shift is None else [x + y for x, y in zip(start, shift, strict=True)]
            return integrated(self.equations, moved, self.times, **options)

        return self._states(self.keep(stage, make))

    def local(self) -> States:
        """Return the Taylor series in the problem's chart."""

        def make() -> Rows:
            local = Local(self.definition)
            q, p = local.left(integrated(local.equations, local.entered(*self.definition.start_numbers()), self.times))
            return [[*a, *b] for a, b in zip(q, p, strict=True)]

        return self._states(self.keep("chart", make))

    def _states(self, rows: Rows) -> States:
        d = self.definition.derivation.d
        return States([row[:d] for row in rows], [row[d:] for row in rows], self.functions)


def differences(a: States, b: States) -> dict[str, Array]:
    """Return the moduli of all differences of two motions."""

    def moduli(x: Rows, y: Rows) -> Array:
        return np.array([[float(abs(u - v)) for u, v in zip(*rows, strict=True)] for rows in zip(x, y, strict=True)])

    return {part: moduli(a.parts()[part], b.parts()[part]) for part in a.parts()}


def sizes(states: States) -> dict[str, float]:
    """Return the largest modulus of each of q, p and lam."""
    return {part: max(float(abs(x)) for row in rows for x in row) for part, rows in states.parts().items()}
