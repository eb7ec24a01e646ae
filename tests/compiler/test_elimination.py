"""Elimination with scaled pivots: it does not mind how rows and columns are scaled, and tells rank loss."""

import numpy as np
import pytest

from daebench.compiler.linear import elimination_compiled
from daebench.compiler.linear.elimination import SINGULAR, eliminate, solve_rows
from daebench.compiler.linear.kernels import array_solver


def test_elimination_solves_and_does_not_mind_how_rows_and_columns_are_scaled():
    rng = np.random.default_rng(3)
    A, B = rng.normal(size=(6, 6)), rng.normal(size=(6, 2))
    scaled = np.diag(10.0 ** np.arange(-12, 12, 4)) @ A @ np.diag(10.0 ** np.arange(12, -12, -4))
    X, pivot = B.copy(), eliminate(A.copy(), B.copy())
    eliminate(A.copy(), X)
    assert np.allclose(A @ X, B, rtol=0, atol=1e-13)
    assert eliminate(scaled, B.copy()) > 1e-3 * pivot


def test_elimination_tells_a_singular_matrix_from_a_badly_scaled_one():
    rng = np.random.default_rng(4)
    A = rng.normal(size=(5, 5))
    A[4] = A[:4].T @ rng.normal(size=4)
    assert eliminate(A, np.ones((5, 1))) < SINGULAR
    assert eliminate(np.array([[1e8, 0, 1.0], [0, 1e-8, 1.0], [1.0, 1.0, 0]]), np.ones((3, 1))) > 0.1
    assert not eliminate(np.array([[np.nan, 1.0], [1.0, 0.0]]), np.ones((2, 1))) > SINGULAR


def matrix(kind, n, rng):
    A = rng.normal(size=(n, n)) * 10.0 ** rng.integers(-8, 9, size=(n, 1))
    if kind == "tied":
        return np.sign(A)
    return A * (np.arange(n) != 2) if kind == "singular" else A


@pytest.mark.parametrize("kind", ["regular", "tied", "singular"])
@pytest.mark.parametrize("sides", [0, 3], ids=["one side", "four sides"])
def test_elimination_by_rows_gives_each_number_of_that_by_entries(kind, sides):
    rng, n = np.random.default_rng(5), 9
    module = {"numpy": np, "absolute": np.absolute, "empty": np.empty, "INF": np.inf, "solve_rows": solve_rows}
    exec(array_solver("elimination", "entries", n, "float64", sides), module)
    A, b, X = matrix(kind, n, rng), rng.normal(size=n), rng.normal(size=(sides, n))
    others = (tuple(map(tuple, X)),) if sides else ()
    exec(array_solver("", "by_rows", n, "float64", sides), module)
    with np.errstate(all="ignore"):
        found, expected = module["by_rows"](A, b, *others), module["entries"](A, b, *others)
    assert len(found) == len(expected) == 2 + bool(sides)
    for one, other in zip(found, expected, strict=True):
        assert np.array_equal(one, other, equal_nan=True)
    if kind == "regular":
        assert np.allclose(A @ np.array(found[0]), b, rtol=0, atol=1e-12 * np.max(np.abs(A)))


@pytest.mark.parametrize("kind", ["regular", "tied", "singular"])
def test_elimination_handed_to_numba_gives_the_same_numbers(kind):
    rng, n = np.random.default_rng(6), 7
    A, B = matrix(kind, n, rng), rng.normal(size=(n, 3))
    X, Y = B.copy(), B.copy()
    assert np.array_equal(eliminate(A.copy(), X), elimination_compiled.eliminate(A.copy(), Y), equal_nan=True)
    assert np.array_equal(X, Y, equal_nan=True)
    if kind == "regular":
        assert np.abs(A @ X - B).max() < 1e-14 * n * np.abs(A).max() * np.abs(X).max()
