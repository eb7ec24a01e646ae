"""Gaussian elimination of a banded matrix, row by row, with a window of the rows that are still coupled.

With half-bandwidth WIDTH the window has WIDTH + 1 rows, whose entries begin at the column that is eliminated next, and end with the right
side. Former pivot rows are stored in ``U``, with the inverse of the pivot in place of the pivot. ``size``, with a row to spare,
has the sums of moduli of the terms that each entry was computed from, and ``scale`` the largest modulus of each row when it came.
"""

from typing import Any

from numpy import absolute, empty, zeros

from daebench.schemes.kernels.language import INF
from daebench.schemes.kernels.sizes import WIDTH


def push(window: Any, size: Any, scale: Any, row: int) -> None:
    """Store the moduli of the entries of a new row of the window, and the largest modulus."""
    largest = abs(window[row, 0])
    for j in range(2 * WIDTH + 1):
        size[row, j] = abs(window[row, j])
        largest = max(largest, size[row, j])
    scale[row] = largest


def pivot_row(window: Any, scale: Any, rows: int) -> int:
    """Return the row whose entry in the first column is largest relative to the scale of its row."""
    best = 0
    for i in range(1, rows):
        # Multiplied out, because the scale of a row of zeros is 0.
        if abs(window[i, 0]) * scale[best] > abs(window[best, 0]) * scale[i]:
            best = i
    return best


def exchange(window: Any, size: Any, scale: Any, best: int) -> None:
    """Exchange the first row and another."""
    for j in range(2 * WIDTH + 2):
        window[0, j], window[best, j] = window[best, j], window[0, j]
    for j in range(2 * WIDTH + 1):
        size[0, j], size[best, j] = size[best, j], size[0, j]
    scale[0], scale[best] = scale[best], scale[0]


def reduce(window: Any, size: Any, scale: Any, rows: int, U: Any, column: int) -> None:
    """Subtract multiples of the pivot row from the others, which move up by a row and left by a column."""
    for j in range(2 * WIDTH + 1):
        # The first row moves out of the window below: its sums are needed after that, in the row to spare.
        size[WIDTH + 1, j] = size[0, j]
    for i in range(1, rows):
        f = window[i, 0] * U[column, 0]
        for j in range(1, 2 * WIDTH + 1):
            window[i - 1, j - 1] = window[i, j] - f * U[column, j]
            size[i - 1, j - 1] = size[i, j] + abs(f) * size[WIDTH + 1, j]
        window[i - 1, 2 * WIDTH] = 0.0
        size[i - 1, 2 * WIDTH] = 0.0
        window[i - 1, 2 * WIDTH + 1] = window[i, 2 * WIDTH + 1] - f * U[column, 2 * WIDTH + 1]
        scale[i - 1] = scale[i]


def settle(window: Any, size: Any, scale: Any, rows: int, U: Any, column: int, smallest: Any) -> Any:
    """Eliminate a column with scaled partial pivoting among a number of rows, which leaves one row less.

    Returns the smallest relative pivot so far: each is taken relative to the sum of moduli of the terms that it was computed from.
    """
    best = pivot_row(window, scale, rows)
    if best != 0:
        exchange(window, size, scale, best)
    share = abs(window[0, 0]) / size[0, 0] if size[0, 0] > 0.0 else 0.0 * scale[0]
    # "not >=", so that NaN is taken, too.
    if not share >= smallest:
        smallest = share
    # One division for each column; everything else are products.
    U[column, 0] = 1.0 / window[0, 0]
    for j in range(1, 2 * WIDTH + 2):
        U[column, j] = window[0, j]
    reduce(window, size, scale, rows, U, column)
    return smallest


def solve(system: Any) -> Any:
    """Return the solution of a system, and the smallest relative pivot.

    Row r of the system, shape(n, 2 WIDTH + 2), has the entries from column r - WIDTH to column r + WIDTH, and the right side last.
    """
    unknowns = len(system)
    window = zeros((WIDTH + 2, 2 * WIDTH + 2), dtype=system.dtype)
    size = absolute(window)
    scale = size[:, 0].copy()
    U = empty((unknowns, 2 * WIDTH + 2), dtype=system.dtype)
    rows, column, smallest = 0, 0, INF
    for entering in range(unknowns + WIDTH):
        if entering < unknowns:
            for j in range(2 * WIDTH + 2):
                window[rows, j] = 0.0
            for j in range(WIDTH - rows, 2 * WIDTH + 1):
                window[rows, rows - WIDTH + j] = system[entering, j]
            window[rows, 2 * WIDTH + 1] = system[entering, 2 * WIDTH + 1]
            row = rows
            push(window, size, scale, row)
            rows += 1
        # A column may be eliminated when every row that reaches it has come; at the end of the matrix no more rows come.
        if rows > WIDTH or (entering >= unknowns - 1 and rows > 0):
            smallest = settle(window, size, scale, rows, U, column, smallest)
            rows -= 1
            column += 1
    x = zeros(unknowns + 2 * WIDTH, dtype=system.dtype)
    for k in range(unknowns - 1, -1, -1):
        t = U[k, 2 * WIDTH + 1]
        for j in range(1, 2 * WIDTH + 1):
            t -= U[k, j] * x[k + j]
        x[k] = t * U[k, 0]
    return x, smallest
