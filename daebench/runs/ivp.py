"""Initial value problems: a problem with the parameters and initial values of a case. Every method solves one."""

import types
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray

from daebench.compiler.definition import Source
from daebench.runs.state import CONSTRAINED, FREE, POISSON, State
from daebench.runs.trajectory import Array as Array
from daebench.runs.trajectory import Outcome, PoissonTrajectory, Trajectory

JACOBIANS = ("G", "Gv_p", "Gv_q", "a_p", "g_qv", "rows")
"""Functions with a row of shape(d,) for each constraint."""

NAMED = 4
"""Largest number of constraints that a sentence names."""


@dataclass(frozen=True)
class InitialValueProblem:
    """A problem with the parameters and initial values of a case, for states of any kind.

    Parameters
    ----------
    source : Source
        The definition.
    case : str
        Name of the case.
    parameters : mapping of str to float
        Run-time parameters in the order of ``par``.
    """

    on_manifold: ClassVar[bool]
    trajectory: ClassVar[type[Outcome]]

    source: Source
    case: str
    parameters: Mapping[str, float]

    @property
    def state(self) -> State:
        """Vectors of a state, and what a run monitors of them."""
        raise NotImplementedError

    @property
    def start(self) -> tuple[Array, ...]:
        """Initial values, in the order in which a state is stored."""
        raise NotImplementedError

    def at(self, *vectors: Array) -> Self:
        """Return the same problem with other initial values, in the order of :attr:`start`."""
        raise NotImplementedError

    def vectors(self, states: NDArray[Any]) -> list[NDArray[Any]]:
        """Return the vectors of stored states, shape(..., N), in the order of :attr:`start`."""
        return np.split(states, np.cumsum([len(vector) for vector in self.start])[:-1], axis=-1)

    @property
    def size(self) -> int:
        """Number of numbers in a state."""
        return sum(map(len, self.start))

    @property
    def moving(self) -> int:
        """Number of positions without the time of a system in time, or of coordinates."""
        return len(self.start[-1])

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the positions without the time: "x of B" in a mechanism, else "q1"; or of the coordinates, "y1"."""
        names = getattr(self.facts, "COORDINATES", ())
        return tuple(names or (f"{self.state.position}{k + 1}" for k in range(self.moving)))

    @property
    def arrays(self) -> bool:
        """Whether the problem's functions take arrays and are compiled, as for a lattice and for a long chain."""
        return bool(getattr(self.facts, "SITES", 0) or getattr(self.facts, "NODES", 0))

    @property
    def problem(self) -> str:
        """Name of the problem."""
        return self.source.problem

    @property
    def facts(self) -> types.ModuleType:
        """Sizes, names and initial values of the problem."""
        return self.source.facts

    @property
    def singular(self) -> str:
        """Solver of its functions for systems that may be singular: "least-squares", or "" for elimination."""
        return ""

    @property
    def par(self) -> tuple[float, ...]:
        """Run-time parameters in the form that kernels take."""
        return tuple(self.parameters.values())

    @property
    def integrals(self) -> tuple[str, ...]:
        """Names of the first integrals besides H."""
        return tuple(self.facts.INTEGRALS)

    @property
    def casimirs(self) -> tuple[str, ...]:
        """Names of the Casimir functions; none on a manifold."""
        return ()

    @property
    def m(self) -> int:
        """Number of constraints."""
        return 0

    @property
    def holonomic(self) -> int:
        """Number of constraints on positions, which come first; the others are on velocities."""
        return self.m

    @property
    def nonholonomic(self) -> bool:
        """Whether a constraint is on velocities."""
        return self.holonomic < self.m

    def functions(self, *names: str) -> types.ModuleType:
        """Return a module of functions of the problem with these names: of tuples and uncompiled, or, if vectors are arrays, compiled."""
        title, stem = f"Functions of {self.problem}.", "_".join(names)
        return self.source.linked(stem, title, names, compiled=self.arrays, singular=self.singular)

    def value(self, name: str, *arguments: Iterable[Any]) -> NDArray[Any]:
        """Return one of the problem's functions of (p, q), or of q, at one point."""
        with np.errstate(all="ignore"):
            # Outside of the domain values are NaN or infinite; callers judge them, so that no warning is due here.
            points = (np.asarray(x) if self.arrays else tuple(map(_number, x)) for x in arguments)
            values = np.array(getattr(self.functions(name), name)(*points, tuple(map(_number, self.par))))
        return self.with_columns(name, values)

    def along(self, name: str, *arguments: Array) -> Array:
        """Return one of the problem's functions along rows of states.

        Parameters
        ----------
        name : str
            Name in ``kernels/language.py`` or ``kernels/composed.py``: H, g, Gv, integrals, lam, ...
        arguments : ndarray, shape(n, d)
            One state a row.

        Returns
        -------
        ndarray, shape(n, ...)
        """
        module = self.functions(name)
        call = getattr(module, name)
        par = tuple(map(_number, self.par))
        with np.errstate(all="ignore"):
            # A function with branches, as one that solves a system with pivots, takes one state at a time; others take columns at once.
            if not module.ELEMENTWISE:
                vector = np.asarray if self.arrays else tuple
                values = np.array([call(*map(vector, row), par) for row in zip(*arguments, strict=True)])
            else:
                values = stacked(call.columns(*(tuple(x.T) for x in arguments), par), arguments[0].shape[:-1])
        return self.with_columns(name, values)

    def with_columns(self, name: str, values: NDArray[Any]) -> NDArray[Any]:
        """Return values of a function; one with a row for each constraint has d columns where there is no row, too."""
        # An empty tuple of rows does not tell their length.
        empty = name in JACOBIANS and self.m == 0 and values.shape[-1] == 0
        return values.reshape(*values.shape, len(self.start[-1])) if empty else values


@dataclass(frozen=True)
class ConstrainedIvp(InitialValueProblem):
    """A constrained Hamiltonian system with the parameters and initial values of a case.

    Parameters
    ----------
    p0, q0 : ndarray, shape(d,)
        Initial momenta and positions.
    on_singular : str
        Action of a run if G loses rank, unless its request prescribes another.
    """

    on_manifold: ClassVar[Literal[True]] = True
    trajectory = Trajectory

    p0: Array
    q0: Array
    on_singular: str = "stop"

    @property
    def singular(self) -> str:
        """Solver of its functions for systems that may be singular: "least-squares", or "" for elimination."""
        return "least-squares" if self.on_singular == "least-squares" else ""

    @property
    def state(self) -> State:
        """Momenta and positions, and the constraints among what a run monitors where there are any."""
        return CONSTRAINED if self.m else FREE

    @property
    def start(self) -> tuple[Array, ...]:
        """Initial momenta and positions."""
        return self.p0, self.q0

    def at(self, *vectors: Array) -> Self:
        """Return the same problem with other initial momenta and positions."""
        p0, q0 = vectors
        return replace(self, p0=p0, q0=q0)

    @property
    def d(self) -> int:
        """Number of positions."""
        return int(self.facts.D)

    @property
    def moving(self) -> int:
        """Number of positions without the time, which has no mass and goes on at 1."""
        return self.d - bool(self.facts.EXTENDED)

    @property
    def m(self) -> int:
        """Number of constraints."""
        return int(self.facts.M)

    @property
    def holonomic(self) -> int:
        """Number of constraints on positions, which come first; the others are on velocities."""
        return self.m - int(getattr(self.facts, "ON_VELOCITIES", 0))

    def words(self, k: int) -> str:
        """Return the words for a constraint of a mechanism; "" of any other problem."""
        words = getattr(self.facts, "CONSTRAINED_BY", ())
        return str(words[k]) if words else ""

    def named(self, k: int) -> str:
        """Return the name of a constraint: its words, or where there are none g1, g2, ..., velocity1, velocity2, ..."""
        return self.words(k) or (f"g{k + 1}" if k < self.holonomic else f"velocity{k + 1 - self.holonomic}")

    def listed(self, constraints: Iterable[int]) -> str:
        """Return the names of constraints, g1 and g2, or the first of many and how many more there are."""
        names = [self.named(k) for k in constraints]
        return " and ".join(names) if len(names) <= NAMED else f"{', '.join(names[:NAMED])} and {len(names) - NAMED} more"


@dataclass(frozen=True)
class PoissonIvp(InitialValueProblem):
    """A Poisson system with the parameters and initial values of a case.

    Parameters
    ----------
    y0 : ndarray, shape(n,)
        Initial state.
    """

    on_manifold: ClassVar[Literal[False]] = False
    trajectory = PoissonTrajectory

    y0: Array

    @property
    def state(self) -> State:
        """Coordinates, and what a run monitors of them."""
        return POISSON

    @property
    def start(self) -> tuple[Array, ...]:
        """Initial state."""
        return (self.y0,)

    def at(self, *vectors: Array) -> Self:
        """Return the same problem with another initial state."""
        (y0,) = vectors
        return replace(self, y0=y0)

    @property
    def casimirs(self) -> tuple[str, ...]:
        """Names of the Casimir functions."""
        return tuple(self.facts.CASIMIRS)


Ivp = ConstrainedIvp | PoissonIvp
"""Initial value problems of either kind, for type checking."""


def _number(x: Any) -> Any:
    """Return a NumPy number, which divides by zero according to IEEE 754; Python's own raises an error."""
    return np.complex128(x) if isinstance(x, complex) else np.float64(x)


def stacked(values: Any, rows: tuple[int, ...]) -> Array:
    """Return nested tuples as one array, with the rows first; each number is an array with an entry for each row, or the same for all.

    If there are several axes of rows, each component is contiguous in memory, as functions of them expect.
    """
    if isinstance(values, tuple):
        parts = [stacked(value, rows) for value in values]
        if not parts:
            return np.empty((*rows, 0))
        return np.stack(parts, axis=1) if len(rows) == 1 else np.moveaxis(np.stack(parts), 0, len(rows))
    # A copy, because an entry that is the same for all rows would be one number in memory.
    return np.broadcast_to(np.asarray(values, dtype=np.result_type(float, np.asarray(values))), rows).copy()
