"""Elimination with scaled pivots: it does not mind how rows and columns are scaled, and tells rank loss; and least squares."""

import numpy as np
import pytest
import uncompiled
from recorded import compiled

from daebench.compiler.callbacks import SINGULAR
from daebench.compiler.linear.compiled_solvers import eliminate
from daebench.compiler.linear.kernels import array_solver

EPS = np.finfo(float).eps


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


def test_elimination_tells_a_number_that_is_none_wherever_it_stands():
    for place in [(i, j) for i in range(4) for j in range(4)]:
        A = np.random.default_rng(8).normal(size=(4, 4))
        A[place] = np.nan
        assert not eliminate(A, np.ones((4, 1))) > SINGULAR


def matrix(kind, n, rng):
    A = rng.normal(size=(n, n)) * 10.0 ** rng.integers(-8, 9, size=(n, 1))
    if kind == "tied":
        return np.sign(A)
    return A * (np.arange(n) != 2) if kind == "singular" else A


@pytest.mark.parametrize("kind", ["regular", "tied", "singular"])
@pytest.mark.parametrize(("kernel", "sides"), [("elimination", None), ("elimination", 0), ("elimination", 3), ("least_squares", None)])
def test_a_compiled_solver_gives_each_number_of_its_kernel_in_python(kernel, kind, sides):
    rng, n = np.random.default_rng(5), 9
    text = f"INF = inf\n{array_solver(kernel, 'root', n, 'float64', sides)}"
    A, b, X = matrix(kind, n, rng), rng.normal(size=n), rng.normal(size=(sides or 0, n))
    others = (tuple(map(tuple, X)),) if sides is not None else ()
    with np.errstate(all="ignore"):
        found, expected = compiled(text)(A, b, *others), uncompiled.run(text, "solver").root(A, b, *others)
    assert len(found) == len(expected) == 2 + (sides is not None)
    for one, other in zip(found, expected, strict=True):
        assert np.array_equal(one, other, equal_nan=True)
    if kind == "regular":
        residuals = np.abs(A @ np.array(found[0]) - b)
        assert np.all(residuals <= 10 * n * EPS * (np.abs(A) @ np.abs(found[0]) + np.abs(b)))
