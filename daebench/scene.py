"""A scene: one problem with the numbers of one case, which is what every method is handed."""

import types
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from daebench.cache import generated
from daebench.errors import BadInput, unknown
from daebench.inputs import real

if TYPE_CHECKING:
    from daebench.derive import Derivation
    from daebench.problem import ConstrainedHamiltonian

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Source:
    """Where a definition comes from: it is made, and SymPy imported, only when something is derived.

    Parameters
    ----------
    problem : str
        Name of the problem.
    key : str
        Text that decides the definition, hashed before anything is imported.
    define : callable
        Returns the definition.
    defaults : mapping of str to float, optional
        Values of parameters that replace those of the sheet.
    """

    problem: str
    key: str = field(repr=False)
    define: Callable[[], "ConstrainedHamiltonian"] = field(repr=False)
    defaults: Mapping[str, float] | None = None

    @cached_property
    def derivation(self) -> "Derivation":
        """Everything that follows from the definition, shared by all that ask."""
        from daebench.derive import Derivation

        return Derivation(self.define())

    def form(self, name: str) -> "Derivation":
        """Return everything that follows from the definition in a form of the system: all but "local" are in its own coordinates."""
        return self._local if name == "local" else self.derivation

    @cached_property
    def _local(self) -> "Derivation":
        from daebench.derive_local import LocalDerivation

        return LocalDerivation(self.derivation)

    @cached_property
    def sheet(self) -> types.ModuleType:
        """Sizes, names and initial values."""

        def build(cached: bool) -> str:
            from daebench import sheet

            return sheet.source(self.problem, self.derivation)

        return generated(f"{self.problem}_sheet", self.key, build)


def source_of(problem: "ConstrainedHamiltonian", name: str = "problem") -> Source:
    """Return the source of a definition made in this process."""
    defaults = {str(symbol): float(value) for symbol, value in problem.parameters.items()}
    return Source(name, problem.fingerprint, lambda: problem, defaults)


@dataclass(frozen=True)
class Scene:
    """One problem with the numbers of one case.

    Parameters
    ----------
    source : Source
        The definition.
    case : str
        Name of the case.
    parameters : mapping of str to float
        Run-time parameters in the order of ``par``.
    p0, q0 : ndarray, shape(d,)
        Initial momenta and positions.
    """

    source: Source
    case: str
    parameters: Mapping[str, float]
    p0: Array
    q0: Array

    @property
    def problem(self) -> str:
        """Name of the problem."""
        return self.source.problem

    @property
    def sheet(self) -> types.ModuleType:
        """Sizes, names and initial values of the problem."""
        return self.source.sheet

    @property
    def par(self) -> tuple[float, ...]:
        """Run-time parameters as kernels take them."""
        return tuple(self.parameters.values())

    @property
    def d(self) -> int:
        """Number of positions."""
        return int(self.sheet.D)

    @property
    def m(self) -> int:
        """Number of constraints."""
        return int(self.sheet.M)

    @property
    def integrals(self) -> tuple[str, ...]:
        """Names of the first integrals besides H."""
        return tuple(self.sheet.INTEGRALS)

    def functions(self, *names: str) -> types.ModuleType:
        """Return a module of the problem's functions of these names, uncompiled: tuples in, tuples out."""

        def build(cached: bool) -> str:
            from daebench.link import HOLE, Linker, Options

            linker = Linker(self.source.derivation, Options(compiled=False))
            return linker.module(f"Functions of {self.problem}.", [(HOLE, name) for name in names], cached)

        return generated(f"{self.problem}_{'_'.join(names)}", f"{self.source.key} functions {names}", build)

    def value(self, name: str, *arguments: Iterable[Any]) -> NDArray[Any]:
        """Return one of the problem's functions of (p, q), or of q, at one point."""
        with np.errstate(all="ignore"):
            points = (tuple(map(_number, x)) for x in arguments)
            return np.array(getattr(self.functions(name), name)(*points, tuple(map(np.float64, self.par))))

    def along(self, name: str, *arguments: Array) -> Array:
        """Return one of the problem's functions along rows of states.

        Parameters
        ----------
        name : str
            Name in ``kernels/hole.py`` or ``kernels/composed.py``: H, g, Gv, integrals, lam, ...
        arguments : ndarray, shape(n, d)
            One state a row.

        Returns
        -------
        ndarray, shape(n, ...)
        """
        module = self.functions(name)
        call = getattr(module, name)
        par = tuple(map(np.float64, self.par))
        with np.errstate(all="ignore"):
            if not module.ELEMENTWISE:
                return np.array([call(*map(tuple, row), par) for row in zip(*arguments, strict=True)])
            columns = call(*(tuple(x.T) for x in arguments), par)
            return _stacked(columns, len(arguments[0]))


def _number(x: Any) -> Any:
    """Return a NumPy number, which divides by zero as IEEE says; Python's own raises."""
    return np.complex128(x) if isinstance(x, complex) else np.float64(x)


def _stacked(values: Any, n: int) -> Array:
    """Return nested tuples of columns as one array with the rows first."""
    if isinstance(values, tuple):
        return np.stack([_stacked(value, n) for value in values], axis=1) if values else np.empty((n, 0))
    return np.broadcast_to(np.asarray(values, dtype=float), (n,)).copy()


def make_scene(
    source: Source,
    case: str,
    parameters: Mapping[str, float] | None = None,
    *,
    p0: Sequence[float] | None = None,
    q0: Sequence[float] | None = None,
) -> Scene:
    """Return the scene of a case, with parameters and initial values replaced where they are given.

    Raises
    ------
    BadInput
        If the case or a parameter is unknown, or a value is not a finite number.
    """
    sheet = source.sheet
    free = not sheet.CASES and p0 is not None and q0 is not None
    if case not in sheet.CASES and not free:
        raise unknown(f"case of {source.problem}", case, sheet.CASES)
    values: dict[str, float] = dict(source.defaults or sheet.PARAMETERS)
    if not free:
        values |= {name: float(value) for name, value in sheet.CASES[case]["parameters"].items() if name in values}
    for name, value in (parameters or {}).items():
        if name not in values:
            raise unknown(f"parameter of {source.problem}", name, values)
        values[name] = real(name, value)
    _require_positive(source.problem, sheet, values)
    start = () if free else _case_start(sheet, case, values)
    p, q = (start[k] if given is None else _initial(name, given, sheet.D) for k, (name, given) in enumerate((("p0", p0), ("q0", q0))))
    for name, array in (("p0", p), ("q0", q)):
        if not np.all(np.isfinite(array)):
            raise BadInput(f"{name} of {source.problem}, case {case}, is {array.tolist()}; it must be finite numbers.")
    return Scene(source, case, values, p, q)


def _require_positive(problem: str, sheet: types.ModuleType, values: Mapping[str, float]) -> None:
    for name in sheet.POSITIVE:
        if not values[name] > 0:
            raise BadInput(f"{name} = {values[name]:g} of {problem} must be greater than 0.")


def _case_start(sheet: types.ModuleType, case: str, values: Mapping[str, float]) -> tuple[Array, ...]:
    with np.errstate(all="ignore"):
        start = sheet.INITIAL[case](tuple(map(np.float64, values.values())))
    return tuple(np.array(x, dtype=float) for x in start)


def _initial(name: str, values: Any, d: int) -> Array:
    if isinstance(values, str) or not np.iterable(values):
        raise BadInput(f"{name} = {values!r} must be {d} numbers.")
    numbers = list(values)
    if len(numbers) != d:
        raise BadInput(f"{name} has {len(numbers)} numbers; the problem has {d} positions.")
    return np.array([real(f"{name}[{i}]", value) for i, value in enumerate(numbers)])
