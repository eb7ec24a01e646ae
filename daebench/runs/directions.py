"""Directions in which a run is differentiated: parameters of the problem, and initial values, which stay on the manifold."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from daebench.compiler.cache import generated
from daebench.errors import BadInput, unknown
from daebench.runs.ivp import ConstrainedIvp, Ivp
from daebench.runs.make_ivp import case_start
from daebench.runs.own_start import base
from daebench.runs.scales import STEP as STEP
from daebench.runs.trajectory import Array
from daebench.systems.lazily import sympy as sp

SAME = 1e-12
"""Relative difference from the start of a case up to which a start is treated as that of the case."""


@dataclass(frozen=True)
class Directions:
    """Derivatives of parameters and of the start in k directions."""

    columns: Mapping[str, int | slice]
    """Directions that belong to each name."""
    par: Array
    """Derivatives of the parameters; shape (parameters, k)."""
    start: Array
    """Derivatives of the start, in the order in which a state is stored; shape (size, k)."""
    units: Array
    """Powers of two by which the directions are multiplied, so that each changes a problem by about its own size; shape (k,)."""

    def widened(self, k: int) -> "Directions":
        """Return these directions, followed by directions of zeros, k in all."""
        more = k - len(self.units)
        par, start = (np.pad(columns, ((0, 0), (0, more))) for columns in (self.par, self.start))
        return replace(self, par=par, start=start, units=np.pad(self.units, (0, more), constant_values=1.0))

    def results(self, rows: Array, parts: Mapping[str, slice]) -> dict[str, dict[str, Array]]:
        """Return derivatives of states, by the name of a parameter or initial value and by the part of the state.

        The rows are of shape(k, n, size), and are changed in place.
        """
        # In place: derivatives of long runs are the largest arrays of a run.
        for row, unit in zip(rows, self.units, strict=True):
            row /= unit
        along = {
            name: np.moveaxis(rows[columns], 0, -1) if isinstance(columns, slice) else rows[columns]
            for name, columns in self.columns.items()
        }
        return {name: {part: by[:, place] for part, place in parts.items()} for name, by in along.items()}


def known_names(ivp: Ivp) -> tuple[str, ...]:
    """Return all names with respect to which a run can be differentiated: parameters, then initial values."""
    return (*ivp.parameters, *ivp.state.starts)


def number_of_directions(ivp: Ivp, names: Sequence[str]) -> int:
    """Return the number of directions of some names: one for a parameter, one for each entry of an initial value."""
    sizes = dict(zip(ivp.state.starts, map(len, ivp.start), strict=True))
    return sum(sizes.get(name, 1) for name in names)


def require_names(ivp: Ivp, names: Sequence[str]) -> None:
    """Check names with respect to which a run is differentiated; raise :class:`BadInput` for one that is unknown, or given twice."""
    for name in names:
        if name not in known_names(ivp):
            raise unknown(f"parameter or initial value of {ivp.problem} to differentiate by", name, known_names(ivp))
    if twice := [name for name in names if list(names).count(name) > 1]:
        raise BadInput(f"{twice[0]} is given twice; differentiate by it once.", "direction-given-twice")


def require_tuples(method: str, ivp: Ivp) -> None:
    """Check that a problem's vectors are tuples of numbers; raise :class:`BadInput` if they are arrays, for a method of this name."""
    if ivp.arrays:
        why = f"the vectors of {ivp.problem} are arrays; choose fewer of its bodies or sites"
        raise BadInput(f"{method} on {ivp.problem} has no sensitivities: {why}.", "sensitivities-unavailable")


def directions(ivp: Ivp, names: Sequence[str]) -> Directions:
    """Return the directions of some parameters and initial values.

    A start with the numbers of its case moves with the parameters as the case prescribes; any other start does not. In each direction the
    moved start is projected onto the manifold as by ``--project``, positions first::

        dq -> dq - M^-1 G^T W^-1 dg,       dg = g_q dq + g_par dpar,           W = G M^-1 G^T
        dp -> dp - G^T W^-1 dv,            dv = (G H_p)_p dp + (G H_p)_q dq + (G H_p)_par dpar

    which leaves changes tangent to the manifold unchanged.
    """
    starts = dict(zip(ivp.state.starts, ivp.start, strict=True))
    ends = np.cumsum([len(vector) for vector in ivp.start])
    place = {name: slice(int(end) - len(starts[name]), int(end)) for name, end in zip(starts, ends, strict=True)}
    k, size, first = number_of_directions(ivp, names), int(ends[-1]), 0
    columns: dict[str, int | slice] = {}
    par, start, units = np.zeros((len(ivp.par), k)), np.zeros((size, k)), np.ones(k)
    following = _following(ivp, starts)
    for name in names:
        last = first + len(starts.get(name, [0]))
        columns[name] = slice(first, last) if name in starts else first
        # A power of two, so that the scaling itself rounds nothing.
        units[first:last] = _unit(starts[name] if name in starts else ivp.parameters[name])
        if name in starts:
            start[place[name], first:last] = np.diag(units[first:last])
        else:
            par[list(ivp.parameters).index(name), first] = units[first]
            for vector, moved in following(name).items():
                start[place[vector], first] = units[first] * moved
        first = last
    if ivp.on_manifold:
        start = np.array([_tangent(ivp, *pair) for pair in zip(par.T, start.T, strict=True)]).reshape(k, size).T
    return Directions(columns, par, start, units)


def moved_by(ivp: Ivp, par: Array) -> Ivp:
    """Return a problem whose parameters have this change as their imaginary part."""
    values = (value + 1j * STEP * change if change else value for value, change in zip(ivp.par, par, strict=True))
    return replace(ivp, parameters=dict(zip(ivp.parameters, values, strict=True)))


def imaginary(x: Any) -> Array:
    """Return the change in the imaginary parts."""
    return np.imag(np.asarray(x)).astype(float) / STEP


def _unit(x: Any) -> float:
    """Return the least power of two above the moduli of some numbers; 1 if all are zero."""
    largest = float(np.max(np.abs(x), initial=0.0))
    return float(2.0 ** math.frexp(largest)[1]) if largest > 0 and math.isfinite(largest) else 1.0


def _following(ivp: Ivp, starts: Mapping[str, Array]) -> Callable[[str], dict[str, Array]]:
    """Return the derivatives, with respect to a parameter, of those initial values that are equal to those of the case."""
    if base(ivp.case) not in ivp.facts.CASES:
        return lambda name: {}
    declared = dict(zip(starts, case_start(ivp.facts, base(ivp.case), ivp.parameters), strict=True))
    # A start that was given in digits is that of the case up to rounding, and moves with the parameters as well.
    unmoved = [name for name, values in starts.items() if np.allclose(values, declared[name], rtol=0.0, atol=SAME * _unit(values))]

    def following(name: str) -> dict[str, Array]:
        rows = dict(zip(starts, start_by_parameters(ivp), strict=True))
        index = list(ivp.parameters).index(name)
        return {vector: rows[vector][:, index] for vector in unmoved}

    return following


def start_by_parameters(ivp: Ivp) -> tuple[Array, ...]:
    """Return the derivatives of a case's initial values with respect to all parameters: p and q, or y; each shape(d, parameters)."""
    names, case_name = ivp.state.starts, base(ivp.case)

    def build() -> str:
        from daebench.compiler import codegen

        derivation = ivp.source.derivation
        declared = derivation.problem if getattr(ivp.facts, "EXTENDED", False) else derivation.definition  # its cases include the time
        case, symbols = declared.cases[case_name], derivation.parameters
        lines = [f'"""Initial values of {ivp.problem} by its parameters."""', "import numpy", "from numpy import *"]
        for name in names:
            values = [sp.sympify(value) for value in getattr(case, name[0])]
            entries = [value.diff(symbol) for value in values for symbol in symbols]
            lines.append(codegen.expressions(f"{name}_by_par", {}, entries, (len(values), len(symbols)), symbols))
        return "\n".join(lines)

    module = generated(f"{ivp.problem}_start_by_par", f"{ivp.source.key} {case_name} start by parameters", build)
    par = tuple(map(np.float64, ivp.par))
    return tuple(np.array(getattr(module, f"{name}_by_par")(par), dtype=float) for name in names)


def _tangent(ivp: ConstrainedIvp, par: Array, start: Array) -> Array:
    """Return the change of the start that keeps it on the manifold when the parameters change."""
    moved, dp, dq = moved_by(ivp, par), *np.split(start, 2)
    G, by_mass = ivp.value("G", ivp.q0), ivp.value("H_pp", ivp.p0, ivp.q0)
    W = G @ by_mass @ G.T
    # By complex step, with parameters and positions changed together: no derivative of g by parameters has to be compiled.
    dq = dq - by_mass @ G.T @ _solved(W, imaginary(moved.value("g", ivp.q0 + 1j * STEP * dq)))
    change = imaginary(moved.value("Gv", ivp.p0 + 1j * STEP * dp, ivp.q0 + 1j * STEP * dq))
    return np.concatenate([dp - G.T @ _solved(W, change), dq])


def _solved(W: Array, b: Array) -> Array:
    """Return W^-1 b, or the solution of least norm if constraints are redundant."""
    return np.asarray(np.linalg.lstsq(W, b, rcond=None)[0], dtype=float)
