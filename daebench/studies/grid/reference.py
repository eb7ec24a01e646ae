"""References for the errors of runs of a study, made once a process: the certified one where it fits, else a finer run."""

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from daebench.errors import BadInput, DaebenchError
from daebench.reference.keep import store
from daebench.reference.keep.record import Reference
from daebench.reference.solution import OwnRun, certified_for, own_run
from daebench.runs.trajectory import Array
from daebench.studies.grid.run_specification import OUTPUTS, GridRun, Where, ivp_of

OWN = "own finer run"
"""How the words begin for what is not certified and no closed form."""

LONGEST = 10.0
"""End of runs where none is given, s, if the reference reaches so far."""


def reference_of(problem: str, case: str) -> Reference:
    """Return the certified reference of a problem's case; errors are those of :func:`daebench.reference.keep.store.find`."""
    return _certified_case(store.find, problem, case)


def usual_end(reference: Reference | None) -> float:
    """Return where runs end that nobody gave an end: after :data:`LONGEST`, or where the reference or double precision ends."""
    return min(LONGEST, reference.horizon, reference.double_horizon) if reference else LONGEST


def certified_of(specification: GridRun) -> Reference | None:
    """Return the certified reference of a run: of its definition, case and parameters, and up to its end; None if there is none."""
    return _certified(store.find, specification.where, specification.t_end)


def own_of(specification: GridRun, times: Array) -> OwnRun:
    """Return a finer run at these times, see :func:`daebench.reference.solution.own_run`, which raises RunFailed if there is none."""
    return _own(specification.where, np.ascontiguousarray(times, dtype=float).tobytes())


def require_reference(specification: GridRun, what: str) -> None:
    """Accept a run that errors can be taken of; raise BadInput if it has no certified reference, and a finer run is not possible."""
    if certified_of(specification):
        return
    try:
        own_of(specification, np.linspace(0.0, specification.t_end, OUTPUTS + 1))
    except DaebenchError as error:
        raise BadInput(
            f"{what} needs a certified reference that fits, or a finer run, and there is neither: {error}", "no-reference-nor-finer-run"
        ) from error


@lru_cache(maxsize=64)
def _certified(find: Callable[..., Reference], where: Where, t_end: float) -> Reference | None:
    return certified_for(ivp_of(*where), t_end)


@lru_cache(maxsize=64)
def _own(where: Where, times: bytes) -> OwnRun:
    return own_run(ivp_of(*where), np.frombuffer(times))


@lru_cache(maxsize=32)
def _certified_case(find: Callable[[str, str], Reference], problem: str, case: str) -> Reference:
    return find(problem, case)
