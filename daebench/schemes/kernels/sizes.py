"""What a linear system is solved for: constants that are settled where a kernel of linear algebra is put into a module."""

UNKNOWNS: int = 1
"""Number of unknowns."""

COLUMNS: int = 2
"""Number of columns of the matrix and of the right sides beside it."""

DEPENDENT: float = 4e-11
"""What is left of a column, relative to the first, below which least squares take it for dependent."""

WIDTH: int = 1
"""Half-bandwidth of a banded matrix."""
