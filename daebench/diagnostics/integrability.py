"""Integrability: constraints on velocities of which a combination is the derivative of a function of the positions, and how many are.

::

    I_0 = span of the rows of G = [g_q; A]      I_{k+1} = {w in I_k : dw = 0 mod I_k}      I_0 > I_1 > ... > I_K = I_{K+1}

By Frobenius' theorem I_K is spanned by dim I_K differentials, those of g among them: R. L. Bryant et al., *Exterior Differential Systems*,
Springer 1991, chapter II. In time, a(q, t) is the column of the time.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

from daebench.diagnostics.written_integrals import CLOSE, Positions, Written, echelon, simple, written
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.systems.lazily import mpmath as mp
from daebench.systems.lazily import sympy as sp

DIGITS = 120
"""Digits that are computed with. A difference loses a third: after four levels twenty are left."""

LARGEST = 40
"""Most positions of a problem that is examined: differences with so many digits take their time."""

POINTS = 2
"""Points at which the flag is computed; at special ones it may be larger."""

Forms = Callable[[Any], Any]
"""Rows of forms at a point, shape(m, d)."""


def kernel(rows: Any, pivots: list[int]) -> Any:
    """Return vectors that rows in reduced echelon form send to 0, shape(d - r, d)."""
    free = [j for j in range(rows.shape[1]) if j not in pivots]
    vectors = np.zeros((len(free), rows.shape[1]), dtype=object)
    vectors[range(len(free)), free] = 1
    vectors[:, pivots] = -rows[:, free].T
    return vectors


def derived_flag(forms: Forms, q: Array, least: int = 0) -> list[int]:
    """Return the dimensions of I_0, I_1, ..., I_K at a point, by differences with many digits.

    Parameters
    ----------
    forms : callable
        Rows of the forms at a point, as an array of mpmath numbers of shape(m, d).
    q : ndarray, shape(d,)
        The point.
    least : int
        Number of independent forms that are known to be differentials.
    """
    pivots = dict[int, list[int]]()

    def reduced(level: int, at: Any) -> Any:
        rows = forms(at) if level == 0 else _next(reduced, level - 1, pivots[level - 1], at)
        sizes = np.max(np.abs(rows), axis=1, initial=0)
        rows, columns = echelon(rows / np.where(sizes > 0, sizes, 1)[:, None], pivots.get(level))
        pivots.setdefault(level, columns)
        return rows

    with mp.workdps(DIGITS):
        base = np.array([mp.mpf(float(x)) for x in q], dtype=object)
        dimensions = [len(reduced(0, base))]
        while dimensions[-1] > least:
            dimensions.append(len(reduced(len(dimensions), base)))
            if dimensions[-1] == dimensions[-2]:
                return dimensions[:-1]
    return dimensions


def _next(reduced: Callable[[int, Any], Any], level: int, pivots: list[int], q: Any) -> Any:
    """Return rows that span {w in I : dw = 0 mod I}: dw(x, y) = (D_x w) y - (D_y w) x on vectors x, y that I sends to 0."""
    rows = reduced(level, q)
    vectors = kernel(rows, pivots)
    # A difference of values with n digits is best with a step of n/3 digits.
    step = mp.mpf(10) ** int(-DIGITS * (2 / 3) ** level / 3)
    slopes = [(reduced(level, q + step * x) - reduced(level, q - step * x)) / (2 * step) @ vectors.T for x in vectors]
    along = np.array(slopes, dtype=object).reshape(len(vectors), len(rows), len(vectors)).transpose(1, 0, 2)
    sizes = np.max(np.abs(along), axis=(1, 2), initial=0)
    scale = np.where(sizes > CLOSE**2, sizes, 1)[:, None]
    curl = (along - along.transpose(0, 2, 1)).reshape(len(rows), -1) / scale
    closed, columns = echelon(curl.T)
    return (kernel(closed, columns) if columns else np.eye(len(rows), dtype=int)) @ (rows / scale)


@dataclass(frozen=True)
class Integrability:
    """How many combinations of the constraints on velocities are derivatives of functions of the positions.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem.
    count : int
        Their number, besides those that follow from g.
    flag : tuple of int
        Dimensions of I_0, I_1, ..., I_K, those of g among them.
    functions : tuple of Written
        The functions, as far as they were written.
    """

    ivp: ConstrainedIvp
    count: int
    flag: tuple[int, ...]
    functions: tuple[Written, ...]

    @property
    def words(self) -> str:
        """It in words."""
        of = self.ivp.m - self.ivp.holonomic
        if not self.count:
            those = "the constraint on velocities is" if of == 1 else f"the {of} constraints on velocities are"
            return f"{those} nonholonomic, since no combination is the derivative of a function of the positions"
        texts = [self._of(x) for x in self.functions]
        if rest := self.count - len(texts):
            texts.append(f"{rest} of these as no function that could be written")
        return f"{self.count} of {of} constraints on velocities {'is' if self.count == 1 else 'are'} on positions: {'; '.join(texts)}"

    def _of(self, one: Written) -> str:
        names = self.ivp.listed(self.ivp.holonomic + k for k in one.constraints)
        makes, those = ("combine to", "one of them") if len(one.constraints) > 1 else ("is, up to a factor,", "it")
        return f"{names} {makes} {one.function} = const; give this as g in place of {those}"


def integrability(ivp: ConstrainedIvp) -> Integrability | None:
    """Return which combinations of the constraints on velocities are on positions; None if there are too many, or no points."""
    positions = Positions(ivp)
    if ivp.d > LARGEST or not any(True for _ in positions.around(POINTS, positions.par)):
        return None
    functions = written(positions, positions.q)
    call = sp.lambdify([positions.q, positions.symbols], positions.G.tolist(), "mpmath", cse=True)
    par = [mp.mpf(x) for x in ivp.par]
    flags = []
    for q in islice(positions.around(4 * POINTS, positions.par), POINTS):
        rank = np.linalg.matrix_rank(positions.rows(q, positions.par)[: ivp.holonomic], tol=CLOSE) if ivp.holonomic else 0
        flag = derived_flag(lambda x: np.array(call(list(x), par), dtype=object), q, rank + len(functions))
        flags.append((flag[-1] - rank, flag))
    count, dimensions = min(flags)
    if count > len(functions):
        functions = written(positions, simple(positions), functions)
    return Integrability(ivp, count, tuple(dimensions), tuple(functions))
