# mypy: disable-error-code="empty-body"
"""The spaces of the vectors and matrices of a scheme, for annotations and for the type checker.

No object of these classes is ever made. Where a file is executed, :mod:`daebench.compiler.values` has the operators, by kinds that have the
names of these classes.
"""

from collections.abc import Iterator
from functools import wraps
from types import FunctionType
from typing import Any, Generic, NoReturn, TypeVar, overload

Number = float
"""A number of the run's type: float64, float32 or complex128."""

K = TypeVar("K")


class Linear(Generic[K]):
    """Elements of a linear space: their sums, and their multiples."""

    def __add__(self, other: K) -> K: ...

    def __sub__(self, other: K) -> K: ...

    def __neg__(self) -> K: ...

    def __mul__(self, w: Number) -> K: ...

    def __rmul__(self, w: Number) -> K: ...

    def __truediv__(self, w: Number) -> K: ...


class Vector(Linear["Vector"]):
    """Positions, momenta or velocities, shape(d,)."""

    @property
    def T(self) -> "Row":
        """The vector as a row."""

    def __getitem__(self, i: int) -> Number: ...


class Row:
    """The transpose of a vector."""


class Multiplier(Linear["Multiplier"]):
    """Multipliers or constraint values, shape(m,)."""

    def __getitem__(self, k: int) -> Number: ...

    def __matmul__(self, x: Row) -> "Rows": ...


class Rows(Linear["Rows"]):
    """A matrix of shape(m, d): a row for each constraint."""

    @property
    def T(self) -> "Columns":
        """The transpose, shape(d, m)."""

    def __getitem__(self, k: int) -> Vector: ...

    @overload
    def __matmul__(self, x: Vector) -> Multiplier: ...
    @overload
    def __matmul__(self, x: "Columns") -> "Gram": ...
    @overload
    def __matmul__(self, x: "Matrix") -> "Rows": ...
    def __matmul__(self, x: Any) -> Any: ...


class Jacobian(Rows):
    """G, shape(m, d); products omit its entries that are zero for every q."""


class Columns(Linear["Columns"]):
    """The transpose of a matrix of shape(m, d)."""

    @property
    def T(self) -> Rows:
        """The transpose, shape(m, d)."""

    @overload
    def __matmul__(self, x: Multiplier) -> Vector: ...
    @overload
    def __matmul__(self, x: Rows) -> "Matrix": ...
    def __matmul__(self, x: Any) -> Any: ...


class Matrix(Linear["Matrix"]):
    """A matrix of shape(d, d)."""

    def __getitem__(self, i: int) -> Vector: ...

    @property
    def T(self) -> "Matrix":
        """The transpose."""

    @overload
    def __matmul__(self, x: Vector) -> Vector: ...
    @overload
    def __matmul__(self, x: "Matrix") -> "Matrix": ...
    @overload
    def __matmul__(self, x: Columns) -> Columns: ...
    def __matmul__(self, x: Any) -> Any: ...


class InverseMass(Matrix):
    """H_pp; products with G omit its entries that are zero for every p and q."""


class Gram(Linear["Gram"]):
    """A matrix of shape(m, m)."""

    def __getitem__(self, k: int) -> Multiplier: ...


class Half(Linear["Half"]):
    """The half u or v of the state of a Poisson system."""


class HalfMatrix(Linear["HalfMatrix"]):
    """The derivative of a half of the right side with respect to a half."""


class Identity:
    """The identity, to which matrices are added."""

    @overload
    def __add__(self, X: Matrix) -> Matrix: ...
    @overload
    def __add__(self, X: HalfMatrix) -> HalfMatrix: ...
    def __add__(self, X: Any) -> Any: ...

    @overload
    def __sub__(self, X: Matrix) -> Matrix: ...
    @overload
    def __sub__(self, X: HalfMatrix) -> HalfMatrix: ...
    def __sub__(self, X: Any) -> Any: ...


I: Identity = Identity()  # noqa: E741
"""The identity matrix."""


class Data(float):
    """Run-time data: a number, or numbers in tuples of any depth, for example a tableau."""

    def __getitem__(self, i: int) -> "Data": ...

    def __iter__(self) -> "Iterator[Data]": ...

    def __len__(self) -> int: ...


State = Any
"""State of a step: (p, q) of a constrained system, y of a Poisson system."""

Report = tuple[int, Number, Number, Any]
"""Status, residual, smallest relative pivot, and Newton's work of a solve."""

Step = tuple[Vector, Vector, Any, Report]
"""Return values of a step: p1 and q1, or p1 - p0 and q1 - q0; the stage multipliers; and a report."""

Update = tuple[Any, Number, Number, Number, Number]
"""Return values of a Newton update: the next iterate, size and scale of its change, the residual and the smallest relative pivot."""


DATA: Data = Data()
"""Numbers of the scheme, its tableau or its options, as :class:`daebench.schemes.kernels.claims.Member` gives them: run-time data."""

FORM_DATA: Data = Data()
"""Numbers of the form of the system: alpha and beta of Baumgarte's, eps of the penalised one."""

LENGTH: Number = 0.0
"""Length of the initial value problem, see ``daebench/runs/scales.py``: the smallest scale of positions; run-time data."""

RATE: Number = 0.0
"""Rate of the initial value problem, 1/s; run-time data, only for schemes that run on every form of the system."""


def declare(names: dict[str, Any]) -> None:
    """Let the functions of a file of the language, given by its global names, raise an error: they are filled in for each problem."""

    def unlinked(function: FunctionType) -> Any:
        @wraps(function)
        def call(*_: Any, **__: Any) -> NoReturn:
            raise NotImplementedError("filled in for each problem")

        return call

    functions = {name: value for name, value in names.items() if isinstance(value, FunctionType) and value.__module__ == names["__name__"]}
    names.update({name: unlinked(function) for name, function in functions.items()})
