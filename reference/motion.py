"""The motion that errors are measured against: a certified reference if one fits, otherwise a finer run of daebench, with a bound."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from daebench.diagnostics.energy_verdict import kinetic_energy
from daebench.errors import BadInput, RunFailed
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.reference.keep import store
from daebench.reference.keep.record import Reference
from daebench.reference.solution import TIGHT, reference_solution
from daebench.runs.ivp import Array, Ivp

CALLS = 400_000
"""Largest number of calls of the right side in each of the two runs of DOP853: some seconds."""

CONSERVED = 1e-6
"""Energy error of a finer run, as a fraction of its largest energy, above which it has missed an event such as a collision."""


@dataclass(frozen=True)
class OwnRun:
    """A run that is finer than the runs compared with it, and is not certified."""

    words: str
    """Description of the run."""
    t: Array
    """Times, s; shape (n,)."""
    states: Mapping[str, Array]
    """"q", "p" and "lam", or "y"; shape (n, components)."""
    bound: Mapping[str, Array]
    """Largest error of each number, of the same shapes."""


def certified_for(ivp: Ivp, end: float) -> Reference | None:
    """Return the certified reference with this definition, case, start and parameters, up to this time; None if there is none."""
    try:
        reference = store.find(ivp.problem, ivp.case)
        catalogue_ivp = initial_value_problem(ivp.problem, ivp.case)
    except BadInput:
        return None
    return reference if _same(ivp, catalogue_ivp) and reference.parameters == dict(ivp.parameters) and end <= reference.horizon else None


def _same(ivp: Ivp, other: Ivp) -> bool:
    """Return whether two initial value problems have the same equations, parameters and start, exactly."""
    starts = len(ivp.start) == len(other.start) and all(map(np.array_equal, ivp.start, other.start))
    return ivp.source.key == other.source.key and ivp.par == other.par and starts


def own_run(ivp: Ivp, times: ArrayLike, calls: float = CALLS) -> OwnRun:
    """Return the motion at these times, with its error bound, see :func:`daebench.reference.solution.reference_solution`.

    Shapes: times (n,).
    """
    t = np.asarray(times, dtype=float)
    exact = reference_solution(ivp, t, calls)
    kind, states, bound = exact.kind, exact.states, exact.bound
    vectors = [states[name] for name in ivp.state.vectors]
    energy = ivp.along("H", *vectors)
    start = float(ivp.value("H", *ivp.start))
    if not np.max(np.abs(energy - start)) <= CONSERVED * _energy_size(ivp, vectors, start):
        raise RunFailed(f"a finer run of {ivp.problem}, case {ivp.case}, does not conserve the energy; choose a shorter end time.")
    words = kind if kind == "closed form" else f"own finer run ({kind}, tol {TIGHT:g})"
    return OwnRun(words, t, states, {part: np.full(rows.shape, bound[part]) for part, rows in states.items()})


def _energy_size(ivp: Ivp, vectors: Sequence[Array], start: float) -> float:
    """Return the size that energy errors are compared with: |H| at the start, or the largest |p^T H_p| if that is more."""
    T = kinetic_energy(ivp, *vectors)
    return max(abs(start), 0.0 if T is None else float(np.max(2 * np.abs(T))), float(np.finfo(float).tiny))
