"""The health of the solution of a linear system: how close to singular its matrix is, NaN where a value is not finite."""

from typing import Any

SINGULAR = 1e-14
"""Relative pivots up to this size are round-off: the matrix may be singular."""


def finite(health: float, values: Any) -> float:
    """Return ``health``, or NaN if any of the values, shape(k,), is not finite."""
    wrong = False
    for value in values:
        wrong |= value - value != 0.0  # true if infinite or NaN; no operation waits for the one before, as in a sum
    return float("nan") if wrong else health


def finite_matrix(health: float, matrix: Any) -> float:
    """Return ``health``, or NaN if any entry of a matrix, shape(n, k), is not finite."""
    wrong = False
    for row in matrix:
        for value in row:
            wrong |= value - value != 0.0
    return float("nan") if wrong else health
