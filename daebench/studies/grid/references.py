"""The certified reference of a case, read and checked once a process: a study asks for it several times a run."""

from collections.abc import Callable
from functools import lru_cache

from daebench.reference.keep import store
from daebench.reference.keep.record import Reference

LONGEST = 10.0
"""End of runs where none is given, s, if the reference reaches so far."""


def reference_of(problem: str, case: str) -> Reference:
    """Return the certified reference of a problem's case.

    Raises
    ------
    BadInput, Damaged
        As :func:`daebench.reference.keep.store.find`.
    """
    return _found(store.find, problem, case)


def usual_end(reference: Reference | None) -> float:
    """Return where runs end that nobody gave an end: after :data:`LONGEST`, or where the reference or double precision ends."""
    return min(LONGEST, reference.horizon, reference.double_horizon) if reference else LONGEST


@lru_cache(maxsize=32)
def _found(find: Callable[[str, str], Reference], problem: str, case: str) -> Reference:
    return find(problem, case)
