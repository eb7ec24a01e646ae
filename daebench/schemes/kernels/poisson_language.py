# mypy: disable-error-code="empty-body"
"""Extension of :mod:`daebench.schemes.kernels.language` for Poisson systems.

The state is one vector y, shape(n,). Schemes that treat its halves differently take y = (u, v, c): u and v of the same length, and c,
which no step changes: the Casimir coordinates of a canonical form.
"""

from daebench.schemes.kernels.spaces import Half, HalfMatrix, Matrix, Number, Report, Vector, declare

# ---- constants, known when the file is executed ----------------------------------------------------------------------------

DENSE: bool = True
"""Derivatives of the vector field exist, so that equations are solved by Newton's iteration; otherwise by fixed-point iteration."""

BOUNDED: bool = False
"""The system declares a domain that its states may not leave."""

# ---- the system ----------------------------------------------------------------------------------------------------------


def step(y0: Vector, h: Number) -> tuple[Vector, Report]:
    """y1 and a report."""


def field(y: Vector) -> Vector:
    """Right side B(y) grad H(y), HLW (2.12)."""


def field_y(y: Vector) -> Matrix:
    """Derivative of the right side, shape(n, n)."""


def rate_u(y: Vector) -> Half:
    """The half u of the right side."""


def rate_v(y: Vector) -> Half:
    """The half v of the right side."""


def rate_u_u(y: Vector) -> HalfMatrix:
    """Derivative of the half u of the right side with respect to u."""


def rate_v_v(y: Vector) -> HalfMatrix:
    """Derivative of the half v of the right side with respect to v."""


def before(y: Vector, time: tuple[Number]) -> Vector:
    """Flows of all parts but the last over a time, the first part first."""


def turn(y: Vector, time: tuple[Number]) -> Vector:
    """Flow of the last part over a time."""


def after(y: Vector, time: tuple[Number]) -> Vector:
    """Flows of all parts but the last over a time, the first part last."""


def inside(y: Vector) -> bool:
    """Whether a state, in the system's own coordinates, is in its domain."""


def chart(y: Vector) -> Vector:
    """State in the system's own coordinates at the coordinates of a scheme."""


# ---- algebra -------------------------------------------------------------------------------------------------------------


def first_half(y: Vector) -> Half:
    """The half u of a state."""


def second_half(y: Vector) -> Half:
    """The half v of a state."""


def joined(u: Half, v: Half, y: Vector) -> Vector:
    """The state (u, v, c) with the c of y."""


declare(globals())
