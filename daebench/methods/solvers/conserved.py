"""What a tolerance-driven run conserves, as a function of a solver's unknowns, and by how much a step may change it."""

import types
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from daebench.methods.formulations.constrained import Dae, Posed

KERNEL = "daebench.schemes.kernels.conserved"

Conserved = Callable[[Any], tuple[float, ...]]
"""What is constant along a motion, as a function of a solver's unknowns y, shape(n,): H, and on constrained problems |g| and |G H_p|."""

NAMES = ("H", "|g|", "|G H_p|")
"""Names of what is conserved."""

INCREMENT = 1e-7
"""Increment of an unknown, in parts of its modulus and of 1, by which derivatives are taken."""

ROUNDINGS = 8.0 * float(np.finfo(float).eps)
"""Relative change of a value that rounding explains."""

MOST_UNKNOWNS = 400
"""Unknowns up to which it is said by how much a step may change what is conserved: it takes as many values of it."""


@dataclass(frozen=True)
class Conservation:
    """What a run conserves, and how far a step within the tolerance may change it.

    Parameters
    ----------
    values : callable
        See :data:`Conserved`.
    size : int
        Number of unknowns that it depends on.
    tol : float
        Relative and absolute tolerance.
    positions : int
        Number of positions, of ``index3``, whose velocities are out of the error test and so uncertain by the error of positions over the
        step; 0 of any other.
    """

    values: Conserved
    size: int
    tol: float
    positions: int = 0

    def explained(self, y: Any, h: float) -> tuple[float, ...]:
        """Return the change of each value by errors of tol (1 + |y_j|) in all unknowns: infinite where there are too many of these.

        Parameters
        ----------
        y : ndarray, shape(n,)
            Unknowns at one end of a step.
        h : float
            Size of the step, s.
        """
        at = self.values(y)
        if self.size > MOST_UNKNOWNS:
            return (float("inf"),) * len(at)
        changes = [ROUNDINGS * abs(value) for value in at]
        for j in range(self.size):
            length = 1.0 + abs(float(y[j]))
            error = self.tol * length
            if 0 < self.positions <= j:
                error += self.tol * (1.0 + float(np.max(np.abs(y[: self.positions])))) / h
            moved = y.copy()
            moved[j] += INCREMENT * length
            for k, (value, other) in enumerate(zip(at, self.values(moved), strict=True)):
                changes[k] += abs(other - value) * error / (INCREMENT * length)
        return tuple(changes)


def conservation(posed: Posed, tol: float) -> Conservation:
    """Return what a run on a posed problem with this tolerance conserves."""
    positions = posed.ivp.d if isinstance(posed, Dae) and posed.formulation == "index3" else 0
    return Conservation(conserved(posed), posed.ivp.size, tol, positions)


def conserved(posed: Posed) -> Conserved:
    """Return the function of the unknowns y, shape(n,), that gives H, and on constrained problems the moduli of g and G H_p besides.

    Parameters
    ----------
    posed : Posed
        What is solved. Where its functions are not compiled, this one is not either.
    """
    par = tuple(map(float, posed.ivp.par))
    if posed.ivp.arrays:
        return np.errstate(all="ignore")(_of_arrays(posed, par))
    compiled = hasattr(posed.residual, "signatures")
    call = _module(posed, compiled=compiled).conserved

    def at(y: Any) -> tuple[float, ...]:
        values: tuple[float, ...] = call(y, par)
        return values

    return at if compiled else np.errstate(all="ignore")(at)


def _of_arrays(posed: Posed, par: tuple[float, ...]) -> Conserved:
    """Return it where vectors are arrays, whose functions are there already."""
    ivp = posed.ivp
    if not isinstance(posed, Dae):
        H, size = ivp.functions("H").H, ivp.size
        return lambda y: (float(H(y[:size], par)),)
    module = ivp.functions("H", "g", "Gv")

    def at(y: Any) -> tuple[float, ...]:
        q, v = posed.unpack(y[None])
        p = posed.momenta(q, v)
        distances = (float(np.sum(np.abs(value))) for value in (module.g(q[0], par), module.Gv(p[0], q[0], par)))
        return float(module.H(p[0], q[0], par)), *distances

    return at


def _module(posed: Posed, *, compiled: bool) -> types.ModuleType:
    from daebench.compiler.codegen import function, pack  # this imports SymPy, which a list of methods does without

    ivp, size = posed.ivp, posed.ivp.size
    ends: tuple[tuple[int, int], ...]
    if isinstance(posed, Dae):
        name, ends = "of_velocities" if posed.mechanical else "of_momenta", ((posed.d, size), (0, posed.d))
    else:
        name, ends = "of_state", ((0, size),)
    vectors = ", ".join(pack(f"y[{i}]" for i in range(*bounds)) for bounds in ends)
    result = f"conserved_{name}({vectors}, par)"
    wrapper = function("conserved(y, par)", f"return {result if isinstance(posed, Dae) else f'({result},)'}")

    title = f"What {ivp.problem} conserves."
    return ivp.source.linked("conserved", title, [(KERNEL, name)], wrapper=("conserved", wrapper), compiled=compiled, singular=ivp.singular)
