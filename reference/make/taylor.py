"""Taylor series in quadruple precision by heyoka: motions computed independently of all our formulations, schemes and solvers."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Protocol

import mpmath as mp

from daebench.errors import RunFailed
from daebench.methods.solvers.quadruple import library, multiple, quad
from daebench.methods.solvers.taylor_equations import Equations

MOST_STEPS = 100_000
"""Largest number of steps from output to output."""


class Piecewise(Protocol):
    """Coordinates that are chosen anew at each output."""

    def begun(self, x: list[Any]) -> tuple[list[Any], list[Any]]:
        """Return the unknowns at an output, and the parameters of the equations up to the next one."""

    def ended(self, x: list[Any], parameters: list[Any]) -> list[Any]:
        """Return the stored form of the unknowns at the next output."""


def integrated(
    equations: Equations,
    start: Sequence[Any],
    times: Sequence[Any],
    *,
    tolerance: str = "1e-34",
    parts: int = 1,
    pieces: Piecewise | None = None,
) -> list[list[Any]]:
    """Return the unknowns at ascending times as mpmath numbers, shape(n, unknowns).

    The step never exceeds the distance of outputs. heyoka's step control reads the last two Taylor coefficients, which vanish for
    symmetric starts at rest; it would then silently take a step that is far too long. Two runs whose steps end at the same times
    have the same rounding, so their difference does not show it.
    """
    hy = library()
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
            raise RunFailed(f"the Taylor series stopped {where}: {outcome}; choose a shorter end time.")
        row = [multiple(x) for x in solver.state]
        rows.append(row if pieces is None else pieces.ended(row, parameters))
    return rows


def _put(array: Any, values: Sequence[Any]) -> None:
    """Write numbers into an array of heyoka."""
    for k, x in enumerate(values):
        array[k] = quad(x)
