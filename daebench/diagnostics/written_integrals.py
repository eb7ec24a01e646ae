"""Functions f(q) that constraints keep without being told: df is a combination of rows of G, found among sums of simple functions.

::

    sum_k a_k dphi_k x = 0 for all x with G x = 0, at many points      phi: positions, then products of two of them or of functions in G

Rows of G may have any factors. A coefficient is a product of powers of parameters, where it follows such a law, or a number.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import Any

import numpy as np

from daebench.diagnostics.unit_rows import across, of_length_one
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.systems.lazily import sympy as sp

CLOSE = 1e-9
"""Relative difference that is one of rounding, also of parameters, which are decimals."""

MOST = 150
"""Most functions in a sum."""

STEPS = 30
"""Number of Gauss-Newton steps to a position that is allowed."""

SPREAD = 0.3
"""Distance of points from the start, relative to its largest coordinate."""


@dataclass(frozen=True)
class Written:
    """A function that constraints keep, and the constraints on velocities whose combination is its derivative."""

    function: "sp.Expr"
    constraints: tuple[int, ...]


class Positions:
    """Positions that the constraints of a problem allow, at random around its start, with the rows of G there."""

    def __init__(self, ivp: ConstrainedIvp) -> None:
        derivation = ivp.source.derivation
        self.q, self.symbols = list(derivation.q), list(derivation.parameters)
        self.G, self.q0, self.par, self.holonomic = derivation.G, np.asarray(ivp.q0), np.array(ivp.par, dtype=float), ivp.holonomic
        self._g = self.function(derivation.g[: self.holonomic, :].tolist())
        self.rows = self.function(derivation.G.tolist())

    def function(self, expressions: Sequence[Any]) -> Callable[[Array, Array], Array]:
        """Return expressions as a function of q and the parameters."""
        call = sp.lambdify([self.q, self.symbols], expressions, "numpy", cse=True)
        return lambda q, par: np.array(call(q, par), dtype=float)

    def around(self, count: int, par: Array) -> Iterator[Array]:
        """Yield positions; fewer where steps do not converge."""
        draw = np.random.default_rng(1)
        size = float(np.max(np.abs(self.q0))) or 1.0
        for _ in range(count):
            q = self.q0 + SPREAD * size * draw.standard_normal(len(self.q0))
            off = np.inf
            with np.errstate(all="ignore"), suppress(np.linalg.LinAlgError):
                for _ in range(STEPS):
                    step = _least(self.rows(q, par)[: self.holonomic], self._g(q, par).ravel())
                    q, off = q - step, np.max(np.abs(step))
                    if not off > CLOSE * CLOSE * size:
                        break
            if off <= CLOSE * size and np.all(np.isfinite(self.rows(q, par))):
                yield q

    def kept(self, functions: Sequence[Any], par: Array) -> Array:
        """Return a basis of the sums of functions that all motions keep, shape(k, n), in reduced echelon form."""
        slopes = self.function(sp.Matrix(functions).jacobian(self.q).tolist())
        count = 2 * len(functions) // max(len(self.q) - len(self.G[:, 0]), 1) + 8
        rates = [across(of_length_one(self.rows(q, par))) @ slopes(q, par).T for q in self.around(count, par)]
        A = np.vstack([np.zeros((1, len(functions))), *rates])
        sizes = np.linalg.norm(A, axis=0)
        sizes[sizes <= CLOSE] = 1.0
        _, values, vectors = np.linalg.svd(A / sizes)
        null = vectors[np.count_nonzero(values > CLOSE * values[0]) :]
        rows = echelon(null)[0]
        return np.asarray(np.where(np.abs(rows) > np.sqrt(CLOSE), rows, 0.0) / sizes)


def _least(A: Array, b: Array) -> Array:
    return np.asarray(np.linalg.lstsq(A, b, rcond=CLOSE)[0])


def echelon(rows: Any, columns: list[int] | None = None) -> tuple[Any, list[int]]:
    """Return the reduced echelon form of rows, which is unique for its span and pivots, and its pivots; of the given columns, or any."""
    rows, chosen = rows.copy(), list[int]()
    allowed = list(range(rows.shape[1])) if columns is None else list(columns)
    while len(chosen) < len(rows) and (left := [j for j in allowed if j not in chosen]):
        k, sizes = len(chosen), np.abs(rows[len(chosen) :, left])
        i, j = divmod(int(np.argmax(sizes)), len(left))
        if not sizes[i, j] > CLOSE:
            break
        rows[[k, k + i]] = rows[[k + i, k]]
        rows[k] = rows[k] / rows[k, left[j]]
        others = [n for n in range(len(rows)) if n != k]
        rows[others] = rows[others] - np.outer(rows[others, left[j]], rows[k])
        chosen.append(left[j])
    return rows[np.argsort(chosen).astype(int)], sorted(chosen)


def written(positions: Positions, functions: Sequence[Any], known: Sequence[Written] = ()) -> list[Written]:
    """Return those sums of functions that constraints on velocities keep whose differentials are independent of dg and those known."""
    integrals = list(known)
    for a in positions.kept(functions, positions.par) if len(functions) <= MOST else ():
        chosen = [k for k in range(len(functions)) if a[k] != 0]
        function = _expression(positions, [functions[k] for k in chosen], a[chosen])
        if constraints := _combined(positions, [x.function for x in integrals], function):
            integrals.append(Written(function, constraints))
    return integrals


def simple(positions: Positions) -> list[Any]:
    """Return positions, functions in G, and products of two of either."""
    single = [*positions.q, *sorted(positions.G.atoms(sp.Function), key=str)]
    return [*single, *(a * b for a, b in combinations_with_replacement(single, 2))]


def _combined(positions: Positions, known: Sequence[Any], function: Any) -> tuple[int, ...]:
    """Return the constraints on velocities that make up df; none if it depends on dg and differentials that are known."""
    slopes = positions.function(sp.Matrix([*known, function]).jacobian(positions.q).tolist())
    shares = []
    for x in positions.around(8, positions.par):
        rows, slope = positions.rows(x, positions.par), slopes(x, positions.par)
        before = np.vstack([rows[: positions.holonomic], slope[:-1]])
        rest = slope[-1] - _least(before.T, slope[-1]) @ before
        if np.linalg.norm(rest) <= np.sqrt(CLOSE) * np.linalg.norm(slope[-1]):
            return ()
        shares.append(np.abs(_least(rows.T, slope[-1])) * np.linalg.norm(rows, axis=1))
    share = np.max(shares, axis=0)[positions.holonomic :]
    return tuple(np.flatnonzero(share > np.sqrt(CLOSE) * np.max(share, initial=0.0)))


def _expression(positions: Positions, functions: Sequence[Any], a: Array) -> Any:
    """Return a sum of functions, with powers of parameters as its coefficients where these are their law."""
    par, a = positions.par, a / a[0]
    powers = np.zeros((len(par), len(a)))
    for k in range(len(par)):
        changed = np.array([x * (1.1 if i == k else 1.0) for i, x in enumerate(par)])
        basis = positions.kept(functions, changed)
        if len(basis) != 1 or not np.all(basis[0] / basis[0][0] * a > 0):
            return sum(_number(x) * f for x, f in zip(a, functions, strict=True))
        powers[k] = np.log(basis[0] / basis[0][0] / a) / np.log(1.1)
    powers = np.where(np.abs(powers - np.round(powers)) < np.sqrt(CLOSE), np.round(powers), 0.0)
    factors = [sp.Mul(*(s ** int(e) for s, e in zip(positions.symbols, column, strict=True))) for column in powers.T]
    numbers = [_number(x / float(f.subs(dict(zip(positions.symbols, par, strict=True))))) for x, f in zip(a, factors, strict=True)]
    total = sum(c * f * phi for c, f, phi in zip(numbers, factors, functions, strict=True))
    return total if total.has(sp.Float) else sp.factor_terms(sp.fraction(sp.together(total))[0])


def _number(x: float) -> Any:
    """Return a fraction with a small denominator where it is one, or a number of twelve digits."""
    fraction = sp.Rational(x).limit_denominator(1000)
    return fraction if abs(fraction - x) <= CLOSE * abs(x) else sp.Float(x, 12)
