"""The derivative of a map along vectors: by complex step where differences of real states agree with it, otherwise by differences."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daebench.errors import BadInput, DaebenchError, RunFailed
from daebench.runs.trajectory import Array

Mapping = Callable[[NDArray[Any]], Any]
"""A map x -> x of vectors of shape(n,), real or complex, that leaves its argument unchanged."""

STEP = 1e-30
"""Imaginary step: its square underflows, so the derivative has no truncation or cancellation error."""

FIRST, SHRINK, LEVELS = 2.0**-8, 4.0, 9
"""First change of x of the difference quotients, relative to its size; factor between steps; largest number of steps."""

NEAR = 2.0**-17
"""First change if they disagree."""

LONGEST = 3
"""Number of levels without improvement after which the differences end."""

ENOUGH = 1e-10
"""Differences that have converged to this part of the largest are not refined."""

ROUGH = 1e-4
"""Differences that do not converge to this part of the largest are of little value."""

ALLOWED = 8.0
"""A complex step agrees with differences if it differs from them by at most this multiple of their floor."""


class DerivativeWarning(UserWarning):
    """The complex step does not give the derivative."""


@dataclass(frozen=True)
class Derivative:
    """The derivative of a map along vectors, and its value.

    Parameters
    ----------
    value : ndarray, shape(n, k)
        Phi'(x) X.
    image : ndarray, shape(n,)
        Phi(x).
    floor : float
        Largest error of the value by differences, relative to its largest entry; 0 for a complex step.
    """

    value: Array
    image: Array
    floor: float = 0.0


def derivative(phi: Mapping, x: ArrayLike, X: ArrayLike, parts: int = 1) -> Derivative:
    """Return Phi'(x) X by complex step if differences of real states agree with it, otherwise by those differences.

    ::

        Phi'(x) X_k = Im Phi(x + i s X_k) / s,      s = 1e-30

    A map that drops imaginary parts, all or some, for example because an iteration inside it uses real numbers, has a wrong derivative by
    complex step. The derivative along one vector, a sum of all X_k with irregular weights, is therefore also computed by central
    differences, extrapolated until they converge; and by smaller ones if these disagree, because a map may be smooth only in pieces. If
    the complex step agrees with neither to within their floor, all X_k are differentiated by differences, and a
    :class:`DerivativeWarning` states the floor. Differences that do not converge, as between masses of a ratio of 1e8, refute only a
    derivative of zero. An iteration that ends too early is not a dropped imaginary part: the derivative is that of the map as computed.

    Parameters
    ----------
    phi : callable
        The map.
    x : array_like, shape(n,)
        The point.
    X : array_like, shape(n, k)
        Directions.
    parts : int
        Number of parts of x, of equal length, that have units of their own: 2 for x = (p, q).

    Raises
    ------
    BadInput
        If neither the complex step nor differences give it.
    """
    x, X = np.asarray(x, dtype=float), np.asarray(X, dtype=float)
    if not X.size:
        return Derivative(X, np.asarray(_vector(phi, x), dtype=float))
    value, image, why = _by_complex_step(phi, x, X)
    if value is not None and not (np.all(np.isfinite(value)) and np.all(np.isfinite(image))):
        return Derivative(value, image)
    # One direction that mixes all of them with irregular weights: checking each would cost as much as differences alone.
    weights = np.cos(1.0 + np.arange(X.shape[1]))
    along, floor = _by_differences(phi, x, X @ weights, parts, FIRST)
    share = _share(along, floor, parts)
    if value is not None:
        # Differences that do not converge agree with anything. They still refute a derivative that is zero throughout a part.
        if _agree(value @ weights, along, floor) and (share <= ROUGH or _nowhere_zero(value @ weights, parts)):
            return Derivative(value, image)
        # Smooth in pieces only, a map may have a kink within the first, larger steps.
        near, near_floor = _by_differences(phi, x, X @ weights, parts, NEAR)
        if _agree(value @ weights, near, near_floor) and _share(near, near_floor, parts) <= ROUGH:
            return Derivative(value, image)
    if share > ROUGH:
        raise BadInput(
            f"the map has no derivative by complex step, because {why}, and its differences converge only to {share:.1e} of it; let it "
            "compute in complex numbers throughout, or iterate to round-off.",
            "map-not-differentiable",
        )
    columns = [_by_differences(phi, x, direction, parts, FIRST) for direction in X.T]
    share = max(_share(along, floor, parts) for along, floor in columns)
    _warn(f"{why}; the derivative is by differences, with an error of up to {share:.1e} of its largest entry")
    return Derivative(np.array([column for column, _ in columns]).T, np.real(_vector(phi, x)).astype(float), share)


def _by_complex_step(phi: Mapping, x: Array, X: Array) -> tuple[Any, Any, str]:
    """Return Phi'(x) X and Phi(x), or None, and the reason for which they may be wrong."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", np.exceptions.ComplexWarning)  # the comparison with differences finds what is dropped
        try:
            columns = np.array([_vector(phi, x + 1j * STEP * direction) for direction in X.T])
        except DaebenchError:
            raise
        except Exception as error:  # noqa: BLE001 - whatever code of the user's own makes of complex numbers
            return None, None, f"it does not take complex numbers ({type(error).__name__})"
    return np.imag(columns).T / STEP, np.real(columns[0]), "it drops imaginary parts"


def _by_differences(phi: Mapping, x: Array, direction: Array, parts: int, first: float) -> tuple[Array, Array]:
    """Return Phi'(x) along a direction, with the error of each entry, by central differences extrapolated to s = 0.

    Steps are relative to the size of each part of x or of its image, which shows the size of a momentum that begins at rest; or to x
    alone, if that converges better. The floor of an entry is the difference of the last two extrapolations, in the worst entry of its part,
    plus the rounding of the images at the smallest step that was used.
    """
    image = np.real(_vector(phi, x))
    best: tuple[Array, Array] = np.zeros(len(image)), np.full(len(image), np.inf)
    for reference in (image, x):
        moving = _sizes(x, reference, parts)
        s = first / (float(np.max(np.abs(direction) / moving)) or 1.0)
        estimate = _extrapolated(phi, x, direction, parts, s, image)
        best = min(best, estimate, key=lambda pair: _share(pair[0], pair[1], parts))
        if _share(best[0], best[1], parts) <= ROUGH:
            break
    return best


def _extrapolated(phi: Mapping, x: Array, direction: Array, parts: int, s: float, image: Array) -> tuple[Array, Array]:
    """Return the same for one first step s; the quotients end when they no longer converge."""
    best, error, share = np.zeros(len(image)), np.full(len(image), np.inf), np.inf
    last: list[Array] = []
    now = np.inf
    for level in range(LEVELS):
        row = [_quotient(phi, x, direction, s)]
        # Richardson's extrapolation: the error of a central difference is a series in even powers of s.
        for k, coarser in enumerate(last):
            row.append(row[k] + (row[k] - coarser) / (SHRINK ** (2 * k + 2) - 1.0))
        if len(row) > 1:
            # The last term is the rounding of the images, which a division by s enlarges: it ends the gain from smaller steps.
            off = np.maximum(np.abs(row[-1] - row[-2]), np.abs(row[-1] - last[-1])) + np.finfo(float).eps * np.abs(image) / s
            sizes = _sizes(off, off, parts)
            now = _share(row[-1], sizes, parts)
            if now < share:
                best, error, share = row[-1], sizes, now
        if share <= ENOUGH or (level > LONGEST and now > share):
            break
        # A row without a value, as of an implicit step that has no solution so far away, begins the table anew.
        last, s = row if np.all(np.isfinite(row[0])) else [], s / SHRINK
    return best, error


def _quotient(phi: Mapping, x: Array, direction: Array, s: float) -> Array:
    """Return the central difference quotient of a real map; NaN if the map has no image, as for an implicit step that is too large."""
    try:
        forth, back = (np.real(_vector(phi, x + sign * s * direction)) for sign in (1.0, -1.0))
    except RunFailed:
        return np.full(len(x), np.nan)
    return np.asarray((forth - back) / (2.0 * s), dtype=float)


def _vector(phi: Mapping, x: NDArray[Any]) -> NDArray[Any]:
    return np.ravel(np.asarray(phi(x)))


def _sizes(x: Array, image: Array, parts: int) -> Array:
    """Return the size of the part that each entry belongs to: its largest modulus in either of two vectors, or of all where it is zero."""
    moduli = np.maximum(np.abs(x), np.abs(image)) if len(x) == len(image) else np.abs(x)
    whole = float(np.max(moduli)) or 1.0
    if len(moduli) % parts:
        return np.full_like(moduli, whole)
    largest = np.max(moduli.reshape(parts, -1), axis=1)
    return np.repeat(np.where(largest > 0, largest, whole), len(moduli) // parts)


def _share(along: Array, floor: Array, parts: int) -> float:
    """Return the largest floor relative to the size of its part."""
    return float(np.max(floor / _sizes(along, along, parts)))


def _agree(value: Array, along: Array, floor: Array) -> bool:
    return bool(np.all(np.abs(value - along) <= ALLOWED * floor))


def _nowhere_zero(along: Array, parts: int) -> bool:
    """Return whether no part is zero throughout; a part that is cast to real numbers is."""
    return all(bool(np.any(part)) for part in np.array_split(along, parts))


def _warn(what: str) -> None:
    warnings.warn(f"of the map whose derivative is taken: {what}.", DerivativeWarning, stacklevel=4)
