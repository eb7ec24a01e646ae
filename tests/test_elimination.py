"""Elimination with scaled pivots: it does not mind how rows and columns are scaled, and tells rank loss."""

import numpy as np

from daebench.elimination import SINGULAR, eliminate


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
