"""Sizes of linear systems: constants that are evaluated when a kernel of linear algebra is put into a module."""

UNKNOWNS: int = 1
"""Number of unknowns."""

COLUMNS: int = 2
"""Number of columns of the matrix and of the right sides beside it."""

DEPENDENT: float = 4e-11
"""Remainder of a column, relative to the first, below which least squares treat it as dependent."""

WIDTH: int = 1
"""Half-bandwidth of a banded matrix."""
