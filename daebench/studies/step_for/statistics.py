"""Statistics of a run, one number a member: means over time of a quantity along the run."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from daebench.errors import BadInput, unknown
from daebench.methods.ensemble.result import EnsembleRun
from daebench.runs.ivp import Array, Ivp
from daebench.runs.members import Members
from daebench.starts.box import columns
from daebench.starts.mechanics import Mechanics

Quantity = Callable[[Members, Array], Array]
"""From members and one state of each, shape(n, c), to one number of each."""


def _of(name: str) -> Quantity:
    return lambda members, states: members.of_states(name, states)


def _component(name: str, i: int) -> Quantity:
    return lambda members, states: members.of_states(name, states)[:, i]


def _coordinate(column: int) -> Quantity:
    return lambda members, states: states[:, column]


def _largest(name: str) -> Quantity:
    return lambda members, states: np.asarray(np.max(np.abs(members.of_states(name, states)), axis=1))


def _potential(members: Members, states: Array) -> Array:
    return Mechanics(members).U(members.ivp.vectors(states)[1].T)


def _kinetic(members: Members, states: Array) -> Array:
    return np.asarray(members.of_states("H", states) - _potential(members, states))


def known(ivp: Ivp) -> Mapping[str, Quantity]:
    """Return the quantities of a problem by name.

    They are ``energy``; ``kinetic`` and ``potential`` energy where H is quadratic in p; ``g`` and ``Gv``, the largest moduli of what
    vanishes on the manifold; coordinates, as q1, p2 or y1; and the problem's first integrals and Casimir functions by their names.
    """
    quantities: dict[str, Quantity] = {"energy": _of("H")}
    if ivp.on_manifold:
        quantities |= {"kinetic": _kinetic, "potential": _potential} if ivp.facts.QUADRATIC else {}
        quantities |= {"g": _largest("g"), "Gv": _largest("Gv")}
    quantities |= {name: _coordinate(column) for name, column in columns(ivp).items()}
    quantities |= {name: _component("integrals", i) for i, name in enumerate(ivp.integrals)}
    return quantities | {name: _component("casimirs", i) for i, name in enumerate(ivp.casimirs)}


def quantity(ivp: Ivp, name: Any) -> Quantity:
    """Return a quantity by name."""
    if ivp.arrays:
        raise BadInput(f"statistics take vectors of few numbers, and those of {ivp.problem} are arrays; choose fewer bodies or sites.")
    quantities = known(ivp)
    if name not in quantities:
        raise unknown(f"statistic of {ivp.problem}", str(name), quantities)
    return quantities[name]


def means(run: EnsembleRun, of: Quantity) -> Array:
    """Return the mean of a quantity over the stored states behind the start, shape(n,); NaN of a member that stopped early."""
    rows = [of(run.members, states) for states in run.states[1:]]
    average: Array = np.mean(rows, axis=0)
    return np.where(run.status == 0, average, np.nan)
