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
    from daebench.chains.chain import ConstrainedChain
    from daebench.derive_local import LocalDerivation
    from daebench.poisson_lattice import PoissonLattice
    from daebench.poisson_system import PoissonSystem
    from daebench.problem import ConstrainedHamiltonian

    Definition = ConstrainedHamiltonian | ConstrainedChain | PoissonSystem | PoissonLattice

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
    algebra : str
        How a chain's vectors are held: "values" or "arrays", see ``chains.derivation``; "" as its size suggests.
    """

    problem: str
    key: str = field(repr=False)
    define: Callable[[], "Definition"] = field(repr=False)
    defaults: Mapping[str, float] | None = None
    algebra: str = ""

    @cached_property
    def derivation(self) -> Any:
        """Everything that follows from the definition, shared by all that ask: a Derivation or a PoissonDerivation."""
        return _derivation(self.define(), self.algebra)

    def form(self, name: str) -> Any:
        """Return everything that follows from the definition in a form of the system: most are in its own coordinates."""
        if name == "local":
            return self._local
        return self._darboux if name == "darboux" else self.derivation

    def split(self, splitting: str) -> Any:
        """Return everything that follows from the definition of a Poisson system with this splitting; "" for the first."""
        return self.derivation.split(splitting) if splitting else self.derivation

    @cached_property
    def _local(self) -> "LocalDerivation":
        from daebench.derive_local import LocalDerivation

        return LocalDerivation(self.derivation)

    @cached_property
    def _darboux(self) -> Any:
        if self.sheet.SITES:
            from daebench.lattice_derivation import DarbouxLattice

            return DarbouxLattice(self.derivation)
        from daebench.poisson_derivation import DarbouxDerivation

        return DarbouxDerivation(self.derivation)

    @cached_property
    def sheet(self) -> types.ModuleType:
        """Sizes, names and initial values."""

        def build(cached: bool) -> str:
            from daebench import lattice_sheet, poisson_sheet, sheet
            from daebench.chains import sheet as chain_sheet
            from daebench.chains.derivation import ChainDerivation
            from daebench.lattice_derivation import LatticeDerivation

            if isinstance(self.derivation, ChainDerivation):
                return chain_sheet.source(self.problem, self.derivation)
            if isinstance(self.derivation, LatticeDerivation):
                return lattice_sheet.source(self.problem, self.derivation)
            if self.derivation.states == "poisson":
                return poisson_sheet.source(self.problem, self.derivation)
            return sheet.source(self.problem, self.derivation)

        return generated(f"{self.problem}_sheet", self.key, build)


def _derivation(problem: "Definition", algebra: str) -> Any:
    from daebench.chains.chain import ConstrainedChain
    from daebench.problem import ConstrainedHamiltonian

    if isinstance(problem, ConstrainedChain):
        from daebench.chains.derivation import derived

        return derived(problem, algebra)
    if algebra == "arrays":
        raise BadInput("the problem is not written as a chain of nodes, so that its vectors cannot be arrays; leave out the algebra.")
    if isinstance(problem, ConstrainedHamiltonian):
        from daebench.derive import Derivation

        return Derivation(problem)
    from daebench.poisson_lattice import PoissonLattice

    if isinstance(problem, PoissonLattice):
        from daebench.lattice_derivation import LatticeDerivation

        return LatticeDerivation(problem)
    from daebench.poisson_derivation import PoissonDerivation

    return PoissonDerivation(problem)


def source_of(problem: "Definition", name: str = "problem", algebra: str = "") -> Source:
    """Return the source of a definition made in this process; ``algebra`` as for :class:`Source`."""
    defaults = {str(symbol): float(value) for symbol, value in problem.parameters.items()}
    return Source(name, f"{problem.fingerprint} {algebra}".rstrip(), lambda: problem, defaults, algebra)


@dataclass(frozen=True)
class Setting:
    """One problem with the numbers of one case, whatever its states are.

    Parameters
    ----------
    source : Source
        The definition.
    case : str
        Name of the case.
    parameters : mapping of str to float
        Run-time parameters in the order of ``par``.
    """

    source: Source
    case: str
    parameters: Mapping[str, float]

    @property
    def start(self) -> tuple[Array, ...]:
        """Initial values, in the order in which a state is stored."""
        raise NotImplementedError

    @property
    def size(self) -> int:
        """Number of numbers in a state."""
        return sum(map(len, self.start))

    @property
    def arrays(self) -> bool:
        """Whether the problem's functions take arrays, and are compiled: those of a lattice and of a long chain do."""
        return bool(getattr(self.sheet, "SITES", 0) or getattr(self.sheet, "NODES", 0))

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
    def integrals(self) -> tuple[str, ...]:
        """Names of the first integrals besides H."""
        return tuple(self.sheet.INTEGRALS)

    def functions(self, *names: str) -> types.ModuleType:
        """Return a module of the problem's functions of these names, uncompiled: tuples in, tuples out."""

        def build(cached: bool) -> str:
            from daebench.link import Linker, Options
            from daebench.syntax import HOLE

            linker = Linker(self.source.derivation, Options(compiled=self.arrays, singular=singular))
            return linker.module(f"Functions of {self.problem}.", [(HOLE, name) for name in names], cached)

        singular = "least-squares" if getattr(self, "on_singular", "") == "least-squares" else ""
        return generated(f"{self.problem}_{'_'.join(names)}", f"{self.source.key} functions {names} {singular}", build)

    def value(self, name: str, *arguments: Iterable[Any]) -> NDArray[Any]:
        """Return one of the problem's functions of (p, q), or of q, at one point."""
        with np.errstate(all="ignore"):
            points = (np.asarray(x) if self.arrays else tuple(map(_number, x)) for x in arguments)
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
                vector = np.asarray if self.arrays else tuple
                return np.array([call(*map(vector, row), par) for row in zip(*arguments, strict=True)])
            columns = call(*(tuple(x.T) for x in arguments), par)
            return _stacked(columns, len(arguments[0]))


@dataclass(frozen=True)
class Scene(Setting):
    """A constrained Hamiltonian system with the numbers of one case.

    Parameters
    ----------
    p0, q0 : ndarray, shape(d,)
        Initial momenta and positions.
    on_singular : str
        What a run does where G loses rank, unless its request says otherwise.
    """

    p0: Array
    q0: Array
    on_singular: str = "stop"

    @property
    def start(self) -> tuple[Array, ...]:
        """Initial momenta and positions."""
        return self.p0, self.q0

    @property
    def d(self) -> int:
        """Number of positions."""
        return int(self.sheet.D)

    @property
    def m(self) -> int:
        """Number of constraints."""
        return int(self.sheet.M)


@dataclass(frozen=True)
class PoissonScene(Setting):
    """A Poisson system with the numbers of one case.

    Parameters
    ----------
    y0 : ndarray, shape(n,)
        Initial state.
    """

    y0: Array

    @property
    def start(self) -> tuple[Array, ...]:
        """Initial state."""
        return (self.y0,)

    @property
    def casimirs(self) -> tuple[str, ...]:
        """Names of the Casimir functions."""
        return tuple(self.sheet.CASIMIRS)


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
    """Return the scene of a case of a constrained problem, with parameters and initial values replaced where they are given.

    Raises
    ------
    BadInput
        If the case or a parameter is unknown, a value is not a finite number, or the problem is a Poisson system.
    """
    return constrained(make_setting(source, case, parameters, p0=p0, q0=q0))


def constrained(setting: Setting) -> Scene:
    """Return a setting as that of a constrained problem; raise :class:`BadInput` where it is a Poisson system's."""
    if not isinstance(setting, Scene):
        raise BadInput(f"{setting.problem} is a Poisson system, and this is for constrained problems; daebench list problems has them.")
    return setting


def make_setting(
    source: Source,
    case: str,
    parameters: Mapping[str, float] | None = None,
    **given: Sequence[float] | None,
) -> Scene | PoissonScene:
    """Return a problem with the numbers of a case: parameters and initial values (p0 and q0, or y0) replaced where they are given.

    Raises
    ------
    BadInput
        If the case or a parameter is unknown, a value is not a finite number, or initial values are those of another kind of problem.
    """
    sheet = source.sheet
    names = ("y0",) if sheet.KIND == "poisson" else ("p0", "q0")
    for name, values in given.items():
        if values is not None and name not in names:
            raise BadInput(f"{source.problem} starts from {' and '.join(names)}; leave out {name}.")
    free = not sheet.CASES and all(given.get(name) is not None for name in names)
    if case not in sheet.CASES and not free:
        raise unknown(f"case of {source.problem}", case, sheet.CASES)
    found = _parameters(source, {} if free else sheet.CASES[case]["parameters"], parameters or {})
    own = () if free else _case_start(sheet, case, found)
    start = [own[k] if (values := given.get(name)) is None else _initial(name, values, sheet) for k, name in enumerate(names)]
    for name, array in zip(names, start, strict=True):
        if not np.all(np.isfinite(array)):
            raise BadInput(f"{name} of {source.problem}, case {case}, is {array.tolist()}; it must be finite numbers.")
    if sheet.KIND == "poisson":
        return _in_domain(PoissonScene(source, case, found, *start))
    return Scene(source, case, found, start[0], start[1], on_singular=sheet.CASES.get(case, {}).get("on_singular", "stop"))


def _parameters(source: Source, of_case: Mapping[str, float], given: Mapping[str, float]) -> dict[str, float]:
    """Return the values of all parameters: the defaults, those of the case, and those that are given, each over the one before."""
    found: dict[str, float] = dict(source.defaults or source.sheet.PARAMETERS)
    found |= {name: float(value) for name, value in of_case.items() if name in found}
    for name, value in given.items():
        if name not in found:
            raise unknown(f"parameter of {source.problem}", name, found)
        found[name] = real(name, value)
    _require_positive(source.problem, source.sheet, found)
    return found


def _in_domain(scene: PoissonScene) -> PoissonScene:
    domain = " and ".join(f"{each} > 0" for each in scene.sheet.DOMAIN)
    if domain and not bool(scene.value("inside", scene.y0)):
        raise BadInput(f"y0 = {scene.y0.tolist()} of {scene.problem} is outside of its domain {domain}; start inside.")
    return scene


def _require_positive(problem: str, sheet: types.ModuleType, values: Mapping[str, float]) -> None:
    for name in sheet.POSITIVE:
        if not values[name] > 0:
            raise BadInput(f"{name} = {values[name]:g} of {problem} must be greater than 0.")


def _case_start(sheet: types.ModuleType, case: str, values: Mapping[str, float]) -> tuple[Array, ...]:
    with np.errstate(all="ignore"):
        start = sheet.INITIAL[case](tuple(map(np.float64, values.values())))
    return tuple(np.array(x, dtype=float) for x in (start if np.ndim(start) > 1 else (start,)))


def _initial(name: str, values: Any, sheet: types.ModuleType) -> Array:
    d, what = (sheet.N, "coordinates") if sheet.KIND == "poisson" else (sheet.D, "positions")
    if isinstance(values, str) or not np.iterable(values):
        raise BadInput(f"{name} = {values!r} must be {d} numbers.")
    numbers = list(values)
    if len(numbers) != d:
        raise BadInput(f"{name} has {len(numbers)} numbers; the problem has {d} {what}.")
    return np.array([real(f"{name}[{i}]", value) for i, value in enumerate(numbers)])
