"""Mathematics of a Poisson system for certification: y' = B(y) grad H(y), other coordinates, energy and Casimir functions."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from daebench.methods.solvers.taylor_equations import hamiltonian
from daebench.reference.keep.definition import Definition
from daebench.reference.make.coordinates import Own
from daebench.reference.make.poisson_coordinates import Canonical, Lifted, Skewed, compiled
from daebench.reference.make.stages import Rows, Vector
from daebench.runs.ivp import Array


class Poisson:
    """See :class:`daebench.reference.make.mathematics.Mathematics`; a state is y.

    Parameters
    ----------
    definition : Definition
        A Poisson system and its numbers.
    """

    series = "Taylor series of y' = B(y) grad H(y) in quadruple precision"
    zero: tuple[str, ...] = ()
    regular = ""
    crosses = False
    perturbations = "in all directions, whether they keep Casimir functions or not"

    def __init__(self, definition: Definition) -> None:
        self.definition, system = definition, definition.problem
        functions = {"energy": system.H, **system.casimirs, **system.integrals}
        self._conserved, self._names = compiled(definition, system.y, list(functions.values())), list(functions)

    @property
    def closed_form(self) -> bool:
        """Whether the motion has a closed form."""
        return self.definition.problem.closed_form is not None

    @cached_property
    def first(self) -> Own:
        """The equations in y of the problem itself."""
        system = self.definition.problem
        return Own(hamiltonian(self.definition, list(system.y), sp.Matrix(system.B), system.H))

    @cached_property
    def other(self) -> Canonical | Lifted | Skewed:
        """Canonical coordinates if the problem declares them, else the constrained system that is mapped to it, else skewed ones."""
        system = self.definition.problem
        if system.darboux is not None:
            return Canonical(self.definition)
        return Skewed(self.definition) if system.lift is None else Lifted(self.definition)

    @cached_property
    def directions(self) -> Array:
        """All directions, because rounding does not preserve Casimir functions; shape(n, n)."""
        return np.eye(self.definition.problem.n)

    def exact(self, times: Sequence[Any]) -> Rows:
        """Return the closed form at times, the first 0."""
        form, (y0,), values = self.definition.problem.closed_form, self.definition.start_numbers(), self.definition.values()
        return [y0, *(list(form(t, y0, values)) for t in times[1:])]

    def parts(self, x: Vector) -> dict[str, Vector]:
        """Return y."""
        return {"y": x}

    def conserved(self, x: Vector) -> dict[str, Vector]:
        """Return energy, Casimir functions and first integrals."""
        return {name: [value] for name, value in zip(self._names, self._conserved(*x), strict=True)}

    def smallest_singular_value(self, x: Vector) -> float:
        """Raise, because there is no rank to lose."""
        raise NotImplementedError
